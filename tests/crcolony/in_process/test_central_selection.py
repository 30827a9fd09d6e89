"""Central selection breeds from the agents of all robots that mated."""

from crcolony.evolution.history import Born, Lived
from tests.support.small_colony import live, new_colony


def test_only_central_selection_crosses_the_borders_of_a_subpopulation() -> None:
    """With it mothers come from any robot; without it never."""
    crossed = {}
    for selection in ("implicit", "central"):
        colony, recorder = new_colony(f"selection={selection}", "life.agents=8")
        colony.start()
        live(colony, 2)
        children = [b for b in recorder.all(Born) if b.mother is not None]
        crossed[selection] = any(
            not b.mother.startswith(f"{b.robot}/") for b in children if b.mother
        )
    assert crossed == {"implicit": False, "central": True}


def test_central_selection_breeds_from_those_that_mated() -> None:
    """Roulette on matings gives no child to an agent that had none, as long as any agent had some."""
    colony, recorder = new_colony("selection=central")
    colony.start()
    live(colony, 3)
    matings = {life.agent: life.matings for life in recorder.all(Lived)}
    children = [b for b in recorder.all(Born) if b.generation > 0]
    assert children
    for child in children:
        for parent in (child.mother, child.father):
            assert parent is not None
            assert matings[parent] > 0
