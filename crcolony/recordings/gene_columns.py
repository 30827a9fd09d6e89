"""Columns for genes: one for every gene name that the robots' settings define."""

from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import EventMessage, RobotMetadata
from crcolony.recordings.tables import GENES, TABLES, Row
from crcolony.robot.genes import agent_schema, module_genes
from crcolony.telemetry.colony_monitor import ColonyMonitor
from crcolony.telemetry.peer_settings import PeerSettings
from crcolony.telemetry.samples import RobotMetadataSample

_MAX_COLUMNS = 4_096
"""Genes with columns of their own."""
_GENES_INDEX = tuple(TABLES["births"]).index(GENES)


class GeneColumns:
    """Collects the names of genes from the robots' metadata, and spreads the genes of a birth over columns."""

    def __init__(self) -> None:
        self.names: dict[str, None] = {}
        """Of the columns, in the order of the metadata"""
        self._monitor, self._settings = ColonyMonitor(), PeerSettings()
        self._names_of: dict[tuple[RobotId, int], tuple[str, ...]] = {}
        """Names of the genes by robot and incarnation"""

    def add_metadata(self, sample: RobotMetadataSample) -> None:
        """Add the columns of a robot's genes, unless there are too many."""
        self._monitor.handle_sample(sample)
        status = self._monitor.robots.get(sample.metadata.robot)
        if status is None or status.metadata is None:
            return
        names = self._gene_names(status.metadata)
        if len({*self.names, *names}) <= _MAX_COLUMNS:
            self.names.update(dict.fromkeys(names))
            self._names_of[status.robot, status.metadata.incarnation] = names

    def _gene_names(self, metadata: RobotMetadata) -> tuple[str, ...]:
        mind = self._settings.of_robot(metadata)
        if mind is None or module_genes(mind.learning) > _MAX_COLUMNS:
            return ()
        return tuple(gene.name for gene in agent_schema(mind.learning, mind.heredity).genes)

    def spread(self, message: EventMessage, row: Row) -> Row:
        """Return a row of `births` with a value in every gene column; genes without names stay in one column."""
        names = self._names_of.get((message.robot, message.incarnation), ())
        genes = row[_GENES_INDEX]
        if not names or genes is None or len(names) != len(genes):
            return (*row, *(None for _ in self.names))
        gene_of = dict(zip(names, genes, strict=True))
        before, after = row[:_GENES_INDEX], row[_GENES_INDEX + 1 :]
        return (*before, None, *after, *map(gene_of.get, self.names))
