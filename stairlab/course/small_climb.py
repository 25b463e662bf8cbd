"""A climb small enough for a table, and a table that learns it: Q-learning (lesson 09)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from stairlab.physics import Staircase
from stairlab.planning import ends_episode, jump_reward
from stairlab.world import StairWorld

MOTIONS: dict[str, tuple[float, float]] = {
    "hop": (200.0, 70.0),
    "leap": (500.0, 65.0),
    "step": (330.0, 78.0),
    "steep": (400.0, 84.0),
}
""" The motions of the small climb: magnitude [N] and angle [deg] """
STEPS = 3
""" Steps of the small climb """
LAST_RUN = 10.0
""" Depth of its last tread, as in Up The Stairs [m] """
CELL = 0.05
""" Width of a cell [m] """
JUMPS = 20
""" Jumps in an episode of the small climb """
DISCOUNT = 0.9
""" What a reward is worth that comes one jump later """
BEST = 1 + DISCOUNT**2 + DISCOUNT**3
""" Discounted return of the best episode of the small climb: a step, a jump that only moves, and two steps """
EPISODES = (1, 2, 5, 10, 20, 50, 100, 200, 400)
""" Episodes after which a table is kept """


# The climb


class SmallClimb:
    """Up The Stairs, small enough for a table: three steps, four motions, and all that is seen of a place is its cell.

    The world goes on from where the cube really is. Places on the same step that differ by less than 0.1 mm are taken for one, so that
    each jump is simulated once and remembered.

    Parameters
    ----------
    cell : float
        Width of a cell along y [m].
    motions : mapping of str to tuple of float, optional
        Name, and magnitude [N] and angle [deg] of each motion.
    n_steps : int
        Steps of the stairs.
    """

    def __init__(
        self, cell: float = CELL, motions: Mapping[str, tuple[float, float]] | None = None, n_steps: int = STEPS
    ) -> None:
        self.cell = cell
        self.motions = dict(motions or MOTIONS)
        self.staircase = Staircase(n_steps, last_run=LAST_RUN)
        self.world = StairWorld(self.staircase)
        self.n_cells = math.ceil(self.staircase.risers[-1] / cell - 1e-9) + 1  # the last one is the top
        self._values = [np.array(motion) for motion in self.motions.values()]
        self._places: list[np.ndarray] = []
        self._numbers: dict[tuple[float, ...], int] = {}
        self._remembered: dict[tuple[int, int], tuple[int, int, float, bool]] = {}
        self._start = self._place = self._number(self.world.start)

    @property
    def state(self) -> np.ndarray:
        """Where the cube really is: the eight features of a state, shape (8,)."""
        return self._places[self._place].copy()

    @property
    def table(self) -> np.ndarray:
        """A new table of zeros: a row for each cell, a column for each motion."""
        return np.zeros((self.n_cells, len(self.motions)))

    def reset(self) -> int:
        """Put the cube into the start pose, and return its cell."""
        self._place = self._start
        return self.cell_of(self.state)

    def step(self, motion: int) -> tuple[int, float, bool]:
        """Jump, and return the new cell, the reward, and whether the episode is over (on the top, or off the map)."""
        key = self._place, int(motion)
        if key not in self._remembered:
            self.world.reset(self._places[self._place])
            jump = self.world.perform(self._values[key[1]])
            reward = jump_reward(jump.dz, self.staircase.rise)
            over = ends_episode(self.staircase, jump)
            self._remembered[key] = self._number(jump.end), self.cell_of(jump.end), reward, over
        self._place, cell, reward, over = self._remembered[key]
        return cell, reward, over

    def cell_of(self, state: np.ndarray) -> int:
        """Return the cell of a state: 0 begins at y = 0, the last one is the top tread."""
        return min(max(math.floor(float(state[1]) / self.cell + 1e-9), 0), self.n_cells - 1)

    def _number(self, state: np.ndarray) -> int:
        _, y, z, qx, *_ = state.tolist()
        number = self._numbers.setdefault((round(y, 4), round(z, 3), round(qx, 2)), len(self._places))
        if number == len(self._places):
            self._places.append(state)
        return number


Step = tuple[int, int, float, int, bool]
""" A jump as the table sees it: cell, motion, reward, next cell, whether the episode is over """


def play(climb: SmallClimb, choose: Callable[[int], int], jumps: int = JUMPS) -> Iterator[Step]:
    """Play one episode; ``choose`` gets a cell and returns a motion's number. Each jump is yielded when it is made."""
    cell = climb.reset()
    for _ in range(jumps):
        motion = int(choose(cell))
        next_cell, reward, over = climb.step(motion)
        yield cell, motion, reward, next_cell, over
        if over:
            return
        cell = next_cell


