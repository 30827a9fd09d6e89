"""A base on code of others: `zenoh-ros2-sdk` of ROBOTIS, who make the TurtleBot 3.

`python -m tests.robot_firmware_bridge.ros2.sdk_base ENDPOINT NAMESPACE`

It moves as it was told last, without a watchdog, and prints `wheels AHEAD TURN` for every command. Keys, tokens,
attachments and the session are the SDK's. Definitions of types are given to it, so that it clones no repository.
"""

import sys
import time
from typing import Any

import zenoh_ros2_sdk as sdk

from tests.robot_firmware_bridge.ros2.simulated_base import STORE, odometry


def main() -> None:
    """Publish odometry until the process ends."""
    endpoint, namespace = sys.argv[1:3]
    twist = (0.0, 0.0)

    def obey(command: Any) -> None:
        nonlocal twist
        twist = (command.linear.x, command.angular.z)
        print(f"wheels {twist[0]:.4f} {twist[1]:.4f}", flush=True)

    def topic(name: str, kind: str) -> dict[str, Any]:
        return {
            "topic": f"/{namespace}/{name}",
            "msg_type": kind,
            "msg_definition": STORE.generate_msgdef(kind)[0],
            "type_hash": STORE.hash_rihs01(kind),
            "namespace": f"/{namespace}",
            "domain_id": 0,
            "router_port": int(endpoint.rpartition(":")[2]),
        }

    publisher = sdk.ROS2Publisher(**topic("odom", "nav_msgs/msg/Odometry"))
    subscriber = sdk.ROS2Subscriber(callback=obey, **topic("cmd_vel", "geometry_msgs/msg/Twist"))
    print("ready", flush=True)
    while subscriber is not None:
        publisher.publish(**vars(odometry(*twist)))
        time.sleep(0.02)


if __name__ == "__main__":
    main()
