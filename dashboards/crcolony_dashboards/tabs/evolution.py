"""Evolution: what the agents of each generation did, how their genes are distributed, and what the best one wants.

Of matings, batteries and conceptions mean and standard deviation (the band); of each meta-parameter a
cloud of agents and its median; of one agent, the one that mated most in the last generation unless another was asked
for, the potentials it shapes its rewards with, as heat maps, and its selector.
"""

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.learning.features import grid_axis
from crcolony.robot.genes import META_PARAMETERS, agent_schema, decode, selector_inputs
from crcolony.robot.modules import MODULES
from crcolony.telemetry.peer_settings import Mind, PeerSettings
from crcolony_dashboards.rerun_streams import Moment, RerunStreams
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.tab import safe, whole_past
from crcolony_dashboards.throttle import ChangeDetector, Throttle
from crcolony_dashboards.view_model.colony_view import Colony, ColonyView
from crcolony_dashboards.view_model.generations import Generation, Spread
from crcolony_dashboards.view_model.log_lines import number_of, robot_of

if TYPE_CHECKING:
    import rerun.blueprint as rrb

MEASURES = {
    "matings": "Matings of an agent",
    "captures": "Batteries an agent captured",
    "conceptions": "Offspring an agent conceived",
}
_SYMBOLS = {"alpha": "α", "gamma": "γ", "lambda": "λ", "tau": "τ", "tau_decay": "decay of τ"}
_CLOUD = 60
"""Agents in a cloud"""
_PIXELS = 61
"""Of a heat map, each way"""


