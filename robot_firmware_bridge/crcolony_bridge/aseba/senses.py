"""What an Aseba robot's raw values mean: a row of our contract from the words of its variables."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import atan2, cos, hypot, sin, tan

import numpy as np
import numpy.typing as npt

from crcolony.body import contract
from crcolony.body.settings import WHEEL_LIMIT_M_S
from crcolony.compiled import FloatArray
from crcolony_bridge.aseba.models import AHEAD, AsebaModel, Camera, ColourRule, Proximity
from crcolony_bridge.aseba.protocol import NodeDescription
from crcolony_bridge.driver import empty_observation

Words = npt.NDArray[np.int16]
_BRIGHT, _OUTSHINES = 0.3, 0.15
"""Of full brightness: how bright a coloured pixel is, and by how much one colour is brighter than both others."""


@dataclass(frozen=True)
class Patch:
    """Neighbouring pixels of one colour."""

    first: int
    pixels: int
    colour: FloatArray
    """Mean red, green and blue (3,), from 0 to 1"""


class Senses:
    """Maps the variables of one node to observations."""

    def __init__(self, model: AsebaModel, node: NodeDescription) -> None:
        self._model, self._node = model, node

    def spans(self) -> list[tuple[int, int]]:
        """Return addresses and sizes of the variables that are needed; raises AsebaError for one that is missing."""
        model, node = self._model, self._node
        spans = [(node.address(name), 1) for name in model.speeds]
        sensors = model.proximity.sensors
        spans.append((node.address(model.proximity.variable, sensors), sensors))
        if (camera := self._camera) is not None:
            spans += [(node.address(name), camera.pixels) for name in camera.variables]
        if model.energy is not None and model.energy.variable in node.addresses:
            spans.append((node.address(model.energy.variable), 1))
        return spans

    def observe(self, words: Words) -> tuple[FloatArray, bool]:
        """Return the observation of a node's variables, and whether its energy is low."""
        model = self._model
        row = empty_observation(model.proximity.range_m)
        distances_m = proximity_m(model.proximity, self._values(words, model.proximity.variable))
        row[contract.PROXIMITY : contract.PROXIMITY + contract.PROXIMITY_SENSORS] = distances_m
        row[contract.IR_RANGE] = distances_m[AHEAD]
        limit = WHEEL_LIMIT_M_S
        for wheel, name in enumerate(model.speeds):
            speed_m_s = self._values(words, name)[0] / model.units_per_m_s
            row[contract.WHEELS + wheel] = np.clip(speed_m_s, -limit, limit)
        if (camera := self._camera) is not None:
            image = np.stack([self._values(words, name) for name in camera.variables], axis=1)
            see(camera, image / camera.full, row)
        return row, self._observe_energy(words, row)

    @property
    def _camera(self) -> Camera | None:
        camera = self._model.camera
        if camera is None or not all(name in self._node.addresses for name in camera.variables):
            return None
        return camera

    def _observe_energy(self, words: Words, row: FloatArray) -> bool:
        rule = self._model.energy
        if rule is None or rule.variable not in self._node.addresses:
            return False
        energy = float(self._values(words, rule.variable)[0])
        row[contract.BATTERY] = np.clip(energy / rule.full, 0.0, 1.0)
        return energy < rule.low

    def _values(self, words: Words, name: str) -> Words:
        address, size = self._node.addresses[name]
        return words[address : address + size]


def proximity_m(proximity: Proximity, raw: Words) -> FloatArray:
    """Return the distances of the columns (PROXIMITY_SENSORS,) from raw values, at the range where there is nothing."""
    distances_m = np.interp(raw, proximity.curve_raw, proximity.curve_m)
    nearest = [
        min((distances_m[sensor] for sensor in sensors), default=proximity.range_m)
        for sensors in proximity.columns
    ]
    return np.array(nearest)


def see(camera: Camera, image: FloatArray, row: FloatArray) -> None:
    """Write the nearest patch of every rule to an observation; `image` is (pixels, 3), from 0 to 1.

    Of things that are equally wide the nearest is the one that looks widest. One that is cut off by the edge of the
    image seems farther away than it is.
    """
    for rule in camera.rules:
        found = max(patches(image, rule.colour), key=lambda patch: patch.pixels, default=None)
        if found is None:
            continue
        distance_m, bearing_rad = _locate(camera, rule, found)
        blob = row[rule.blob : rule.blob + contract.COLOUR + 3]
        if blob[0] and blob[contract.DISTANCE] <= distance_m:
            continue
        blob[0], blob[contract.DISTANCE], blob[contract.BEARING] = 1.0, distance_m, bearing_rad
        blob[contract.COLOUR :] = np.clip(found.colour, 0.0, 1.0)


def patches(image: FloatArray, colour: int) -> Iterator[Patch]:
    """Yield the patches of an image (pixels, 3) in which a colour outshines both others."""
    others = np.delete(image, colour, axis=1).max(axis=1)
    is_it = (image[:, colour] >= _BRIGHT) & (image[:, colour] - others >= _OUTSHINES)
    edges = np.flatnonzero(np.diff(np.concatenate(([0], is_it.astype(np.int8), [0]))))
    for first, end in edges.reshape(-1, 2):
        yield Patch(int(first), int(end - first), image[first:end].mean(axis=0))


def _locate(camera: Camera, rule: ColourRule, patch: Patch) -> tuple[float, float]:
    """Return distance and bearing from the robot's middle of the middle of what a patch shows."""
    pixel_rad = 2.0 * camera.half_angle_rad / (camera.pixels - 1)
    angle_rad = -camera.half_angle_rad + pixel_rad * (patch.first + (patch.pixels - 1) / 2)
    from_camera_m = rule.width_m / 2 / tan(patch.pixels * pixel_rad / 2)
    ahead_m = camera.ahead_m + from_camera_m * cos(angle_rad)
    left_m = from_camera_m * sin(angle_rad)
    return hypot(ahead_m, left_m), atan2(left_m, ahead_m)
