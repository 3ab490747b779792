"""A `Transport` by means of keys and bytes, in the format of ROS 2's ``rmw_zenoh``: what Zenoh and the simulated network have in common."""
