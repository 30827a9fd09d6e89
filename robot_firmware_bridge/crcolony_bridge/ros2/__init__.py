"""Robots that run ROS 2 over Zenoh (rmw_zenoh), driven without ROS on this machine."""
