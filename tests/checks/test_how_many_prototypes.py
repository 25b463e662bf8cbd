"""What the checks of lesson 05 say of solutions, of usual mistakes, and of what else is special to them."""

from functools import partial

import numpy as np
import pytest

from stairlab.checks import check_coefficient_of_variation, check_ignores_units, check_mean_and_spread, check_xi
from stairlab.checks import how_many_prototypes as checks
from stairlab.effects import EffectClasses
from stairlab.prototypes import prototype_counts

from .verdicts import answered, assert_right


def mean_and_spread(effects, ddof=1):
    return effects.mean(axis=0).sum(), effects.std(axis=0, ddof=ddof).sum()


def coefficient_of_variation(mean, spread, largest):
    return np.minimum(spread / mean, largest)


def weights(mean, spread):
    return (1 - coefficient_of_variation(mean, spread, 0.999999)) * spread


def ratios(mean, spread):
    return weights(mean, spread) / weights(mean, spread).min()


def xi(mean, spread):
    return np.minimum(np.floor(ratios(mean, spread)), 10).astype(int)


def ignores_units(counts, mean, spread):
    return np.array_equal(counts(mean, spread), counts(1000 * mean, 1000 * spread))


SOLUTIONS = {
    check_mean_and_spread: mean_and_spread,
    check_coefficient_of_variation: coefficient_of_variation,
    check_xi: xi,
    check_ignores_units: ignores_units,
}


@pytest.mark.parametrize(("check", "solution"), SOLUTIONS.items())
def test_the_solution_is_right(check, solution):
    assert_right(check, solution)


