"""Checks of lesson 10, does it hold up."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from stairlab.checks._judge import Mistake, Verdict, attempt_call, described, judge, same

RESAMPLES = 6000
""" Resamples that a bootstrap is asked for: an end of its interval is then sure to about 1 % of the interval's width """
CLOSE = 0.05
""" Ends of two bootstrap intervals that differ by less than this share of the width are the same """


def check_interquartile_mean(function: Any, more: int = 0) -> Verdict:
    """Check ``interquartile_mean(scores)``: the mean of the middle half, ``len(scores) // 4`` values dropped at each end.

    The usual mistakes: not sorted; an eighth dropped at each end; the median; the mean; values between the quartiles kept.
    """

    def right(scores: np.ndarray) -> float:
        cut = len(scores) // 4
        return float(np.sort(scores)[cut : len(scores) - cut].mean())

    def unsorted(scores: np.ndarray) -> float:
        cut = len(scores) // 4
        return float(scores[cut : len(scores) - cut].mean())

    def eighths(scores: np.ndarray) -> float:
        cut = len(scores) // 8
        return float(np.sort(scores)[cut : len(scores) - cut].mean())

    def between_quartiles(scores: np.ndarray) -> float:
        low, high = np.quantile(scores, [0.25, 0.75])
        return float(scores[(low <= scores) & (scores <= high)].mean())

    rng = np.random.default_rng(0)
    cases: list[tuple[Any, ...]] = [
        (np.array([3.0, 1.0, 15.0, 2.0, 1.0, 5.0, 0.0, 3.0]),),
        (np.array([4.0, 15.0, 11.0, 4.0, 7.0, 4.0, 15.0, 13.6, 4.0, 10.8, 14.2]),),
        (np.array([1.0, 2.0, 12.0, 2.5, 3.0, 1.5, 9.0, 2.0, 2.0, 4.0, 0.5, 1.0, 8.0, 6.0, 3.5, 7.0]),),
    ]
    cases += [(rng.gamma(2, 2, int(rng.integers(4, 40))),) for _ in range(more)]
    mistakes = [
        Mistake("This takes the middle of the list as it comes: sort the scores first.", unsorted),
        Mistake("This drops a quarter in all; drop a quarter at each end, so that half remain.", eighths),
        Mistake("This is the median; the interquartile mean averages the whole middle half.", lambda s: np.median(s)),
        Mistake("This is the mean of all scores; drop a quarter of them at each end first.", lambda s: s.mean()),
        Mistake(
            "This keeps the values between the quartiles, which may be more or fewer than half: drop len(scores) // 4 at each end.",
            between_quartiles,
        ),
    ]
    return judge("interquartile_mean", function, right, cases, mistakes, "One wild run cannot move it far.")


def check_difference_interval(function: Any, more: int = 0) -> Verdict:
    """Check ``difference_interval(first, second, resamples, rng)``: the 95 % bootstrap interval of a difference of mean scores.

    ``first`` and ``second`` are evaluations, of shape (n_seeds, n_evaluations); seeds are resampled. As it draws, ends may be off
    by 5 % of the interval's width. The usual mistakes: without replacement; evaluations instead of seeds resampled; the same seeds
    for both; runs instead of means; 90 %; second minus first; both drawn from one pool.
    """
    name, rng = "difference_interval", np.random.default_rng(0)
    sizes = [(20, 20), (12, 12), (8, 15), *(tuple(rng.integers(8, 25, 2)) for _ in range(more))]
    cases = [_two_studies(rng, *numbers) for numbers in sizes]
    came: list[np.ndarray] = []
    for number, (first, second) in enumerate(cases):
        given = (first.copy(), second.copy(), RESAMPLES, np.random.default_rng(number))
        attempt = attempt_call(name, function, given)
        if attempt.problem:
            return Verdict(False, attempt.problem)
        if not (same(given[0], first) and same(given[1], second)):
            return Verdict(False, f"Not yet: {name} changes its input. Work on a copy.")
        ends = _two_numbers(attempt.value)
        if ends is None:
            return Verdict(
                False, f"Not yet: {name} must return two numbers, low and high, not {described(attempt.value)}."
            )
        if ends[0] > ends[1]:
            return Verdict(False, f"Not yet: the low end comes first, but {name} returned {described(tuple(ends))}.")
        came.append(ends)
    expected = [_reference(_seeds, case) for case in cases]
    off = [_distance(*pair) for pair in zip(came, expected, strict=True)]
    if max(off) < CLOSE:
        return Verdict(True, "Right. What leaves out 0 is decided, and the unit is the seed.")
    for words, draw in _BOOTSTRAP_MISTAKES.items():
        made = [_reference(draw, case) for case in cases]
        if max(_distance(*pair) for pair in zip(came, made, strict=True)) < CLOSE:
            return Verdict(False, f"Not yet. {words}")
    worst = int(np.argmax(off))
    first, second = cases[worst]
    return Verdict(
        False,
        f"Not yet: for {len(first)} and {len(second)} seeds with {first.shape[1]} evaluations each came "
        f"{_ends(came[worst])}, expected was about {_ends(expected[worst])}.",
    )


