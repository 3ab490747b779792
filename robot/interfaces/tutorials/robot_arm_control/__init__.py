"""ROS 2 package robot_arm_control: srv, action. Generated."""
