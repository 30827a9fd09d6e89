"""A process that drives a robot until it is frozen or killed, and prints the time of each command.

`python -m tests.robot_firmware_bridge.ros2.driving_process ADDRESS TTL_S`
"""

import sys
import time

from crcolony_bridge.ros2.driver import Ros2Robot

from tests.robot_firmware_bridge.aseba.driven import drive


def main() -> None:
    """Command afresh with every reading."""
    robot = Ros2Robot(sys.argv[1])
    robot.open()
    robot.activate()
    print("ready", flush=True)
    while True:
        robot.read(0.5)
        robot.write(drive(float(sys.argv[2])))
        print(f"commanded at {time.monotonic()}", flush=True)


if __name__ == "__main__":
    main()
