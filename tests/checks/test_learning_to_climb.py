"""What the checks of lesson 09 say of solutions, of usual mistakes, and of what else is special to them."""

from itertools import pairwise

import numpy as np
import pytest

from stairlab.checks import check_dense_parameters, check_discounted_returns, check_epsilon_greedy, check_q_update

from .verdicts import answered, assert_right


def discounted_returns(rewards, discount):
    returns, after = np.zeros(len(rewards)), 0.0
    for t in reversed(range(len(rewards))):
        after = rewards[t] + discount * after
        returns[t] = after
    return returns


def epsilon_greedy(values, exploration):
    best = values == values.max()
    return exploration / len(values) + (1 - exploration) * best / best.sum()


def q_update(table, frozen, step, learning_rate, discount):
    cell, motion, reward, next_cell, over = step
    target = reward if over else reward + discount * frozen[next_cell].max()
    new = table.copy()
    new[cell, motion] += learning_rate * (target - table[cell, motion])
    return new


def dense_parameters(sizes):
    return sum(before * after + after for before, after in pairwise(sizes))


SOLUTIONS = {
    check_discounted_returns: discounted_returns,
    check_epsilon_greedy: epsilon_greedy,
    check_q_update: q_update,
    check_dense_parameters: dense_parameters,
}


@pytest.mark.parametrize(("check", "solution"), SOLUTIONS.items())
def test_the_solution_is_right(check, solution):
    assert_right(check, solution)


def test_lists_and_other_ways_are_right_too():
    def by_sums(rewards, discount):
        n = len(rewards)
        return [sum(discount ** (k - t) * rewards[k] for k in range(t, n)) for t in range(n)]

    assert check_discounted_returns(by_sums, more=20)
    assert check_epsilon_greedy(lambda *given: list(epsilon_greedy(*given)), more=20)
    assert check_dense_parameters(lambda sizes: np.sum(np.multiply(sizes[1:], np.add(sizes[:-1], 1))), more=20)


def powers(rewards, discount):
    return discount ** np.arange(len(rewards))


@pytest.mark.parametrize(
    ("mistaken", "words"),
    [
        (lambda r, g: discounted_returns(r, g)[0], "from the first jump on only"),
        (lambda r, g: np.cumsum(powers(r, g) * r), "up to each jump"),
        (lambda r, g: np.cumsum(r[::-1])[::-1], "without a discount"),
        (lambda r, g: np.cumsum((powers(r, g) * r)[::-1])[::-1], "since the start of the episode"),
        (lambda r, g: g * discounted_returns(r, g), "discount the reward of the jump itself"),
        (lambda r, g: np.append(discounted_returns(r, g)[1:], 0), "leave out the reward"),
        (lambda r, g: discounted_returns(r, g)[::-1], "turned round"),
    ],
)
def test_mistakes_with_returns_are_recognised(mistaken, words):
    for more in (0, 20):
        assert words in answered(check_discounted_returns, mistaken, more=more)


def first_best(values):
    return np.arange(len(values)) == values.argmax()


def all_best(values):
    return (values == values.max()) / (values == values.max()).sum()


@pytest.mark.parametrize(
    ("mistaken", "words"),
    [
        (lambda v, e: np.where(first_best(v), 1 - e, e / (len(v) - 1)), "may be the best one, too"),
        (lambda v, e: np.where(first_best(v), 1 - e, e / len(v)), "do not sum to 1"),
        (
            lambda v, e: np.where(v == v.max(), (1 - e) * all_best(v), e / max((v < v.max()).sum(), 1)),
            "may be the best one, too",
        ),
        (lambda v, e: e * all_best(v) + (1 - e) / len(v), "exchanged"),
        (lambda v, e: e * first_best(v) + (1 - e) / len(v), "exchanged"),
        (lambda v, e: epsilon_greedy(-v, e), "smallest value"),
        (lambda v, e: (1 - e) * first_best(v) + e / len(v), "share the probability"),
        (lambda v, e: (1 - e) * (v == v.max()) + e / len(v), "exceeds 1"),
    ],
)
def test_mistakes_with_exploration_are_recognised(mistaken, words):
    for more in (0, 20):
        assert words in answered(check_epsilon_greedy, mistaken, more=more)


def update(table, step, rate, target):
    new = table.copy()
    new[step[0], step[1]] += rate * (target - table[step[0], step[1]])
    return new


def target_of(step, future, discount):
    return step[2] if step[4] else step[2] + discount * future


@pytest.mark.parametrize(
    ("mistaken", "words"),
    [
        (lambda q, f, s, a, g: update(q, s, a, s[2] + g * f[s[3]].max()), "bootstrap from a terminal state"),
        (lambda q, f, s, a, g: update(q, s, a, target_of(s, f[s[0]].max(), g)), "place where the jump began"),
        (lambda q, f, s, a, g: update(q, s, a, target_of(s, f.max(), g)), "over the whole frozen table"),
        (lambda q, f, s, a, g: update(q, s, a, target_of(s, q[s[3]].max(), g)), "the table that learns"),
        (lambda q, f, s, a, g: update(q, s, 1, target_of(s, f[s[3]].max(), g)), "forget the learning rate"),
        (lambda q, f, s, a, g: update(q, s, a, target_of(s, f[s[3]].max(), 1)), "forget the discount"),
        (lambda q, f, s, a, g: update(q, s, a, target_of(s, f[s[3], s[1]], g)), "the same motion"),
        (lambda q, f, s, a, g: q_update(q, f, s, a, g)[s[0], s[1]], "the new entry only"),
    ],
)
def test_mistakes_with_a_correction_are_recognised(mistaken, words):
    for more in (0, 20):
        assert words in answered(check_q_update, mistaken, more=more)


def test_adding_the_target_without_subtracting_the_entry_is_recognised():
    def added(table, frozen, step, rate, discount):
        new = table.copy()
        new[step[0], step[1]] += rate * target_of(step, frozen[step[3]].max(), discount)
        return new

    assert "subtract the old entry" in check_q_update(added, more=20).words


def test_changing_the_table_that_was_given_is_noticed():
    def in_place(table, frozen, step, rate, discount):
        table[:] = q_update(table, frozen, step, rate, discount)
        return table

    assert "changes its input" in check_q_update(in_place).words


@pytest.mark.parametrize(
    ("mistaken", "words"),
    [
        (lambda sizes: sum(a * b for a, b in pairwise(sizes)), "biases are missing"),
        (lambda sizes: dense_parameters(sizes) + sizes[0], "biases to the input"),
        (lambda sizes: sum(a * b + a for a, b in pairwise(sizes)), "each neuron that the layer has"),
        (lambda sizes: sum(a * b + 1 for a, b in pairwise(sizes)), "one bias for a layer"),
        (sum, "count the neurons"),
        (lambda sizes: dense_parameters(sizes[:-1]), "last layer is missing"),
    ],
)
def test_mistakes_with_parameters_are_recognised(mistaken, words):
    for more in (0, 20):
        assert words in answered(check_dense_parameters, mistaken, more=more)