def check_probability_of_improvement(function: Any, more: int = 0) -> Verdict:
    """Check ``probability_of_improvement(first, second)``: the share of pairs in which the first scores higher, ties counted half.

    The usual mistakes: ties lost; ties won; only runs with the same number compared; the means compared; the second's probability.
    """

    def right(first: np.ndarray, second: np.ndarray) -> float:
        higher, equal = first[:, None] > second, first[:, None] == second
        return float((higher + 0.5 * equal).mean())

    def side_by_side(first: np.ndarray, second: np.ndarray) -> float:
        pairs = list(zip(first, second, strict=False))
        return sum((x > y) + 0.5 * (x == y) for x, y in pairs) / len(pairs)

    rng = np.random.default_rng(0)
    cases: list[tuple[Any, ...]] = [
        (np.array([3.0, 5.0]), np.array([1.0, 3.0, 4.0])),
        (np.array([1.0, 2.0, 2.0, 7.0]), np.array([2.0, 0.0, 4.0, 2.0, 15.0])),
        (np.array([4.0, 4.0, 4.0]), np.array([4.0, 4.0])),
    ]
    cases += [tuple(rng.integers(0, 8, int(rng.integers(3, 12))).astype(float) for _ in range(2)) for _ in range(more)]
    mistakes = [
        Mistake(
            "You let ties count as lost: a pair of equal scores counts half.",
            lambda first, second: (first[:, None] > second).mean(),
        ),
        Mistake(
            "You let ties count as won: a pair of equal scores counts half.",
            lambda first, second: (first[:, None] >= second).mean(),
        ),
        Mistake(
            "You compared the first run with the first, the second with the second, and so on; runs have no partners: compare every "
            "run of the one with every run of the other.",
            side_by_side,
        ),
        Mistake(
            "You compared the means; the question is about single runs, pair by pair.",
            lambda first, second: float((first.mean() > second.mean()) + 0.5 * (first.mean() == second.mean())),
        ),
        Mistake("This is the probability that the second is higher.", lambda first, second: right(second, first)),
    ]
    praise = "It is the statistic of Mann and Whitney, divided by the number of pairs."
    return judge("probability_of_improvement", function, right, cases, mistakes, praise)


def check_judge_claim(function: Any, more: int = 0) -> Verdict:
    """Check ``judge_claim(interval, region)``: "supported", "contradicted" or "undecided", for a claim that a number lies in a region.

    The usual mistakes: the middle of the interval decides; what is undecided is contradicted; touching is enough; an interval with 0
    in it is never decided; an interval with 0 in it proves likeness.
    """

    def right(interval: tuple[float, float], region: tuple[float, float]) -> str:
        if region[0] < interval[0] and interval[1] < region[1]:
            return "supported"
        return "contradicted" if interval[1] < region[0] or region[1] < interval[0] else "undecided"

    def by_middle(interval: tuple[float, float], region: tuple[float, float]) -> str:
        return "supported" if region[0] < sum(interval) / 2 < region[1] else "contradicted"

    def by_zero(interval: tuple[float, float], region: tuple[float, float]) -> str:
        return "undecided" if interval[0] < 0 < interval[1] else by_middle(interval, region)

    def absence(interval: tuple[float, float], region: tuple[float, float]) -> str:
        both = math.isfinite(region[0]) and math.isfinite(region[1])
        return "supported" if both and interval[0] < 0 < interval[1] else right(interval, region)

    endless = math.inf
    cases: list[tuple[Any, ...]] = [
        ((0.4, 2.1), (0.0, endless)),
        ((-8.1, -3.7), (0.0, endless)),
        ((-1.2, 1.9), (0.0, endless)),
        ((-2.0, 0.6), (0.0, endless)),
        ((-0.4, 0.7), (-1.0, 1.0)),
        ((-3.0, 3.4), (-1.0, 1.0)),
        ((1.5, 4.0), (-1.0, 1.0)),
        ((500.0, 9000.0), (2000.0, endless)),
        ((-2.0, -0.5), (-endless, 0.0)),
    ]
    rng = np.random.default_rng(0)
    for _ in range(more):
        low, margin = rng.uniform(-4, 3), rng.uniform(0.5, 2)
        region = ((-margin, margin), (0.0, endless), (-endless, 0.0), (margin, endless))[int(rng.integers(4))]
        cases.append(((float(low), float(low + rng.uniform(0.2, 3))), tuple(float(end) for end in region)))
    mistakes = [
        Mistake(
            "You judge by the middle of the interval, so nothing is ever left undecided; the whole interval must lie in the "
            "region, or outside.",
            by_middle,
        ),
        Mistake(
            "You call contradicted what is undecided: an interval that lies partly in the region contradicts nothing.",
            lambda interval, region: "supported" if right(interval, region) == "supported" else "contradicted",
        ),
        Mistake(
            "You call a claim true when its region and the interval only touch; the whole interval must lie in the region.",
            lambda interval, region: "contradicted" if right(interval, region) == "contradicted" else "supported",
        ),
        Mistake(
            "You ask whether the interval holds 0; ask how it lies to the region, which may have 0 in it or be far from it.",
            by_zero,
        ),
        Mistake(
            "You take an interval that holds 0 for a proof that two things are alike; one from -3 to 3.4 also holds large ones.",
            absence,
        ),
    ]
    return judge("judge_claim", function, right, cases, mistakes, "Undecided is a finding, too.")


