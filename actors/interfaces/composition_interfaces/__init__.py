"""ROS 2 package composition_interfaces: srv. Generated."""
