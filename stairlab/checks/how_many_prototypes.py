"""Checks of lesson 05, how many prototypes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from stairlab.checks._judge import Mistake, Verdict, judge
from stairlab.prototypes import LARGEST_CV, MAX_COUNT

_MEAN = np.array([0.0898, 0.29, 0.8908, 1.6074, 2.3436, 2.9513])
_SPREAD = np.array([0.0553, 0.0242, 0.1044, 0.1074, 0.0827, 0.1107])
""" The six classes of the lesson [m] """
_ABOVE_ONE = (np.array([0.1351, 1.1353, 2.5811]), np.array([0.1399, 0.3685, 0.404]))
_NEGATIVE = (np.array([0.27, -1.07, 1.2, 2.6]), np.array([0.13, 0.48, 0.3, 0.4]))
""" Classes with a cv above 1, and with a negative mean [m] """


def _mean_and_spread(effects: np.ndarray, ddof: int = 1) -> tuple[float, float]:
    return float(effects.mean(axis=0).sum()), float(effects.std(axis=0, ddof=ddof).sum())


def check_mean_and_spread(function: Any, more: int = 0) -> Verdict:
    """Check ``mean_and_spread(effects)``: mean and standard deviation (ddof = 1) of a class, each summed over the dimensions.

    The usual mistakes: divided by n; the variance; the mean over the dimensions instead of their sum; the spread of the sums; one
    number for each dimension; the two exchanged.
    """
    rng = np.random.default_rng(50)
    cases = [
        (np.array([[0.1, 0.0], [0.3, 0.0], [0.2, 0.3]]),),
        (np.array([[0.58, 0.3], [0.7, 0.3], [0.45, 0.3], [0.69, 0.31]]),),
        (np.array([[-0.3, -0.3, 0.1], [0.4, 0.6, 0.2], [0.2, 0.0, -0.2], [0.9, 0.3, 0.0]]),),
    ]
    cases += [(rng.normal(0.5, 0.2, (int(rng.integers(3, 40)), int(rng.integers(2, 4)))),) for _ in range(more)]
    mistakes = [
        Mistake(
            "You divided by n; the paper's released code divides by n - 1, as np.std(..., ddof=1) does.",
            lambda effects: _mean_and_spread(effects, ddof=0),
        ),
        Mistake(
            "This is the variance; the standard deviation is its square root, taken before the dimensions are added.",
            lambda effects: (_mean_and_spread(effects)[0], effects.var(axis=0, ddof=1).sum()),
        ),
        Mistake(
            "This is the variance, and divided by n at that; take the square root, and divide by n - 1.",
            lambda effects: (_mean_and_spread(effects)[0], effects.var(axis=0).sum()),
        ),
        Mistake(
            "This is the mean over the dimensions; the released code adds them up.",
            lambda effects: tuple(value / effects.shape[1] for value in _mean_and_spread(effects)),
        ),
        Mistake(
            "You added the dimensions of each effect first, and took the spread of the sums. Take the standard deviation of each "
            "dimension, then add those.",
            lambda effects: (_mean_and_spread(effects)[0], effects.sum(axis=1).std(ddof=1)),
        ),
        Mistake(
            "You combined the variances of the dimensions and took one root; the released code adds the standard deviations.",
            lambda effects: (_mean_and_spread(effects)[0], np.sqrt(effects.var(axis=0, ddof=1).sum())),
        ),
        Mistake(
            "This has a number for each dimension; equation 2 wants one mean and one spread: add the dimensions up.",
            lambda effects: (effects.mean(axis=0), effects.std(axis=0, ddof=1)),
        ),
        Mistake(
            "Mean and spread have changed places: return the mean first.",
            lambda effects: _mean_and_spread(effects)[::-1],
        ),
        Mistake(
            "This is the length of the mean effect; the released code adds the means of the dimensions, with their signs.",
            lambda effects: (np.linalg.norm(effects.mean(axis=0)), _mean_and_spread(effects)[1]),
        ),
    ]
    praise = "So the published code makes one mean and one spread of a class."
    return judge("mean_and_spread", function, _mean_and_spread, cases, mistakes, praise)


def _cv(mean: np.ndarray, spread: np.ndarray, largest: float = LARGEST_CV) -> np.ndarray:
    return np.minimum(spread / mean, largest)


def check_coefficient_of_variation(function: Any, more: int = 0) -> Verdict:
    """Check ``coefficient_of_variation(mean, spread, largest)``: equation 3 for all classes, cut at ``largest``, shape (n_classes,).

    The usual mistakes: not cut; upside down; the sign of the mean lost; cut at 0 as well; cut at 1; in percent.
    """
    mistakes = [
        Mistake(
            "A cv above the limit stays as it is; the published code cuts it, so that 1 - cv stays positive.",
            lambda mean, spread, largest: spread / mean,
        ),
        Mistake(
            "This is mean over spread, equation 3 upside down: cv is the spread relative to the mean.",
            lambda mean, spread, largest: _cv(spread, mean, largest),
        ),
        Mistake(
            "This is mean over spread, equation 3 upside down, and nothing is cut.",
            lambda mean, spread, largest: mean / spread,
        ),
        Mistake(
            "The sign of the mean is lost. That may be the better formula, but equation 3 divides by the mean as it is.",
            lambda mean, spread, largest: _cv(np.abs(mean), spread, largest),
        ),
        Mistake(
            "Negative values are cut at 0 here; the published code cuts from above only.",
            lambda mean, spread, largest: np.clip(spread / mean, 0, largest),
        ),
        Mistake(
            "You cut at 1, not at the limit that is given: with cv = 1, 1 - cv is 0, and equation 2 divides by it.",
            lambda mean, spread, largest: _cv(mean, spread, 1.0),
        ),
        Mistake(
            "You set every cv to the limit, at least: np.minimum cuts from above, np.maximum from below.",
            lambda mean, spread, largest: np.maximum(spread / mean, largest),
        ),
        Mistake("This is in percent; cv has no unit.", lambda *case: 100 * _cv(*case)),
    ]
    cases: list[tuple[Any, ...]] = [
        (_MEAN, _SPREAD, LARGEST_CV),
        (*_ABOVE_ONE, 0.9),
        (np.array([0.1, 0.5, 0.2]), np.array([0.3, 0.2, 0.9]), LARGEST_CV),
        (*_NEGATIVE, 0.95),
    ]
    cases += [(*case, 0.9) for case in _random_classes(51, more)]
    praise = "Near a mean of 0 it explodes, whatever the spread."
    return judge("coefficient_of_variation", function, _cv, cases, mistakes, praise)


def _random_classes(seed: int, count: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Draw means and spreads of three to eight classes, like those that occur, now and then with a cv above 1 [m]."""
    rng = np.random.default_rng(seed)
    cases = []
    for _ in range(count):
        k = int(rng.integers(3, 9))
        cases.append((np.sort(rng.uniform(0.08, 3, k)), rng.uniform(0.02, 0.15, k)))
    return cases


