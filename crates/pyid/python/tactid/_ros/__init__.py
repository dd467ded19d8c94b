"""The ROS 2 node, on the ``rclpy`` of the user's installation."""
