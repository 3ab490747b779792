"""Algorithms of navigation: a local costmap, following a path, gaps, docking; and the guard before what a person drives into."""
