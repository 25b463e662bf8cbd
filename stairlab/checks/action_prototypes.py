"""Checks of lesson 07, action prototypes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from stairlab.checks._judge import Mistake, Verdict, judge

MEANS = np.array([[0.09, 0.0], [0.29, 0.0], [0.59, 0.3], [1.01, 0.6], [1.44, 0.9], [1.75, 1.2]])
""" Mean effects like those of the lesson: dy and dz [m] """
Place = Callable[[np.ndarray, int], np.ndarray]


def _distances(effects: Any, means: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.reshape(effects, (-1, 1, means.shape[1])) - means, axis=2)


def check_reached_class(function: Any, more: int = 0) -> Verdict:
    """Check ``reached_class(effect, on_map, means)``: the class, from 1, with the nearest mean effect [m]; 0 off the map.

    The usual mistakes: a class for a jump off the map; the place in the array, which counts from 0; the farthest mean; differences
    added up with their signs; only one of the dimensions.
    """

    def nearest(effect: np.ndarray, means: np.ndarray) -> int:
        return int(1 + _distances(effect, means)[0].argmin())

    def but(choose: Callable[[np.ndarray, np.ndarray], Any]) -> Callable[..., int]:
        return lambda effect, on_map, means: int(choose(effect, means)) if on_map else 0

    right = but(nearest)
    cases: list[tuple[np.ndarray, bool, np.ndarray]] = [
        (np.array([0.55, 0.3]), True, MEANS),
        (np.array([1.21, 0.9]), True, MEANS),
        (np.array([0.2, 0.0]), True, MEANS),
        (np.array([2.4, 0.9]), False, MEANS),
        (np.array([1.0, 0.1]), True, np.array([[0.0, 1.0], [1.0, 0.0], [2.0, 2.0]])),
    ]
    rng = np.random.default_rng(7)
    for _ in range(more):
        means = rng.uniform(-1, 2, size=(int(rng.integers(2, 8)), int(rng.integers(2, 4))))
        cases.append((rng.uniform(-1, 2, size=(means.shape[1],)), bool(rng.random() < 0.8), means))
    signed = "Differences were added with their signs, so that a negative one makes up for a positive one: square them first."
    mistakes = [
        Mistake(
            "A jump off the map has a nearest class as well, but has not reached it: return 0 where on_map is False.",
            lambda effect, on_map, means: nearest(effect, means),
        ),
        Mistake(
            "argmin counts from 0; classes are numbered from 1, and 0 is kept for “off the map”.",
            but(lambda effect, means: nearest(effect, means) - 1),
        ),
        Mistake(
            "argmin counts from 0, classes from 1; and a jump off the map reaches none: return 0 where on_map is False.",
            lambda effect, on_map, means: nearest(effect, means) - 1,
        ),
        Mistake(
            "This is the class that is farthest: argmax of the distances, where argmin was wanted.",
            but(lambda effect, means: 1 + _distances(effect, means)[0].argmax()),
        ),
        Mistake(signed, but(lambda effect, means: 1 + (means - effect).sum(axis=1).argmin())),
        Mistake(signed, but(lambda effect, means: 1 + (effect - means).sum(axis=1).argmin())),
        Mistake(signed, but(lambda effect, means: 1 + np.abs((effect - means).sum(axis=1)).argmin())),
        Mistake(
            "Only the first dimension was compared; use the distance in the whole effect plane.",
            but(lambda effect, means: 1 + np.abs(means[:, 0] - effect[0]).argmin()),
        ),
        Mistake(
            "Only the last dimension was compared; use the distance in the whole effect plane.",
            but(lambda effect, means: 1 + np.abs(means[:, -1] - effect[-1]).argmin()),
        ),
    ]
    praise = "Off the map is asked first: the nearest mean exists wherever a cube ends."
    return judge("reached_class", function, right, cases, mistakes, praise)


def check_reliable_share(function: Any, more: int = 0) -> Verdict:
    """Check ``reliable_share(effects, on_map, own, means)``: the share of prototypes that end on the map in their own class.

    The usual mistakes: jumps off the map counted as if they had landed; divided by the jumps on the map only; classes from 0; the
    number instead of the share; the share on the map.
    """

    def kept(effects: np.ndarray, own: np.ndarray, means: np.ndarray) -> np.ndarray:
        return _distances(effects, means).argmin(axis=1) + 1 == own

    def right(effects: np.ndarray, on_map: np.ndarray, own: np.ndarray, means: np.ndarray) -> float:
        return float((kept(effects, own, means) & on_map).mean())

    def on_map_only(effects: np.ndarray, on_map: np.ndarray, own: np.ndarray, means: np.ndarray) -> float:
        return float((kept(effects, own, means) & on_map).sum() / on_map.sum())

    effects = np.array([[0.3, 0.0], [0.28, 0.0], [0.68, 0.3], [1.21, 0.9], [2.4, 0.9], [1.82, 1.2], [3.1, 0.0]])
    cases = [
        (effects, np.array([True, True, True, True, False, True, False]), np.array([1, 2, 3, 4, 6, 6, 5]), MEANS),
        (effects[:4], np.ones(4, dtype=bool), np.array([2, 2, 3, 5]), MEANS),
    ]
    rng = np.random.default_rng(7)
    for _ in range(more):
        n = int(rng.integers(3, 20))
        own = rng.integers(1, 7, size=n)
        drawn = MEANS[own - 1] + rng.normal(0, 0.25, size=(n, 2))
        on_map = rng.random(n) < 0.7
        on_map[0] = True
        cases.append((drawn, on_map, own, MEANS))
    mistakes = [
        Mistake(
            "Jumps off the map were counted by their nearest class, as if they had landed; "
            "a prototype that leaves the map has failed.",
            lambda effects, on_map, own, means: float(kept(effects, own, means).mean()),
        ),
        Mistake(
            "You divided by the jumps on the map only: a prototype that leaves the map has failed, it is not missing. "
            "Divide by all prototypes.",
            on_map_only,
        ),
        Mistake(
            "argmin counts from 0 and classes from 1: add 1 before you compare with own.",
            lambda effects, on_map, own, means: right(effects, on_map, own + 1, means),
        ),
        Mistake(
            "This is the number of prototypes that keep their promise; the share is that number divided by all of them.",
            lambda effects, on_map, own, means: float((kept(effects, own, means) & on_map).sum()),
        ),
        Mistake(
            "This is the share that fails: one minus the share that was asked for.",
            lambda effects, on_map, own, means: 1 - right(effects, on_map, own, means),
        ),
        Mistake(
            "This is the share that ends on the map, in whatever class; it has to be the own one.",
            lambda effects, on_map, own, means: float(np.mean(on_map)),
        ),
    ]
    praise = "The library's reliability counts in the same way."
    return judge("reliable_share", function, right, cases, mistakes, praise)


def check_medoid(function: Any, more: int = 0) -> Verdict:
    """Check ``medoid(motions, spread)``: the motion with the smallest sum of distances to all others, in standard deviations.

    The usual mistakes: the mean or the median; newtons added to degrees; squared distances, which give the motion nearest to the
    mean; the row's number; the motion in standard deviations.
    """

    def sums(motions: np.ndarray, spread: np.ndarray, power: int = 1) -> np.ndarray:
        scaled = motions / spread
        return (_distances(scaled, scaled) ** power).sum(axis=1)

    def right(motions: np.ndarray, spread: np.ndarray) -> np.ndarray:
        return motions[sums(motions, spread).argmin()]

    def raw(motions: np.ndarray, spread: np.ndarray) -> np.ndarray:
        return motions[sums(motions, np.ones(2)).argmin()]

    spread = np.array([260.0, 26.0])
    first = np.array([[100.0, 20], [110, 35], [130, 50], [125, 65], [140, 80], [700, 40], [820, 39], [930, 38]])
    cases = [
        (first, spread),
        (np.array([[400.0, 60], [420, 75], [450, 48], [600, 44], [980, 42], [640, 84], [430, 88]]), spread),
        (np.array([[100.0, 50], [110, 51], [120, 49], [130, 50], [300, 52], [900, 50], [950, 48]]), spread),
        (np.array([[500.0, 60.0]]), spread),
    ]
    rng = np.random.default_rng(7)
    for _ in range(more):
        n = int(rng.integers(5, 60))
        angles = rng.uniform(42, 87, size=n)
        bow = np.column_stack([400 + 0.9 * (angles - 63) ** 2 + rng.uniform(0, 80, size=n), angles])
        cases.append((bow, spread))
    mistakes = [
        Mistake(
            "This is the mean motion, which nobody has tried; the medoid is one of the motions.",
            lambda motions, spread: motions.mean(axis=0),
        ),
        Mistake(
            "Newtons were added to degrees: divide the motions by spread before you take distances.",
            raw,
        ),
        Mistake(
            "This is the motion nearest to the mean: a sum of squared distances is smallest there. Add the distances themselves.",
            lambda motions, spread: motions[sums(motions, spread, power=2).argmin()],
        ),
        Mistake(
            "This is the number of the medoid's row; return the motion itself, motions[...].",
            lambda motions, spread: int(sums(motions, spread).argmin()),
        ),
        Mistake(
            "The distances are right, but the motion came back in standard deviations: return it in newtons and degrees.",
            lambda motions, spread: (motions / spread)[sums(motions, spread).argmin()],
        ),
        Mistake(
            "This is the motion that is farthest from all others: argmax of the sums, where argmin was wanted.",
            lambda motions, spread: motions[sums(motions, spread).argmax()],
        ),
        Mistake(
            "This is the median of each column, which need not be a motion of the class.",
            lambda motions, spread: np.median(motions, axis=0),
        ),
    ]
    praise = "It was observed, so replayed exactly it keeps its class's promise."
    return judge("medoid", function, right, cases, mistakes, praise)


def check_class_prototypes(function: Any, more: int = 0) -> Verdict:
    """Check ``class_prototypes(motions, labels, number, xi, place)``: equation 4 for one class, in newtons and degrees.

    The usual mistakes: motions as they are; standardised over the class only, or with the samples off the map, or with ddof = 1;
    not brought back to newtons and degrees; the mean whatever xi is; ``place`` also for xi = 1; a single motion without its row.
    """

    def built(
        whose: str = "clustered", back: bool = True, mean: Callable[[int], bool] = lambda xi: xi == 1, ddof: int = 0
    ) -> Any:
        def prototypes(motions: np.ndarray, labels: np.ndarray, number: int, xi: int, place: Place) -> np.ndarray:
            chosen = {"clustered": labels > 0, "all": labels >= 0, "class": labels == number}
            centre, spread = np.zeros(2), np.ones(2)
            if whose != "none":
                centre, spread = motions[chosen[whose]].mean(axis=0), motions[chosen[whose]].std(axis=0, ddof=ddof)
            points = (motions[labels == number] - centre) / spread
            nodes = points.mean(axis=0, keepdims=True) if mean(xi) else place(points, xi)
            return nodes * spread + centre if back else nodes

        return prototypes

    rng = np.random.default_rng(7)
    cases = [(*_bows(rng, 60), number, xi, around_the_middle) for number, xi in ((1, 3), (2, 1), (3, 4))]
    cases.append((*_bows(rng, 60), 1, 4, two_of_them))
    cases += [
        (*_bows(rng, 40), int(rng.integers(1, 4)), int(rng.integers(1, 5)), around_the_middle) for _ in range(more)
    ]
    mistakes = [
        Mistake(
            "Motions went into place as they are, so that a hundred newtons outweigh forty degrees: standardise them first, as the "
            "published code does.",
            built("none"),
        ),
        Mistake(
            "Mean and standard deviation were taken over this class only; take them over all clustered samples (labels > 0), so that "
            "every class is measured alike.",
            built("class"),
        ),
        Mistake(
            "The samples off the map (label 0) went into the mean and standard deviation; only clustered ones do.",
            built("all"),
        ),
        Mistake(
            "The nodes are still in standard deviations: multiply by them and add the mean, to come back to newtons and degrees.",
            built(back=False),
        ),
        Mistake(
            "This is the mean motion for every xi; where xi is larger than 1, place(points, xi) gives the prototypes.",
            built(mean=lambda xi: True),
        ),
        Mistake(
            "Where xi is 1, equation 4 takes the mean motion; place is for xi larger than 1 only.",
            built(mean=lambda xi: False),
        ),
        Mistake(
            "You divided by n - 1 in the standard deviation; here it is by n, ddof=0.",
            built(ddof=1),
        ),
        Mistake(
            "The motions are right, but a single one needs a row of its own: the shape is (1, 2) then, not (2,).",
            lambda *arguments: np.squeeze(built()(*arguments), axis=0) if arguments[3] == 1 else built()(*arguments),
        ),
    ]
    praise = "With robust growing neural gas as place, this is what effect_prototypes does for each class."
    return judge("class_prototypes", function, built(), cases, mistakes, praise)


def around_the_middle(points: np.ndarray, n: int) -> np.ndarray:
    """Place n prototypes without chance, for the exercise: means of all points, each weighted by how near it is to one of n anchors.

    Parameters
    ----------
    points : ndarray of shape (n_points, 2)
        Standardised motions; the anchors lie at distance 1 around 0, so that other units give other prototypes.
    n : int
        Number of prototypes.

    Returns
    -------
    ndarray of shape (n, 2)
    """
    turn = 2 * np.pi * np.arange(n) / n
    weights = 1 / (1 + _distances(np.column_stack([np.cos(turn), np.sin(turn)]), points) ** 2)
    return weights @ points / weights.sum(axis=1, keepdims=True)


def two_of_them(points: np.ndarray, n: int) -> np.ndarray:
    """Place two of n prototypes, for the exercise: n is a maximum, as for robust growing neural gas.

    Parameters
    ----------
    points : ndarray of shape (n_points, 2)
        Standardised motions.
    n : int
        Largest number of prototypes.

    Returns
    -------
    ndarray of shape (2, 2)
    """
    return around_the_middle(points, n)[:2]


def _bows(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Draw n motions and their labels: three classes in bows, and some off the map."""
    labels = np.append(rng.integers(0, 4, size=n - 8), np.repeat([0, 1, 2, 3], 2))
    angles = rng.uniform(42, 87, size=n)
    forces = 250 + 90 * np.where(labels == 0, 5, labels) + 0.4 * (angles - 63) ** 2 + rng.uniform(0, 60, size=n)
    return np.column_stack([forces, angles]), labels