# Bootstraps, right and wrong: each draws statistics of resamples.


def _two_studies(
    rng: np.random.Generator, n_first: int, n_second: int, n_evaluations: int = 5
) -> tuple[np.ndarray, np.ndarray]:
    """Make up evaluations of two methods, ordered by score, so that resampling both alike shows."""
    shift = rng.uniform(-3, 3)
    runs = [np.sort(rng.gamma(2, 2, int(n))) for n in (n_first, n_second)]
    first, second = (run[:, None] + rng.normal(0, 0.3, (len(run), n_evaluations)) for run in runs)
    return first + shift, second


def _reference(draw: Callable[..., np.ndarray], case: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Return the interval of a bootstrap that is sure to a small part of its width."""
    level = (0.05, 0.95) if draw is _ninety else (0.025, 0.975)
    return np.quantile(draw(*case, np.random.default_rng(1)), level)


def _drawn_means(values: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return values[rng.integers(len(values), size=(4 * RESAMPLES, len(values)))].mean(axis=1)


def _seeds(first: np.ndarray, second: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return _drawn_means(first.mean(axis=1), rng) - _drawn_means(second.mean(axis=1), rng)


def _ninety(first: np.ndarray, second: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return _seeds(first, second, rng)


def _without_replacement(first: np.ndarray, second: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return np.array([first.mean() - second.mean()])


def _evaluations(first: np.ndarray, second: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return _drawn_means(first.ravel(), rng) - _drawn_means(second.ravel(), rng)


def _same_seeds(first: np.ndarray, second: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    x, y = first.mean(axis=1), second.mean(axis=1)
    chosen = rng.integers(min(len(x), len(y)), size=(4 * RESAMPLES, min(len(x), len(y))))
    return x[chosen].mean(axis=1) - y[chosen].mean(axis=1)


def _single_runs(first: np.ndarray, second: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return rng.choice(first.mean(axis=1), 4 * RESAMPLES) - rng.choice(second.mean(axis=1), 4 * RESAMPLES)


def _turned(first: np.ndarray, second: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return -_seeds(first, second, rng)


def _pooled(first: np.ndarray, second: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    pool = np.concatenate([first.mean(axis=1), second.mean(axis=1)])
    x, y = (rng.choice(pool, (4 * RESAMPLES, len(runs))).mean(axis=1) for runs in (first, second))
    return x - y


_BOOTSTRAP_MISTAKES: dict[str, Callable[..., np.ndarray]] = {
    "All your resamples have the same mean: drawn without replacement, they are the same runs in another order.": _without_replacement,
    "You resampled evaluations; those of a run are the same network again, so the interval is too narrow. Average each run, then "
    "resample the seeds.": _evaluations,
    "You drew the same seeds for both methods; their runs have nothing to do with each other: draw for each by itself.": _same_seeds,
    "These are quantiles of differences of single runs; the interval is of the mean, so average each resample first.": _single_runs,
    "This is a 90 % interval: 95 % leave 2.5 % on each side.": _ninety,
    "This is the second minus the first.": _turned,
    "You drew both methods from one pool, as if they were the same; draw each from its own runs.": _pooled,
}


def _two_numbers(value: Any) -> np.ndarray | None:
    try:
        ends = np.asarray(value, dtype=float)
    except Exception:  # whatever a student returns
        return None
    return ends if ends.shape == (2,) and np.isfinite(ends).all() else None


def _distance(came: np.ndarray, expected: np.ndarray) -> float:
    """Return how far two intervals' ends are apart, in widths of the expected one; for one without width, nearly equal is 0."""
    apart, width = float(np.abs(came - expected).max()), float(np.ptp(expected))
    return apart / width if width > 1e-9 else 0.0 if apart < 1e-6 else math.inf


def _ends(interval: np.ndarray) -> str:
    return f"[{interval[0]:.2f}, {interval[1]:.2f}]"
