"""Conformance with ROS 2: vectors from upstream tests or measured, and the checks that run them against `actors`."""
