"""Writes the golden vectors of the frames: `python -m tests.robot_firmware_bridge.make_vectors`.

They change with the version of the protocol alone.
"""

import json

from crcolony_bridge.reference_firmware import messages
from crcolony_bridge.reference_firmware.frames import Frame, encode_frame

from tests.support.paths import ROOT

FRAMES = {
    "hello": messages.hello(0xC0FFEE, 20, 1),
    "describe": messages.describe(240, 2),
    "command": messages.Command(0xC0FFEE, 200, -100, 250, (255, 0, 128), 7, True, True).frame(3),
    "command, all zero": messages.Command(0, 0, 0, 0).frame(0),
    "stop": messages.stop(4),
    "clear": messages.clear(0xC0FFEE, 5),
    "ping": messages.ping(123_456_789, 6),
    "ping at zero": messages.ping(0, 0xFFFF),
    "infrared part": messages.ir_load(0xC0FFEE, 0xA5, 300, 231, bytes(range(69)), 7),
    "acknowledgement": Frame(messages.MessageType.ACK, 5, bytes([messages.MessageType.CLEAR])),
    "refusal": Frame(messages.MessageType.NAK, 3, bytes([messages.MessageType.COMMAND, 3])),
    "without a payload": Frame(messages.MessageType.STOP, 0, b""),
    "longest, no zeros": Frame(messages.MessageType.DESCRIPTION, 0x1234, bytes([0xFF]) * 240),
    "longest, all zeros": Frame(messages.MessageType.DESCRIPTION, 0x1234, bytes(240)),
}


def main() -> None:
    vectors = [
        {
            "name": name,
            "type": int(frame.type),
            "seq": frame.seq,
            "payload": frame.payload.hex(),
            "encoded": encode_frame(frame).hex(),
        }
        for name, frame in FRAMES.items()
    ]
    path = ROOT / "tests" / "vectors" / "firmware_frames.json"
    path.write_text(json.dumps(vectors, indent=1) + "\n")


if __name__ == "__main__":
    main()
