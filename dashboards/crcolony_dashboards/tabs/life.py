"""The life tab: energy, learning module in control, and rates of matings and captures.

A few robots have lines of their own; of many the median and the middle 50 and 80 % are drawn.
"""

from typing import TYPE_CHECKING

import numpy as np

from crcolony.protocol.telemetry_messages import RobotState
from crcolony.robot.modules import MODULES
from crcolony_dashboards.rerun_streams import Moment, RerunStreams
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.tab import MAX_ROBOT_LINES, entity_name
from crcolony_dashboards.throttle import Throttle
from crcolony_dashboards.view_model.colony_view import ColonyView

if TYPE_CHECKING:
    import rerun.blueprint as rrb

QUANTILES = (0.1, 0.25, 0.5, 0.75, 0.9)


class LifeTab:
    """Draws states twice a second, as often as robots publish them."""

    def __init__(self) -> None:
        self._state_throttle, self._rate_throttle = Throttle(0.5), Throttle(1.0)
        self._styled: set[str] = set()

    def layout(self) -> "rrb.Container":
        """Return energy, modules and rates, one below the other."""
        import rerun.blueprint as rrb

        return rrb.Vertical(
            rrb.TimeSeriesView(
                origin="/life/energy",
                name="Energy (0 starves, 1 is full)",
                axis_y=rrb.ScalarAxis(range=(-0.02, 1.02)),
            ),
            rrb.StateTimelineView(
                origin="/life/module",
                name=f"Module in control (of at most {MAX_ROBOT_LINES} robots)",
            ),
            rrb.Horizontal(
                rrb.TimeSeriesView(
                    origin="/life/mating_module",
                    name="Share of robots whose mating module is in control",
                    axis_y=rrb.ScalarAxis(range=(-0.02, 1.02)),
                ),
                rrb.TimeSeriesView(
                    origin="/life/rates",
                    name="Matings and batteries per robot and minute of the colony's time",
                ),
            ),
            name="Life",
        )

    def setup(self, streams: RerunStreams) -> None:
        """Set names and colours of the quantiles."""
        import rerun as rr

        greys = [(90, 96, 104), (140, 148, 158), palette.INK, (140, 148, 158), (90, 96, 104)]
        streams.log(
            "/life/energy/all",
            rr.SeriesLines(
                names=[f"{round(100 * quantile)} %" for quantile in QUANTILES],
                colors=greys,
                widths=[1.0, 1.0, 2.0, 1.0, 1.0],
            ),
            static=True,
        )

    def draw(self, streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        """Draw states and rates that are due."""
        if self._rate_throttle.is_due(moment.unix_s):
            self._draw_rates(streams, view)
        if not self._state_throttle.is_due(moment.unix_s):
            return
        states = view.states()
        if not states:
            return
        if len(states) <= MAX_ROBOT_LINES:
            self._draw_energies(streams, view, states)
        else:
            self._draw_quantiles(streams, states)
        self._draw_modules(streams, view, states[:MAX_ROBOT_LINES])
        for name in view.colonies:
            in_colony = view.states(name)
            if in_colony:
                mating = np.mean([state.module == len(MODULES) - 1 for state in in_colony])
                self._add_point(
                    streams, f"/life/mating_module/{entity_name(name)}", name, float(mating)
                )

    def _draw_energies(
        self, streams: RerunStreams, view: ColonyView, states: list[RobotState]
    ) -> None:
        for state in states:
            path = f"/life/energy/{entity_name(view.name_of(state.robot))}"
            self._add_point(streams, path, view.name_of(state.robot), state.energy)

    @staticmethod
    def _draw_quantiles(streams: RerunStreams, states: list[RobotState]) -> None:
        import rerun as rr

        energies = [state.energy for state in states]
        streams.log("/life/energy/all", rr.Scalars(np.quantile(energies, QUANTILES)))

    def _draw_modules(
        self, streams: RerunStreams, view: ColonyView, states: list[RobotState]
    ) -> None:
        """Draw the module in control of every robot; changes between two states are not visible."""
        import rerun as rr

        for state in states:
            path = f"/life/module/{entity_name(view.name_of(state.robot))}"
            if path not in self._styled:
                self._styled.add(path)
                names = [module.name for module in MODULES] + ["none"]
                shown = [*palette.MODULES[: len(MODULES)], palette.STALE]
                streams.log(
                    path,
                    rr.StateConfiguration(values=names, labels=names, colors=shown),
                    static=True,
                )
            in_control = MODULES[state.module].name if 0 <= state.module < len(MODULES) else "none"
            streams.log(path, rr.StateChange(state=in_control))

    def _draw_rates(self, streams: RerunStreams, view: ColonyView) -> None:
        for name, colony in view.colonies.items():
            rates = colony.rates.per_robot_minute()
            if rates is None:
                continue
            prefix = f"{name}: " if len(view.colonies) > 1 else ""
            for what, rate in zip(("matings", "batteries"), rates, strict=True):
                path = f"/life/rates/{what}_{entity_name(name)}"
                self._add_point(streams, path, prefix + what, rate)

    def _add_point(self, streams: RerunStreams, path: str, name: str, value: float) -> None:
        """Add a point to a line, which gets its name and colour with its first point."""
        import rerun as rr

        if path not in self._styled:
            colour = palette.series_colour(len(self._styled))
            self._styled.add(path)
            style = rr.SeriesLines(names=[name], colors=[colour], widths=[1.6])
            streams.log(path, style, static=True)
        streams.log(path, rr.Scalars(value))
