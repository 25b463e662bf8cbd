"""The game of lesson 08: it is the environment's, can be undone, and what is found from a gap is what the world does."""

import math

import numpy as np
import pytest

from stairlab import Staircase, best_return, make_env, random_prototypes, trap_width
from stairlab.course.game import READINGS, Game, from_gap, gap_of, play, repeat, replay_plan, step_of, widest_after
from stairlab.planning import jump_reward
from stairlab.tumbling import TumblingWorld
from stairlab.world import StairWorld

SINGLE, LEAP, HOP = [300.0, 70.0], [600.0, 75.0], [50.0, 89.0]
THREE = np.array([SINGLE, LEAP, HOP])
SHORT = Staircase(3, last_run=10.0)


@pytest.mark.parametrize("dz", [0.3, 0.9, 0.06])
def test_all_readings_pay_one_for_a_climb(dz):
    assert [reward(dz, 0.3) for reward in READINGS.values()] == [1, 1, 1]


def test_the_printed_reading_pays_for_falling_and_the_others_do_not():
    assert [reward(-0.6, 0.3) for reward in READINGS.values()] == pytest.approx([2, -2, -2])


def test_only_the_dead_band_does_not_pay_for_jitter():
    assert [reward(1e-14, 0.3) for reward in READINGS.values()] == [1, 1, 0]


@pytest.mark.parametrize("seed", [0, 1])
def test_a_game_gives_what_the_environment_gives(seed):
    motions = random_prototypes(StairWorld(), 6, seed=seed)
    env, game = make_env(motions), Game(motions)
    first, _ = env.reset()
    np.testing.assert_array_equal(first, game.observation)
    rng = np.random.default_rng(seed)
    while not game.over:
        action = int(rng.integers(6))
        game.jump(action)
        observation, reward, terminated, truncated, info = env.step(action)
        np.testing.assert_array_equal(observation, game.observation)
        assert (reward, info["steps"]) == (game.rewards[-1], game.steps[-1])
        assert (terminated or truncated) == game.over


def test_undoing_all_jumps_leads_back_to_the_start_and_replaying_them_to_the_same_places():
    game = Game(THREE)
    for action in (0, 1, 2, 0):
        game.jump(action)
    places = [state.tolist() for state in game.states]
    for _ in range(4):
        game.undo()
    game.undo()  # nothing at the start
    assert (game.value, game.steps.tolist(), game.actions) == (0, [0], [])
    for action in (0, 1, 2, 0):
        game.jump(action)
    assert [state.tolist() for state in game.states] == places


def test_undo_takes_the_end_of_an_episode_back():
    game = Game(THREE, SHORT)
    game.jump(1)
    assert game.over
    assert game.on_top
    game.undo()
    assert not game.over
    game.jump(0)
    assert game.steps.tolist() == [0, 1]


def test_a_game_that_is_over_and_a_motion_that_is_none_are_refused():
    game = Game(THREE, SHORT, max_jumps=1)
    with pytest.raises(ValueError, match="from 0 to 2, not 3"):
        game.jump(3)
    game.jump(2)
    with pytest.raises(ValueError, match="The episode is over"):
        game.jump(0)


def test_looking_where_a_motion_leads_changes_nothing():
    game = Game(THREE)
    game.jump(0)
    before = game.observation.tolist()
    jump = game.lead(0)
    assert game.observation.tolist() == before
    game.jump(0)
    np.testing.assert_array_equal(jump.end, game.states[-1])


def test_the_return_is_the_last_step_less_what_leaps_skip():
    rng = np.random.default_rng(3)
    for seed in range(3):
        motions = random_prototypes(StairWorld(), 6, seed=seed)
        game = play(motions, lambda seen: int(rng.integers(6)), max_jumps=15)
        skipped = (game.gains[game.gains > 0] - 1).sum()
        assert round(game.value) == game.steps[-1] - skipped
        assert game.value == sum(jump_reward(dz, 0.3) for dz in np.diff(game.heights))


def test_one_motion_climbs_all_fifteen_steps_and_stays_out_of_its_trap():
    game = repeat(SINGLE)
    assert (game.value, game.on_top, len(game.actions)) == (15, True, 15)
    assert game.gaps[:-1].min() > trap_width(Staircase.fifteen(), [SINGLE])


def test_a_motion_that_gets_stuck_is_not_repeated_in_vain():
    stuck = repeat((454, 80))
    whole = play([[454, 80]], lambda seen: 0)
    assert len(stuck.actions) < 20
    assert len(whole.actions) == 50
    assert stuck.value == whole.value


def test_a_plan_is_replayed_to_its_value():
    for motions in (THREE, random_prototypes(StairWorld(), 4, seed=0)):
        plan = best_return(Staircase.fifteen(), motions, max_jumps=4, progress=False)
        game = replay_plan(motions, plan)
        assert game.value == plan.value
        assert game.over
        np.testing.assert_array_equal(game.states, plan.states)


@pytest.fixture
def tumbling():
    return TumblingWorld(Staircase.fifteen())


def test_where_the_cube_tumbles_a_seed_gives_a_game_again_and_another_one_another_game(tumbling):
    first, again, other = (play(THREE, lambda seen: 1, tumbling, max_jumps=4, seed=seed) for seed in (0, 0, 1))
    np.testing.assert_array_equal(first.states, again.states)
    assert first.states[-1].tolist() != other.states[-1].tolist()
    assert first.tumbles
    assert not Game(THREE).tumbles


def test_where_the_cube_tumbles_a_jump_that_was_undone_comes_out_as_before_and_as_it_was_led_to(tumbling):
    game = Game(THREE, tumbling, seed=3)
    game.jump(0)
    led = game.lead(1).end
    end = game.jump(1).end
    game.undo()
    np.testing.assert_array_equal(game.jump(1).end, end)
    np.testing.assert_array_equal(led, end)
    np.testing.assert_array_equal(game.path(2).end, end)
    assert tumbling.state.tolist() == tumbling.start.tolist()  # a game has a cube of its own


def test_a_plan_of_the_tumbling_world_is_replayed_with_the_rocking_that_the_search_assumed(tumbling):
    plan = best_return(tumbling, THREE, max_jumps=4, progress=False)
    game = replay_plan(THREE, plan, tumbling)
    np.testing.assert_array_equal(game.states, plan.states)
    assert game.value == plan.value


def test_the_gap_of_a_turned_cube_is_that_of_its_foremost_corner(tumbling):
    stairs = tumbling.staircase
    turned = tumbling.state_at(0.4, 0.05, yaw=math.radians(45))
    assert gap_of(turned, stairs) == pytest.approx(0.2 - 0.05 * math.sqrt(2))
    assert gap_of(tumbling.state_at(0.4, 0.05, rotation=math.pi / 2), stairs) == pytest.approx(0.15)


def test_from_a_gap_a_motion_does_what_the_world_does():
    stairs, world = Staircase.fifteen(), StairWorld(Staircase.fifteen())
    start = world.reset(world.state_at(stairs.risers[7] - 0.05 - 0.2, 0.3 * 7 + 0.05))
    assert gap_of(start, stairs) == pytest.approx(0.2)
    jump = world.jump(*SINGLE)
    gained, gap = from_gap(SINGLE, 0.2)
    assert (gained, gap) == (step_of(jump.end, stairs) - 7, gap_of(jump.end, stairs))


def test_inside_the_trap_no_motion_climbs_and_beyond_it_one_does():
    width = trap_width(Staircase.fifteen(), THREE)
    assert math.isfinite(widest_after(THREE, 0.5 * width))
    assert math.isinf(widest_after(THREE, 0.25))
