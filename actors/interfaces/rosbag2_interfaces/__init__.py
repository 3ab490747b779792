"""ROS 2 package rosbag2_interfaces: msg, srv. Generated."""
