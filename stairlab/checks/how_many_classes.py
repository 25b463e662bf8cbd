"""Checks of lesson 04, how many classes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from stairlab.checks._judge import Mistake, Verdict, judge


def check_silhouette_of(function: Any, more: int = 0) -> Verdict:
    """Check ``silhouette_of(i, samples, labels)``: the silhouette of one sample.

    The usual mistakes: the sample itself counted in a, the nearest sample of another class for b, all other samples for b, distances
    to centres, squared distances, a minus b, 1 for a sample that is alone.
    """
    rng = np.random.default_rng(4)
    samples = np.array([[0.0, 0.0], [0.2, 0.0], [0.5, 0.0], [0.7, 0.3], [0.9, 0.3], [1.2, 0.9], [0.6, 0.1]])
    labels = np.array([0, 0, 0, 1, 1, 2, 1])
    cases = [(0, samples, labels), (4, samples, labels), (6, samples, labels), (5, samples, labels)]
    for _ in range(more):
        some = np.append(np.arange(3), rng.integers(0, 3, 12))
        cases.append((int(rng.integers(15)), rng.uniform(0, 2, (15, 2)), some))
    mistakes = [
        Mistake(
            "You count the sample itself in a: its distance to itself is 0 and makes a smaller. Divide by the number of the others.",
            lambda *case: _silhouette(*case, own=np.mean),
        ),
        Mistake(
            "For b you take the nearest single sample of another class; it is the mean distance to the nearest class.",
            lambda *case: _silhouette(*case, other=np.min),
        ),
        Mistake(
            "For b you take the mean over all samples of other classes; each class has a mean of its own, and the smallest counts.",
            lambda *case: _silhouette(*case, pick=None),
        ),
        Mistake(
            "For b you take the class with the largest mean distance; the next class is the one with the smallest.",
            lambda *case: _silhouette(*case, pick=max),
        ),
        Mistake(
            "You measure the distances to the centres of the classes; a and b are means of the distances to their samples.",
            _to_centers,
        ),
        Mistake(
            "You take squared distances; a and b are means of the distances themselves.",
            lambda *case: _silhouette(*case, power=2),
        ),
        Mistake(
            "The sign is wrong: b - a is positive where the sample is nearer to its own class.",
            lambda *case: -_silhouette(*case),
        ),
        Mistake(
            "A sample that is alone in its class has the silhouette 0, by definition: nothing tells how well it fits.",
            lambda *case: _silhouette(*case, alone=1.0),
        ),
        Mistake(
            "A sample that is alone in its class has no others to take a mean of, hence nan; its silhouette is 0, by definition.",
            lambda *case: _silhouette(*case, alone=np.nan),
        ),
        Mistake("Divide b - a by the larger of a and b.", lambda *case: _silhouette(*case, divide=False)),
    ]
    return judge(
        "silhouette_of",
        function,
        _silhouette,
        cases,
        mistakes,
        "The mean over all samples is the score of Algorithm 2.",
    )


def check_choose_k(function: Any, more: int = 0) -> Verdict:
    """Check ``choose_k(ks, scores, tolerance)``: the smallest k whose score is at most ``tolerance`` below the best.

    The usual mistakes: the best score whatever the tolerance, the index in place of k, the largest such k, the lowest score, a
    tolerance that is a share, one that has to be beaten.
    """

    def right(ks: Sequence[int], scores: Sequence[float], tolerance: float) -> int:
        return next(k for k, score in zip(ks, scores, strict=True) if score >= max(scores) - tolerance)

    def last(ks: Sequence[int], scores: Sequence[float], tolerance: float) -> int:
        return [k for k, score in zip(ks, scores, strict=True) if score >= max(scores) - tolerance][-1]

    rng = np.random.default_rng(4)
    cases = [
        ([3, 4, 5, 6, 7], [0.5, 0.625, 0.78125, 0.8125, 0.75], 0.0625),
        ([3, 4, 5, 6, 7, 8], [0.5, 0.625, 0.75, 0.8125, 0.78125, 0.8125], 0.0),
        ([2, 3, 4, 5, 6], [0.25, 0.5, 0.6875, 0.75, 0.5], 0.0625),
        ([2, 3, 4, 5], [0.125, 0.3125, 0.5, 0.25], 0.25),
    ]
    for _ in range(more):
        low = int(rng.integers(2, 5))
        scores = (
            rng.integers(20, 30, int(rng.integers(4, 9))) / 32
        ).tolist()  # halves of halves: differences are exact
        cases.append((list(range(low, low + len(scores))), scores, float(rng.integers(0, 4) / 32)))
    mistakes = [
        Mistake(
            "You take the best score, whatever the tolerance; a smaller k that is nearly as good is to win.",
            lambda ks, scores, _: ks[int(np.argmax(scores))],
        ),
        Mistake(
            "You return the place in the list, not the k that stands there: ks does not begin at 0.",
            lambda ks, scores, tolerance: ks.index(right(ks, scores, tolerance)),
        ),
        Mistake("Of the k that are good enough you return the last one; the smallest is asked for.", last),
        Mistake(
            "Of equal scores you take the last one: only a better score may replace the first.",
            lambda ks, scores, _: ks[len(scores) - 1 - int(np.argmax(scores[::-1]))],
        ),
        Mistake(
            "You look for the lowest scores; of a silhouette, the highest is the best.",
            lambda ks, scores, tolerance: right(ks, [-score for score in scores], tolerance),
        ),
        Mistake(
            "You take the tolerance as a share of the best score; it is a difference of scores.",
            lambda ks, scores, tolerance: right(ks, scores, tolerance * max(scores)),
        ),
        Mistake(
            "A score that is exactly the tolerance below the best is good enough, too: at most, not less than.",
            lambda ks, scores, tolerance: next(
                k
                for k, score in zip(ks, scores, strict=True)
                if score > max(scores) - tolerance or score == max(scores)
            ),
        ),
    ]
    return judge(
        "choose_k", function, right, cases, mistakes, "With a tolerance of 0 this is Algorithm 2: the first best wins."
    )


def check_davies_bouldin_ratio(function: Any, more: int = 0) -> Verdict:
    """Check ``davies_bouldin_ratio(first, second)``: how wide two classes are, over how far apart they are.

    The usual mistakes: the standard deviation for the width, the mean of the widths, the ratio upside down, squares, distances between
    samples, a sum for a mean.
    """

    def right(first: np.ndarray, second: np.ndarray) -> float:
        return (_width(first) + _width(second)) / _apart(first, second)

    def spread(samples: np.ndarray) -> float:
        return float(np.sqrt(((samples - samples.mean(axis=0)) ** 2).sum(axis=1).mean()))

    def squares(samples: np.ndarray) -> float:
        return float(((samples - samples.mean(axis=0)) ** 2).sum(axis=1).mean())

    def summed(samples: np.ndarray) -> float:
        return _width(samples) * len(samples)

    rng = np.random.default_rng(4)
    cases = [
        (np.array([[0.0, 0.0], [0.2, 0.0], [0.1, 0.3]]), np.array([[0.9, 0.3], [1.1, 0.3]])),
        (np.array([[0.0, 0.0], [0.4, 0.0], [0.2, 0.1], [0.1, 0.1]]), np.array([[0.5, 0.9], [0.9, 0.6], [0.8, 0.6]])),
    ]
    cases += [
        (rng.normal(0, 0.3, (int(rng.integers(2, 9)), 2)), rng.normal(1, 0.4, (int(rng.integers(2, 9)), 2)))
        for _ in range(more)
    ]
    mistakes = [
        Mistake(
            "The width is the mean distance to the centre; you take the root of the mean square, which is the standard deviation.",
            lambda a, b: (spread(a) + spread(b)) / _apart(a, b),
        ),
        Mistake("You take the mean of the two widths; the ratio has their sum.", lambda a, b: right(a, b) / 2),
        Mistake(
            "The ratio is upside down: wide classes near each other are to have a large one.",
            lambda a, b: 1 / right(a, b),
        ),
        Mistake(
            "You divide by the squared distance of the centres; take the root.",
            lambda a, b: (_width(a) + _width(b)) / _apart(a, b) ** 2,
        ),
        Mistake(
            "You take squared distances to the centre for the width; take the root of each.",
            lambda a, b: (squares(a) + squares(b)) / _apart(a, b),
        ),
        Mistake(
            "You add up the distances to the centre; the width is their mean, or large classes would look wide.",
            lambda a, b: (summed(a) + summed(b)) / _apart(a, b),
        ),
        Mistake(
            "You divide by the mean distance between the samples of the two classes; the distance of their centres is meant.",
            lambda a, b: (_width(a) + _width(b)) / float(np.linalg.norm(a[:, None] - b, axis=2).mean()),
        ),
    ]
    return judge("davies_bouldin_ratio", function, right, cases, mistakes, "Small is good here.")


def check_scale_max_abs(function: Any, more: int = 0) -> Verdict:
    """Check ``scale_max_abs(effects)``: each column divided by its largest absolute value; a column of zeros stays.

    The usual mistakes: the largest value instead of the largest absolute one, one divisor for all columns, the range from 0 to 1, the
    standard deviation, rows for columns, nan where a column is zero.
    """

    def right(effects: np.ndarray) -> np.ndarray:
        largest = np.abs(effects).max(axis=0)
        return effects / np.where(largest == 0, 1.0, largest)

    def plain(effects: np.ndarray) -> np.ndarray:
        with np.errstate(all="ignore"):
            return effects / np.abs(effects).max(axis=0)

    def guarded(effects: np.ndarray, divisor: np.ndarray) -> np.ndarray:
        return effects / np.where(divisor == 0, 1.0, divisor)

    rng = np.random.default_rng(4)
    cases = [
        (np.array([[0.5, 0.0], [2.0, 1.2], [-0.1, 0.3]]),),
        (np.array([[-0.4, 0.3], [0.1, 0.9], [0.2, 0.6]]),),
        (np.array([[0.0, 0.5, 0.3], [0.0, -1.5, 0.6]]),),
    ]
    cases += [(rng.normal(0.1, rng.uniform(0.1, 2, 3), (8, 3)),) for _ in range(more)]
    mistakes = [
        Mistake(
            "A column of zeros became nan (0/0): where the largest absolute value is 0, leave the column as it is.",
            plain,
        ),
        Mistake(
            "You divide by the largest value; where a negative one is larger in size, it must be that size: take np.abs first.",
            lambda effects: guarded(effects, effects.max(axis=0)),
        ),
        Mistake(
            "You divide everything by one number; each column has its own.",
            lambda effects: effects / np.abs(effects).max(),
        ),
        Mistake(
            "You divide each row by its largest value; the dimensions of the effects are the columns (axis=0).",
            lambda effects: effects / np.abs(effects).max(axis=1, keepdims=True),
        ),
        Mistake(
            "You move each column to the range from 0 to 1; here zero has to stay zero, so divide without subtracting.",
            lambda effects: guarded(effects - effects.min(axis=0), np.ptp(effects, axis=0)),
        ),
        Mistake(
            "You divide by the standard deviation; max-abs divides by the largest absolute value.",
            lambda effects: guarded(effects, effects.std(axis=0)),
        ),
        Mistake(
            "You subtract the mean and divide by the standard deviation; max-abs only divides, by the largest absolute value.",
            lambda effects: guarded(effects - effects.mean(axis=0), effects.std(axis=0)),
        ),
    ]
    return judge("scale_max_abs", function, right, cases, mistakes, "All dimensions now reach from -1 to 1 at most.")


def _silhouette(
    i: int,
    samples: np.ndarray,
    labels: np.ndarray,
    *,
    own: Callable[[np.ndarray], float] | None = None,
    other: Callable[[np.ndarray], float] = np.mean,
    pick: Callable[..., float] | None = min,
    power: int = 1,
    alone: float = 0.0,
    divide: bool = True,
) -> float:
    """Return the silhouette of sample i; the keywords make mistakes."""
    distances = np.linalg.norm(samples - samples[i], axis=1) ** power
    mine = labels == labels[i]
    if mine.sum() == 1:
        return alone
    a = own(distances[mine]) if own else distances[mine].sum() / (mine.sum() - 1)
    b = pick(other(distances[labels == c]) for c in np.unique(labels[~mine])) if pick else distances[~mine].mean()
    return float((b - a) / (max(a, b) if divide else 1.0))


def _to_centers(i: int, samples: np.ndarray, labels: np.ndarray) -> float:
    if (labels == labels[i]).sum() == 1:
        return 0.0
    distances = {c: np.linalg.norm(samples[labels == c].mean(axis=0) - samples[i]) for c in np.unique(labels)}
    a = distances.pop(labels[i])
    b = min(distances.values())
    return float((b - a) / max(a, b))


def _width(samples: np.ndarray) -> float:
    return float(np.linalg.norm(samples - samples.mean(axis=0), axis=1).mean())


def _apart(first: np.ndarray, second: np.ndarray) -> float:
    return float(np.linalg.norm(first.mean(axis=0) - second.mean(axis=0)))
