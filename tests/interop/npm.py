"""Packages of npm for programs that we did not write."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.interop.environment import FOLDER


def installed(*packages: str) -> Path:
    """A folder with these packages, made once and kept outside the repository. Skips the test where they cannot be had."""
    if shutil.which("npm") is None or shutil.which("node") is None:
        pytest.skip("node and npm are not installed")
    kept = Path(os.environ.get(FOLDER, "") or Path.home() / ".cache" / "robactor-interop")
    folder = kept / f"npm-{hashlib.sha256(' '.join(packages).encode()).hexdigest()[:12]}"
    if not (folder / "ready").exists():
        folder.mkdir(parents=True, exist_ok=True)
        command = [
            "npm",
            "install",
            "--no-audit",
            "--no-fund",
            "--ignore-scripts",
            "--fetch-retries=1",
            "--prefix",
            str(folder),
            *packages,
        ]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            pytest.skip(f"the packages cannot be installed: {done.stderr.strip()[-200:]}")
        (folder / "ready").touch()
    return folder
