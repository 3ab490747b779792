"""ROS 2 package proposed_interfaces: srv, action. Generated."""
