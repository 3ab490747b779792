"""Measurements of the robot, each printed by one command: `python -m robot evaluate walk`, `... barn FOLDER`."""
