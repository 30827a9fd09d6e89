"""Plots over generations: measures of the agents, meta-parameters as clouds of points, and the selector's weights."""

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.robot.genes import META_PARAMETERS, agent_schema, selector_inputs
from crcolony.robot.modules import MODULES
from crcolony.telemetry.peer_settings import Mind
from crcolony_dashboards.rerun_streams import RerunStreams
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.evolution_layout import MEASURES
from crcolony_dashboards.tabs.tab import entity_name
from crcolony_dashboards.view_model.generations import Generation, Spread

_MAX_POINTS = 60
"""Agents in a cloud"""


class GenerationPlots:
    """Adds one generation after the other to the plots, and styles every line when it is drawn first."""

    def __init__(self) -> None:
        self._styled: set[str] = set()

    def draw_measures(
        self,
        streams: RerunStreams,
        colony: str,
        generation: Generation,
        colour: palette.Colour,
    ) -> None:
        """Draw mean and standard deviation of every measure."""
        import rerun as rr

        for name in MEASURES:
            spread: Spread = getattr(generation, name)
            path = f"/evolution/{name}/{entity_name(colony)}"
            mean = rr.Measurements(
                [spread.mean],
                variances=[spread.sd**2],
                names=[colony],
                colors=[colour],
                widths=[2.0],
            )
            streams.log(path, mean)
            # Rerun scales the axis by lines, not by the band of a measurement
            ends = rr.SeriesLines(
                names=["mean - sd", "mean + sd"], colors=[_dimmed(colour)] * 2, widths=[0.5] * 2
            )
            self._style(streams, f"{path}_ends", ends)
            streams.log(
                f"{path}_ends", rr.Scalars([spread.mean - spread.sd, spread.mean + spread.sd])
            )

    def draw_genes(
        self, streams: RerunStreams, colony: str, genotypes: FloatArray, mind: Mind
    ) -> None:
        """Draw a cloud and the median of every meta-parameter, and the mean weights of the selector."""
        import rerun as rr

        schema = agent_schema(mind.learning, mind.heredity)
        name = entity_name(colony)
        cloud = genotypes[:: max(1, -(-len(genotypes) // _MAX_POINTS))]
        median_style = rr.SeriesLines(names=["median"], colors=[palette.INK], widths=[1.6])
        for module, colour in zip(MODULES, palette.MODULES, strict=True):
            cloud_style = rr.SeriesPoints(
                colors=[_dimmed(colour)] * _MAX_POINTS,
                markers=["circle"] * _MAX_POINTS,
                marker_sizes=[1.2] * _MAX_POINTS,
            )
            for meta in META_PARAMETERS:
                column = schema.index(f"{module.name}.{meta}")
                path = f"/evolution/genes/{module.name}/{meta}/{name}"
                points = np.full(_MAX_POINTS, np.nan)
                points[: len(cloud)] = cloud[:, column]
                self._style(streams, path, cloud_style)
                self._style(streams, f"{path}_median", median_style)
                streams.log(path, rr.Scalars(points))
                median = float(np.median(genotypes[:, column]))
                streams.log(f"{path}_median", rr.Scalars(median))
        self._draw_selector(streams, name, genotypes)

    def _draw_selector(self, streams: RerunStreams, name: str, genotypes: FloatArray) -> None:
        import rerun as rr

        inputs = selector_inputs()
        path = f"/evolution/selector/{name}"
        names = [name.replace("_target_visible", "'s target visible") for name in inputs]
        colours = [palette.series_colour(k) for k in range(len(inputs))]
        self._style(streams, path, rr.SeriesLines(names=names, colors=colours))
        streams.log(path, rr.Scalars(genotypes[:, : len(inputs)].mean(axis=0)))

    def _style(self, streams: RerunStreams, path: str, style: object) -> None:
        """Log the style of an entity once, as static data, which also viewers that connect late receive."""
        if path not in self._styled:
            self._styled.add(path)
            streams.log(path, style, static=True)


def _dimmed(colour: palette.Colour) -> palette.Colour:
    red, green, blue = (round(0.7 * part) for part in colour)
    return red, green, blue
