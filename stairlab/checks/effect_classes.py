"""Checks of lesson 03, effect classes."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from stairlab.checks._judge import Mistake, Verdict, judge


def check_histogram_bin(function: Any, more: int = 0) -> Verdict:
    """Check ``histogram_bin(value, low, high, n_bins)``: the number of the bin, from 0, that a value lies in.

    The usual mistakes: the largest value in a bin of its own, bins counted from 1, rounding to the nearest, bins that begin at 0, a
    width for one bin too few, an inner edge in the lower bin.
    """

    def place(value: float, low: float, high: float, n_bins: int) -> float:
        return (value - low) / (high - low) * n_bins

    def right(value: float, low: float, high: float, n_bins: int) -> int:
        return min(math.floor(place(value, low, high, n_bins)), n_bins - 1)

    rng = np.random.default_rng(3)
    cases = [(0.7, 0.0, 2.0, 4), (0.9, -0.5, 1.5, 8), (0.5, 0.0, 2.0, 4), (2.0, 0.0, 2.0, 4), (-0.5, -0.5, 1.5, 8)]
    for _ in range(more):
        low, width = rng.uniform(-1, 0), rng.uniform(0.5, 3)
        cases.append((float(low + rng.uniform(0, width)), float(low), float(low + width), int(rng.integers(2, 12))))
    mistakes = [
        Mistake(
            "The largest value came into bin n_bins, which does not exist: bins have the numbers 0 to n_bins - 1, and the last one "
            "takes its right edge, too.",
            lambda *case: math.floor(place(*case)),
        ),
        Mistake("You count the bins from 1; the first bin has the number 0.", lambda *case: right(*case) + 1),
        Mistake(
            "You count the bins from 1, and the largest value has a bin of its own; bins have the numbers 0 to n_bins - 1.",
            lambda *case: math.floor(place(*case)) + 1,
        ),
        Mistake(
            "You round to the nearest number; a value lies in the bin whose lower edge is below it: round down.",
            lambda *case: min(round(place(*case)), case[3] - 1),
        ),
        Mistake(
            "The bins begin at low, not at 0: subtract it first.", lambda x, a, b, n: min(int(x / ((b - a) / n)), n - 1)
        ),
        Mistake(
            "Your bins are too wide: n_bins bins have n_bins + 1 edges, so that the range is divided by n_bins.",
            lambda x, a, b, n: min(math.floor((x - a) / (b - a) * (n - 1)), n - 1),
        ),
        Mistake(
            "A value on an inner edge belongs to the upper of its two bins, as in b_j <= x < b_{j+1}.",
            lambda *case: max(math.ceil(place(*case)) - 1, 0),
        ),
    ]
    praise = "Remember that an edge on a level of heights would split it."
    return judge("histogram_bin", function, right, cases, mistakes, praise)


def check_nearest_centers(function: Any, more: int = 0) -> Verdict:
    """Check ``nearest_centers(samples, centers)``: the index of the nearest centre of each sample.

    The usual mistakes: sums of differences for distances, with and without their signs, the first dimension only, the farthest
    centre, counting from 1, the nearest sample of each centre, the last of two equally near centres.
    """

    def right(samples: np.ndarray, centers: np.ndarray) -> np.ndarray:
        return _squared(samples, centers).argmin(axis=1)

    def manhattan(samples: np.ndarray, centers: np.ndarray) -> np.ndarray:
        return np.abs(samples[:, None] - centers).sum(axis=2)

    rng = np.random.default_rng(3)
    cases = [
        (
            np.array([[0.0, 0.0], [0.98, 0.2], [1.4, 0.8], [0.4, 1.0]]),
            np.array([[1.6, 0.0], [0.9, 0.9], [-1.2, 0.3]]),
        ),
        (np.array([[0.0, 0.0], [0.5, 0.25]]), np.array([[1.0, 0.0], [-1.0, 0.0]])),
    ]
    cases += [(rng.uniform(0, 2, (12, 2)), rng.uniform(0, 2, (int(rng.integers(2, 6)), 2))) for _ in range(more)]
    mistakes = [
        Mistake(
            "You add up the differences of the coordinates; the distance is the root of the sum of their squares.",
            lambda samples, centers: manhattan(samples, centers).argmin(axis=1),
        ),
        Mistake(
            "You add up differences without squaring them, so that they cancel and less than nothing is nearest.",
            lambda samples, centers: (samples[:, None] - centers).sum(axis=2).argmin(axis=1),
        ),
        Mistake(
            "You compare in the first dimension only; both belong to the distance.",
            lambda samples, centers: np.abs(samples[:, None, 0] - centers[:, 0]).argmin(axis=1),
        ),
        Mistake(
            "These are the farthest centres: take argmin, not argmax.",
            lambda samples, centers: _squared(samples, centers).argmax(axis=1),
        ),
        Mistake(
            "You count the centres from 1; the first has the index 0.",
            lambda samples, centers: right(samples, centers) + 1,
        ),
        Mistake(
            "This is the nearest sample of each centre; asked for is the nearest centre of each sample, so argmin has to run along "
            "the other axis.",
            lambda samples, centers: _squared(samples, centers).argmin(axis=0),
        ),
        Mistake(
            "Where two centres are equally near, the first one counts.",
            lambda samples, centers: len(centers) - 1 - _squared(samples, centers)[:, ::-1].argmin(axis=1),
        ),
    ]
    praise = "The squares need no root: it would not change which is smallest."
    return judge("nearest_centers", function, right, cases, mistakes, praise)


def check_update_centers(function: Any, more: int = 0) -> Verdict:
    """Check ``update_centers(samples, labels, centers)``: the means of the classes, none left empty.

    The usual mistakes: nan, zero or the old place for an empty class, no row for it, a sample that is counted twice, the sample
    farthest from or nearest to the empty centre, the one that is farthest after the update, the median, a mean over all samples.
    """
    rng = np.random.default_rng(3)
    full = (
        np.array([[0.0, 0.0], [0.1, 0.0], [0.5, 0.0], [0.5, 0.3], [0.8, 0.3]]),
        np.array([0, 0, 0, 1, 1]),
        np.array([[0.1, 0.0], [0.6, 0.2]]),
    )
    empty = (
        np.array([[0.0, 0.0], [0.2, 0.0], [0.5, 0.3], [0.7, 0.3], [1.8, 1.2]]),
        np.array([0, 0, 1, 1, 1]),
        np.array([[-0.8, 0.0], [1.4, 0.9], [3.0, -2.0]]),
    )
    cases = [full, empty]
    while len(cases) < more + 2:
        samples, centers = rng.uniform(0, 2, (14, 2)), rng.uniform(0, 2, (int(rng.integers(2, 5)), 2))
        if rng.random() < 0.5:
            centers[int(rng.integers(len(centers)))] = (9.0, -9.0)
        labels = _squared(samples, centers).argmin(axis=1)
        counts = np.bincount(labels, minlength=len(centers))
        if (counts != 1).all() and (counts == 0).sum() < 2:
            cases.append((samples, labels, centers))
    mistakes = [
        Mistake(
            "The mean of an empty class is 0/0, and nan stays nan for ever: give the class the sample farthest from its own centre.",
            lambda *case: _means(*case, of_empty=lambda *_: np.full(2, np.nan)),
        ),
        Mistake(
            "The centre of an empty class stays where it was, and may stay empty for ever: give the class the sample that is farthest "
            "from its own centre.",
            lambda *case: _means(*case, of_empty=lambda k, *_: case[2][k]),
        ),
        Mistake(
            "The centre of an empty class went to (0, 0), which is a place like any other: give the class the sample that is farthest "
            "from its own centre.",
            lambda *case: _means(*case, of_empty=lambda *_: np.zeros(2)),
        ),
        Mistake("An empty class has no row in your result; there must be as many centres as before.", _dropped),
        Mistake(
            "The farthest sample is counted twice: it leaves its old class before the means are taken.",
            lambda *case: _means(*case, of_empty=lambda *_: case[0][_worst(*case)]),
        ),
        Mistake(
            "You took the sample farthest from the empty centre; meant is the one that is farthest from the centre of its own class.",
            lambda *case: _refilled(*case, pick=_farthest_from_empty),
        ),
        Mistake(
            "You took the sample nearest to the empty centre; meant is the one that is farthest from the centre of its own class.",
            lambda *case: _refilled(*case, pick=_nearest_to_empty),
        ),
        Mistake(
            "You looked for the farthest sample after the means were taken; its distance is that to the centre it was assigned to.",
            lambda *case: _refilled(*case, pick=_worst_after_update),
        ),
        Mistake("This is the median of each class; the smallest sum of squares is at the mean.", _medians),
        Mistake(
            "You divide by the number of all samples; each mean is over the samples of its class.",
            lambda *case: (
                _refilled(*case) * np.bincount(_labels(*case), minlength=len(case[2]))[:, None] / len(case[0])
            ),
        ),
    ]
    praise = "With nearest_centers, this is a whole turn of K-Means."
    return judge("update_centers", function, _refilled, cases, mistakes, praise)


def check_inertia(function: Any, more: int = 0) -> Verdict:
    """Check ``inertia(samples, centers)``: the sum of squared distances of the samples to their nearest centres.

    The usual mistakes: distances that are not squared, the mean, the sum over all centres, the root, one axis only.
    """

    def right(samples: np.ndarray, centers: np.ndarray) -> float:
        return float(_squared(samples, centers).min(axis=1).sum())

    rng = np.random.default_rng(3)
    cases = [
        (np.array([[0.0, 0.0], [0.3, 0.4], [1.0, 0.6]]), np.array([[0.0, 0.0], [1.0, 0.0]])),
        (np.array([[0.2, 0.1], [0.9, 0.3], [1.4, 0.9], [1.8, 1.2]]), np.array([[0.5, 0.1], [1.6, 1.0], [0.0, 1.2]])),
    ]
    cases += [(rng.uniform(0, 2, (12, 2)), rng.uniform(0, 2, (int(rng.integers(2, 6)), 2))) for _ in range(more)]
    mistakes = [
        Mistake(
            "You add up the distances; the inertia adds up their squares.",
            lambda samples, centers: np.sqrt(_squared(samples, centers)).min(axis=1).sum(),
        ),
        Mistake(
            "This is the mean of the squared distances; the inertia is their sum.",
            lambda samples, centers: right(samples, centers) / len(samples),
        ),
        Mistake(
            "You add up the distances to all centres; each sample counts with its nearest one only.",
            lambda samples, centers: _squared(samples, centers).sum(),
        ),
        Mistake(
            "This is the root of the inertia; the sum of squares itself is asked for, in m².",
            lambda samples, centers: math.sqrt(right(samples, centers)),
        ),
        Mistake(
            "You took the square of the summed distances; square each distance, then add up.",
            lambda samples, centers: np.sqrt(_squared(samples, centers)).min(axis=1).sum() ** 2,
        ),
    ]
    return judge("inertia", function, right, cases, mistakes, "No turn of K-Means makes it larger.")


def _squared(samples: np.ndarray, centers: np.ndarray) -> np.ndarray:
    """Return the squared distance of each sample (rows) to each centre (columns)."""
    return ((samples[:, None] - centers) ** 2).sum(axis=2)


def _means(
    samples: np.ndarray, labels: np.ndarray, centers: np.ndarray, *, of_empty: Callable[..., np.ndarray]
) -> np.ndarray:
    """Return the mean of each class, and ``of_empty(k)`` for class k if it is empty."""
    return np.array(
        [samples[labels == k].mean(axis=0) if (labels == k).any() else of_empty(k) for k in range(len(centers))]
    )


def _worst(samples: np.ndarray, labels: np.ndarray, centers: np.ndarray) -> int:
    """Return the sample that is farthest from the centre of its own class."""
    return int(((samples - centers[labels]) ** 2).sum(axis=1).argmax())


def _farthest_from_empty(samples: np.ndarray, labels: np.ndarray, centers: np.ndarray) -> int:
    empty = next(k for k in range(len(centers)) if not (labels == k).any())
    return int(((samples - centers[empty]) ** 2).sum(axis=1).argmax())


def _nearest_to_empty(samples: np.ndarray, labels: np.ndarray, centers: np.ndarray) -> int:
    empty = next(k for k in range(len(centers)) if not (labels == k).any())
    return int(((samples - centers[empty]) ** 2).sum(axis=1).argmin())


def _worst_after_update(samples: np.ndarray, labels: np.ndarray, centers: np.ndarray) -> int:
    return _worst(samples, labels, _means(samples, labels, centers, of_empty=lambda k: centers[k]))


def _labels(
    samples: np.ndarray, labels: np.ndarray, centers: np.ndarray, *, pick: Callable[..., int] = _worst
) -> np.ndarray:
    """Return labels without an empty class: it has the sample that ``pick`` names."""
    labels = labels.copy()
    for k in range(len(centers)):
        if not (labels == k).any():
            labels[pick(samples, labels, centers)] = k
    return labels


def _refilled(
    samples: np.ndarray, labels: np.ndarray, centers: np.ndarray, *, pick: Callable[..., int] = _worst
) -> np.ndarray:
    labels = _labels(samples, labels, centers, pick=pick)
    return np.array([samples[labels == k].mean(axis=0) for k in range(len(centers))])


def _dropped(samples: np.ndarray, labels: np.ndarray, centers: np.ndarray) -> np.ndarray:
    return np.array([samples[labels == k].mean(axis=0) for k in np.unique(labels)])


def _medians(samples: np.ndarray, labels: np.ndarray, centers: np.ndarray) -> np.ndarray:
    labels = _labels(samples, labels, centers)
    return np.array([np.median(samples[labels == k], axis=0) for k in range(len(centers))])
