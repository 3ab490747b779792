"""Checks against a real ROS 2 with `rmw_zenoh_cpp`, where one is installed: ``python -m tests.interop.ros2``."""
