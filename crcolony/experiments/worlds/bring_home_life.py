"""The life of a robot in `bring_home`: it learns by MAXQ-Q, from pack to pack, in a compiled loop."""

from crcolony.compiled import IntArray, compiled
from crcolony.experiments.worlds.bring_home import Place, World, act, observe, place_at_nest
from crcolony.learning.maxq.maxq_q import Learner, learn_and_select, start_episode
from crcolony.learning.policies import NO_ACTION
from crcolony.randomness import Stream

STEP_REWARD = -1.0


@compiled
def live(
    learner: Learner,
    world: World,
    place: Place,
    steps: int,
    patience: int,
    trips: IntArray,
    stream: Stream,
) -> int:
    """Live for some steps; return how many packs came home, and write the length of each trip to `trips`.

    A trip begins in the nest. After `patience` steps without success it is broken off, and nothing is learnt of that;
    so does one of a robot whose root has ended, which stands still until then. At most `trips.size` are written.
    """
    delivered, elapsed = 0, 0
    place_at_nest(world, place, stream)
    action = start_episode(learner, observe(world, place), stream)
    for _ in range(steps):
        elapsed += 1
        is_home = False
        if action != NO_ACTION:
            is_home = act(world, place, action, stream)
            action = learn_and_select(learner, STEP_REWARD, observe(world, place), is_home, stream)
        if is_home:
            if delivered < trips.shape[0]:
                trips[delivered] = elapsed
            delivered += 1
        if is_home or elapsed == patience:
            elapsed = 0
            place_at_nest(world, place, stream)
            action = start_episode(learner, observe(world, place), stream)
    return delivered
