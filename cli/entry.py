"""The program `robactor`: `python -m robot`, unless another project's package stands in the place of the robot's.

Robot Framework installs a package `robot` too. The program begins outside of that package, so that it can say so.
"""

from __future__ import annotations

import os
import sys

__all__ = ["console", "said_of_another_robot"]


def console() -> None:
    """Run one command, and exit; 1 if the package `robot` is not the robot's."""
    said = said_of_another_robot()
    if said is not None:
        sys.exit(f"robactor: {said}")
    from robot.__main__ import console as run_a_command

    run_a_command()


def said_of_another_robot() -> str | None:
    """A sentence with the remedy if what Python imports as `robot` is another project's; None if all is well."""
    try:
        import robot
    except ImportError as error:  # theirs, installed over ours: `robot.run` says so
        return str(error)
    ours = os.path.join(os.path.dirname(os.path.dirname(os.path.realpath(__file__))), "robot", "__init__.py")
    found = os.path.realpath(robot.__file__ or "")
    if found == ours:
        return None
    return (
        f"the package robot that Python finds is another project's, {found}, and hides the robot's: install each in an environment "
        "of its own, or rename it if it is yours"
    )
