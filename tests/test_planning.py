"""What a motion set could do at best."""

import dataclasses
from functools import cache

import numpy as np
import pytest

from stairlab.physics import Staircase
from stairlab.planning import Plan, best_return, jump_reward, trap_width
from stairlab.prototypes import Prototypes, random_prototypes, uniform_prototypes
from stairlab.tumbling import TumblingWorld
from stairlab.world import Jump, StairWorld

SINGLE_STEP = [300.0, 70.0]  # gains one step from the start pose, and from wherever it lands
TINY = Staircase(2, last_run=1.0)
TINY_JUMPS = 4
CLIMB = Staircase(3, last_run=1.0)
CLIMB_JUMPS = 5


def plan_of(staircase, motions, **options):
    return best_return(staircase, motions, progress=False, **options)


def small_set(seed, n=3):
    return random_prototypes(StairWorld(), n, seed=seed).motions


def climbing_set(seed):
    return np.random.default_rng(seed).uniform([200, 60], [600, 89], (3, 2))


@cache
def best_of_all(seed):
    return brute_force(CLIMB, climbing_set(seed), CLIMB_JUMPS)


def brute_force(staircase, motions, jumps, kind=StairWorld):
    """Try every episode; return the best return in whole steps. Written apart from the planner, after equation 5."""

    def best_from(state, left):
        if left == 0:
            return 0
        returns = []
        for magnitude, angle in np.float32(motions).astype(float):
            world = kind(staircase)
            world.reset(state)
            jump = world.jump(magnitude, angle)
            reward = 1 if jump.dz > 0.05 else round(jump.dz / staircase.rise) if jump.dz < -0.05 else 0
            over = not jump.on_map or jump.end[2] > staircase.top
            returns.append(reward + (0 if over else best_from(jump.end, left - 1)))
        return max(returns)

    return best_from(StairWorld(staircase).start, jumps)


@pytest.fixture(scope="module")
def uniform_plan() -> Plan:
    return plan_of(Staircase.fifteen(), uniform_prototypes(StairWorld()))


@pytest.mark.parametrize("seed", [0, 3, 7, 8, 12, 22])  # returns from 1 to 3, some after jumps that gain nothing
def test_no_episode_of_all_that_there_are_returns_more(seed):
    plan = plan_of(CLIMB, climbing_set(seed), max_jumps=CLIMB_JUMPS, tolerance=1e-6)
    assert plan.exhausted
    assert plan.proved
    assert plan.whole_value == best_of_all(seed) == plan.bound


def test_where_going_on_costs_steps_whole_episodes_are_compared():
    staircase, motions = Staircase(3), np.random.default_rng(19).uniform([300, 60], [800, 80], (2, 2))
    plan = plan_of(staircase, motions, max_jumps=5, tolerance=1e-6)
    assert plan.proved
    assert plan.whole_value == brute_force(staircase, motions, 5)


@pytest.mark.parametrize("seed", [0, 3, 7, 8, 12, 22])
def test_merging_like_states_keeps_the_return_a_lower_bound(seed):
    plan = plan_of(CLIMB, climbing_set(seed), max_jumps=CLIMB_JUMPS, tolerance=0.05)
    assert plan.whole_value <= best_of_all(seed)


def test_a_jump_that_gains_one_step_from_everywhere_returns_one_for_each_step():
    plan = plan_of(Staircase.fifteen(), [SINGLE_STEP])
    assert plan.value == plan.bound == 15
    assert (len(plan), plan.steps_climbed, plan.reached_top, plan.proved) == (15, 15, True, True)
    assert plan.rewards.tolist() == [1.0] * 15


def test_a_leap_that_is_sooner_on_a_tread_does_not_hide_the_single_steps_that_pay_more():
    leap = [500.0, 75.0]
    assert round(StairWorld().jump(*leap).dz / 0.3) == 2
    plan = plan_of(Staircase(4, last_run=2.0), [SINGLE_STEP, leap], tolerance=1.0)
    assert plan.value == plan.bound == 4


def test_low_flat_jumps_return_nothing_and_use_up_the_episode():
    plan = plan_of(Staircase.fifteen(), [[50, 1], [60, 10]], max_jumps=8)
    assert (plan.value, plan.bound, plan.steps_climbed, len(plan)) == (0, 0, 0, 8)
    assert plan.exhausted
    assert plan.proved
    assert not plan.reached_top


