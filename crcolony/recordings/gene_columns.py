"""A column for every gene that has a name: what robots tell of their settings says what their genes are."""

from crcolony.protocol import key_expressions
from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import EventMessage, RobotMetadata
from crcolony.recordings.tables import GENES, TABLES, Row
from crcolony.robot.genes import agent_schema, module_genes
from crcolony.telemetry.colony_monitor import ColonyMonitor, TelemetrySample
from crcolony.telemetry.peer_settings import PeerSettings

_MAX_GENES = 4_096
"""With columns of their own"""
_PLACE = tuple(TABLES["births"]).index(GENES)


class GeneColumns:
    """Learns what the genes of robots are called, and spreads those of a birth over columns."""

    def __init__(self) -> None:
        self.names: dict[str, None] = {}
        """Of the columns, in the order in which they were told"""
        self._monitor, self._settings = ColonyMonitor(), PeerSettings()
        self._known: dict[tuple[RobotId, int], tuple[str, ...]] = {}
        """By robot and life"""

    def learn(self, sample: TelemetrySample) -> None:
        """Take what somebody has answered about itself."""
        self._monitor.handle_sample(sample)
        _, robot = key_expressions.parse_robot_topic(sample.key, "metadata") or ("", b"")
        status = self._monitor.robots.get(robot)
        if status is None or status.metadata is None:
            return
        names = self._names_in(status.metadata)
        if len({*self.names, *names}) <= _MAX_GENES:
            self.names.update(dict.fromkeys(names))
            self._known[robot, status.metadata.incarnation] = names

    def _names_in(self, about: RobotMetadata) -> tuple[str, ...]:
        mind = self._settings.of_robot(about)
        if mind is None or module_genes(mind.learning) > _MAX_GENES:
            return ()
        return tuple(gene.name for gene in agent_schema(mind.learning, mind.heredity).genes)

    def spread(self, message: EventMessage, row: Row) -> Row:
        """Return a row of births with a value in every column; genes without names stay as they are, in one."""
        names, genes = self._known.get((message.robot, message.incarnation), ()), row[_PLACE]
        if not names or genes is None or len(names) != len(genes):
            return (*row, *(None for _ in self.names))
        value_of = dict(zip(names, genes, strict=True))
        return (*row[:_PLACE], None, *row[_PLACE + 1 :], *map(value_of.get, self.names))
