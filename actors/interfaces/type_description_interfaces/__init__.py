"""ROS 2 package type_description_interfaces: msg, srv. Generated."""
