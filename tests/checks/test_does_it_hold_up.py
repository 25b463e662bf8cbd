"""The checks of lesson 10: the solutions are right, and usual mistakes are recognised by name."""

import math

import numpy as np
import pytest
from scipy.stats import mannwhitneyu, trim_mean

from stairlab.checks import (
    check_difference_interval,
    check_interquartile_mean,
    check_judge_claim,
    check_probability_of_improvement,
)
from stairlab.estimates import difference_of, improvement, interval

from .verdicts import answered, assert_right

# The solutions


def middle_half_mean(scores):
    ordered, cut = np.sort(scores), len(scores) // 4
    return ordered[cut : len(ordered) - cut].mean()


def resampled(scores, resamples, rng):
    return scores[rng.integers(len(scores), size=(resamples, len(scores)))].mean(axis=1)


def ends(differences, outside=0.025):
    return np.quantile(differences, [outside, 1 - outside])


def difference_interval(first, second, resamples, rng):
    return ends(resampled(first.mean(axis=1), resamples, rng) - resampled(second.mean(axis=1), resamples, rng))


def probability_of_improvement(first, second):
    return (first[:, None] > second).mean() + (first[:, None] == second).mean() / 2


def judge_claim(interval, region):
    if region[0] < interval[0] and interval[1] < region[1]:
        return "supported"
    return "contradicted" if interval[1] < region[0] or region[1] < interval[0] else "undecided"


@pytest.mark.parametrize(
    ("check", "solution"),
    [
        (check_interquartile_mean, middle_half_mean),
        (check_difference_interval, difference_interval),
        (check_probability_of_improvement, probability_of_improvement),
        (check_judge_claim, judge_claim),
    ],
)
def test_the_solution_is_right_for_more_inputs_too(check, solution):
    assert_right(check, solution)


def test_what_scipy_and_the_library_say_is_right():
    assert check_interquartile_mean(lambda scores: trim_mean(scores, 0.25), more=20)
    assert check_probability_of_improvement(improvement, more=20)
    assert check_probability_of_improvement(
        lambda x, y: mannwhitneyu(x, y, method="asymptotic").statistic / (len(x) * len(y)), more=20
    )
    assert check_difference_interval(
        lambda x, y, resamples, rng: interval(difference_of(np.mean), x.mean(axis=1), y.mean(axis=1))
    )


def test_an_interval_that_is_drawn_in_a_loop_is_right():
    def in_a_loop(first, second, resamples, rng):
        x, y = first.mean(axis=1), second.mean(axis=1)
        found = [rng.choice(x, len(x)).mean() - rng.choice(y, len(y)).mean() for _ in range(resamples)]
        return tuple(ends(found))

    assert check_difference_interval(in_a_loop)


# Usual mistakes


