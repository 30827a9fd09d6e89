"""What a mating does to a robot: the decision about an offspring, its rollback, and its replay."""

from typing import Any

import numpy as np

from crcolony.evolution.population import Offspring
from crcolony.evolution.reproduction import MatingOffer
from crcolony.protocol.encounters import EncounterRecord
from crcolony.protocol.mating_messages import pack_genes, unpack_genes
from crcolony.protocol.telemetry_messages import Exchanged
from crcolony.randomness import generator
from crcolony.robot.robot import Robot
from crcolony.robot.state import Robots
from crcolony.storage.rows import Decision


class MatingDecisions:
    """The decisions of one robot. `batch` holds its row of state."""

    def __init__(self, robot: Robot, batch: Robots) -> None:
        self._robot, self._batch = robot, batch
        self._before: tuple[Any, list[Offspring], int] | None = None
        """Random stream, pool and number of conceptions before the last decision"""

    def decide(self, record: EncounterRecord) -> Decision:
        """Decide by the present energy of the agent that met; an agent of an earlier generation has no offspring."""
        robot, subpopulation = self._robot, self._robot.subpopulation
        self._before = (robot.stream.copy(), list(subpopulation.pool), subpopulation.conceived)
        assert record.partner is not None, "a decision needs the genes of the partner"
        is_alive = record.own.agent in subpopulation.ids
        offspring, energy = None, 0.0
        if is_alive:
            index = subpopulation.ids.index(record.own.agent)
            energy = float(self._batch.energies[robot.row, index])
            genes = unpack_genes(record.partner.genes, subpopulation.schema)
            offspring = robot.mate(MatingOffer(record.partner.agent, genes), index)
        return Decision(
            energy=energy,
            conceived=offspring is not None,
            too_late=not is_alive,
            child=pack_genes(offspring.genes) if offspring else b"",
            step=robot.steps,
            stream=robot.stream.astype("<u8").tobytes(),
        )

    def rollback(self) -> None:
        """Restore the state before the last decision."""
        assert self._before is not None, "there is no decision to roll back"
        stream, pool, conceived = self._before
        self._robot.stream[...] = stream
        self._robot.subpopulation.pool = pool
        self._robot.subpopulation.conceived = conceived

    def replay(self, record: EncounterRecord, decision: Decision) -> bool:
        """Apply a decision that is newer than the snapshot; return whether there was an offspring."""
        robot = self._robot
        robot.stream[...] = np.frombuffer(decision.stream, dtype="<u8")
        if not decision.conceived or record.partner is None:
            return False
        genes = unpack_genes(decision.child, robot.subpopulation.schema)
        offspring = Offspring(genes, record.own.agent, record.partner.agent, decision.step)
        robot.subpopulation.add_to_pool(offspring, generator(robot.stream.copy()))
        return True


def exchanged_event(record: EncounterRecord, decision: Decision) -> Exchanged:
    """Return the event of a mating as one of its two robots publishes it."""
    assert record.partner is not None, "a mating has two sides"
    return Exchanged(
        record.tick,
        record.encounter,
        record.own.agent,
        record.partner.agent,
        decision.energy,
        decision.conceived,
        decision.too_late,
    )
