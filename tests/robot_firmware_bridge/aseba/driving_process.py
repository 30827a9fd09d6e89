"""A process that drives a robot until it is frozen or killed, and prints the time of each command.

`python -m tests.robot_firmware_bridge.aseba.driving_process ADDRESS TTL_S`
"""

import sys
import time

import numpy as np
from crcolony_bridge.aseba.driver import AsebaRobot

from crcolony.body import contract


def main() -> None:
    """Command afresh with every reading."""
    action = np.zeros(contract.ACTION_WIDTH)
    action[[contract.WHEEL_LEFT, contract.WHEEL_RIGHT]] = 0.1
    action[contract.TTL] = float(sys.argv[2])
    robot = AsebaRobot(sys.argv[1])
    robot.open()
    robot.activate()
    while True:
        robot.read(0.5)
        robot.write(action)
        print(time.monotonic(), flush=True)


if __name__ == "__main__":
    main()
