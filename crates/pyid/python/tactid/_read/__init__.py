"""Recordings in other forms than logs of ROS 2: tables, ROS 1 bags, and descriptions of robots."""
