"""ROS 2 package humanoid_control_interfaces: msg, srv, action. Generated."""
