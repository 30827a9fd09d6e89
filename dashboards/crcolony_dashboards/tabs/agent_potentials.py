"""What one agent has inherited: potentials Φ as heat maps, meta-parameters and selector as text."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.learning.features import grid_axis
from crcolony.robot.genes import META_PARAMETERS, decode, selector_inputs
from crcolony.robot.modules import MODULES
from crcolony.telemetry.peer_settings import Mind
from crcolony_dashboards.rerun_streams import RerunStreams
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.evolution_layout import SYMBOLS
from crcolony_dashboards.view_model.naming import NameLookup, agent_number, agent_robot

_PIXELS = 61
"""Width and height of a heat map"""


def draw_agent(
    streams: RerunStreams, agent: str, genes: FloatArray, mind: Mind, name_of: NameLookup
) -> None:
    """Draw the potentials of an agent, and describe it in words."""
    import rerun as rr

    weights = decode(genes, mind.learning).potentials
    potentials = [potential(mind, module_weights) for module_weights in weights]
    for module, values in zip(MODULES, potentials, strict=True):
        path = f"/evolution/potential/{module.name}"
        streams.log(path, rr.Image(palette.heat_map(values[::-1])))
        streams.log(f"{path}/axes", _axes(mind))
    text = format_agent(agent, genes, mind, potentials, name_of)
    streams.log("/evolution/agent", rr.TextDocument(text, media_type="text/markdown"))


def has_camera(mind: Mind) -> bool:
    """Return whether a robot sees anything that a potential could depend on."""
    return min(mind.body.camera_range_m, mind.body.camera_half_angle_rad) > 1e-6


def potential(mind: Mind, weights: FloatArray) -> FloatArray:
    """Return a potential over distance (rows, from 0) and bearing (columns, from the left), (61, 61)."""
    range_m, half_angle_rad = mind.body.camera_range_m, mind.body.camera_half_angle_rad
    distances_m = np.linspace(0.0, range_m, _PIXELS)
    bearings_rad = np.abs(np.linspace(-half_angle_rad, half_angle_rad, _PIXELS))
    by_distance = _responses(distances_m, range_m, mind.learning.potential_distances)
    by_bearing = _responses(bearings_rad, half_angle_rad, mind.learning.potential_bearings)
    return np.asarray(by_distance @ weights @ by_bearing.T)


def _responses(inputs: FloatArray, high: float, count: int) -> FloatArray:
    """Return the responses of `count` normalised radial units between 0 and `high`, (inputs, units)."""
    centres, width = grid_axis(0.0, high, count)
    responses = np.exp(-0.5 * ((inputs[:, None] - centres) / width) ** 2)
    return np.asarray(responses / responses.sum(axis=1, keepdims=True))


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
    for name, weight in zip(selector_inputs(), decoded.selector[0], strict=True):
        rows.append(f"- {weight:+.2f} {name.replace('_', ' ')}")
    return "\n".join(rows)


def _axes(mind: Mind) -> object:
    """Return labels beside a heat map."""
    import rerun as rr

    degrees = round(float(np.degrees(mind.body.camera_half_angle_rad)))
    last = _PIXELS - 1
    marks = {
        (0.0, last + 4.0): f"{degrees}° left",
        (last / 2, last + 4.0): "ahead, 0 m",
        (last * 1.0, last + 4.0): f"{degrees}° right",
        (last / 2, -4.0): f"{mind.body.camera_range_m:g} m",
    }
    return rr.Points2D(
        np.array(list(marks)),
        labels=list(marks.values()),
        radii=0.1,
        colors=[palette.DIM],
        show_labels=True,
    )
