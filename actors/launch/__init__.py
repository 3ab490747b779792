"""Launch files of ROS 2, in Python, XML and YAML, as supervisor trees."""
