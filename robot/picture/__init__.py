"""`python -m robot picture`: the walking robot in its world, drawn to a PNG file."""

from robot.picture.command import main

__all__ = ["main"]