def _weight(mean: np.ndarray, spread: np.ndarray) -> np.ndarray:
    return (1 - _cv(mean, spread)) * spread


def _xi(mean: np.ndarray, spread: np.ndarray) -> np.ndarray:
    return _counted(_weight(mean, spread))


def _counted(weight: np.ndarray, divisor: float | None = None, cap: float = MAX_COUNT) -> np.ndarray:
    return np.minimum(np.floor(weight / (weight.min() if divisor is None else divisor)), cap)


def check_xi(function: Any, more: int = 0) -> Verdict:
    """Check ``xi(mean, spread)``: equation 2 for all classes, with cv cut at 0.999999 and at most ten, shape (n_classes,).

    The usual mistakes: rounded, or not cut to whole numbers; rounded up; 1 - cv forgotten; cv instead of it; divided by the
    largest weight, or by the sum; no cap; cv not cut.
    """

    def ratio(mean: np.ndarray, spread: np.ndarray) -> np.ndarray:
        weight = _weight(mean, spread)
        return weight / weight.min()

    def uncut(mean: np.ndarray, spread: np.ndarray) -> np.ndarray:
        return _counted((1 - spread / mean) * spread)

    mistakes = [
        Mistake(
            "You rounded to the nearest whole number; equation 2 cuts off the decimals: np.floor.",
            lambda mean, spread: np.minimum(np.round(ratio(mean, spread)), MAX_COUNT),
        ),
        Mistake(
            "You rounded up; equation 2 cuts off the decimals: np.floor.",
            lambda mean, spread: np.minimum(np.ceil(ratio(mean, spread)), MAX_COUNT),
        ),
        Mistake(
            "The decimals are still there: a number of prototypes is whole, np.floor cuts them off.",
            lambda mean, spread: np.minimum(ratio(mean, spread), MAX_COUNT),
        ),
        Mistake(
            f"There is no cap: the published code gives no class more than {MAX_COUNT}.",
            lambda mean, spread: np.floor(ratio(mean, spread)),
        ),
        Mistake(
            "The factor 1 - cv is missing: this compares the spreads alone.",
            lambda mean, spread: _counted(spread),
        ),
        Mistake(
            "You took cv for 1 - cv: an unreliable class would get more prototypes, not fewer.",
            lambda mean, spread: _counted(_cv(mean, spread) * spread),
        ),
        Mistake(
            "This compares 1 - cv alone; the standard deviation is missing.",
            lambda mean, spread: _counted(1 - _cv(mean, spread)),
        ),
        Mistake(
            "You divided by the largest weight, so that nearly every count is 0. Divide by the smallest: then every class gets one.",
            lambda mean, spread: _counted(_weight(mean, spread), _weight(mean, spread).max()),
        ),
        Mistake(
            "You divided by the smallest spread; equation 2 divides by the smallest weight, (1 - cv) std.",
            lambda mean, spread: _counted(_weight(mean, spread), spread.min()),
        ),
        Mistake(
            f"cv is not cut at {LARGEST_CV}: where it exceeds 1, a weight is negative, and the counts of all others with it.",
            uncut,
        ),
    ]
    cases = [(_MEAN, _SPREAD), _ABOVE_ONE, (np.array([0.5, 1.0, 2.0, 2.0]), np.array([0.031, 0.052, 0.117, 0.5]))]
    cases += _random_classes(52, more)
    return judge(
        "xi", function, _xi, cases, mistakes, "Now change one spread a little, and see who else's count changes."
    )


