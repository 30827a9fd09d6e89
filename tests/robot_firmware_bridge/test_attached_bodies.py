"""Attached robots are bodies like those of an arena: joined, observed, driven, met, and given back."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from crcolony_bridge.attached_bodies import AttachedBodies, body_settings
from crcolony_bridge.driver import DriverState, RobotDescription

from crcolony.body import contract
from crcolony.body.settings import CyberRodent
from crcolony.body_server.body_slots import NoBodyError
from crcolony.protocol.body_messages import (
    Action,
    BodyGranted,
    Contact,
    Observation,
    decode_observation,
    pack_row,
    unpack_row,
)
from tests.robot_firmware_bridge.fake_driver import AttachedFakes, reading
from tests.support.process import wait_until

IDS = [bytes([k]) * 16 for k in range(1, 5)]


class Setup(AttachedFakes):
    """Two attached robots as bodies."""

    def __init__(self) -> None:
        super().__init__(2)
        self.bodies = AttachedBodies(self.robots, 7, 0.1, energy_per_charge=0.5)
        self.now_s = 0.0

    def meet(
        self, periods: int, online: Sequence[bytes] = (), *, is_low: bool = False
    ) -> dict[int, Contact]:
        """Let both hear what the other's beacon was told to repeat; return the contact of each body."""
        contacts = {}
        for _ in range(periods):
            said = [driver.beacons[-1:] for driver in self.drivers]
            heard = [(1 - k, message) for k in (0, 1) for message in said[k]]
            for slot, observation in enumerate(self.step(*heard, online=online, is_low=is_low)):
                if observation.contact is not None:
                    contacts[slot] = observation.contact
                    assert unpack_row(observation.row)[contract.ENCOUNTER] == 1.0
        return contacts

    def join(self, k: int) -> BodyGranted:
        """Let robot k ask for a body; raises NoBodyError."""
        return self.bodies.grant(self.bodies.join(IDS[k], "test"), bytes(16), bytes(32))

    def step(
        self,
        *heard: tuple[int, bytes],
        battery: float = 0.5,
        is_low: bool = False,
        is_critical: bool = False,
        online: Sequence[bytes] = (),
    ) -> list[Observation]:
        """Let all robots measure and a control period pass; return the observations."""
        for slot, driver in enumerate(self.drivers):
            messages = [message for at, message in heard if at == slot]
            driver.readings.put(
                replace(
                    reading(battery, *messages),
                    is_battery_low=is_low,
                    is_battery_critical=is_critical,
                )
            )
            wait_until(lambda slot=slot: self.robots[slot]._reading is not None, "a reading")  # type: ignore[misc]
        self.now_s += 0.1
        observed = self.bodies.step(self.now_s, online)
        return [decode_observation(self.bodies.observation(robot)) for robot in observed]


@pytest.fixture
def setup() -> Iterator[Setup]:
    """Two robots that are plugged in."""
    made = Setup()
    yield made
    made.close()


def test_a_robot_joins_observes_and_drives(setup: Setup) -> None:
    """And the body stands still when it leaves."""
    granted = setup.join(0)
    assert granted.slot == 0
    assert not granted.lockstep
    body = msgspec.json.decode(granted.body, type=CyberRodent)
    assert body.track_m == setup.drivers[0].description.track_m
    (observation,) = setup.step()
    row = np.zeros(contract.ACTION_WIDTH)
    row[[contract.WHEEL_LEFT, contract.TTL]] = 0.1, 0.3
    assert setup.bodies.apply_action(IDS[0], Action(observation.tick, pack_row(row)))
    wait_until(lambda: setup.drivers[0].written, "it drives")
    assert not setup.bodies.apply_action(IDS[0], Action(observation.tick, pack_row(row)))
    assert setup.bodies.counts == {"stale": 1}
    setup.bodies.leave(IDS[0])
    wait_until(lambda: setup.drivers[0].state is DriverState.INACTIVE, "it stands still")


