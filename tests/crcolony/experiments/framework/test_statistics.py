"""The statistics agree with closed forms, brute force, simulation and the literature."""

import numpy as np
import pytest
from scipy import stats

from crcolony.experiments.framework.statistics import (
    correlation_power,
    detectable_correlation,
    effect_size,
    equivalence,
    holm,
    mean_interval,
    mean_pairwise_correlation,
    one_sided_p,
    rank_correlation,
    ratio_interval,
)


def test_equivalence_is_that_of_a_worked_example() -> None:
    """Differences -1, 0, 1, 2, 3 with margin 3: t is 4√2 and -2√2 with 4 degrees of freedom, a closed form."""

    def tail(t: float) -> float:
        """P(T > t) of Student's t with 4 degrees of freedom."""
        x = t * t / (1.0 + t * t / 4.0)
        return float(0.5 - 0.375 * np.sqrt(x) * (1.0 - x / 12.0))

    other = np.array([4.0, 2.0, 9.0, 5.0, 1.0])
    found = equivalence(other + np.arange(-1.0, 4.0), other, 3.0)
    assert found.difference == pytest.approx(1.0)
    assert found.p_inferior == pytest.approx(tail(4.0 * np.sqrt(2.0)))
    assert found.p_superior == pytest.approx(tail(2.0 * np.sqrt(2.0)))
    assert found.p == found.p_superior == pytest.approx(0.0237, abs=1e-4)
    half = 2.1318 * np.sqrt(0.5)  # the 95 % quantile of t in every table
    assert (found.low, found.high) == pytest.approx((1.0 - half, 1.0 + half), abs=1e-4)


def test_the_interval_lies_within_the_margins_exactly_if_the_test_shows_equivalence() -> None:
    """At a level of 5 %, for differences of all sizes."""
    rng = np.random.default_rng(2)
    verdicts = []
    for shift in np.linspace(-1.0, 1.0, 41):
        one, other = rng.normal(5.0 + shift, 1.0, 12), rng.normal(5.0, 0.2, 12)
        found = equivalence(one, other, 1.0)
        assert (found.p < 0.05) == (found.low > -1.0 and found.high < 1.0)
        assert (found.p_inferior < 0.05) == (found.low > -1.0)
        verdicts.append(found.p < 0.05)
    assert any(verdicts)
    assert not all(verdicts)


def test_a_significance_that_is_missing_is_not_equivalence() -> None:
    """Two samples that scatter widely do not differ significantly, and are not shown to be equal either."""
    rng = np.random.default_rng(1)
    one, other = rng.normal(5.0, 3.0, 8), rng.normal(5.0, 3.0, 8)
    assert stats.ttest_rel(one, other).pvalue > 0.05
    assert equivalence(one, other, 0.5).p > 0.05


