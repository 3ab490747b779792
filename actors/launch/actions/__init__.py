"""The actions of a launch description."""