def test_a_leap_over_the_stairs_ends_the_episode_with_nothing():
    plan = plan_of(Staircase(1), [[1000, 45]])
    assert (plan.value, plan.steps_climbed, len(plan)) == (0, 0, 1)
    assert not StairWorld(Staircase(1)).on_map(plan.states[-1])


def test_a_leap_of_m_steps_loses_m_minus_one():
    leap = [[600.0, 75.0]]
    gained = round(StairWorld().jump(*leap[0]).dz / 0.3)
    assert gained == 3
    plan = plan_of(Staircase(3, last_run=2.0), leap)
    assert (plan.value, plan.steps_climbed, plan.reached_top) == (1, 3, True)
    assert plan.proved


@pytest.mark.parametrize("seed", range(4))
def test_an_episode_that_reaches_the_top_returns_the_steps_less_what_its_leaps_skip(seed):
    staircase = Staircase(6, last_run=10.0)
    plan = plan_of(staircase, small_set(seed, n=8), max_jumps=20, max_simulated=500)
    steps = np.rint((plan.states[:, 2] - 0.05) / 0.3)
    gained = np.diff(steps)
    assert plan.steps_climbed == steps.max()
    assert plan.whole_value == np.minimum(gained, 1).sum() == steps[-1] - (gained[gained > 0] - 1).sum()
    assert plan.whole_value <= plan.bound <= 6


def test_a_fresh_world_replays_the_plan_to_the_bit(uniform_plan):
    world = StairWorld(Staircase.fifteen())
    motions = uniform_prototypes(world).motions.astype(np.float32)
    np.testing.assert_array_equal(uniform_plan.states[0], world.start)
    for motion, state, reward in zip(
        motions[uniform_plan.motions], uniform_plan.states[1:], uniform_plan.rewards, strict=True
    ):
        jump = world.perform(motion)
        np.testing.assert_array_equal(jump.end, state)
        assert jump_reward(jump.dz, 0.3) == reward
    assert uniform_plan.value == uniform_plan.rewards.sum()


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_environment_gives_the_plan_the_same_rewards_and_ends_with_it(seed):
    pytest.importorskip("gymnasium")
    from stairlab.envs import DiscreteMotions, UpTheStairs

    prototypes = random_prototypes(StairWorld(), 6, seed=seed)
    env = DiscreteMotions(UpTheStairs(n_steps=15), prototypes)
    plan = plan_of(Staircase.fifteen(), prototypes, max_jumps=12, max_simulated=300)
    env.reset()
    over = []
    for motion, state, reward in zip(plan.motions, plan.states[1:], plan.rewards, strict=True):
        observation, given, terminated, _, _ = env.step(motion)
        np.testing.assert_array_equal(observation[:3], state[:3].astype(np.float32))
        assert given == reward
        over.append(terminated)
    assert not any(over[:-1])
    assert over[-1] or len(plan) == 12


def test_the_uniform_set_can_climb_the_fifteen_steps(uniform_plan):
    assert uniform_plan.reached_top
    assert uniform_plan.whole_value <= uniform_plan.bound <= 15
    assert len(uniform_plan) <= 50


def test_more_motions_never_hurt_a_search_that_came_to_its_end():
    motions = small_set(5, n=5)
    plans = [plan_of(TINY, motions[:n], max_jumps=TINY_JUMPS) for n in range(1, 6)]
    assert all(plan.exhausted for plan in plans)
    assert np.all(np.diff([plan.bound for plan in plans]) >= 0)


def test_an_episode_of_few_jumps_earns_no_more_than_one_for_each():
    plan = plan_of(Staircase.fifteen(), [SINGLE_STEP], max_jumps=3)
    assert plan.value == plan.bound == len(plan) == 3
    assert not plan.reached_top


def test_a_spent_budget_is_told_and_the_episode_is_whole_all_the_same():
    plan = plan_of(Staircase.fifteen(), small_set(1, n=10), max_jumps=10, max_simulated=1)
    assert not plan.exhausted
    assert not plan.proved
    assert (plan.expanded, plan.bound) == (1, 10)
    assert plan.simulated <= 10 + 10 * 10
    assert len(plan) == 10 or not StairWorld(Staircase.fifteen()).on_map(plan.states[-1])