def test_lists_and_floats_are_right_too():
    def in_loops(mean, spread):
        weight = [(1 - min(s / m, 0.999999)) * s for m, s in zip(mean, spread, strict=True)]
        return [float(min(w // min(weight), 10)) for w in weight]

    assert check_xi(in_loops, more=20)
    assert check_mean_and_spread(lambda effects: list(mean_and_spread(effects)), more=20)
    assert check_ignores_units(lambda c, m, s: c(m, s).tolist() == c(1000 * m, 1000 * s).tolist(), more=20)


def test_the_exercises_are_what_the_library_does(samples):
    classes = EffectClasses.from_samples(samples)
    effects = samples.effect("dy", "dz")
    mean, spread = np.array([mean_and_spread(effects[classes.labels == k]) for k in classes.numbers]).T
    np.testing.assert_array_equal(xi(mean, spread), prototype_counts(classes)["xi"])


def test_the_planted_bugs_depend_on_the_unit_and_the_others_do_not():
    found = [ignores_units(counts, checks._MEAN, checks._SPREAD) for counts in checks.COUNTS]
    assert found == ["without a bug" in counts.name for counts in checks.COUNTS]


def shown(counts, mean, spread):
    return counts(mean, spread) == counts(1000 * mean, 1000 * spread)


MISTAKES = [
    (
        check_mean_and_spread,
        partial(mean_and_spread, ddof=0),
        "divided by n; the paper's released code divides by n - 1",
    ),
    (check_mean_and_spread, lambda e: (e.mean(0).sum(), e.var(0, ddof=1).sum()), "This is the variance; the standard"),
    (check_mean_and_spread, lambda e: (e.mean(0).sum(), e.var(0).sum()), "This is the variance, and divided by n"),
    (check_mean_and_spread, lambda e: (e.mean(0).mean(), e.std(0, ddof=1).mean()), "mean over the dimensions"),
    (check_mean_and_spread, lambda e: (e.sum(1).mean(), e.sum(1).std(ddof=1)), "the spread of the sums"),
    (check_mean_and_spread, lambda e: (e.mean(0).sum(), np.sqrt(e.var(0, ddof=1).sum())), "combined the variances"),
    (check_mean_and_spread, lambda e: (e.mean(0), e.std(0, ddof=1)), "a number for each dimension"),
    (check_mean_and_spread, lambda e: mean_and_spread(e)[::-1], "changed places"),
    (check_mean_and_spread, lambda e: (np.linalg.norm(e.mean(0)), e.std(0, ddof=1).sum()), "length of the mean"),
    (check_coefficient_of_variation, lambda m, s, largest: s / m, "stays as it is"),
    (check_coefficient_of_variation, lambda m, s, largest: np.minimum(m / s, largest), "upside down: cv"),
    (check_coefficient_of_variation, lambda m, s, largest: m / s, "nothing is cut"),
    (check_coefficient_of_variation, lambda m, s, largest: np.minimum(s / abs(m), largest), "sign of the mean"),
    (check_coefficient_of_variation, lambda m, s, largest: np.clip(s / m, 0, largest), "cut at 0"),
    (check_coefficient_of_variation, lambda m, s, largest: np.minimum(s / m, 1), "cut at 1"),
    (check_coefficient_of_variation, lambda m, s, largest: np.maximum(s / m, largest), "np.maximum from below"),
    (check_coefficient_of_variation, lambda m, s, largest: 100 * np.minimum(s / m, largest), "percent"),
    (check_xi, lambda m, s: np.minimum(np.round(ratios(m, s)), 10), "to the nearest"),
    (check_xi, lambda m, s: np.minimum(np.ceil(ratios(m, s)), 10), "rounded up"),
    (check_xi, lambda m, s: np.minimum(ratios(m, s), 10), "decimals are still there"),
    (check_xi, lambda m, s: np.floor(ratios(m, s)), "no cap"),
    (check_xi, lambda m, s: np.minimum(np.floor(s / s.min()), 10), "1 - cv is missing"),
    (check_xi, lambda m, s: np.minimum(np.floor((s - weights(m, s)) / (s - weights(m, s)).min()), 10), "cv for 1 - cv"),
    (
        check_xi,
        lambda m, s: np.minimum(np.floor(weights(m, s) / s / (weights(m, s) / s).min()), 10),
        "compares 1 - cv alone",
    ),
    (check_xi, lambda m, s: np.floor(weights(m, s) / weights(m, s).max()), "by the largest weight"),
    (check_xi, lambda m, s: np.minimum(np.floor(weights(m, s) / s.min()), 10), "by the smallest spread"),
    (check_xi, lambda m, s: np.minimum(np.floor((s - s**2 / m) / (s - s**2 / m).min()), 10), "cv is not cut"),
    (check_ignores_units, lambda c, m, s: True, "finds no bug at all"),
    (check_ignores_units, lambda c, m, s: False, "says False of every"),
    (check_ignores_units, lambda c, m, s: np.array_equal(c(m, s), c(1000 * m, s)), "the means only"),
    (check_ignores_units, lambda c, m, s: np.array_equal(c(m, s), c(m, 1000 * s)), "the spreads only"),
    (check_ignores_units, lambda c, m, s: np.array_equal(c(m, s), c(m / 1000, s / 1000)), "so multiply"),
    (check_ignores_units, lambda c, m, s: c(m, s).sum() == c(1000 * m, 1000 * s).sum(), "slips through"),
    (check_ignores_units, lambda c, m, s: not ignores_units(c, m, s), "wrong way round"),
    (check_ignores_units, lambda c, m, s: shown(c, m, s).any(), "some of the counts only"),
    (check_ignores_units, shown, "for each class"),
]


@pytest.mark.parametrize(("check", "mistake", "words"), MISTAKES, ids=[words for _, _, words in MISTAKES])
@pytest.mark.parametrize("more", [0, 20])
def test_usual_mistakes_are_recognised(check, mistake, words, more):
    assert words in answered(check, mistake, more=more)


def test_what_is_wrong_in_another_way_is_shown_with_an_example():
    assert "came" in repr(check_xi(lambda mean, spread: np.ones(len(mean))))
    assert "counts that add 0.01" in repr(
        check_ignores_units(lambda c, m, s: c.name != "counts that round spreads to a hundredth")
    )


def test_an_answer_that_changes_its_input_is_told_so():
    def careless(mean, spread):
        spread /= mean
        return xi(mean, spread * mean)

    assert "Work on a copy" in repr(check_xi(careless))
