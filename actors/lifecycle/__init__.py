"""Managed nodes, by the rules of ROS 2 lifecycle nodes."""
