"""Checks of lesson 06, growing neural gas."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from stairlab.checks._judge import Mistake, Verdict, judge

_Network = tuple[np.ndarray, np.ndarray]
""" Nodes, shape (n_nodes, 2), and edges, shape (n_edges, 2) """


def check_winner_and_runner_up(function: Any, more: int = 0) -> Verdict:
    """Check ``winner_and_runner_up(samples, nodes)``: numbers of the nearest and second nearest node, shape (n_samples, 2).

    The usual mistakes: the runner-up first; the two farthest; distances instead of numbers; distances along the axes; a row for each
    place instead of each sample.
    """

    def gaps(samples: np.ndarray, nodes: np.ndarray) -> np.ndarray:
        return np.linalg.norm(samples[:, None] - nodes, axis=2)

    def right(samples: np.ndarray, nodes: np.ndarray) -> np.ndarray:
        return gaps(samples, nodes).argsort(axis=1)[:, :2]

    rng = np.random.default_rng(6)
    nodes = np.array([[0.0, 0.0], [3.0, 0.0], [2.0, 2.0], [-4.0, 1.0]])
    cases = [
        (np.array([[1.0, 0.2], [2.9, 1.0], [-1.8, 0.9]]), nodes),
        (np.array([[0.1, 3.0], [-5.0, -5.0]]), nodes[[2, 0, 3, 1]]),
    ]
    cases += [(rng.normal(size=(int(rng.integers(1, 6)), 2)), rng.normal(size=(4, 2))) for _ in range(more)]
    mistakes = [
        Mistake(
            "These are the right two nodes, with the runner-up first: the nearest one, the winner, comes first.",
            lambda samples, nodes: right(samples, nodes)[:, ::-1],
        ),
        Mistake(
            "These are the two nodes that are farthest away: argsort puts the smallest distance first.",
            lambda samples, nodes: gaps(samples, nodes).argsort(axis=1)[:, -2:],
        ),
        Mistake(
            "These are the two nodes that are farthest away: argsort puts the smallest distance first.",
            lambda samples, nodes: gaps(samples, nodes).argsort(axis=1)[:, :-3:-1],
        ),
        Mistake(
            "These are the two smallest distances; asked for are the numbers of the nodes. argsort instead of sort gives them.",
            lambda samples, nodes: np.sort(gaps(samples, nodes), axis=1)[:, :2],
        ),
        Mistake(
            "This is near along the axes, the sum of the absolute differences; the distance is the root of the sum of their squares.",
            lambda samples, nodes: np.abs(samples[:, None] - nodes).sum(axis=2).argsort(axis=1)[:, :2],
        ),
        Mistake(
            "The table is on its side: a row for each sample is asked for, with the winner in column 0.",
            lambda samples, nodes: right(samples, nodes).T,
        ),
    ]
    praise = "The edge between these two is made new, whatever the other nodes do."
    return judge("winner_and_runner_up", function, right, cases, mistakes, praise)


def check_update_nodes(function: Any, more: int = 0) -> Verdict:
    """Check ``update_nodes(x, nodes, edges, winner_rate, neighbour_rate)``: the nodes after one sample, shape (n_nodes, 2).

    The usual mistakes: all nodes move; only the runner-up does; only pairs that begin with the winner are read; neighbours with the
    winner's rate; neighbours towards the winner; away from the sample.
    """

    def winner_of(x: np.ndarray, nodes: np.ndarray) -> int:
        return int(np.linalg.norm(nodes - x, axis=1).argmin())

    def neighbours_of(winner: int, edges: np.ndarray) -> np.ndarray:
        return edges[(edges == winner).any(axis=1)].sum(axis=1) - winner

    def moving(who: Callable[..., Any], toward: str = "sample", sign: float = 1.0, same_rate: bool = False) -> Any:
        def update(
            x: np.ndarray, nodes: np.ndarray, edges: np.ndarray, winner_rate: float, neighbour_rate: float
        ) -> Any:
            winner = winner_of(x, nodes)
            after = nodes.copy()
            after[winner] += sign * winner_rate * (x - nodes[winner])
            goal = x if toward == "sample" else nodes[winner]
            for i in who(x, nodes, edges, winner):
                after[i] += sign * (winner_rate if same_rate else neighbour_rate) * (goal - nodes[i])
            return after

        return update

    def neighbours(x: np.ndarray, nodes: np.ndarray, edges: np.ndarray, winner: int) -> np.ndarray:
        return neighbours_of(winner, edges)

    def everybody(x: np.ndarray, nodes: np.ndarray, edges: np.ndarray, winner: int) -> np.ndarray:
        return np.delete(np.arange(len(nodes)), winner)

    def runner_up(x: np.ndarray, nodes: np.ndarray, edges: np.ndarray, winner: int) -> np.ndarray:
        return np.linalg.norm(nodes - x, axis=1).argsort()[1:2]

    rng = np.random.default_rng(6)
    nodes = np.array([[0.0, 0.0], [2.0, 0.0], [4.0, 1.0], [6.0, 0.0], [2.0, 5.0]])
    edges = np.array([[0, 1], [1, 2], [2, 3], [0, 4]])
    cases = [
        (np.array([3.0, 1.0]), nodes, edges, 0.5, 0.1),
        (np.array([1.8, -1.0]), nodes, edges, 0.1, 0.005),
        (np.array([0.5, 0.4]), nodes, edges[:, ::-1].copy(), 0.2, 0.1),
    ]
    for _ in range(more):
        points, pairs = _random_network(rng)
        cases.append(
            (rng.normal(size=2), points, pairs, float(rng.uniform(0.05, 0.5)), float(rng.uniform(0.001, 0.04)))
        )
    mistakes = [
        Mistake(
            "All nodes moved. Only the winner's neighbours, those that share an edge with it, move with it.",
            moving(everybody),
        ),
        Mistake(
            "Only the runner-up moved with the winner. Neighbours are all nodes that share an edge with the winner.",
            moving(runner_up),
        ),
        Mistake(
            "The winner is right, but its neighbours did not move.",
            moving(lambda x, nodes, edges, winner: []),
        ),
        Mistake(
            "Some neighbours stayed where they were: an edge joins both of its ends, so the winner may stand second in the pair.",
            moving(lambda x, nodes, edges, winner: edges[edges[:, 0] == winner, 1]),
        ),
        Mistake(
            "Some neighbours stayed where they were: an edge joins both of its ends, so the winner may stand first in the pair.",
            moving(lambda x, nodes, edges, winner: edges[edges[:, 1] == winner, 0]),
        ),
        Mistake(
            "The neighbours moved with the winner's rate; theirs is neighbour_rate.",
            moving(neighbours, same_rate=True),
        ),
        Mistake(
            "The neighbours moved towards the winner; they move towards the sample too, by a smaller share of their way to it.",
            moving(neighbours, toward="winner"),
        ),
        Mistake("The nodes moved away from the sample: the way there is x - node.", moving(neighbours, sign=-1.0)),
    ]
    praise = "With rates by age, bounded pulls and the push it is what the library does for each sample."
    return judge("update_nodes", function, moving(neighbours), cases, mistakes, praise)


def check_bounded_pulls(function: Any, more: int = 0) -> Verdict:
    """Check ``bounded_pulls(gaps, restricting)``: strength of each sample's pull, as the restricting distance follows, shape (n,).

    The usual mistakes: the arithmetic mean; half of the harmonic mean; cut off at the restricting distance; not bounded; a
    restricting distance that does not follow, or only far samples.
    """

    def pulls(far: Callable[[float, float], float], near_follows: bool = True, far_follows: bool = True) -> Any:
        def of(gaps: np.ndarray, restricting: float) -> np.ndarray:
            strengths = []
            for gap in gaps:
                if gap > restricting:
                    strengths.append(far(gap, restricting))
                    restricting = strengths[-1] if far_follows else restricting
                else:
                    strengths.append(gap)
                    restricting = (restricting + gap) / 2 if near_follows else restricting
            return np.array(strengths, dtype=float)

        return of

    def harmonic(gap: float, restricting: float) -> float:
        return 2 / (1 / restricting + 1 / gap)

    rng = np.random.default_rng(6)
    cases = [
        (np.array([1.0, 6.0]), 2.0),
        (np.array([0.5, 20.0, 0.7, 3.0, 3.0]), 1.0),
        (np.array([100.0, 100.0, 1.0, 0.2]), 0.5),
    ]
    cases += [
        (rng.exponential(2.0, size=int(rng.integers(3, 9))) + 0.01, float(rng.uniform(0.2, 3))) for _ in range(more)
    ]
    mistakes = [
        Mistake(
            "Far samples pull with the arithmetic mean of the two distances, which an outlier can make as large as it likes; "
            "the harmonic mean is 2 / (1/d + 1/g).",
            pulls(lambda gap, restricting: (gap + restricting) / 2),
        ),
        Mistake(
            "Far samples pull with half of the harmonic mean: of two numbers it is 2 / (1/d + 1/g).",
            pulls(lambda gap, restricting: harmonic(gap, restricting) / 2),
        ),
        Mistake(
            "Far samples are cut off at the restricting distance; they pull with the harmonic mean, up to twice as strongly.",
            pulls(lambda gap, restricting: restricting),
        ),
        Mistake(
            "No pull is bounded: a sample beyond the restricting distance pulls with the harmonic mean only.",
            pulls(lambda gap, restricting: gap),
        ),
        Mistake("No pull is bounded: a sample beyond the restricting distance pulls with the harmonic mean only.",
            lambda gaps, restricting: np.array(gaps, dtype=float)),
        Mistake(
            "The restricting distance stayed as it was: after each sample it follows, and the next sample meets the new one.",
            pulls(harmonic, near_follows=False, far_follows=False),
        ),
        Mistake(
            "The restricting distance follows far samples only; after a near one it becomes (d + g) / 2.",
            pulls(harmonic, near_follows=False),
        ),
        Mistake(
            "The restricting distance follows near samples only; after a far one it becomes the pull.",
            pulls(harmonic, far_follows=False),
        ),
    ]  # fmt: skip
    praise = "No sample pulls with more than twice the restricting distance that it meets."
    return judge("bounded_pulls", function, pulls(harmonic), cases, mistakes, praise)


def check_new_node(function: Any, more: int = 0) -> Verdict:
    """Check ``new_node(nodes, edges, errors)``: where the next node goes, shape (2,).

    The usual mistakes: the two largest errors, joined or not; the edge with the largest sum; the nearest neighbour, or the one with
    the smallest error; the longest edge; on the worst node itself.
    """

    def neighbours_of(node: int, edges: np.ndarray) -> np.ndarray:
        return edges[(edges == node).any(axis=1)].sum(axis=1) - node

    def beside_worst(pick: Callable[[np.ndarray, np.ndarray, int, np.ndarray], int]) -> Any:
        def place(nodes: np.ndarray, edges: np.ndarray, errors: np.ndarray) -> np.ndarray:
            worst = int(errors.argmax())
            beside = neighbours_of(worst, edges)
            return (nodes[worst] + nodes[beside[pick(nodes, errors, worst, beside)]]) / 2

        return place

    def gaps(nodes: np.ndarray, worst: int, beside: np.ndarray) -> np.ndarray:
        return np.linalg.norm(nodes[beside] - nodes[worst], axis=1)

    def middle_of(nodes: np.ndarray, pair: np.ndarray) -> np.ndarray:
        return nodes[pair].mean(axis=0)

    right = beside_worst(lambda nodes, errors, worst, beside: int(errors[beside].argmax()))
    rng = np.random.default_rng(6)
    nodes = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 3.0], [5.0, 3.0], [5.0, -4.0]])
    edges = np.array([[0, 1], [1, 2], [2, 3], [3, 4]])
    cases = [
        (nodes, edges, np.array([3.0, 9.0, 4.0, 7.0, 6.5])),
        (nodes, edges, np.array([4.0, 9.0, 1.0, 8.0, 7.0])),
        (nodes, np.array([[3, 0], [1, 3], [4, 3], [0, 2]]), np.array([5.0, 4.0, 1.0, 6.0, 2.0])),
    ]
    for _ in range(more):
        points, pairs = _random_network(rng)
        cases.append((points, pairs, rng.uniform(0.5, 10, size=len(points))))
    mistakes = [
        Mistake(
            "This is between the two largest errors of all, but those nodes need not be neighbours: look for the second one among the "
            "neighbours of the first.",
            lambda nodes, edges, errors: middle_of(nodes, errors.argsort()[-2:]),
        ),
        Mistake(
            "This is the edge with the largest sum of errors. The node with the largest error comes first, then its worst neighbour.",
            lambda nodes, edges, errors: middle_of(nodes, edges[errors[edges].sum(axis=1).argmax()]),
        ),
        Mistake(
            "This is between the worst node and its nearest neighbour; of the neighbours it is the one with the largest error.",
            beside_worst(lambda nodes, errors, worst, beside: int(gaps(nodes, worst, beside).argmin())),
        ),
        Mistake(
            "This is between the worst node and its neighbour with the smallest error; it is the one with the largest.",
            beside_worst(lambda nodes, errors, worst, beside: int(errors[beside].argmin())),
        ),
        Mistake(
            "This is the middle of the longest edge; errors decide, not lengths.",
            lambda nodes, edges, errors: middle_of(
                nodes, edges[np.linalg.norm(nodes[edges[:, 0]] - nodes[edges[:, 1]], axis=1).argmax()]
            ),
        ),
        Mistake(
            "This is the place of the worst node itself, where two nodes would coincide. Go halfway to its worst neighbour.",
            lambda nodes, edges, errors: nodes[errors.argmax()],
        ),
    ]
    praise = "The edge there gives way to two, from both ends to the new node."
    return judge("new_node", function, right, cases, mistakes, praise)


def _random_network(rng: np.random.Generator) -> _Network:
    """Return four to seven nodes in a chain whose pairs stand either way round, and a further edge."""
    n = int(rng.integers(4, 8))
    chain = np.column_stack([np.arange(n - 1), np.arange(1, n)])
    edges = np.vstack([chain, [[0, n - 1]]])
    turned = rng.random(len(edges)) < 0.5
    edges[turned] = edges[turned, ::-1]
    return rng.normal(size=(n, 2)), edges
