"""Tests of the ROS 2 driver, and the programs that stand in for a robot and its router."""
