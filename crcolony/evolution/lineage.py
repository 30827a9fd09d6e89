"""Lineage: the parents and the time of every birth. Each robot gives its agents unique ids."""

from dataclasses import dataclass

AgentId = str
"""`robot/number`: the robot in which the agent was born, and that robot's count of births."""


def agent_id(robot: str, number: int) -> AgentId:
    """Return the id of the agent that was a robot's birth of this number, counted from 0."""
    return f"{robot}/{number}"


@dataclass(frozen=True)
class Birth:
    """An agent joined a robot's subpopulation at the start of a generation."""

    agent: AgentId
    mother: AgentId | None
    """The parent in the same robot; None in the first generation."""
    father: AgentId | None
    """The parent in the partner; None for a mutated copy of the mother."""
    genotype: str
    """Content hash of the genes."""
    generation: int
    step: int
