"""What the checks of lesson 07 say of solutions, of usual mistakes, and of what else is special to them."""

import numpy as np
import pytest

from stairlab.checks import check_class_prototypes, check_medoid, check_reached_class, check_reliable_share
from stairlab.checks.action_prototypes import around_the_middle

from .verdicts import answered, assert_right


def distances(effects, means):
    return np.linalg.norm(np.reshape(effects, (-1, 1, means.shape[1])) - means, axis=2)


def reached_class(effect, on_map, means):
    return int(distances(effect, means)[0].argmin()) + 1 if on_map else 0


def reliable_share(effects, on_map, own, means):
    return np.mean([reached_class(e, o, means) == k for e, o, k in zip(effects, on_map, own, strict=True)])


def medoid(motions, spread):
    return motions[distances(motions / spread, motions / spread).sum(axis=1).argmin()]


def class_prototypes(motions, labels, number, xi, place):
    clustered = motions[labels > 0]
    centre, spread = clustered.mean(axis=0), clustered.std(axis=0)
    points = (motions[labels == number] - centre) / spread
    return (points.mean(axis=0, keepdims=True) if xi == 1 else place(points, xi)) * spread + centre


SOLUTIONS = {
    check_reached_class: reached_class,
    check_reliable_share: reliable_share,
    check_medoid: medoid,
    check_class_prototypes: class_prototypes,
}


@pytest.mark.parametrize(("check", "solution"), SOLUTIONS.items())
def test_the_solution_is_right(check, solution):
    assert_right(check, solution)


REACHED = {
    "on_map": lambda effect, on_map, means: reached_class(effect, True, means),
    "kept for": lambda effect, on_map, means: reached_class(effect, True, means) - 1 if on_map else 0,
    "reaches none": lambda effect, on_map, means: reached_class(effect, True, means) - 1,
    "farthest": lambda effect, on_map, means: int(distances(effect, means)[0].argmax()) + 1 if on_map else 0,
    "square them": lambda effect, on_map, means: int((means - effect).sum(axis=1).argmin()) + 1 if on_map else 0,
    "with their signs": lambda effect, on_map, means: int((effect - means).sum(axis=1).argmin()) + 1 if on_map else 0,
    "makes up for": lambda effect, on_map, means: int(abs((effect - means).sum(axis=1)).argmin()) + 1 if on_map else 0,
    "first dimension": lambda effect, on_map, means: int(abs(means[:, 0] - effect[0]).argmin()) + 1 if on_map else 0,
    "last dimension": lambda effect, on_map, means: int(abs(means[:, -1] - effect[-1]).argmin()) + 1 if on_map else 0,
}
SHARE = {
    "as if they had landed": lambda effects, on_map, own, means: reliable_share(effects, on_map | True, own, means),
    "on the map only": lambda effects, on_map, own, means: reliable_share(
        effects[on_map], on_map[on_map], own[on_map], means
    ),
    "add 1": lambda effects, on_map, own, means: ((distances(effects, means).argmin(axis=1) == own) & on_map).mean(),
    "This is the number": lambda effects, on_map, own, means: len(own) * reliable_share(effects, on_map, own, means),
    "fails": lambda effects, on_map, own, means: 1 - reliable_share(effects, on_map, own, means),
    "in whatever class": lambda effects, on_map, own, means: on_map.mean(),
}
MEDOID = {
    "nobody has tried": lambda motions, spread: motions.mean(axis=0),
    "added to degrees": lambda motions, spread: medoid(motions, np.ones(2)),
    "nearest to the mean": lambda motions, spread: motions[
        np.linalg.norm((motions - motions.mean(axis=0)) / spread, axis=1).argmin()
    ],
    "row": lambda motions, spread: distances(motions / spread, motions / spread).sum(axis=1).argmin(),
    "back in standard deviations": lambda motions, spread: medoid(motions, spread) / spread,
    "farthest": lambda motions, spread: motions[distances(motions / spread, motions / spread).sum(axis=1).argmax()],
    "median": lambda motions, spread: np.median(motions, axis=0),
}


def prototypes_with(chosen, back=True, ddof=0):
    def mistaken(motions, labels, number, xi, place):
        rows = motions[chosen(labels, number)]
        centre, spread = (rows.mean(axis=0), rows.std(axis=0, ddof=ddof)) if len(rows) else (np.zeros(2), np.ones(2))
        points = (motions[labels == number] - centre) / spread
        nodes = points.mean(axis=0, keepdims=True) if xi == 1 else place(points, xi)
        return nodes * spread + centre if back else nodes

    return mistaken


PROTOTYPES = {
    "as they are": prototypes_with(lambda labels, number: labels < 0),
    "over this class only": prototypes_with(lambda labels, number: labels == number),
    "off the map": prototypes_with(lambda labels, number: labels >= 0),
    "still in standard deviations": prototypes_with(lambda labels, number: labels > 0, back=False),
    "n - 1": prototypes_with(lambda labels, number: labels > 0, ddof=1),
    "a row of its own": lambda motions, labels, number, xi, place: (
        motions[labels == number].mean(axis=0) if xi == 1 else class_prototypes(motions, labels, number, xi, place)
    ),
    "for every xi": lambda motions, labels, number, xi, place: class_prototypes(motions, labels, number, 1, place),
    "larger than 1 only": lambda motions, labels, number, xi, place: class_prototypes(
        motions, labels, number, 1.5 if xi == 1 else xi, lambda points, n: place(points, int(n))
    ),
}
MISTAKES = [
    pytest.param(check, words, function, id=f"{check.__name__}: {words}")
    for check, mistakes in (
        (check_reached_class, REACHED),
        (check_reliable_share, SHARE),
        (check_medoid, MEDOID),
        (check_class_prototypes, PROTOTYPES),
    )
    for words, function in mistakes.items()
]


@pytest.mark.parametrize(("check", "words", "mistake"), MISTAKES)
def test_each_usual_mistake_is_recognised_by_its_words(check, words, mistake):
    for more in (0, 20):
        assert words in answered(check, mistake, more=more)


def test_a_function_that_changes_its_input_is_told_so():
    def changes(motions, spread):
        motions /= spread
        return motions[0]

    assert "changes its input" in check_medoid(changes).words


def test_the_placer_of_the_check_stays_among_the_points_and_depends_on_their_unit():
    points = np.array([[0.0, 0.0], [500.0, 1.0], [100.0, 60.0]])
    nodes = around_the_middle(points, 4)
    assert nodes.shape == (4, 2)
    assert (points.min(axis=0) <= nodes).all()
    assert (nodes <= points.max(axis=0)).all()
    assert not np.allclose(around_the_middle(points / [260, 26], 4) * [260, 26], nodes)
