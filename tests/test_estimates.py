"""Figures over seeds and their intervals: against NumPy, SciPy and counting by hand."""

import numpy as np
import pytest
from scipy.stats import bootstrap
from small_study import made_up

from stairlab.estimates import Estimate, iqm

rng = np.random.default_rng(0)
HIGH, LOW = rng.normal(10, 1, 20), rng.normal(5, 1, 20)


def test_the_interquartile_mean_is_the_mean_of_the_middle_half():
    assert iqm(np.array([100.0, 1, 2, 3, 4, 5, 6, -100])) == np.mean([2, 3, 4, 5])
    assert iqm(np.full((3, 20), 2.0)).tolist() == [2, 2, 2]


def test_a_score_is_estimated_by_scipys_bootstrap_over_seeds():
    found = made_up({"effect": HIGH}).iqm_score("effect")
    oracle = bootstrap((HIGH,), iqm, n_resamples=9999, method="percentile", rng=np.random.default_rng(0))
    assert found.value == pytest.approx(iqm(HIGH))
    assert (found.low, found.high) == pytest.approx(oracle.confidence_interval, abs=1e-12)
    assert HIGH.min() < found.low < found.value < found.high < HIGH.max()


def test_five_seeds_give_no_interval_and_six_do():
    assert np.isnan(made_up({"effect": HIGH[:5]}).iqm_score("effect").low)
    assert np.isfinite(made_up({"effect": HIGH[:6]}).iqm_score("effect").low)
    assert made_up({"effect": HIGH[:5]}).iqm_curve("effect")[["low", "high"]].isna().to_numpy().all()


def test_the_estimates_are_the_same_every_time():
    results = made_up({"effect": HIGH, "uniform": LOW})
    assert results.difference("effect", "uniform") == results.difference("effect", "uniform")


def test_the_probability_of_improvement_counts_pairs_and_half_of_the_ties():
    x, y = np.array([1.0, 2, 3, 3, 5, 6]), np.array([0.0, 3, 3, 4, 4, 9])
    pairs = (x[:, None] > y).mean() + (x[:, None] == y).mean() / 2
    results = made_up({"effect": x, "uniform": y})
    assert results.probability_of_improvement("effect", "uniform").value == pytest.approx(pairs)
    assert results.probability_of_improvement("uniform", "effect").value == pytest.approx(1 - pairs)


def test_an_estimate_reads_as_a_number_with_its_interval():
    assert str(Estimate(1.25, 0.5, 2.0)) == "1.2 [0.5, 2.0]"
    assert str(Estimate(1.25, np.nan, np.nan)) == "1.2"
