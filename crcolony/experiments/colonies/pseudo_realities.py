"""Pseudo-realities: worlds that are sampled evenly around the one of a design (Ligot and Birattari 2019), for a robot
that forages.

A world has noisy eyes, wheels that turn faster or slower than they are meant to, actions that are late, walls and
pillars. `CENTRE` is in the middle of all that is sampled, so that worlds are as often easier as harder than it. `EDGE`
has no noise, no delay and no pillar: hardly a world is easier.
"""

from dataclasses import dataclass

import msgspec
import numpy as np

from crcolony.body.settings import Noise
from crcolony.config import Config, check_config

LONGEST_DELAY_STEPS, MOST_PILLARS = 2, 2
_NOISE_M, _NOISE_RAD = 0.06, 0.1
_SPREAD = 0.15
"""By this share a wheel turns too fast or too slowly at most."""
_SIDE_M, _SIDE_SPREAD_M = 2.0, 0.4
_PILLAR_RADIUS_M = 0.1


@dataclass(frozen=True)
class PseudoReality:
    """A world and a body in it."""

    distance_noise_m: float
    bearing_noise_rad: float
    delay_steps: int
    """Control steps by which actions are late"""
    wheels: tuple[float, float]
    """How fast the left wheel and the right one turn, 1 is as they are meant to"""
    width_m: float
    height_m: float
    pillars: tuple[tuple[float, float, float], ...]

    def config_of(self, config: Config) -> Config:
        """Return the settings of a robot in this world; its wheels are none of them."""
        noise = Noise(distance_m=self.distance_noise_m, bearing_rad=self.bearing_noise_rad)
        replace = msgspec.structs.replace
        found = replace(
            config,
            body=replace(config.body, noise=noise, action_latency_steps=self.delay_steps),
            arena=replace(
                config.arena, width_m=self.width_m, height_m=self.height_m, pillars=self.pillars
            ),
        )
        check_config(found)
        return found


CENTRE = PseudoReality(
    distance_noise_m=0.5 * _NOISE_M,
    bearing_noise_rad=0.5 * _NOISE_RAD,
    delay_steps=LONGEST_DELAY_STEPS // 2,
    wheels=(1.0, 1.0),
    width_m=_SIDE_M,
    height_m=_SIDE_M,
    pillars=((0.0, 0.0, _PILLAR_RADIUS_M),),
)
EDGE = PseudoReality(0.0, 0.0, 0, (1.0, 1.0), _SIDE_M, _SIDE_M, ())


def sample_pseudo_reality(rng: np.random.Generator) -> PseudoReality:
    """Return a world of the range; pillars stand in the middle half of it, where no robot is caught behind them."""
    width_m, height_m = rng.uniform(_SIDE_M - _SIDE_SPREAD_M, _SIDE_M + _SIDE_SPREAD_M, 2).tolist()
    left, right = rng.uniform(1.0 - _SPREAD, 1.0 + _SPREAD, 2).tolist()
    places = rng.uniform(-0.25, 0.25, (int(rng.integers(MOST_PILLARS + 1)), 2)).tolist()
    return PseudoReality(
        distance_noise_m=rng.uniform(0.0, _NOISE_M),
        bearing_noise_rad=rng.uniform(0.0, _NOISE_RAD),
        delay_steps=int(rng.integers(LONGEST_DELAY_STEPS + 1)),
        wheels=(left, right),
        width_m=width_m,
        height_m=height_m,
        pillars=tuple((x * width_m, y * height_m, _PILLAR_RADIUS_M) for x, y in places),
    )
