"""What one agent has inherited: potentials Φ as heat maps, meta-parameters and selector as text."""

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.robot.genes import META_PARAMETERS, decode
from crcolony.robot.modules import MODULES
from crcolony.telemetry.peer_settings import Mind
from crcolony_dashboards.rerun_streams import RerunStreams
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.view_model.comparison import INPUTS, SYMBOLS
from crcolony_dashboards.view_model.naming import NameLookup, agent_number, agent_robot
from crcolony_dashboards.view_model.potentials import potential

if TYPE_CHECKING:
    import rerun.blueprint as rrb

_PIXELS = 61
"""Width and height of a heat map"""
_BAR_X, _BAR_WIDTH = _PIXELS + 4, 5
"""Of the colour bar beside it"""


def potential_views() -> "list[rrb.View]":
    """Return a view of the potential of every module."""
    import rerun.blueprint as rrb

    return [
        rrb.Spatial2DView(
            origin=f"/genes/potential/{module.name}",
            name=f"Φ of {module.name}, by where its target is",
            background=palette.BACKGROUND,
            visual_bounds=rrb.VisualBounds2D(
                x_range=(-16.0, _BAR_X + 24.0), y_range=(-18.0, _PIXELS + 20.0)
            ),
        )
        for module in MODULES
    ]


def draw_agent(
    streams: RerunStreams, agent: str, genes: FloatArray, mind: Mind, name_of: NameLookup
) -> None:
    """Draw the potentials of an agent, and describe it in words."""
    import rerun as rr

    weights = decode(genes, mind.learning).potentials
    potentials = [potential(mind, module_weights, _PIXELS) for module_weights in weights]
    for module, values in zip(MODULES, potentials, strict=True):
        path = f"/genes/potential/{module.name}"
        streams.log(path, rr.Image(heat_map_with_scale(values)))
        _draw_axes(streams, path, mind, values)
    text = format_agent(agent, genes, mind, potentials, name_of)
    streams.log("/genes/agent", rr.TextDocument(text, media_type="text/markdown"))


def heat_map_with_scale(values: FloatArray) -> palette.Colours:
    """Return the picture of a potential, with large distances at the top and a colour bar at its right."""
    picture = np.empty((_PIXELS, _BAR_X + _BAR_WIDTH, 3), dtype=np.uint8)
    picture[:] = palette.BACKGROUND
    picture[:, :_PIXELS] = palette.heat_map(values[::-1])
    scale = np.linspace(values.max(), values.min(), _PIXELS)
    picture[:, _BAR_X:] = palette.heat_map(scale)[:, None]
    return picture


def format_agent(
    agent: str,
    genes: FloatArray,
    mind: Mind,
    potentials: Sequence[FloatArray],
    name_of: NameLookup,
) -> str:
    """Return what an agent has inherited, in Markdown."""
    decoded, heads = decode(genes, mind.learning), [module.name for module in MODULES]
    rows = [
        f"**Agent {agent_number(agent)} of {name_of(agent_robot(agent))}**",
        "",
        f"| | {' | '.join(heads)} |",
        "|---" * (1 + len(heads)) + "|",
    ]
    columns = [dataclasses.astuple(meta) for meta in decoded.meta_parameters]
    for meta, values in zip(META_PARAMETERS, zip(*columns, strict=True), strict=True):
        rows.append(f"| {SYMBOLS[meta]} | {' | '.join(f'{value:.3f}' for value in values)} |")
    lows = [f"{values.min():.2f}" for values in potentials]
    highs = [f"{values.max():.2f}" for values in potentials]
    rows += [f"| lowest Φ | {' | '.join(lows)} |", f"| highest Φ | {' | '.join(highs)} |", ""]
    rows += ["Its selector mates where this is above 0:", ""]
    for name, weight in zip(INPUTS, decoded.selector[0], strict=True):
        rows.append(f"- {weight:+.2f} {name}")
    return "\n".join(rows)


def _draw_axes(streams: RerunStreams, path: str, mind: Mind, values: FloatArray) -> None:
    """Draw numbers and names of both axes, and a colour bar with the lowest, the middle and the highest value."""
    import rerun as rr

    degrees = round(float(np.degrees(mind.body.camera_half_angle_rad)))
    last, range_m = _PIXELS - 1, mind.body.camera_range_m
    low, high = float(values.min()), float(values.max())
    marks = {
        (0.0, last + 2.0): f"{-degrees}",
        (last / 2, last + 2.0): "0",
        (last * 1.0, last + 2.0): f"{degrees}",
        (last / 2, last + 10.0): "bearing (degrees, right is +)",
        (-7.0, last - 4.0): "0",
        (-7.0, last / 2 - 3.0): f"{0.5 * range_m:g}",
        (-7.0, -3.0): f"{range_m:g}",
        (2.0, -13.0): "distance (m)",
        (_BAR_X + 12.0, last - 4.0): f"{low:.2f}",
        (_BAR_X + 12.0, last / 2 - 3.0): f"{0.5 * (low + high):.2f}",
        (_BAR_X + 12.0, -3.0): f"{high:.2f}",
        (_BAR_X + 4.0, -13.0): "Φ",
    }
    labels = rr.Points2D(
        np.array(list(marks)),
        labels=list(marks.values()),
        radii=0.0,
        colors=[palette.SOFT],
        show_labels=True,
    )
    streams.log(f"{path}/numbers", labels)
