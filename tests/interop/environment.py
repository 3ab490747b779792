"""The Python environments of programs that we did not write, made once and kept outside the repository."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Final

REQUIREMENTS: Final = (
    "zenoh-ros2-sdk==0.1.8",
    "pyzeros==0.1.0",
    "eclipse-zenoh==1.10.2",
    "foxglove-sdk==0.30.3",
    "cyclonedds==11.0.1",
)
DISTRIBUTIONS: Final = ("jazzy", "kilted")
"""The distributions of ROS 2 that PyPI has as wheels: `rclpy` on Fast DDS, and messages."""
FOLDER: Final = "ROBACTOR_INTEROP"
"""The environment variable that names where environments are kept."""


class NotHere(Exception):
    """The environment cannot be made; the text says why."""


@cache
def foreign_python() -> Path:
    """The interpreter of an environment with `REQUIREMENTS`, and nothing of ours. Raises NotHere."""
    return _python(REQUIREMENTS)


@cache
def ros2_python(distribution: str) -> Path:
    """The interpreter of an environment with a ROS 2 of `DISTRIBUTIONS`. Raises NotHere."""
    packages = ("geometry-msgs", "lifecycle-msgs", "nav-msgs", "sensor-msgs", "std-msgs", "std-srvs", "test-msgs")
    names = ("rclpy[fastrtps]", *packages)
    return _python(tuple(f"ros-{distribution}-{name}" for name in names))


def _python(requirements: tuple[str, ...]) -> Path:
    kept = Path(os.environ.get(FOLDER, "") or Path.home() / ".cache" / "robactor-interop")
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    name = hashlib.sha256("\n".join(requirements).encode()).hexdigest()[:12]
    folder = kept / f"{version}-{name}"
    python, ready = folder / "bin" / "python", folder / "ready"
    if not ready.exists():
        _run(sys.executable, "-m", "venv", "--clear", str(folder))
        _run(str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *requirements)
        ready.touch()
    return python


def _run(*command: str) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        said = (done.stderr.strip() or done.stdout.strip()).splitlines() or ["it said nothing"]
        raise NotHere(f"{' '.join(command[1:4])}: {said[-1]}")
