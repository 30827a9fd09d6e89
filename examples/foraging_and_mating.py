"""Plot two minutes of a colony: the energy of robots, their paths, and where they mate.

crcolony evolve --out runs/mine && crcolony export runs/mine
python examples/foraging_and_mating.py runs/mine/parquet mine.png
"""

import sys

import matplotlib.pyplot as plt
import numpy as np
import pyarrow.parquet as pq

LENGTH_S = 120.0
GAP_S = 5.0
MAX_ROBOTS = 6
if len(sys.argv) != 3:
    sys.exit("usage: python examples/foraging_and_mating.py FOLDER PICTURE")
folder, picture = sys.argv[1:]


def read(name):
    """Return a table as one array for each column."""
    table = pq.read_table(f"{folder}/{name}.parquet")
    return {column: table[column].to_numpy() for column in table.column_names}


poses, states, matings, packs = map(read, ("poses", "states", "matings", "packs"))
if len(poses["tick"]) == 0:
    sys.exit(f"{folder}: no arena was recorded, so there is nothing to draw")

# The last span of time in which the arena was recorded without a gap.
period_s, ticks = poses["period_s"][-1], np.unique(poses["tick"])
gaps = ticks[1:][np.diff(ticks) * period_s > GAP_S]
first = max([*gaps[-1:], ticks[0], ticks[-1] - LENGTH_S / period_s])


def rows_of(robot, table):
    """Return which rows of a table are of one robot, in that span of time."""
    return (table["robot"] == robot) & (table["tick"] >= first) & (table["tick"] <= ticks[-1])


numbers = dict(zip(states["robot"], states["number"], strict=True))
seen = set(poses["robot"][poses["tick"] >= first]) & set(numbers)
robots = sorted(seen, key=numbers.get)[:MAX_ROBOTS]
figure, axes = plt.subplot_mosaic(
    [[robot, "arena"] for robot in robots], width_ratios=(1.4, 1), figsize=(12, 5), layout="tight"
)
arena, now = axes["arena"], packs["tick"] == ticks[-1]
arena.plot(packs["x_m"][now], packs["y_m"][now], "s", color="0.75")
for k, robot in enumerate(robots):
    energy, state, path = axes[robot], rows_of(robot, states), rows_of(robot, poses)
    energy.plot((states["tick"][state] - first) * period_s, states["energy"][state], f"C{k}")
    arena.plot(poses["x_m"][path], poses["y_m"][path], f"C{k}", linewidth=0.8, alpha=0.6)
    for mating in np.flatnonzero(rows_of(robot, matings)):
        tick, face = matings["tick"][mating], f"C{k}" if matings["conceived"][mating] else "white"
        mark = {"marker": "o", "color": f"C{k}", "markerfacecolor": face, "zorder": 3}
        energy.plot((tick - first) * period_s, matings["energy"][mating], **mark)
        there = np.flatnonzero(path)[np.abs(poses["tick"][path] - tick).argmin()]
        arena.plot(poses["x_m"][there], poses["y_m"][there], **mark)
    energy.set(
        xlim=(0, LENGTH_S), ylim=(0, 1.08), xlabel="time (s)", ylabel=f"robot {numbers[robot]}"
    )
    energy.label_outer()

axes[robots[0]].set_title("Energy of the agent in control; dots: matings, filled: conceived")
width_m, height_m = poses["width_m"][-1], poses["height_m"][-1]
arena.set(xlim=(-width_m / 2, width_m / 2), ylim=(-height_m / 2, height_m / 2), aspect="equal")
arena.set(xlabel="x (m)", ylabel="y (m)", title="Paths, matings, and battery packs (at the end)")
figure.savefig(picture, dpi=130)
