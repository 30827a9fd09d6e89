"""Implausible data are refused without raising."""

import contextlib
from typing import Any

import msgspec
import numpy as np
import pytest
from crcolony_dashboards.view_model.plausibility import is_plausible_event, is_plausible_scene

from crcolony.evolution.history import Born, Lived
from crcolony.protocol.codec import WireError, encode
from crcolony.protocol.telemetry_messages import Scene, ScenePack, SceneRobot, decode_scene
from tests.support.fake_telemetry import IDS, agent, born, lived
from tests.vectors.make import TELEMETRY

NAN, INF = float("nan"), float("inf")


def scene(**changes: Any) -> Scene:
    plausible = TELEMETRY["scene"]
    assert isinstance(plausible, Scene)
    return msgspec.structs.replace(plausible, **changes)


def robot(x_m: float = 0.0, y_m: float = 0.0, heading_rad: float = 0.0) -> SceneRobot:
    return SceneRobot(IDS[0], "blue", x_m, y_m, heading_rad, False, 0.0, 0.0, 0.0, False)


def pack(x_m: float, y_m: float) -> ScenePack:
    return ScenePack(x_m, y_m, 0.0, 1.0, 0.0, 0.4)


def test_a_scene_is_plausible() -> None:
    """With robots and packs, or without."""
    assert is_plausible_scene(scene())
    assert is_plausible_scene(scene(robots=[], packs=[]))


@pytest.mark.parametrize(
    "changes",
    [
        *({size: value} for size in ("width_m", "height_m") for value in (0.0, -1.0, INF, NAN)),
        *({"period_s": value} for value in (-0.2, INF, NAN, 1e300)),
        {"tick": 2**53 - 1, "period_s": 1e3},
        *({"robots": [robot(), robot(*where)]} for where in [(NAN,), (0.0, INF), (0.0, 0.0, NAN)]),
        *({"robots": [robot(-1e30)]}, {"robots": [robot(0.0, 0.0, 1e300)]}),
        *({"packs": [pack(*where)]} for where in [(NAN, 0.0), (0.0, -INF), (1e9, 0.0)]),
    ],
)
def test_sizes_times_and_positions_of_a_scene_are_finite(
    changes: dict[str, Any],
) -> None:
    """Others are refused by the decoder, or as implausible."""
    with pytest.raises(WireError) if "tick" not in changes else contextlib.nullcontext():
        assert not is_plausible_scene(decode_scene(encode(scene(**changes))))


def test_births_and_lifetimes_are_plausible() -> None:
    """Of a founder, of a child, and a lifetime."""
    assert is_plausible_event(born(agent(0, 1), genes=[]))
    assert is_plausible_event(born(agent(0, 1), 7, [-3.0, 1e6], mother="a/0", father="a/1"))
    assert is_plausible_event(lived(agent(0, 1), 2**53 - 1))


@pytest.mark.parametrize(
    "event",
    [
        born("x" * 65),
        born("x/1", mother="x" * 65),
        born("x/1", father="x" * 65),
        born("x/1", -1),
        born("x/1", 2**64 - 1),
        born("x/1", genes=[0.5, NAN]),
        born("x/1", genes=[-INF]),
        born("x/1", genes=[1e300]),
        msgspec.structs.replace(born("x/1"), genes=np.zeros(2).tobytes()[:-1]),
        lived("x" * 65),
        lived("x/1", -1),
        lived("x/1", 2**53),
    ],
)
def test_names_generations_and_genes_are_bounded(
    event: Born | Lived,
) -> None:
    """Events beyond the limits are implausible."""
    assert not is_plausible_event(event)
