"""Things are broken on purpose while the robot works: `python -m tests.chaos processes --kills N --seed S`."""
