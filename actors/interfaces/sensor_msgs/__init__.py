"""ROS 2 package sensor_msgs: msg, srv. Generated."""
