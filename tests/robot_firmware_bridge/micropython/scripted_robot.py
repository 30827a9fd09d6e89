"""The script for MicroPython on a board that is all variables, in virtual time."""

from crcolony_bridge.micropython import robot_script as script
from crcolony_bridge.reference_firmware.frames import Frame, FrameReader, encode_frame
from crcolony_bridge.reference_firmware.messages import MessageType, Telemetry


class FakeBoard:
    """A board whose clock and sensors are variables (see `crcolony_bridge.micropython.board`)."""

    uid = bytes(range(1, 9))
    description = b'{"model":"no hardware"}'
    capabilities = 0
    proximity_sensors = 2
    battery_low_mv, battery_critical_mv = 6800, 6200

    def __init__(self) -> None:
        self.now_ms, self.mv, self.sent = 0, 8000, b""
        self.wheels = (1, 1)
        self.inputs: list[bytes] = []
        self.is_released = False

    def received(self) -> bytes:
        if not self.inputs:
            raise EOFError
        return self.inputs.pop(0)

    def send(self, data: bytes) -> None:
        self.sent += data

    def ms(self) -> int:
        return self.now_ms

    def set_wheels(self, left_mm_s: int, right_mm_s: int) -> None:
        self.wheels = (left_mm_s, right_mm_s)

    def set_outputs(self, red: int, green: int, blue: int, speaker: int, switches: int) -> None:
        pass

    def battery_mv(self) -> int:
        return self.mv

    def proximity_mm(self, sensor: int) -> int:
        return 50 * (sensor + 1)

    def release(self) -> None:
        self.is_released = True


class ScriptedRobot:
    """The script on a fake board."""

    def __init__(self) -> None:
        self.board = FakeBoard()
        self.robot = script.Robot(self.board)
        self._reader = FrameReader()
        self.board.set_wheels(0, 0)

    def receive(self, data: bytes) -> None:
        """Let bytes of the host arrive."""
        for encoded in script.receive(self.robot, data):
            script.take_frame(self.robot, encoded)

    def run(self, ms: int) -> None:
        """Let time pass."""
        for _ in range(ms):
            self.board.now_ms += 1
            script.tick(self.robot)

    def sent(self) -> list[Frame]:
        """Return the frames that were sent since the last call."""
        data, self.board.sent = self.board.sent, b""
        return list(self._reader.feed(data))

    def ask(self, *frames: Frame) -> list[Frame]:
        """Send frames, and return what is answered at once."""
        self.sent()
        for frame in frames:
            self.receive(encode_frame(frame))
        return self.sent()

    def telemetry(self) -> Telemetry:
        """Return the next telemetry."""
        self.sent()
        self.run(100)
        return Telemetry.parse(
            next(frame for frame in self.sent() if frame.type == MessageType.TELEMETRY)
        )
