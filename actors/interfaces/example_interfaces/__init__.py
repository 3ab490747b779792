"""ROS 2 package example_interfaces: msg, srv, action. Generated."""
