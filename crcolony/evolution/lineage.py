"""Lineage: who was born of whom, and when. Names are given by the robots themselves, and never twice."""

from dataclasses import dataclass

AgentId = str
"""`robot/number`: the robot that raised the agent, and its own count of births (as odNEAT's innovation numbers)."""


def agent_id(robot: str, number: int) -> AgentId:
    """Name the number-th agent born in a robot."""
    return f"{robot}/{number}"


@dataclass(frozen=True)
class Birth:
    """An agent came into a robot's subpopulation at the start of a generation."""

    agent: AgentId
    mother: AgentId | None
    """The own robot's parent; None in the first generation"""
    father: AgentId | None
    """The partner's agent; None for a mutated copy of the mother"""
    genotype: str
    """Content hash"""
    generation: int
    step: int
