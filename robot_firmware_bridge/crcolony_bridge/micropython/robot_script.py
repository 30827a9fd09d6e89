"""The robot, as `firmware/core/robot.c` has it, for controllers that run MicroPython; `upload.py` puts it there.

Wheels turn only while a command of the present session is alive: its time to live and the latch stop them, whatever
has become of the host. It is written for little memory: functions are uploaded one at a time, and use the standard
library's `struct` alone. What differs between boards is in `boards/`.
"""

from struct import pack, unpack_from
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from crcolony_bridge.micropython.board import Board

MAX_TTL_MS = 500
LEASE_MS = 1000
MIN_PERIOD_MS = 100
HYSTERESIS_MV = 200
MAX_REQUEST_BYTES = 64
DESCRIPTION_PART_BYTES = 96
LEAST_BYTES = {0x01: 6, 0x04: 2, 0x10: 15, 0x11: 0, 0x12: 4, 0x40: 4}
"""Of the payload of a request, by its type."""


class Robot:
    """All that the robot remembers."""

    def __init__(self, board: "Board") -> None:
        self.board = board
        self.rest = b""
        self.bad_frames = self.seq = self.command_seq = 0
        self.session = -1
        self.heard_ms = self.command_ms = self.due_ms = board.ms()
        self.ttl_ms = self.period_ms = self.left = self.right = 0
        self.is_stopped = self.has_expired = self.is_low = self.is_critical = False
        self.applied = (0, 0)  # to the motors


def crc16(data: "bytes | bytearray") -> int:
    """Return the CRC-16/CCITT-FALSE, a byte at a time and without a table."""
    crc = 0xFFFF
    for byte in data:
        x = crc >> 8 ^ byte
        x ^= x >> 4
        crc = (crc << 8 ^ x << 12 ^ x << 5 ^ x) & 0xFFFF
    return crc


def encode(type_: int, seq: int, payload: bytes) -> bytes:
    """Return a frame with its delimiter. COBS in one buffer: a part for each zero would fill the memory."""
    body = pack("<BBH", 16, type_, seq & 0xFFFF) + payload
    body += pack("<H", crc16(body))
    out = bytearray(len(body) + 2)
    code_at = 0
    for at, byte in enumerate(body, 1):
        if byte:
            out[at] = byte
        else:
            out[code_at] = at - code_at
            code_at = at
    out[code_at] = len(body) + 1 - code_at
    return bytes(out)


def decode(encoded: bytes) -> bytes:
    """Return a frame's content without its CRC, nothing for what is no frame."""
    body = bytearray(encoded)
    at = 0
    while at < len(body):
        code = body[at]
        body[at] = 0
        at += code
    if at > len(body) or len(body) < 7:
        return b""
    if unpack_from("<H", body, len(body) - 2)[0] != crc16(body[1:-2]):
        return b""
    return bytes(body[1:-2])


def stand_still(robot: Robot) -> None:
    robot.left = robot.right = robot.ttl_ms = 0


def drive(robot: Robot) -> None:
    """Give the motors what has been decided: in one place, and few calls deep, for the stack is small."""
    if robot.applied != (robot.left, robot.right):
        robot.applied = (robot.left, robot.right)
        robot.board.set_wheels(robot.left, robot.right)


def info(robot: Robot) -> bytes:
    """Return what the robot is."""
    board = robot.board
    text = board.description
    sensors, abilities = board.proximity_sensors, board.capabilities
    sizes = pack("<BHHHHH", sensors, abilities, MAX_TTL_MS, 0, crc16(text), len(text))
    return pack("<I", robot.session) + sizes + board.uid


def greet(robot: Robot, payload: bytes, now_ms: int) -> int:
    """Give the robot to a session; return the reason why not, 0 for none."""
    session, period_ms = unpack_from("<IH", payload)
    if session != robot.session:
        if robot.session >= 0 and now_ms - robot.heard_ms < LEASE_MS:
            return 5
        stand_still(robot)
    robot.session = session
    robot.heard_ms = robot.due_ms = now_ms
    robot.period_ms = max(period_ms, MIN_PERIOD_MS)
    return 0


def obey(robot: Robot, seq: int, payload: bytes, now_ms: int) -> int:
    """Carry out a command; return the reason why not, 0 for none."""
    if robot.is_stopped:
        return 3
    left, right, ttl_ms, *outputs = unpack_from("<hhHBBBBB", payload, 4)
    robot.command_seq = seq
    robot.command_ms = now_ms
    robot.board.set_outputs(*outputs)
    if robot.is_critical:
        return 6
    robot.ttl_ms = min(ttl_ms, MAX_TTL_MS)
    robot.has_expired = False
    robot.left, robot.right = (left, right) if robot.ttl_ms else (0, 0)
    return 0


