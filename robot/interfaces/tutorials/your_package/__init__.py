"""ROS 2 package your_package: srv, action. Generated."""
