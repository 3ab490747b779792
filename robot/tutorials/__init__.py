"""The small systems of the ROS 2 tutorials, each in one file."""
