"""Poses, angles, vectors and transforms: values and functions that know nothing of the robot."""
