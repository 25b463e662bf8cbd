"""What the checks of lesson 06 say of solutions, of usual mistakes, and of what else is special to them."""

from functools import partial

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from stairlab.checks import (
    check_bounded_pulls,
    check_new_node,
    check_update_nodes,
    check_winner_and_runner_up,
)

from .verdicts import answered, assert_right


def winner_and_runner_up(samples, nodes):
    return cdist(samples, nodes).argsort(axis=1)[:, :2]


def neighbours_of(node, edges):
    return [j if i == node else i for i, j in edges if node in (i, j)]


def update_nodes(x, nodes, edges, winner_rate, neighbour_rate):
    moved = nodes.copy()
    winner = np.linalg.norm(nodes - x, axis=1).argmin()
    moved[winner] += winner_rate * (x - nodes[winner])
    for neighbour in neighbours_of(winner, edges):
        moved[neighbour] += neighbour_rate * (x - nodes[neighbour])
    return moved


def bounded_pulls(gaps, restricting):
    pulls = []
    for gap in gaps:
        if gap > restricting:
            pull = restricting = 2 / (1 / restricting + 1 / gap)
        else:
            pull, restricting = gap, (restricting + gap) / 2
        pulls.append(pull)
    return pulls


def new_node(nodes, edges, errors):
    worst = errors.argmax()
    neighbour = max(neighbours_of(worst, edges), key=lambda i: errors[i])
    return (nodes[worst] + nodes[neighbour]) / 2


SOLUTIONS = {
    check_winner_and_runner_up: winner_and_runner_up,
    check_update_nodes: update_nodes,
    check_bounded_pulls: bounded_pulls,
    check_new_node: new_node,
}


@pytest.mark.parametrize(("check", "solution"), SOLUTIONS.items())
def test_the_solution_is_right(check, solution):
    assert_right(check, solution)


def test_loops_and_lists_are_right_too():
    def loop(samples, nodes):
        return [sorted(range(len(nodes)), key=lambda i: np.linalg.norm(nodes[i] - x))[:2] for x in samples]

    assert check_winner_and_runner_up(loop, more=20)


# The usual mistakes: the function that makes it, and the words that it is recognised by


def two_smallest_distances(samples, nodes):
    return np.sort(cdist(samples, nodes), axis=1)[:, :2]


def everybody_moves(x, nodes, edges, winner_rate, neighbour_rate):
    moved = nodes + neighbour_rate * (x - nodes)
    winner = np.linalg.norm(nodes - x, axis=1).argmin()
    moved[winner] = nodes[winner] + winner_rate * (x - nodes[winner])
    return moved


def runner_up_moves(x, nodes, edges, winner_rate, neighbour_rate):
    winner, runner_up = np.linalg.norm(nodes - x, axis=1).argsort()[:2]
    return update_nodes(x, nodes, [(winner, runner_up)], winner_rate, neighbour_rate)


def nobody_else_moves(x, nodes, edges, winner_rate, neighbour_rate):
    return update_nodes(x, nodes, [], winner_rate, neighbour_rate)


def pairs_are_read_one_way(x, nodes, edges, winner_rate, neighbour_rate, place=0):
    winner = np.linalg.norm(nodes - x, axis=1).argmin()
    return update_nodes(x, nodes, [edge for edge in edges if edge[place] == winner], winner_rate, neighbour_rate)


def one_rate_for_all(x, nodes, edges, winner_rate, neighbour_rate):
    return update_nodes(x, nodes, edges, winner_rate, winner_rate)


def neighbours_move_to_the_winner(x, nodes, edges, winner_rate, neighbour_rate):
    moved = nodes.copy()
    winner = np.linalg.norm(nodes - x, axis=1).argmin()
    moved[winner] += winner_rate * (x - nodes[winner])
    for neighbour in neighbours_of(winner, edges):
        moved[neighbour] += neighbour_rate * (nodes[winner] - nodes[neighbour])
    return moved


def away_from_the_sample(x, nodes, edges, winner_rate, neighbour_rate):
    return update_nodes(x, nodes, edges, -winner_rate, -neighbour_rate)


def pulls_with(far, near_follows=True, far_follows=True):
    def pulls(gaps, restricting):
        found = []
        for gap in gaps:
            if gap > restricting:
                found.append(far(gap, restricting))
                restricting = found[-1] if far_follows else restricting
            else:
                found.append(gap)
                restricting = (restricting + gap) / 2 if near_follows else restricting
        return np.array(found)

    return pulls


def harmonic(gap, restricting):
    return 2 / (1 / restricting + 1 / gap)


