"""ROS 2 package std_srvs: srv. Generated."""
