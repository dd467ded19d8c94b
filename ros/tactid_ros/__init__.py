"""The ROS 2 package of tactid."""