@pytest.mark.parametrize(
    ("mistake", "words"),
    [
        (lambda s: s[len(s) // 4 : len(s) - len(s) // 4].mean(), "sort the scores first"),
        (lambda s: trim_mean(s, 0.125), "a quarter at each end"),
        (np.median, "the median"),
        (np.mean, "mean of all scores"),
        (lambda s: s[(s >= np.quantile(s, 0.25)) & (s <= np.quantile(s, 0.75))].mean(), "between the quartiles"),
    ],
)
def test_mistakes_with_the_middle_half_are_recognised(mistake, words):
    assert words in answered(check_interquartile_mean, mistake)


def without_replacement(first, second, resamples, rng):
    x, y = first.mean(axis=1), second.mean(axis=1)
    return ends([rng.permutation(x).mean() - rng.permutation(y).mean() for _ in range(resamples)])


def evaluations(first, second, resamples, rng):
    return ends(resampled(first.ravel(), resamples, rng) - resampled(second.ravel(), resamples, rng))


def same_seeds(first, second, resamples, rng):
    n = min(len(first), len(second))
    places = rng.integers(n, size=(resamples, n))
    return ends(first.mean(axis=1)[places].mean(axis=1) - second.mean(axis=1)[places].mean(axis=1))


def single_runs(first, second, resamples, rng):
    return ends(rng.choice(first.mean(axis=1), resamples) - rng.choice(second.mean(axis=1), resamples))


def ninety(first, second, resamples, rng):
    x, y = (resampled(one.mean(axis=1), resamples, rng) for one in (first, second))
    return ends(x - y, 0.05)


def turned(first, second, resamples, rng):
    return difference_interval(second, first, resamples, rng)


def pooled(first, second, resamples, rng):
    pool = np.concatenate([first.mean(axis=1), second.mean(axis=1)])
    x, y = (rng.choice(pool, (resamples, len(one))).mean(axis=1) for one in (first, second))
    return ends(x - y)


@pytest.mark.parametrize(
    ("mistake", "words"),
    [
        (without_replacement, "without replacement"),
        (evaluations, "You resampled evaluations"),
        (same_seeds, "the same seeds for both"),
        (single_runs, "differences of single runs"),
        (ninety, "90 % interval"),
        (turned, "second minus the first"),
        (pooled, "one pool"),
    ],
)
def test_mistakes_with_the_bootstrap_are_recognised_with_few_and_many_inputs(mistake, words):
    assert words in answered(check_difference_interval, mistake)
    if mistake is not same_seeds:  # for more inputs its seeds may not fit
        assert words in answered(check_difference_interval, mistake, more=5)


def test_an_interval_must_be_two_numbers_in_order():
    assert "two numbers" in answered(check_difference_interval, lambda first, second, resamples, rng: 3.0)
    assert "two numbers" in answered(check_difference_interval, lambda first, second, resamples, rng: ("low", "high"))
    assert "low end comes first" in answered(check_difference_interval, lambda *case: difference_interval(*case)[::-1])
    assert "expected was about" in answered(check_difference_interval, lambda *case: difference_interval(*case) + 1)


def test_an_interval_that_changes_the_evaluations_is_told_so():
    def changes(first, second, resamples, rng):
        first += 1
        return difference_interval(first, second, resamples, rng)

    assert "changes its input" in answered(check_difference_interval, changes)


@pytest.mark.parametrize(
    ("mistake", "words"),
    [
        (lambda x, y: (x[:, None] > y).mean(), "ties count as lost"),
        (lambda x, y: (x[:, None] >= y).mean(), "ties count as won"),
        (lambda x, y: np.mean([(a > b) + (a == b) / 2 for a, b in zip(x, y, strict=False)]), "runs have no partners"),
        (lambda x, y: 1.0 if x.mean() > y.mean() else 0.5 if x.mean() == y.mean() else 0.0, "compared the means"),
        (lambda x, y: probability_of_improvement(y, x), "the second is higher"),
    ],
)
def test_mistakes_with_the_probability_of_improvement_are_recognised(mistake, words):
    assert words in answered(check_probability_of_improvement, mistake)


def by_middle(interval, region):
    return "supported" if region[0] < sum(interval) / 2 < region[1] else "contradicted"


@pytest.mark.parametrize(
    ("mistake", "words"),
    [
        (by_middle, "the middle of the interval"),
        (
            lambda i, r: "supported" if judge_claim(i, r) == "supported" else "contradicted",
            "call contradicted what is undecided",
        ),
        (lambda i, r: "contradicted" if judge_claim(i, r) == "contradicted" else "supported", "only touch"),
        (lambda i, r: "undecided" if i[0] < 0 < i[1] else by_middle(i, r), "whether the interval holds 0"),
        (
            lambda i, r: "supported" if math.isfinite(r[0] + r[1]) and i[0] < 0 < i[1] else judge_claim(i, r),
            "proof that two things are alike",
        ),
    ],
)
def test_mistakes_with_claims_are_recognised(mistake, words):
    assert words in answered(check_judge_claim, mistake)