def test_there_are_as_many_bodies_as_robots_that_are_there(setup: Setup) -> None:
    """The reason is said to who gets none."""
    setup.drivers[0].lose()
    wait_until(lambda: not setup.robots[0].is_connected, "it is lost")
    granted = setup.join(0)
    assert granted.slot == 1
    with pytest.raises(NoBodyError, match="robot0 not connected"):
        setup.join(1)


def test_a_robot_that_is_silent_has_no_observations(setup: Setup) -> None:
    """Its virtual agents live on when it returns: time without a body is no lifetime."""
    setup.join(0)
    assert len(setup.step()) == 1
    assert setup.bodies.step(1.0) == []


def test_charging_feeds_the_robot(setup: Setup) -> None:
    """By the energy that a full charge is worth."""
    setup.join(0)
    setup.step(battery=0.2)
    (observation,) = setup.step(battery=0.6)
    assert unpack_row(observation.row)[contract.CHARGE] == pytest.approx(0.2)


def test_a_robot_with_a_low_battery_meets_nobody(setup: Setup) -> None:
    """Until it is charged."""
    setup.join(0)
    setup.join(1)
    for is_low in (True, False):
        setup.step(is_low=is_low)
        for robot in IDS[:2]:
            row = np.zeros(contract.ACTION_WIDTH)
            row[contract.BEACON] = 1.0
            assert setup.bodies.apply_action(robot, Action(setup.bodies.tick, pack_row(row)))
        assert len(setup.meet(6, is_low=is_low)) == (0 if is_low else 2)


def test_who_lives_in_a_robot_with_a_critical_battery_rests_until_it_is_charged(
    setup: Setup,
) -> None:
    """Without observations, in the same body; the charge is energy then, and nobody else gets the body."""
    setup.join(0)
    setup.step(battery=0.2)
    assert setup.step(battery=0.1, is_critical=True) == []
    with pytest.raises(NoBodyError, match="robot1 battery critical"):
        setup.join(1)
    (observation,) = setup.step(battery=0.6)
    assert unpack_row(observation.row)[contract.CHARGE] == pytest.approx(0.25)


def test_two_robots_that_hear_each_other_have_the_same_contact(setup: Setup) -> None:
    """Each message is what the other's beacon was told to repeat."""
    setup.join(0)
    setup.join(1)
    contacts = setup.meet(6)
    assert setup.bodies.received
    assert contacts[0].robot == IDS[1]
    assert contacts[1].robot == IDS[0]
    assert contacts[0].nonce == contacts[1].nonce


def test_two_robots_whose_infrared_carries_words_have_the_same_contact(setup: Setup) -> None:
    """If both are on the network, where the rest of a mating goes; no envelope ever goes by infrared."""
    for driver in setup.drivers:
        driver.description = replace(driver.description, ir="tokens", max_ir_bytes=2)
    for k in (0, 1):
        setup.join(k)
    assert setup.meet(40, online=IDS[2:]) == {}, "neither knows who the other one is"
    setup.bodies.send_by_infrared(setup.now_s, IDS[0], b"an envelope")
    contacts = setup.meet(40, online=IDS)
    assert [contacts[slot].robot for slot in (0, 1)] == [IDS[1], IDS[0]]
    assert contacts[0].nonce == contacts[1].nonce
    assert all(len(word) == 2 for driver in setup.drivers for word in driver.beacons)
    assert setup.bodies.received == []


def test_a_body_is_described_by_its_robot() -> None:
    """What a robot senses is what it has sensors for."""
    plain = body_settings(RobotDescription("plain", track_m=0.05, radius_m=0.03))
    assert not plain.infrared
    assert plain.radius_m == 0.03
    seeing = RobotDescription("seeing", proximity_bearings_rad=(0.0,), proximity_range_m=0.05)
    assert body_settings(seeing).proximity_range_m == 0.05
