"""The dashboard: seven tabs, drawn from the telemetry of colonies, live or recorded."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from crcolony.telemetry.colony_monitor import ColonyMonitor
from crcolony.telemetry.status_changes import StatusChange
from crcolony_dashboards.rerun_streams import Moment, RerunStreams
from crcolony_dashboards.tabs.colony import ColonyTab
from crcolony_dashboards.tabs.evolution import EvolutionTab
from crcolony_dashboards.tabs.genes import GenesTab
from crcolony_dashboards.tabs.life import LifeTab
from crcolony_dashboards.tabs.lineage import LineageTab
from crcolony_dashboards.tabs.log import LogTab
from crcolony_dashboards.tabs.network import NetworkTab
from crcolony_dashboards.tabs.tab import Tab
from crcolony_dashboards.throttle import Throttle
from crcolony_dashboards.view_model.colony_view import ColonyView

if TYPE_CHECKING:
    import rerun.blueprint as rrb


class Dashboard:
    """Draws the state of a `ColonyMonitor`.

    `agent` names the agent whose potentials are drawn; if empty, it is the one that mated most.
    """

    def __init__(self, monitor: ColonyMonitor, agent: str = "") -> None:
        self.view = ColonyView(monitor)
        self.tabs: Sequence[Tab] = (
            ColonyTab(),
            EvolutionTab(),
            GenesTab(agent),
            LifeTab(),
            LineageTab(),
            NetworkTab(),
            LogTab(),
        )
        self._second_throttle = Throttle(1.0)
        self._sim_s = 0.0
        """The last known time of the colony, kept when its arena is gone"""

    def blueprint(self, timeline: str, is_live: bool) -> "rrb.Blueprint":
        """Return the layout of all tabs, with the timeline that viewers show first."""
        import rerun.blueprint as rrb

        return rrb.Blueprint(
            rrb.Tabs(*(tab.layout() for tab in self.tabs), active_tab=0),
            rrb.TimePanel(
                state="collapsed",
                timeline=timeline,
                play_state="following" if is_live else "playing",
                loop_mode="off" if is_live else "all",
            ),
            rrb.BlueprintPanel(state="collapsed"),
            rrb.SelectionPanel(state="collapsed"),
            auto_views=False,
            auto_layout=False,
        )

    def setup(self, streams: RerunStreams) -> None:
        """Log static data; called once, before anything is drawn."""
        for tab in self.tabs:
            tab.setup(streams)

    def handle_changes(self, changes: Sequence[StatusChange], unix_s: float) -> None:
        """Process status changes in order, received at `unix_s`."""
        for change in changes:
            self.view.handle_change(change, unix_s)

    def draw(self, streams: RerunStreams, unix_s: float) -> None:
        """Draw everything that is due at `unix_s`."""
        view = self.view
        view.monitor.handle_timeouts(unix_s)
        view.refresh(unix_s)
        if self._second_throttle.is_due(unix_s):
            view.update_rates(unix_s)
            view.update_generations(unix_s)
        sim_s = view.sim_s()
        self._sim_s = self._sim_s if sim_s is None else sim_s
        moment = Moment(unix_s, self._sim_s, view.generation())
        streams.set_time(moment)
        for tab in self.tabs:
            tab.draw(streams, view, moment)