@dataclass(frozen=True)
class _Counts:
    """A function that counts prototypes, right or with a bug, and what it is called in a verdict."""

    name: str
    function: Callable[[np.ndarray, np.ndarray], np.ndarray]

    def __call__(self, mean: np.ndarray, spread: np.ndarray) -> np.ndarray:
        with np.errstate(all="ignore"):  # 0/0 where a student gives kilometres
            return self.function(np.asarray(mean, float), np.asarray(spread, float))

    def __repr__(self) -> str:
        return f"<{self.name}>"


def _normalised(mean: np.ndarray, spread: np.ndarray) -> np.ndarray:
    largest = max(mean.max(), spread.max())
    return _xi(mean / largest, spread / largest)


COUNTS = (
    _Counts("counts without a bug", _xi),
    _Counts("counts that add 0.01 to every spread", lambda mean, spread: _xi(mean, spread + 0.01)),
    _Counts("counts without a bug, normalised first", _normalised),
    _Counts("counts without a bug, by the spread alone", lambda mean, spread: _counted(spread)),
    _Counts("counts by the spread alone, at least 0.05", lambda mean, spread: _counted(np.maximum(spread, 0.05))),
    _Counts("counts that round spreads to a hundredth", lambda mean, spread: _xi(mean, np.round(spread, 2))),
    _Counts("counts of the weight, divided by 0.01", lambda mean, spread: np.floor(_weight(mean, spread) / 0.01)),
    _Counts(
        "counts that exchange the last two classes where means exceed 100",
        lambda mean, spread: _xi(mean, spread)[[0, 1, 2, 3, 4, 5] if mean.max() < 100 else [0, 1, 2, 3, 5, 4]],
    ),
    _Counts(
        "counts without a bug, where means exceed 0.01",
        lambda mean, spread: _xi(mean, spread)[[0, 1, 2, 3, 4, 5] if mean.max() >= 0.01 else [0, 1, 2, 3, 5, 4]],
    ),
)
""" What the test of the last exercise is tried on: four are right in metres and millimetres, the others depend on the unit """


