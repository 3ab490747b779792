"""ROS 2 package stereo_msgs: msg. Generated."""