def test_a_larger_budget_narrows_the_gap_between_return_and_bound():
    motions = random_prototypes(StairWorld(), 4, seed=4)
    short, long = (plan_of(Staircase(5, last_run=10.0), motions, max_jumps=15, max_simulated=n) for n in (8, 2000))
    assert short.bound >= long.bound
    assert short.whole_value <= long.bound


def test_a_set_and_its_motions_are_the_same_to_the_planner_and_stay_as_they_are():
    prototypes = Prototypes(small_set(2))
    before = prototypes.motions.copy()
    first, second = (plan_of(TINY, given, max_jumps=TINY_JUMPS) for given in (prototypes, before.tolist()))
    np.testing.assert_array_equal(prototypes.motions, before)
    for one, other in zip(dataclasses.astuple(first), dataclasses.astuple(second), strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(
    ("dz", "reward"), [(0.3, 1), (1.2, 1), (0.06, 1), (0.05, 0), (0, 0), (-0.05, 0), (-0.3, -1), (-0.9, -3)]
)
def test_climbing_earns_one_and_falling_costs_its_height(dz, reward):
    assert jump_reward(dz, 0.3) == pytest.approx(reward)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"staircase": 15}, "staircase must be a Staircase"),
        ({"staircase": Staircase(rise=0.05)}, r"staircase.rise must be at least 0.1, not 0.05"),
        ({"motions": np.empty((0, 2))}, "motions must have at least 1 row"),
        ({"motions": [300, 70]}, r"motions must have the shape \(n, 2\)"),
        ({"motions": "jump"}, "motions must be an array of numbers"),
        ({"motions": [[300, np.nan]]}, "motions must be finite"),
        ({"motions": [[300, 70], [1200, 70]]}, r"motions must lie between .* but row 1 is"),
        ({"motions": [[300, 70], [300, 0.5]]}, r"motions must lie between .* but row 1 is"),
        ({"motions": [[300, 70], [400, 60], [300, 70]]}, "motions must all be different"),
        ({"motions": [[300, 70], [300 + 1e-9, 70]]}, "motions must all be different"),
        ({"max_jumps": 0}, "max_jumps must be at least 1, not 0"),
        ({"max_jumps": 2.5}, "max_jumps must be a whole number"),
        ({"max_simulated": 0}, "max_simulated must be at least 1, not 0"),
        ({"tolerance": 0}, "tolerance must be greater than 0"),
    ],
)
def test_bad_input_is_refused_with_a_sentence_that_names_it(arguments, message):
    given = {"staircase": TINY, "motions": [SINGLE_STEP], "progress": False} | arguments
    with pytest.raises((ValueError, TypeError), match=message):
        best_return(**given)


def test_a_riser_is_a_wider_trap_for_a_flatter_set():
    widths = [trap_width(Staircase.fifteen(), [[500.0, angle]]) for angle in (88.0, 84.0, 80.0, 75.0)]
    assert widths == sorted(widths)
    assert len(set(widths)) == 4


def test_the_trap_is_about_as_wide_as_the_steepest_path_allows():
    # on a straight path the cube's front reaches the riser at height g tan(alpha); gravity only bends it down, tumbling helps a little
    for angle in (80.0, 84.0, 88.0):
        width = trap_width(Staircase.fifteen(), [[1000.0, angle]])
        assert 0.6 < width * np.tan(np.radians(angle)) / 0.3 < 1.2


def test_the_trap_of_a_set_is_that_of_its_best_motion():
    flat, steep = [500.0, 75.0], [500.0, 86.0]
    assert trap_width(Staircase.fifteen(), [flat, steep]) == trap_width(Staircase.fifteen(), [steep])


def test_motions_that_never_climb_are_trapped_everywhere():
    assert trap_width(Staircase.fifteen(), [[50.0, 89.0], [1000.0, 1.0]]) == np.inf


@pytest.fixture
def straight_paths(monkeypatch):
    """A world in which a cube flies straight on and climbs a step if its front passes the edge: tan(angle) > rise / gap."""

    def perform(world, motion):
        magnitude, angle = motion
        start, rise = world.state, world.staircase.rise
        end = start.copy()
        if np.tan(np.radians(angle)) * (world.staircase.d_obs(start[1]) - 0.05) > rise:
            end[2] += rise
        return Jump(magnitude, angle, start, end, on_map=True, duration=1.0)

    monkeypatch.setattr(StairWorld, "perform", perform)