def test_the_effect_size_is_the_share_of_pairs_won() -> None:
    """Ties count half; 1 if all are above, 0.5 for two equal samples."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        one, other = rng.integers(0, 6, 7).astype(float), rng.integers(0, 6, 9).astype(float)
        wins = [(a > b) + 0.5 * (a == b) for a in one for b in other]
        assert effect_size(one, other) == pytest.approx(np.mean(wins))
    assert effect_size(np.array([3.0, 4.0]), np.array([1.0, 2.0])) == 1.0
    assert effect_size(np.arange(5.0), np.arange(5.0)) == 0.5


def test_intervals_cover_the_mean_as_often_as_they_say() -> None:
    """Of 200 samples of 20 about 95 % (by bootstrap, a little less); the interval is the same every time."""
    rng = np.random.default_rng(4)
    found = [mean_interval(rng.normal(2.0, 1.0, 20)) for _ in range(200)]
    covered = np.mean([interval.low < 2.0 < interval.high for interval in found])
    assert 0.88 < covered < 0.98
    values = rng.normal(2.0, 1.0, 20)
    assert mean_interval(values) == mean_interval(values)
    assert mean_interval(np.append(values, np.nan)) == mean_interval(values)


def test_the_ratio_of_paired_values_uses_the_pairs() -> None:
    """Runs that are all twice their partners have a ratio of exactly 2, however much they scatter."""
    other = np.random.default_rng(5).uniform(1.0, 9.0, 15)
    found = ratio_interval(2.0 * other, other)
    assert (found.estimate, found.low, found.high) == pytest.approx((2.0, 2.0, 2.0))
    scattered = ratio_interval(2.0 * other[::-1], other)
    assert scattered.low < 1.8 < 2.2 < scattered.high


def test_few_runs_have_no_intervals_and_no_tests() -> None:
    """They are NaN, and the estimates are still there."""
    pair = np.array([1.0, 2.0])
    assert mean_interval(pair).estimate == 1.5
    assert ratio_interval(2.0 * pair, pair).estimate == 2.0
    assert np.isnan(mean_interval(pair).low)
    assert np.isnan(ratio_interval(pair, pair).high)
    assert np.isnan(equivalence(pair, pair, 1.0).p)
    assert np.isnan(rank_correlation(np.arange(3.0), np.arange(3.0)).rho)
    assert np.isnan(rank_correlation(np.ones(9), np.arange(9.0)).rho)


def test_a_one_sided_p_is_that_of_scipy() -> None:
    """Of a mean, and of pairs by their differences; the two sides of a bound add up to 1."""
    rng = np.random.default_rng(1)
    one, other = rng.normal(1.0, 1.0, 9), rng.normal(0.0, 1.0, 9)
    expected = stats.ttest_rel(one, other, alternative="greater").pvalue
    assert one_sided_p(one - other, 0.0, "greater") == pytest.approx(expected)
    assert one_sided_p(one, 0.4, "less") + one_sided_p(one, 0.4, "greater") == pytest.approx(1.0)
    assert one_sided_p(one, 9.0, "less") < 0.001 < 0.999 < one_sided_p(one, 9.0, "greater")


def test_values_that_are_all_alike_leave_no_doubt() -> None:
    """But for rounding; what is equal to the bound is not beyond it, and few values show nothing."""
    alike = np.array([0.1 + 0.2, 0.3, 0.3])
    assert one_sided_p(alike, 0.2, "greater") == one_sided_p(alike, 0.4, "less") == 0.0
    assert one_sided_p(alike, 0.4, "greater") == one_sided_p(alike, 0.2, "less") == 1.0
    assert one_sided_p(np.zeros(5), 0.0, "greater") == one_sided_p(np.zeros(5), 0.0, "less") == 1.0
    assert np.isnan(one_sided_p(alike[:2], 0.2, "greater"))


def test_a_rank_correlation_is_that_of_scipy_with_its_interval() -> None:
    """Ranks matter alone; the interval covers the correlation of a normal population about as often as it says."""
    rng = np.random.default_rng(6)
    one, other = rng.normal(size=20), rng.normal(size=20)
    found = rank_correlation(one, np.exp(other))
    expected = stats.spearmanr(one, other)
    assert (found.rho, found.p) == pytest.approx((expected.statistic, expected.pvalue))
    rho = 6.0 / np.pi * np.arcsin(-0.6 / 2.0)  # Spearman's, of a normal pair correlated by -0.6
    covered = 0
    for _ in range(300):
        x, y = rng.multivariate_normal([0.0, 0.0], [[1.0, -0.6], [-0.6, 1.0]], 20).T
        interval = rank_correlation(x, y)
        covered += interval.low < rho < interval.high
    assert 0.9 < covered / 300 < 0.99


@pytest.mark.parametrize("rho", [0.0, -0.4, 0.6])
def test_the_power_of_a_correlation_is_that_of_a_simulation(rho: float) -> None:
    """The share of 800 samples of 20 in which it is significant, within sampling error and the approximation's."""
    rng = np.random.default_rng(7)
    pearson = 2.0 * np.sin(np.pi * rho / 6.0)
    covariance = [[1.0, pearson], [pearson, 1.0]]
    samples = rng.multivariate_normal([0.0, 0.0], covariance, (800, 20))
    p = [stats.spearmanr(sample[:, 0], sample[:, 1]).pvalue for sample in samples]
    assert correlation_power(rho, 20) == pytest.approx(np.mean(np.array(p) < 0.05), abs=0.06)


def test_the_detectable_correlation_has_the_power_it_is_named_for() -> None:
    """Over 20 runs 0.6 is found four times out of five."""
    assert detectable_correlation(20, 0.8) == pytest.approx(0.60, abs=0.01)
    assert correlation_power(detectable_correlation(20, 0.8), 20) == pytest.approx(0.8, abs=1e-3)
    assert detectable_correlation(100, 0.8) < detectable_correlation(20, 0.8)


def test_holm_is_that_of_a_worked_example() -> None:
    """0.01, 0.04, 0.03, 0.005: four, three, two and one times, never falling (Holm 1979); NaN is no test."""
    assert holm([0.01, 0.04, np.nan, 0.03, 0.005]) == pytest.approx(
        [0.03, 0.06, np.nan, 0.06, 0.02], nan_ok=True
    )
    assert holm([]) == []
    assert holm([0.7, 0.9]) == [1.0, 1.0]


def test_the_mean_pairwise_correlation_is_that_of_every_two_runs() -> None:
    """By brute force; copies of a run that a bootstrap draws twice do not raise the interval to 1."""
    profiles = np.random.default_rng(4).normal(size=(8, 12))
    found = mean_pairwise_correlation(profiles)
    pairs = [np.corrcoef(profiles[i], profiles[j])[0, 1] for i in range(8) for j in range(i)]
    assert found.estimate == pytest.approx(np.mean(pairs))
    assert found.low < found.estimate < found.high < 0.5
    assert np.isnan(mean_pairwise_correlation(profiles[:2]).low)
    assert mean_pairwise_correlation(np.tile(profiles[0], (5, 1))).low == pytest.approx(1.0)