def check_ignores_units(function: Any, more: int = 0) -> Verdict:
    """Check ``ignores_units(counts, mean, spread)``: a test that says whether ``counts`` gives the same in millimetres as in metres.

    The usual mistakes: always True; only the means, or only the spreads, are converted; divided by 1000; only the sum is compared;
    the answer turned round.
    """

    def right(counts: _Counts, mean: np.ndarray, spread: np.ndarray) -> bool:
        return bool(np.array_equal(counts(mean, spread), counts(1000 * mean, 1000 * spread)))

    rng = np.random.default_rng(53)
    cases = [(counts, _MEAN, _SPREAD) for counts in COUNTS]
    for _ in range(more):
        change = rng.uniform(0.95, 1.05, 6)
        cases.append((COUNTS[rng.integers(4)], _MEAN * change, _SPREAD * change))
    mistakes = [
        Mistake(
            "Your test finds no bug at all: it says True of every function. Call counts twice, in both units, and compare.",
            lambda counts, mean, spread: True,
        ),
        Mistake(
            "Your test says False of every function, also of the right ones. Call counts twice, in both units, and compare.",
            lambda counts, mean, spread: False,
        ),
        Mistake(
            "You converted the means only. Spreads are lengths, too: both must be in the same unit, or cv changes.",
            lambda counts, mean, spread: np.array_equal(counts(mean, spread), counts(1000 * mean, spread)),
        ),
        Mistake(
            "You converted the spreads only. Means are lengths, too: both must be in the same unit, or cv changes.",
            lambda counts, mean, spread: np.array_equal(counts(mean, spread), counts(mean, 1000 * spread)),
        ),
        Mistake(
            "You divided by 1000; the same length is 1000 times as many millimetres as metres, so multiply.",
            lambda counts, mean, spread: np.array_equal(counts(mean, spread), counts(mean / 1000, spread / 1000)),
        ),
        Mistake(
            "You compare the sums of the counts, or sort them: a bug that takes from one class and gives to another slips through.",
            lambda counts, mean, spread: counts(mean, spread).sum() == counts(1000 * mean, 1000 * spread).sum(),
        ),
        Mistake(
            "The answer is the wrong way round: True must mean that the unit does not matter.",
            lambda counts, mean, spread: not right(counts, mean, spread),
        ),
        Mistake(
            "You compared some of the counts only, such as the first or any of them: np.array_equal compares all.",
            lambda counts, mean, spread: (counts(mean, spread) == counts(1000 * mean, 1000 * spread)).any(),
        ),
        Mistake(
            "This returns a True or False for each class; the test must say one of them for all: np.array_equal, or .all().",
            lambda counts, mean, spread: counts(mean, spread) == counts(1000 * mean, 1000 * spread),
        ),
    ]
    praise = "A test of this kind needs no known answer, only something that must not change."
    return judge("ignores_units", function, right, cases, mistakes, praise)
