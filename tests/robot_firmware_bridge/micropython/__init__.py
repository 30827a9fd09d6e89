"""Tests of `robot_firmware_bridge`: the firmware in C, drivers, and real firmware in emulators."""
