"""Measurements of the robot, each printed by one command: `python -m tests.figures walk`, `... barn FOLDER`."""
