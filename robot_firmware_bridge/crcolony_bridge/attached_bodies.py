"""The robots that are attached to this machine, as bodies that robots of a colony can join, like those of an arena."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np

from crcolony.body import contract
from crcolony.body.settings import CyberRodent
from crcolony.body_server.body_slots import BodySlots
from crcolony.compiled import FloatArray
from crcolony.protocol.body_messages import Contact
from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import ArenaMetadata
from crcolony_bridge.attached_robot import AttachedRobot
from crcolony_bridge.charge import ChargeMeter
from crcolony_bridge.driver import RobotDescription
from crcolony_bridge.infrared.beacon import Beacon, BeaconEncoding, BeaconMessage
from crcolony_bridge.infrared.short_beacon import ShortEncoding
from crcolony_bridge.infrared.whole_beacon import WholeEncoding


@dataclass(frozen=True)
class BodyBeacon:
    """The beacon of the robot in a body, and how its messages go by the infrared of that body."""

    beacon: Beacon
    encoding: BeaconEncoding


def new_beacon(robot: RobotId, body: RobotDescription) -> BodyBeacon:
    """Return the beacon of a robot in a body of this description."""
    encoding: BeaconEncoding = ShortEncoding(robot) if body.ir == "tokens" else WholeEncoding()
    return BodyBeacon(Beacon(robot, encoding.form), encoding)


class AttachedBodies(BodySlots):
    """A slot for every attached robot. `step` begins a control period with what the robots have measured since."""

    def __init__(
        self,
        robots: Sequence[AttachedRobot],
        bridge_run: int,
        period_s: float,
        *,
        energy_per_charge: float = 1.0,
        grace_s: float = 30.0,
    ) -> None:
        super().__init__(len(robots), bridge_run, period_s, grace_s=grace_s)
        self._attached = list(robots)
        self._rows = np.zeros((len(robots), contract.OBSERVATION_WIDTH))
        self._contacts: list[Contact | None] = [None] * len(robots)
        self._beacons: list[BodyBeacon | None] = [None] * len(robots)
        self._loaded: list[bytes] = [b""] * len(robots)
        self.received: list[tuple[RobotId, BeaconMessage]] = []
        """Whole messages that bodies have received by infrared in the last control period, each with its receiver"""
        self._stepped_s = 0.0
        self._meters = [ChargeMeter(energy_per_charge) for _ in robots]

    def step(self, now_s: float, online: Iterable[RobotId] = ()) -> list[RobotId]:
        """Begin a control period; return the robots whose bodies have measured something in the last one.

        `online` are the robots on the network: no others can be met where infrared carries words alone.
        """
        self.tick += 1
        self._stepped_s = now_s
        self.received.clear()
        observed = []
        for slot, attached in enumerate(self._attached):
            reading, heard = attached.take()
            robot = self.occupant(slot)
            if robot is None:
                continue
            if reading is not None:
                battery = float(reading.row[contract.BATTERY])
                if attached.is_exhausted:
                    self._meters[slot].fall(battery)
                else:
                    self._rows[slot] = reading.row
                    self._rows[slot, contract.CHARGE] = self._meters[slot].update(battery)
                    observed.append(robot)
            self._exchange_ir(now_s, slot, robot, heard, online)
        return observed

    def send_by_infrared(self, now_s: float, robot: RobotId, envelope: bytes) -> None:
        """Let the body of a robot send an envelope by infrared; does nothing if it has no body here."""
        slot = self.robots.get(robot)
        port = None if slot is None else self._beacons[slot]
        if port is not None:
            port.beacon.load(now_s, envelope)

    def metadata(self, arena: str) -> ArenaMetadata:
        """Return the reply to an observer's metadata query: the settings of the first body."""
        settings = msgspec.json.encode({"body": self._cyber_rodent(0)}).decode()
        return ArenaMetadata(arena, self.arena_run, settings)

    def _exchange_ir(
        self,
        now_s: float,
        slot: int,
        robot: RobotId,
        heard: list[bytes],
        online: Iterable[RobotId],
    ) -> None:
        attached, port = self._attached[slot], self._beacons[slot]
        if port is None or port.beacon.robot != robot:
            port = self._beacons[slot] = new_beacon(robot, attached.driver.description)
        messages = port.encoding.decode(now_s, heard, online)
        if port.encoding.form.has_envelopes:  # who is met by words is on the network already
            self.received += [(robot, message) for message in messages]
        found = [port.beacon.receive(now_s, message) for message in messages]
        contacts = [contact for contact in found if contact is not None]
        self._contacts[slot] = contacts[-1] if contacts else None
        data = port.encoding.encode(now_s, port.beacon.message(now_s))
        if data != self._loaded[slot]:
            self._loaded[slot] = data
            attached.load_beacon(data)

    # Bodies -----------------------------------------------------------------------------------------------------------

    def _is_usable(self, slot: int) -> bool:
        return not self._attached[slot].why_unusable()

    def _why_no_slot(self) -> str:
        reasons = [
            f"{robot.name} {why}" for robot in self._attached if (why := robot.why_unusable())
        ]
        if reasons:
            return f"no robot is free: {', '.join(reasons)}"[:200]
        return super()._why_no_slot()

    def _embody(self, slot: int, colony: int) -> None:
        self._contacts[slot] = None
        self._loaded[slot] = b""
        self._attached[slot].drive(True)

    def _remove(self, slot: int) -> None:
        self._beacons[slot] = None
        self._attached[slot].drive(False)

    def _act(self, slot: int, action: FloatArray) -> None:
        """Apply an action at once: a wheel that waits for the next control period turns late."""
        port = self._beacons[slot]
        if port is not None:
            if not self._attached[slot].may_meet:
                action[contract.BEACON] = 0.0  # whatever its robot wants
            port.beacon.is_ready = bool(action[contract.BEACON] >= 0.5)
            if port.beacon.must_be_on(self._stepped_s):
                action[contract.BEACON] = 1.0  # a mating that has begun is finished
        self._attached[slot].act(action)

    def _body_settings(self, slot: int) -> str:
        return msgspec.json.encode(self._cyber_rodent(slot)).decode()

    def _sense(self, slot: int) -> tuple[FloatArray, Contact | None]:
        row = self._rows[slot].copy()
        contact = self._contacts[slot]
        if contact is not None:
            row[contract.ENCOUNTER] = 1.0
            row[contract.ENCOUNTER_NONCE] = contact.nonce
        return row, contact

    def _cyber_rodent(self, slot: int) -> CyberRodent:
        return body_settings(self._attached[slot].driver.description)


def body_settings(robot: RobotDescription) -> CyberRodent:
    """Return the settings of a body that is like this robot."""
    return CyberRodent(
        radius_m=robot.radius_m,
        track_m=robot.track_m,
        infrared=bool(robot.proximity_bearings_rad),
        ir_range_m=robot.proximity_range_m,
        proximity_range_m=robot.proximity_range_m,
        inertial=True,
    )
