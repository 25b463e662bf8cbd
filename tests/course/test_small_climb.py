"""The small climb of lesson 09, and the table that learns it."""

import numpy as np
import pytest

from stairlab import StairWorld, best_return
from stairlab.course.small_climb import (
    BEST,
    EPISODES,
    MOTIONS,
    SmallClimb,
    greedy_return,
    learning_curves,
    play,
    q_learning,
)

# The small climb


def test_the_small_climb_is_the_world_of_the_paper_seen_by_cell(climb):
    world = StairWorld(climb.staircase)
    assert climb.reset() == 5
    for number in (2, 0, 2):
        jump = world.jump(*list(MOTIONS.values())[number])
        cell, reward, over = climb.step(number)
        assert np.allclose(climb.state, jump.end, atol=1e-3)
        assert cell == int(jump.end[1] / 0.05)
        assert reward == (1.0 if jump.dz > 0.05 else 0.0)
        assert not over
    assert climb.step(2) == (climb.n_cells - 1, 1.0, True)


def test_a_jump_is_simulated_once_and_remembered(climb, monkeypatch):
    climb.reset()
    before = climb.step(2)
    monkeypatch.setattr(StairWorld, "perform", lambda *_: pytest.fail("nothing must be simulated"))
    climb.reset()
    assert climb.step(2) == before


def test_cells_are_whole_numbers_from_the_ground_to_the_top():
    climb = SmallClimb(cell=0.4)
    assert climb.n_cells == 5
    assert climb.table.shape == (5, 4)
    places = [climb.world.state_at(y, 0.05) for y in (-1, 0.1, 0.55, 0.9, 1.39, 9)]
    assert [climb.cell_of(place) for place in places] == [0, 0, 1, 2, 3, 4]


def test_an_episode_is_over_on_the_top_or_after_its_jumps(climb):
    assert [step[4] for step in play(climb, lambda cell: 1)] == [True]
    assert len(list(play(climb, lambda cell: 0))) == 20
    assert len(list(play(climb, lambda cell: 0, jumps=3))) == 3


def test_the_best_episode_returns_three_and_its_discounted_return_is_what_is_learned(climb, learned):
    plan = best_return(climb.staircase, np.array(list(MOTIONS.values())), max_jumps=20, progress=False)
    assert plan.proved
    assert plan.value == pytest.approx(3, abs=1e-3)
    assert np.round(plan.rewards).tolist() == [1, 0, 1, 1]
    assert abs(BEST - 1 - 0.81 - 0.729) < 1e-12
    assert greedy_return(climb, learned.table) == pytest.approx(3, abs=1e-3)
    assert learned.table[climb.reset()].max() == pytest.approx(BEST, abs=0.01)


# Q-learning


def test_one_correction_is_the_formula(climb):
    found = q_learning(climb, 1, learning_rate=0.25, exploration=0.0, seed=0)
    rng, table = np.random.default_rng(0), climb.table

    def choose(cell):
        rng.random()
        best = np.flatnonzero(table[cell] == table[cell].max())
        return int(best[rng.integers(len(best))])

    for cell, motion, reward, after, over in play(climb, choose):
        target = reward if over else reward + 0.9 * table[after].max()
        table[cell, motion] = 0.75 * table[cell, motion] + 0.25 * target
    assert np.allclose(found.table, table)


def test_tables_are_kept_at_the_marks_and_are_copies(learned):
    assert tuple(learned.tables) == EPISODES
    assert np.array_equal(learned.tables[400], learned.table)
    assert not np.array_equal(learned.tables[1], learned.tables[50])
    assert list(learned.jumps.values()) == sorted(learned.jumps.values())
    assert learned.jumps[400] == len(learned.starts)


def test_equal_seeds_learn_equal_tables_in_any_order(climb, learned):
    q_learning(climb, 20, seed=1)
    assert np.array_equal(q_learning(SmallClimb()).table, learned.table)


def test_a_frozen_table_carries_values_one_jump_further_with_each_copy(climb):
    starts = np.array(q_learning(climb, 400, exploration=0.5, copy_every=1500).starts)
    assert starts[:1500].max() <= 1 + 1e-9
    assert starts.max() <= 1.9 + 1e-9
    assert starts[-1] > 1.8


def test_without_exploration_robots_keep_to_the_first_thing_that_paid(climb, capsys):
    found = learning_curves({"never": {"exploration": 0.0}, "often": {"exploration": 0.5}}, 5, 200, climb, True)
    assert "often: 5 seeds, " in capsys.readouterr().out
    assert found["never"].shape == (5, 8)
    assert found["often"][:, -1].mean() > found["never"][:, -1].mean() + 0.5
