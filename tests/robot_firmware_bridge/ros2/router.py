"""The Zenoh router that ROS 2 robots have: `python -m tests.robot_firmware_bridge.ros2.router ENDPOINT`."""

import json
import sys
import threading

import zenoh


def main() -> None:
    """Route until the process ends."""
    settings = {
        "mode": "router",
        "listen": {"endpoints": [sys.argv[1]]},
        "scouting": {"multicast": {"enabled": False}},
    }
    with zenoh.open(zenoh.Config.from_json5(json.dumps(settings))):
        print("ready", flush=True)
        threading.Event().wait()


if __name__ == "__main__":
    main()
