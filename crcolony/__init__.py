"""crcolony: a colony of robots that evolves how to learn, after *Embodied Evolution of Learning Ability* (S. Elfwing).

Robots learn by reinforcement inside a lifetime, meet, and exchange genotypes pairwise; nothing selects centrally. Each
robot can be its own process, and processes find each other over Zenoh.

    crcolony.body, learning, evolution, robot, world        the model of the thesis: pure computation
    crcolony.protocol, transport, storage, nodes, runtime   robots and arenas as processes on a network
    crcolony.in_process, fault_simulation                   whole colonies in one process
    crcolony.telemetry, recordings, results, experiments    observation, results and statistics
    crcolony.commands, cli                                  the command `crcolony`

Modules are imported from their packages: importing `crcolony` itself loads none of them.
"""

__all__ = ["__version__"]


def __getattr__(name: str) -> str:
    """Return `__version__`, which is looked up only when it is used: that takes longer than `crcolony --help`."""
    if name != "__version__":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib.metadata import version

    return version("crcolony")