def answer(robot: Robot, type_: int, seq: int, payload: bytes) -> bytes:
    """Do what a request asks for; return the answer, type and payload, nothing for none."""
    now_ms = robot.board.ms()
    reason = 0
    if len(payload) < LEAST_BYTES.get(type_, 999):
        return bytes([0x7F, type_, 2 if type_ in LEAST_BYTES else 4])
    if type_ == 0x11:
        robot.is_stopped = True
        stand_still(robot)
        return b"\x7e\x11"
    if type_ == 0x40:
        return b"\x41" + payload[:4] + pack("<I", now_ms)
    if type_ == 0x04:
        text = robot.board.description
        start = unpack_from("<H", payload)[0]
        part = text[start : start + DESCRIPTION_PART_BYTES]
        return pack("<BHH", 5, len(text), start) + part
    if type_ == 0x01:
        reason = greet(robot, payload, now_ms)
        if reason == 0:
            return b"\x02" + info(robot)
    elif unpack_from("<I", payload)[0] != robot.session:
        reason = 5
    else:
        robot.heard_ms = now_ms
        if type_ == 0x10:
            reason = obey(robot, seq, payload, now_ms)
        else:
            robot.is_stopped = False
            stand_still(robot)
            return b"\x7e\x12"
    return bytes([0x7F, type_, reason]) if reason else b""


def take_frame(robot: Robot, encoded: bytes) -> None:
    """Answer a frame, and count what is none."""
    body = decode(encoded)
    if not body:
        robot.bad_frames = min(robot.bad_frames + 1, 0xFFFF)
        return
    first, type_, seq = unpack_from("<BBH", body)
    reply = answer(robot, type_, seq, body[4:]) if first >> 4 == 1 else bytes([0x7F, type_, 1])
    drive(robot)
    if reply:
        robot.board.send(encode(reply[0], seq, reply[1:]))


def receive(robot: Robot, data: bytes) -> "list[bytes]":
    """Return the frames that bytes of the host complete; no more is kept than the longest request has."""
    *frames, rest = (robot.rest + data).split(b"\0")
    robot.rest = rest[: MAX_REQUEST_BYTES + 1]  # one too many: what it becomes is no frame
    return [encoded for encoded in frames if encoded]


def guard_battery(robot: Robot) -> None:
    """Refuse motion on an empty battery, with hysteresis."""
    board = robot.board
    mv = board.battery_mv()
    robot.is_low = mv < board.battery_low_mv + (HYSTERESIS_MV if robot.is_low else 0)
    was_critical = robot.is_critical
    robot.is_critical = mv < board.battery_critical_mv + (HYSTERESIS_MV if was_critical else 0)
    if robot.is_critical and not was_critical:
        stand_still(robot)


def telemetry(robot: Robot, now_ms: int) -> bytes:
    """Return what the robot measures; wheels without encoders turn as they are told."""
    board = robot.board
    flags = (robot.is_stopped, robot.is_low, robot.is_critical, robot.ttl_ms > 0)
    status = sum([1 << bit for bit, is_set in enumerate(flags) if is_set])
    status |= 32 if robot.has_expired else 0
    payload = pack("<IHHH", now_ms & 0xFFFFFFFF, status, robot.bad_frames, robot.command_seq)
    payload += pack("<hh", robot.left, robot.right) * 2
    payload += pack("<hHB", 0, board.battery_mv(), board.proximity_sensors)
    mm = [board.proximity_mm(sensor) for sensor in range(board.proximity_sensors)]
    return payload + b"".join([pack("<H", distance) for distance in mm])


def tick(robot: Robot) -> None:
    """Stop the wheels when it is time, and send what is due."""
    now_ms = robot.board.ms()
    if robot.ttl_ms and now_ms - robot.command_ms >= robot.ttl_ms:
        stand_still(robot)
        robot.has_expired = True
    guard_battery(robot)
    drive(robot)
    if robot.period_ms and now_ms >= robot.due_ms:
        robot.due_ms = max(robot.due_ms + robot.period_ms, now_ms)
        robot.board.send(encode(0x20, robot.seq, telemetry(robot, now_ms)))
        robot.seq += 1


def run(board: "Board") -> None:
    """Be a robot until the controller is reset; the wheels stand still whatever ends it."""
    robot = Robot(board)
    try:
        board.set_wheels(0, 0)
        board.send(encode(0x03, 0, b"\x04" + board.uid))
        while True:
            try:
                for encoded in receive(robot, board.received()):
                    take_frame(robot, encoded)
                tick(robot)
            except MemoryError:  # the latch is kept: what ends this loop would lose it
                stand_still(robot)
                drive(robot)
    finally:
        board.set_wheels(0, 0)
        board.release()
