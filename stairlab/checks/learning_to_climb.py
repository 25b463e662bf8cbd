"""Checks of lesson 09, learning to climb."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from stairlab.checks._judge import Mistake, Verdict, judge

Step = tuple[int, int, float, int, bool]


def check_discounted_returns(function: Any, more: int = 0) -> Verdict:
    """Check ``discounted_returns(rewards, discount)``: the discounted return from each jump of an episode on, shape (n_jumps,).

    The usual mistakes: the return of the start only, sums from the start, no discount, discounting by the jumps since the start,
    discounting the first reward too, leaving it out.
    """

    def right(rewards: np.ndarray, discount: float) -> np.ndarray:
        n = len(rewards)
        return np.array([sum(discount ** (k - t) * rewards[k] for k in range(t, n)) for t in range(n)])

    rng = np.random.default_rng(9)
    cases = [
        (np.array([1.0, 0.0, 1.0, 1.0]), 0.9),
        (np.array([0.0, 0.0, 2.0, -1.0, 1.0]), 0.5),
        (np.array([3.0, 1.0]), 0.8),
    ]
    cases += [
        (rng.integers(-2, 2, rng.integers(2, 12)).astype(float), float(rng.uniform(0.1, 0.95))) for _ in range(more)
    ]
    mistakes = [
        Mistake(
            "This is the return from the first jump on only; give one number for each jump of the episode.",
            lambda rewards, discount: right(rewards, discount)[0],
        ),
        Mistake(
            "These are the rewards up to each jump; a return is what comes from that jump on, to the end of the episode.",
            lambda rewards, discount: np.cumsum(discount ** np.arange(len(rewards)) * rewards),
        ),
        Mistake(
            "This sums the rewards without a discount: a reward that comes k jumps later counts discount ** k.",
            lambda rewards, discount: right(rewards, 1.0),
        ),
        Mistake(
            "You discount by the number of jumps since the start of the episode; count them from the jump whose return it is.",
            lambda rewards, discount: right(rewards, discount) * discount ** np.arange(len(rewards)),
        ),
        Mistake(
            "You discount the reward of the jump itself: it comes at once, and counts in full.",
            lambda rewards, discount: discount * right(rewards, discount),
        ),
        Mistake(
            "You leave out the reward of the jump itself; the return from jump t on begins with it.",
            lambda rewards, discount: np.append(right(rewards, discount)[1:], 0.0),
        ),
        Mistake(
            "The order is turned round: the first number belongs to the first jump.",
            lambda rewards, discount: right(rewards, discount)[::-1],
        ),
    ]
    praise = "From the last jump backwards it is one line: G = r + discount * G."
    return judge("discounted_returns", function, right, cases, mistakes, praise)


def check_epsilon_greedy(function: Any, more: int = 0) -> Verdict:
    """Check ``epsilon_greedy(values, exploration)``: the probability of each motion, shape (n_motions,).

    The usual mistakes: the best motion never drawn at random, its random share forgotten, exploration and its complement exchanged,
    equal best motions not sharing, the smallest value taken for the best.
    """

    def shares(values: np.ndarray) -> np.ndarray:
        best = values == values.max()
        return best / best.sum()

    def first(values: np.ndarray) -> np.ndarray:
        return (np.arange(len(values)) == values.argmax()).astype(float)

    def right(values: np.ndarray, exploration: float, best: Any = shares) -> np.ndarray:
        return (1 - exploration) * best(values) + exploration / len(values)

    def others_only(values: np.ndarray, exploration: float, best: Any = shares) -> np.ndarray:
        others = best(values) == 0
        return (1 - exploration) * best(values) + exploration * others / max(others.sum(), 1)

    def forgotten(values: np.ndarray, exploration: float, best: Any = shares) -> np.ndarray:
        chosen = best(values)
        return np.where(chosen > 0, (1 - exploration) * chosen, exploration / len(values))

    rng = np.random.default_rng(9)
    cases = [
        (np.array([0.0, 1.0, 2.5, 0.3]), 0.2),
        (np.array([1.0, 0.0, 1.0, 0.5, -1.0]), 0.3),
        (np.array([0.4, 0.2]), 0.6),
    ]
    cases += [(rng.integers(-2, 4, rng.integers(2, 9)) / 2, float(rng.uniform(0.05, 0.9))) for _ in range(more)]
    mistakes = []
    for best in (shares, first):
        mistakes += [
            Mistake(
                "You draw only among the other motions when you explore; a motion drawn at random may be the best one, too. So the "
                "best has 1 - exploration and its share of the random draws.",
                lambda values, exploration, best=best: others_only(values, exploration, best),
            ),
            Mistake(
                "The probabilities do not sum to 1: the best motion also has its share of the random draws, exploration / n.",
                lambda values, exploration, best=best: forgotten(values, exploration, best),
            ),
            Mistake(
                "Exploration and its complement are exchanged: with the probability exploration a motion is drawn at random, else "
                "the best is taken.",
                lambda values, exploration, best=best: right(values, 1 - exploration, best),
            ),
            Mistake(
                "You prefer the motion with the smallest value; the best has the largest.",
                lambda values, exploration, best=best: right(-values, exploration, best),
            ),
        ]
    mistakes.append(
        Mistake(
            "Where several motions are equally good, you take the first of them; they share the probability 1 - exploration equally.",
            lambda values, exploration: right(values, exploration, first),
        )
    )
    mistakes.append(
        Mistake(
            "Each of several equally good motions gets the whole 1 - exploration, so that the sum exceeds 1; they share it.",
            lambda values, exploration: (1 - exploration) * (values == values.max()) + exploration / len(values),
        )
    )
    return judge("epsilon_greedy", function, right, cases, mistakes, "They sum to 1, as probabilities must.")


def check_q_update(function: Any, more: int = 0) -> Verdict:
    """Check ``q_update(table, frozen, step, learning_rate, discount)``: the table after one correction, shape (n_cells, n_motions).

    The usual mistakes: bootstrapping from a terminal state, the maximum over the wrong place, or over the table that learns, no
    learning rate, no discount, adding the target whole.
    """

    def update(
        table: np.ndarray, step: Step, learning_rate: float, discount: float, future: float, ends: bool = True
    ) -> np.ndarray:
        cell, motion, reward, _, over = step
        target = reward if over and ends else reward + discount * future
        new = table.copy()
        new[cell, motion] += learning_rate * (target - table[cell, motion])
        return new

    def right(table: np.ndarray, frozen: np.ndarray, step: Step, learning_rate: float, discount: float) -> np.ndarray:
        return update(table, step, learning_rate, discount, frozen[step[3]].max())

    def added_whole(
        table: np.ndarray, frozen: np.ndarray, step: Step, learning_rate: float, discount: float
    ) -> np.ndarray:
        new = right(table, frozen, step, learning_rate, discount)
        new[step[0], step[1]] += learning_rate * table[step[0], step[1]]
        return new

    rng = np.random.default_rng(9)

    def case(over: bool) -> tuple[np.ndarray, np.ndarray, Step, float, float]:
        table, frozen = (np.round(rng.uniform(0, 3, (4, 3)), 1) for _ in range(2))
        cell, next_cell = (int(number) for number in rng.choice(4, 2, replace=False))
        step = cell, int(rng.integers(3)), float(rng.integers(-1, 2)), next_cell, over
        return table, frozen, step, float(rng.choice([0.1, 0.3, 0.5])), float(rng.choice([0.5, 0.8, 0.9]))

    by_hand = np.array([[0.0, 1.0], [2.0, 0.5]]), np.array([[0.0, 0.5], [1.0, 0.0]])
    cases = [(*by_hand, (0, 1, 1.0, 1, False), 0.5, 0.9), case(True), case(False)]
    cases += [case(bool(rng.random() < 0.3)) for _ in range(more)]
    mistakes = [
        Mistake(
            "You bootstrap from a terminal state: after the last jump of an episode that is over nothing follows, and the target is "
            "the reward alone.",
            lambda table, frozen, step, rate, discount: update(
                table, step, rate, discount, frozen[step[3]].max(), ends=False
            ),
        ),
        Mistake(
            "The maximum is over the motions in the place where the jump began; take it where the jump has ended, in next_cell.",
            lambda table, frozen, step, rate, discount: update(table, step, rate, discount, frozen[step[0]].max()),
        ),
        Mistake(
            "The maximum is over the whole frozen table; take it over the motions in next_cell.",
            lambda table, frozen, step, rate, discount: update(table, step, rate, discount, frozen.max()),
        ),
        Mistake(
            "You look up the value of next_cell in the table that learns; ask the frozen copy, as DQN asks its target network.",
            lambda table, frozen, step, rate, discount: update(table, step, rate, discount, table[step[3]].max()),
        ),
        Mistake(
            "You forget the learning rate: the entry becomes the target. It should go only a part of the way.",
            lambda table, frozen, step, rate, discount: right(table, frozen, step, 1.0, discount),
        ),
        Mistake(
            "You forget the discount of the value of next_cell.",
            lambda table, frozen, step, rate, discount: right(table, frozen, step, rate, 1.0),
        ),
        Mistake(
            "You add a part of the target instead of going a part of the way to it: subtract the old entry from the target first.",
            added_whole,
        ),
        Mistake(
            "You take the value of the same motion in next_cell; Q-learning takes the best motion there.",
            lambda table, frozen, step, rate, discount: update(table, step, rate, discount, frozen[step[3], step[1]]),
        ),
        Mistake(
            "You return the new entry only; return the table with it.",
            lambda table, frozen, step, rate, discount: right(table, frozen, step, rate, discount)[step[0], step[1]],
        ),
    ]
    return judge("q_update", function, right, cases, mistakes, "With frozen the same as table, this is Q-learning.")


def check_dense_parameters(function: Any, more: int = 0) -> Verdict:
    """Check ``dense_parameters(sizes)``: the number of parameters of a dense network with layers of these sizes.

    The usual mistakes: no biases, biases for the input too or on the wrong side, one bias for a layer, neurons instead of
    parameters, the last layer left out.
    """

    def right(sizes: list[int]) -> int:
        return sum(before * after + after for before, after in pairwise(sizes))

    def weights(sizes: list[int]) -> int:
        return sum(before * after for before, after in pairwise(sizes))

    rng = np.random.default_rng(9)
    cases = [([4, 64, 64, 16],), ([6, 256, 256, 1],), ([3, 2],)]
    cases += [([int(size) for size in rng.integers(1, 50, rng.integers(2, 6))],) for _ in range(more)]
    mistakes = [
        Mistake("The biases are missing: each neuron has one, but for those of the input.", weights),
        Mistake(
            "You give biases to the input, too; it only hands its numbers on.",
            lambda sizes: weights(sizes) + sum(sizes),
        ),
        Mistake(
            "You add a bias for each neuron that a layer gets its input from; each neuron that the layer has needs one.",
            lambda sizes: weights(sizes) + sum(sizes[:-1]),
        ),
        Mistake(
            "You add one bias for a layer; each neuron has a bias of its own.",
            lambda sizes: weights(sizes) + len(sizes) - 1,
        ),
        Mistake("You count the neurons; count the weights between them and their biases.", sum),
        Mistake("The last layer is missing: a network with n sizes has n - 1 layers.", lambda sizes: right(sizes[:-1])),
    ]
    praise = "So 4, 64, 64, 16 gives the paper's 5,520."
    return judge("dense_parameters", function, right, cases, mistakes, praise)