@pytest.mark.parametrize("angle", [50.0, 60.0, 70.0, 80.0, 85.0, 88.0, 89.0])  # 89 degrees is as steep as motions are
def test_the_gaps_are_fine_enough_to_find_the_trap_of_straight_paths(angle, straight_paths):
    closed_form = 0.3 / np.tan(np.radians(angle))
    assert 0.86 * closed_form < trap_width(Staircase.fifteen(), [[500.0, angle]]) <= closed_form


def test_paths_too_flat_for_the_widest_gap_are_trapped_everywhere(straight_paths):
    assert trap_width(Staircase.fifteen(), [[500.0, 44.0]]) == np.inf


# In the tumbling world: the cube rocks in the same, fixed way before each jump


@pytest.fixture(scope="module")
def tumbling_plan() -> Plan:
    return plan_of(TumblingWorld(Staircase.fifteen()), uniform_prototypes(StairWorld()), max_simulated=3000)


def test_a_plan_of_the_tumbling_world_is_replayed_by_a_fresh_one_to_the_bit(tumbling_plan):
    world = TumblingWorld(Staircase.fifteen())
    motions = uniform_prototypes(world).motions.astype(np.float32)
    np.testing.assert_array_equal(tumbling_plan.states[0], world.start)
    for motion, state, reward in zip(
        motions[tumbling_plan.motions], tumbling_plan.states[1:], tumbling_plan.rewards, strict=True
    ):
        jump = world.perform(motion)
        assert jump.end.tobytes() == state.tobytes()
        assert jump_reward(jump.dz, 0.3) == reward
    assert tumbling_plan.value == tumbling_plan.rewards.sum()
    assert tumbling_plan.whole_value <= tumbling_plan.bound <= 15
    assert np.abs(tumbling_plan.states[:, 0]).max() > 1e-6  # it left the plane


@pytest.mark.parametrize("seed", [0, 3])
def test_no_episode_of_the_tumbling_world_returns_more(seed):
    world = TumblingWorld(CLIMB)
    plan = plan_of(world, climbing_set(seed), max_jumps=CLIMB_JUMPS, tolerance=1e-6)
    assert plan.proved
    assert plan.whole_value == brute_force(CLIMB, climbing_set(seed), CLIMB_JUMPS, TumblingWorld)


def test_a_search_leaves_the_world_that_it_is_given_as_it_was():
    world = TumblingWorld(CLIMB)
    world.jump(500, 70)
    before = world.state
    first = plan_of(world, climbing_set(0), max_jumps=3, max_simulated=50)
    assert trap_width(world, [[500.0, 86.0]]) < 0.1
    assert world.state.tobytes() == before.tobytes()
    np.testing.assert_array_equal(first.states[0], world.start)


def test_the_plane_is_the_world_of_bare_stairs():
    motions = climbing_set(7)
    plans = [plan_of(given, motions, max_jumps=4, max_simulated=100) for given in (CLIMB, StairWorld(CLIMB))]
    assert plans[0].states.tobytes() == plans[1].states.tobytes()
    steep = [[500.0, 84.0]]
    assert trap_width(Staircase.fifteen(), steep) == trap_width(StairWorld(Staircase.fifteen()), steep)


def test_the_rocking_of_the_world_is_searched_with():
    motions = climbing_set(3)
    still, rocking = (plan_of(TumblingWorld(CLIMB, rocking=r), motions, max_jumps=3, max_simulated=50) for r in (0, 1))
    assert still.states.tobytes() != rocking.states.tobytes()


@pytest.mark.parametrize("angle", [80.0, 84.0, 88.0])
def test_the_trap_of_an_upright_cube_is_about_as_wide_in_both_worlds(angle):
    """From upright on a tread the chance to climb is the same function of the gap in both; rocking moves it by some gaps tried."""
    plane, tumbling = (trap_width(kind(Staircase.fifteen()), [[1000.0, angle]]) for kind in (StairWorld, TumblingWorld))
    assert 0.7 < tumbling / plane < 1.4
    assert 0.6 < tumbling * np.tan(np.radians(angle)) / 0.3 < 1.2
