"""The experiment on pseudo-realities: what its runs are, and what a run leaves."""

import numpy as np

from crcolony.experiments.colonies.foraging_lives import WINDOWS
from crcolony.experiments.framework.experiment import CONDITION, SEED, Plan, Row
from crcolony.experiments.pseudo_reality import EXPERIMENT, KINDS
from crcolony.experiments.pseudo_reality_claims import AT_CENTRE, AT_EDGE

WORLD = ("delay_steps", "distance_noise_m", "wheel_left", "wheel_right", "width_m", "pillars")


def test_a_quick_run_has_all_columns_and_a_figure() -> None:
    """Of both homes, which meet the same worlds; losses are those of the packs."""
    rows: list[Row] = []
    for job in EXPERIMENT.jobs(Plan([7], True)):
        found = job.run()
        rows += [{CONDITION: job.condition, SEED: job.seed, **row} for row in found]  # type: ignore[dict-item]
    assert {name for row in rows for name in row} - {CONDITION, SEED} == set(EXPERIMENT.columns)
    met: list[list[Row]] = []
    for home in (AT_CENTRE, AT_EDGE):
        own = [row for row in rows if row[CONDITION] == home]
        worlds = [row for row in own if "world" in row]
        met.append([{name: row[name] for name in WORLD} for row in worlds])
        (found,) = [row for row in own if "evolved_last" in row]
        assert sum("window" in row for row in own) == WINDOWS
        for kind in KINDS:
            away = np.mean([float(row[f"packs_{kind}"]) for row in worlds])
            curve = sum(float(row.get(f"curve_{kind}_away", 0.0)) for row in own)
            assert np.isclose(away, float(found[f"life_{kind}_away"]))
            assert np.isclose(away, curve)
            kept = away / float(found[f"life_{kind}_home"])
            assert np.isclose(1.0 - kept, float(found[f"loss_{kind}"]))
            for delay in {int(row["delay_steps"]) for row in worlds}:
                some = [row[f"packs_{kind}"] for row in worlds if row["delay_steps"] == delay]
                kept = np.mean(np.array(some, dtype=float)) / float(found[f"life_{kind}_home"])
                assert np.isclose(1.0 - kept, float(found[f"loss_{kind}_delay_{delay}"]))
    assert met[0] == met[1]
    assert met[0][0] != met[0][1]
    labels = [str(line.get_label()) for line in EXPERIMENT.draw(rows).axes[0].lines]
    assert [label for label in labels if label[0] != "_"] == ["newborn", "frozen", "learning on"]