class EvolutionTab:
    """Draws each generation when it is over. `agent` is whose potentials are drawn, "" for whoever mated most."""

    def __init__(self, agent: str = "") -> None:
        self._agent = agent
        self._beat = Throttle(1.0)
        self._settings = PeerSettings()
        self._styled: set[str] = set()
        self._drawn, self._has_drawn = ChangeDetector(), False

    def layout(self) -> "rrb.Container":
        """Return the place of measures above, genes in the middle, and one agent below."""
        import rerun.blueprint as rrb

        measures = [
            rrb.TimeSeriesView(
                origin=f"/evolution/{name}",
                name=f"{title}: mean ± sd",
                axis_x=whole_past(),
                plot_legend=rrb.PlotLegend(visible=False),
            )
            for name, title in MEASURES.items()
        ]
        genes = [
            rrb.TimeSeriesView(
                origin=f"/evolution/genes/{module.name}/{meta}",
                name=f"{module.name} {_SYMBOLS[meta]}",
                axis_x=whole_past(),
                plot_legend=rrb.PlotLegend(visible=False),
            )
            for module in MODULES
            for meta in META_PARAMETERS
        ]
        potentials = [
            rrb.Spatial2DView(
                origin=f"/evolution/potential/{module.name}",
                name=f"Potential of {module.name}: distance up, bearing across",
                background=palette.BACKGROUND,
            )
            for module in MODULES
        ]
        return rrb.Vertical(
            rrb.Horizontal(*measures),
            rrb.Grid(*genes, grid_columns=len(META_PARAMETERS)),
            rrb.Horizontal(
                *potentials,
                rrb.TimeSeriesView(
                    origin="/evolution/selector",
                    name="Weights of the selector: mean of all agents",
                    axis_x=whole_past(),
                ),
                rrb.TextDocumentView(origin="/evolution/agent", name="Agent"),
                column_shares=[1, 1, 1.4, 0.8],
            ),
            row_shares=[1, 1.6, 1.2],
            name="Evolution",
        )

    def setup(self, streams: RerunStreams) -> None:
        """Nothing is there before a generation is over."""

    def draw(self, streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        """Draw generations that have ended since the last time."""
        if not self._beat.is_due(moment.unix_s):
            return
        for colony, generation in view.take_ended_generations(moment.unix_s):
            streams.set_time(_end_of(generation, view.period_s(), moment))
            number = list(view.colonies).index(colony.name)
            self._draw_measures(streams, colony, generation, palette.series_colour(number))
            mind = self._mind_of(view, colony, generation.genotypes)
            if mind is not None:
                self._draw_genes(streams, colony, generation, mind)
        streams.set_time(moment)
        self._draw_agent(streams, view, moment)

    def _mind_of(self, view: ColonyView, colony: Colony, genotypes: FloatArray) -> Mind | None:
        """Return how genes of a colony are read: as one of its robots says whose genes are as many."""
        for status in view.alive:
            mind = (
                self._settings.of_robot(status.metadata) if status.colony == colony.name else None
            )
            if mind is None or not _sees(mind):
                continue
            if genotypes.shape[-1] == len(agent_schema(mind.learning, mind.heredity)):
                return mind
        return None

    def _draw_measures(
        self, streams: RerunStreams, colony: Colony, generation: Generation, colour: palette.Colour
    ) -> None:
        import rerun as rr

        for name in MEASURES:
            spread: Spread = getattr(generation, name)
            path = f"/evolution/{name}/{safe(colony.name)}"
            mean = rr.Measurements(
                [spread.mean],
                variances=[spread.sd**2],
                names=[colony.name],
                colors=[colour],
                widths=[2.0],
            )
            streams.log(path, mean)
            if f"{path}_ends" not in self._styled:  # what the axis is scaled by: the band is not
                self._styled.add(f"{path}_ends")
                ends = rr.SeriesLines(
                    names=["mean - sd", "mean + sd"], colors=[_dimmed(colour)] * 2, widths=[0.5] * 2
                )
                streams.log(f"{path}_ends", ends, static=True)
            streams.log(
                f"{path}_ends", rr.Scalars([spread.mean - spread.sd, spread.mean + spread.sd])
            )

    def _draw_genes(
        self, streams: RerunStreams, colony: Colony, generation: Generation, mind: Mind
    ) -> None:
        import rerun as rr

        schema = agent_schema(mind.learning, mind.heredity)
        genes, name = generation.genotypes, safe(colony.name)
        cloud = genes[:: max(1, -(-len(genes) // _CLOUD))]
        for module, colour in zip(MODULES, palette.MODULES, strict=True):
            for meta in META_PARAMETERS:
                place = schema.index(f"{module.name}.{meta}")
                path = f"/evolution/genes/{module.name}/{meta}"
                points = np.full(_CLOUD, np.nan)
                points[: len(cloud)] = cloud[:, place]
                if f"{path}/{name}" not in self._styled:
                    self._styled.add(f"{path}/{name}")
                    dots = rr.SeriesPoints(
                        colors=[_dimmed(colour)] * _CLOUD,
                        markers=["circle"] * _CLOUD,
                        marker_sizes=[1.2] * _CLOUD,
                    )
                    line = rr.SeriesLines(names=["median"], colors=[palette.INK], widths=[1.6])
                    streams.log(f"{path}/{name}", dots, static=True)
                    streams.log(f"{path}/{name}_median", line, static=True)
                streams.log(f"{path}/{name}", rr.Scalars(points))
                streams.log(f"{path}/{name}_median", rr.Scalars(float(np.median(genes[:, place]))))
        self._draw_selector(streams, colony, genes)

    def _draw_selector(self, streams: RerunStreams, colony: Colony, genes: FloatArray) -> None:
        import rerun as rr

        inputs = selector_inputs()
        path = f"/evolution/selector/{safe(colony.name)}"
        if path not in self._styled:
            self._styled.add(path)
            names = [name.replace("_target_visible", "'s target visible") for name in inputs]
            colours = [palette.series_colour(k) for k in range(len(inputs))]
            streams.log(path, rr.SeriesLines(names=names, colors=colours), static=True)
        streams.log(path, rr.Scalars(genes[:, : len(inputs)].mean(axis=0)))

    def _draw_agent(self, streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        """Draw the potentials of one agent, when it is another than before."""
        import rerun as rr

        agent, colony = self._choose(view)
        genes = colony.generations.genes_of(agent) if colony is not None else None
        mind = self._mind_of(view, colony, genes) if colony and genes is not None else None
        if genes is None or mind is None or not self._drawn.is_due(agent, moment.unix_s):
            return
        self._has_drawn = True
        weights = decode(genes, mind.learning).potentials
        potentials = [potential(mind, of_module) for of_module in weights]
        for module, values in zip(MODULES, potentials, strict=True):
            path = f"/evolution/potential/{module.name}"
            streams.log(path, rr.Image(palette.heat(values[::-1])))
            streams.log(f"{path}/axes", _axes(mind))
        text = agent_in_words(view, agent, genes, mind, potentials)
        streams.log("/evolution/agent", rr.TextDocument(text, media_type="text/markdown"))

    def _choose(self, view: ColonyView) -> tuple[str, Colony | None]:
        for colony in view.colonies.values():
            if self._agent and colony.generations.genes_of(self._agent) is not None:
                return self._agent, colony
        for colony in view.colonies.values():
            if colony.best:
                return colony.best, colony
            for state in view.states(colony.name):
                if not self._has_drawn and colony.generations.genes_of(state.agent) is not None:
                    return state.agent, colony
        return "", None


def _end_of(generation: Generation, period_s: float | None, now: Moment) -> Moment:
    """Return when a generation ended, at the latest now: whoever comes late hears of it later."""
    sim_s = min(now.sim_s, max(0.0, generation.tick * (period_s or 0.0)))
    return Moment(min(generation.unix_s, now.unix_s), sim_s, generation.number)


def _sees(mind: Mind) -> bool:
    """Tell whether a robot sees anything that a potential could be of."""
    return min(mind.body.camera_range_m, mind.body.camera_half_angle_rad) > 1e-6


def potential(mind: Mind, weights: FloatArray) -> FloatArray:
    """Return a potential over distance (rows, from 0) and bearing (columns, from the left), (61, 61)."""
    range_m, half_angle_rad = mind.body.camera_range_m, mind.body.camera_half_angle_rad
    distances_m = np.linspace(0.0, range_m, _PIXELS)
    bearings_rad = np.abs(np.linspace(-half_angle_rad, half_angle_rad, _PIXELS))
    by_distance = _responses(distances_m, range_m, mind.learning.potential_distances)
    by_bearing = _responses(bearings_rad, half_angle_rad, mind.learning.potential_bearings)
    return np.asarray(by_distance @ weights @ by_bearing.T)


def _responses(places: FloatArray, high: float, count: int) -> FloatArray:
    """Return what units of a normalised network from 0 to `high` answer along one axis, (places, units)."""
    centres, width = grid_axis(0.0, high, count)
    answers = np.exp(-0.5 * ((places[:, None] - centres) / width) ** 2)
    return np.asarray(answers / answers.sum(axis=1, keepdims=True))


def agent_in_words(
    view: ColonyView,
    agent: str,
    genes: FloatArray,
    mind: Mind,
    potentials: Sequence[FloatArray],
) -> str:
    """Say what an agent has inherited, in Markdown."""
    decoded, heads = decode(genes, mind.learning), [module.name for module in MODULES]
    rows = [
        f"**Agent {number_of(agent)} of {view.call(robot_of(agent))}**",
        "",
        f"| | {' | '.join(heads)} |",
        "|---" * (1 + len(heads)) + "|",
    ]
    columns = [dataclasses.astuple(meta) for meta in decoded.meta_parameters]
    for meta, values in zip(META_PARAMETERS, zip(*columns, strict=True), strict=True):
        rows.append(f"| {_SYMBOLS[meta]} | {' | '.join(f'{value:.3f}' for value in values)} |")
    lows = [f"{values.min():.2f}" for values in potentials]
    highs = [f"{values.max():.2f}" for values in potentials]
    rows += [f"| lowest Φ | {' | '.join(lows)} |", f"| highest Φ | {' | '.join(highs)} |", ""]
    rows += ["Its selector mates where this is above 0:", ""]
    for name, weight in zip(selector_inputs(), decoded.selector[0], strict=True):
        rows.append(f"- {weight:+.2f} {name.replace('_', ' ')}")
    return "\n".join(rows)


def _axes(mind: Mind) -> object:
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


def _dimmed(colour: palette.Colour) -> palette.Colour:
    red, green, blue = (round(0.7 * part) for part in colour)
    return red, green, blue
