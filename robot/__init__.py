"""The quadruped. `Robot` is the whole of it in one line, for programs and tests; `python -m robot` runs it from a terminal."""

from __future__ import annotations

TYPE_CHECKING = False  # as that of `typing`, which takes a while to import, and `--help` waits for
if TYPE_CHECKING:
    from typing import Any

    from robot.assembly import Robot

__all__ = ["Robot"]


def __getattr__(name: str) -> Any:
    """Load the robot when it is asked for: its parts need numpy, and `python -m robot --help` does not."""
    if name == "Robot":
        from robot.assembly import Robot

        return Robot
    if name in ("run_cli", "rebot_cli"):  # what the commands of Robot Framework import
        raise ImportError(
            "robactor was installed over Robot Framework, and both are a package robot: install each in an environment of its own, or "
            "pip uninstall robactor, then pip install --force-reinstall --no-deps robotframework"
        )
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