def two_largest_errors(nodes, edges, errors):
    return nodes[np.argsort(errors)[-2:]].mean(axis=0)


def largest_sum(nodes, edges, errors):
    i, j = max(edges.tolist(), key=lambda edge: errors[edge[0]] + errors[edge[1]])
    return (nodes[i] + nodes[j]) / 2


def beside_the_worst(choose):
    def place(nodes, edges, errors):
        worst = errors.argmax()
        neighbour = choose(neighbours_of(worst, edges), nodes, errors, worst)
        return (nodes[worst] + nodes[neighbour]) / 2

    return place


def nearest(neighbours, nodes, errors, worst):
    return min(neighbours, key=lambda i: np.linalg.norm(nodes[i] - nodes[worst]))


def best(neighbours, nodes, errors, worst):
    return min(neighbours, key=lambda i: errors[i])


def longest_edge(nodes, edges, errors):
    i, j = max(edges.tolist(), key=lambda edge: np.linalg.norm(nodes[edge[0]] - nodes[edge[1]]))
    return (nodes[i] + nodes[j]) / 2


MISTAKES = [
    (check_winner_and_runner_up, lambda s, n: winner_and_runner_up(s, n)[:, ::-1], "with the runner-up first"),
    (check_winner_and_runner_up, lambda s, n: cdist(s, n).argsort(axis=1)[:, -2:], "farthest away"),
    (check_winner_and_runner_up, lambda s, n: (-cdist(s, n)).argsort(axis=1)[:, :2], "farthest away"),
    (check_winner_and_runner_up, two_smallest_distances, "numbers of the nodes"),
    (check_winner_and_runner_up, lambda s, n: cdist(s, n, "cityblock").argsort(axis=1)[:, :2], "absolute differences"),
    (check_winner_and_runner_up, lambda s, n: winner_and_runner_up(s, n).T, "on its side"),
    (check_update_nodes, everybody_moves, "All nodes moved"),
    (check_update_nodes, runner_up_moves, "Only the runner-up moved"),
    (check_update_nodes, nobody_else_moves, "did not move"),
    (check_update_nodes, pairs_are_read_one_way, "stand second in the pair"),
    (check_update_nodes, partial(pairs_are_read_one_way, place=1), "stand first in the pair"),
    (check_update_nodes, one_rate_for_all, "winner's rate"),
    (check_update_nodes, neighbours_move_to_the_winner, "towards the winner"),
    (check_update_nodes, away_from_the_sample, "away from the sample"),
    (check_bounded_pulls, pulls_with(lambda gap, d: (gap + d) / 2), "arithmetic mean"),
    (check_bounded_pulls, pulls_with(lambda gap, d: 1 / (1 / gap + 1 / d)), "half of the harmonic mean"),
    (check_bounded_pulls, pulls_with(lambda gap, d: d), "cut off"),
    (check_bounded_pulls, pulls_with(lambda gap, d: gap), "No pull is bounded"),
    (check_bounded_pulls, lambda gaps, d: gaps + 0.0, "No pull is bounded"),
    (check_bounded_pulls, pulls_with(harmonic, near_follows=False, far_follows=False), "stayed as it was"),
    (check_bounded_pulls, pulls_with(harmonic, near_follows=False), "far samples only"),
    (check_bounded_pulls, pulls_with(harmonic, far_follows=False), "near samples only"),
    (check_new_node, two_largest_errors, "need not be neighbours"),
    (check_new_node, largest_sum, "largest sum"),
    (check_new_node, beside_the_worst(nearest), "nearest neighbour"),
    (check_new_node, beside_the_worst(best), "smallest error"),
    (check_new_node, longest_edge, "longest edge"),
    (check_new_node, lambda nodes, edges, errors: nodes[errors.argmax()], "worst node itself"),
]


@pytest.mark.parametrize(("check", "mistaken", "words"), MISTAKES)
@pytest.mark.parametrize("more", [0, 20])
def test_a_usual_mistake_is_recognised_by_name(check, mistaken, words, more):
    assert words in answered(check, mistaken, more=more)


def test_changing_the_nodes_in_place_is_told():
    def in_place(x, nodes, edges, winner_rate, neighbour_rate):
        nodes += update_nodes(x, nodes, edges, winner_rate, neighbour_rate) - nodes
        return nodes

    assert "changes its input" in check_update_nodes(in_place).words


def test_what_no_mistake_explains_is_shown_with_what_was_expected():
    words = check_bounded_pulls(lambda gaps, restricting: gaps * 0 + 7).words
    assert "came [7., 7.], expected was [1. , 2.4]" in words