def greedy_return(climb: SmallClimb, table: np.ndarray) -> float:
    """Return the sum of rewards of an episode that takes the best motion by the table (of equal ones the first)."""
    return sum(reward for _, _, reward, _, _ in play(climb, lambda cell: int(table[cell].argmax())))


# The table


@dataclass(frozen=True, eq=False)
class Learned:
    """What Q-learning has learned. Made by ``q_learning``.

    Attributes
    ----------
    table : ndarray of shape (n_cells, n_motions)
        The table at the end.
    tables : dict of int to ndarray
        The table after so many episodes.
    jumps : dict of int to int
        The jumps made until then.
    starts : list of float
        After each jump, the value of the start: the largest entry of its row.
    """

    table: np.ndarray
    tables: dict[int, np.ndarray] = field(repr=False)
    jumps: dict[int, int] = field(repr=False)
    starts: list[float] = field(repr=False)


def q_learning(
    climb: SmallClimb,
    episodes: int = EPISODES[-1],
    learning_rate: float = 0.3,
    exploration: float = 0.3,
    seed: int = 0,
    *,
    discount: float = DISCOUNT,
    copy_every: int = 1,
    marks: Sequence[int] = EPISODES,
) -> Learned:
    r"""Learn a table by Q-learning.

    .. math:: Q(s, a) \leftarrow Q(s, a) + \alpha \left( r + \gamma \max_{a'} Q^-(s', a') - Q(s, a) \right)

    After the last jump of an episode that is over, the target is the reward alone.

    Parameters
    ----------
    climb : SmallClimb
        What is learned.
    episodes : int
        Episodes to play.
    learning_rate, exploration, discount : float
        The learning rate alpha, the share epsilon of jumps chosen at random, and the discount gamma, each from 0 to 1.
    seed : int
        Of the generator.
    copy_every : int
        The table on the right side is a copy, made anew after so many jumps; with 1 it is the table itself.
    marks : sequence of int
        Episodes after which a copy of the table is kept.

    Returns
    -------
    Learned
    """
    rng, table = np.random.default_rng(seed), climb.table
    frozen = table if copy_every == 1 else table.copy()
    start, n_motions = climb.reset(), table.shape[1]
    tables, jumps, starts = {}, {}, []

    def choose(cell: int) -> int:
        if rng.random() < exploration:
            return int(rng.integers(n_motions))
        best = np.flatnonzero(table[cell] == table[cell].max())
        return int(best[rng.integers(len(best))])

    for episode in range(1, episodes + 1):
        for cell, motion, reward, next_cell, over in play(climb, choose):
            target = reward if over else reward + discount * frozen[next_cell].max()
            table[cell, motion] += learning_rate * (target - table[cell, motion])
            starts.append(float(table[start].max()))
            if copy_every > 1 and len(starts) % copy_every == 0:
                frozen = table.copy()
        if episode in marks:
            tables[episode], jumps[episode] = table.copy(), len(starts)
    return Learned(table, tables, jumps, starts)


def learning_curves(
    settings: Mapping[str, Mapping[str, Any]],
    seeds: int = 20,
    episodes: int = 200,
    climb: SmallClimb | None = None,
    progress: bool = False,
) -> dict[str, np.ndarray]:
    """Learn with each of some settings and many seeds.

    Parameters
    ----------
    settings : mapping of str to mapping
        Name, and arguments of ``q_learning``.
    seeds, episodes : int
        Seeds (from 0), and episodes of each.
    climb : SmallClimb, optional
        What is learned.
    progress : bool
        Print a line when all seeds of a setting are done.

    Returns
    -------
    dict of str to ndarray of shape (seeds, n_marks)
        The greedy return after each number of episodes in ``EPISODES``, up to ``episodes``.
    """
    climb = climb or SmallClimb()
    found = {}
    for name, arguments in settings.items():
        learned = [q_learning(climb, episodes, seed=seed, **arguments) for seed in range(seeds)]
        found[name] = np.array([[greedy_return(climb, table) for table in one.tables.values()] for one in learned])
        if progress:
            print(f"{name}: {seeds} seeds, {sum(len(one.starts) for one in learned):,} jumps")
    return found
