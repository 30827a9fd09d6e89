"""Episodes on the mountain car of a learner without potential, in one compiled loop."""

from crcolony.compiled import FloatArray, IntArray, compiled
from crcolony.experiments.worlds.mountain_car import MOST_STEPS, drive
from crcolony.learning.sarsa_lambda import Learner, learn_and_select, start_episode


@compiled
def drive_episodes(
    learner: Learner, state: FloatArray, starts: FloatArray, draws: FloatArray, steps: IntArray
) -> int:
    """Learn an episode from each of the positions `starts` (episodes,); return the steps of all.

    Writes the `steps` (episodes,) of each, at most MOST_STEPS. `draws` (any,) are used in turn.
    """
    total = 0
    for episode in range(starts.shape[0]):
        state[0] = starts[episode]
        state[1] = 0.0
        action = start_episode(learner, state, draws[total % draws.shape[0]])
        count = 0
        while action >= 0 and count < MOST_STEPS:
            terminal = drive(state, action)
            count += 1
            total += 1
            action = learn_and_select(
                learner, action, -1.0, state, terminal, draws[total % draws.shape[0]]
            )
        steps[episode] = count
    return total
