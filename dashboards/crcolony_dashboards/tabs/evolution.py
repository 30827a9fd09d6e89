"""The evolution tab: what agents did and how genes are distributed, by generation, and the potentials of one agent.

Of matings, batteries and conceptions mean and standard deviation are drawn; of each meta-parameter a cloud of agents
and its median; of one agent its potentials, meta-parameters and selector.
"""

from typing import TYPE_CHECKING

from crcolony.compiled import FloatArray
from crcolony.robot.genes import agent_schema
from crcolony.telemetry.peer_settings import Mind, PeerSettings
from crcolony_dashboards.rerun_streams import Moment, RerunStreams
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.agent_potentials import draw_agent, has_camera
from crcolony_dashboards.tabs.evolution_layout import evolution_layout
from crcolony_dashboards.tabs.generation_plots import GenerationPlots
from crcolony_dashboards.throttle import ChangeDetector, Throttle
from crcolony_dashboards.view_model.colony_view import Colony, ColonyView
from crcolony_dashboards.view_model.generations import Generation

if TYPE_CHECKING:
    import rerun.blueprint as rrb

_PERIOD_S = 1.0


class EvolutionTab:
    """Draws each generation when it has ended.

    `agent` names the agent whose potentials are drawn; if empty, it is the one that mated most in the last generation.
    """

    def __init__(self, agent: str = "") -> None:
        self._agent = agent
        self._throttle = Throttle(_PERIOD_S)
        self._settings = PeerSettings()
        self._plots = GenerationPlots()
        self._drawn_agent, self._has_drawn_agent = ChangeDetector(), False

    def layout(self) -> "rrb.Container":
        """Return the layout of the tab."""
        return evolution_layout()

    def setup(self, streams: RerunStreams) -> None:
        """Draw nothing: there is nothing before the end of a generation."""

    def draw(self, streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        """Draw the generations that have ended since the last call, each at the time of its end, and one agent."""
        if not self._throttle.is_due(moment.unix_s):
            return
        for colony, generation in view.pop_ended_generations(moment.unix_s):
            streams.set_time(_end_of(generation, view.period_s(), moment))
            colour = palette.series_colour(list(view.colonies).index(colony.name))
            self._plots.draw_measures(streams, colony.name, generation, colour)
            mind = self._mind_of(view, colony, generation.genotypes)
            if mind is not None:
                self._plots.draw_genes(streams, colony.name, generation.genotypes, mind)
        streams.set_time(moment)
        self._draw_agent(streams, view, moment)

    def _mind_of(self, view: ColonyView, colony: Colony, genotypes: FloatArray) -> Mind | None:
        """Return the settings by which the genes of a colony are decoded, from one of its robots with as many genes."""
        for status in view.alive:
            if status.colony != colony.name:
                continue
            mind = self._settings.of_robot(status.metadata)
            if mind is None or not has_camera(mind):
                continue
            if genotypes.shape[-1] == len(agent_schema(mind.learning, mind.heredity)):
                return mind
        return None

    def _draw_agent(self, streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        """Draw the potentials of one agent, when it is another one than before."""
        agent, colony = self._choose_agent(view)
        genes = colony.generations.genes_of(agent) if colony is not None else None
        mind = self._mind_of(view, colony, genes) if colony and genes is not None else None
        if genes is None or mind is None or not self._drawn_agent.is_due(agent, moment.unix_s):
            return
        self._has_drawn_agent = True
        draw_agent(streams, agent, genes, mind, view.name_of)

    def _choose_agent(self, view: ColonyView) -> tuple[str, Colony | None]:
        """Return the chosen agent, else the best of the last generation, else (at first) any in control of a robot."""
        for colony in view.colonies.values():
            if self._agent and colony.generations.genes_of(self._agent) is not None:
                return self._agent, colony
        for colony in view.colonies.values():
            if colony.best:
                return colony.best, colony
            for state in view.states(colony.name):
                if not self._has_drawn_agent and (
                    colony.generations.genes_of(state.agent) is not None
                ):
                    return state.agent, colony
        return "", None


def _end_of(generation: Generation, period_s: float | None, now: Moment) -> Moment:
    """Return when a generation ended; at the latest now, whatever the robots' clocks say."""
    sim_s = min(now.sim_s, max(0.0, generation.tick * (period_s or 0.0)))
    return Moment(min(generation.unix_s, now.unix_s), sim_s, generation.number)
