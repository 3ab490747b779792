"""Lifecycle nodes (managed nodes), by the rules of ROS 2."""
