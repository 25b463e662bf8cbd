"""Up The Stairs, and motion sets as discrete actions."""

import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as check_env_of_sb3

import stairlab
from stairlab import DiscreteMotions, Staircase, StairWorld, TumblingWorld, make_env, uniform_prototypes
from stairlab.envs import UpTheStairs
from stairlab.planning import MAX_JUMPS, trap_width
from stairlab.world import recall_or_fly

CLIMB = np.array([330.0, 68.0], dtype=np.float32)  # one step, from the start pose


HOP = np.array([50, 89], dtype=np.float32)  # on the spot
IN_3D = {"world": "tumbling"}


def make(**options):
    """Make the environment in the plane, unless a world is named."""
    return gym.make("stairlab/UpTheStairs-v1", **{"world": "plane"} | options)


def on_the_top(y=7.0, **options):
    """Return an environment with the cube on the last of fifteen treads."""
    env = make(**options)
    env.reset(seed=0)
    world = env.unwrapped.world
    world.reset(world.state_at(y, world.staircase.top + 0.05))
    return env


def rollout(env, seed, jumps=12):
    observation, info = env.reset(seed=seed)
    env.action_space.seed(seed)
    seen = [(observation.tolist(), 0.0, False, False, info)]
    for _ in range(jumps):
        observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
        seen.append((observation.tolist(), reward, terminated, truncated, info))
        if terminated or truncated:
            env.reset()
    return seen


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"observation": "full"},
        {"actuation_noise": 0.1, "x_drift": True},
        {"n_steps": 4},
        IN_3D,
        IN_3D | {"observation": "full", "actuation_noise": 0.1},
        IN_3D | {"rocking": 0.0, "friction": 0.5},
        IN_3D | {"top_goes_on": True, "time_outs_end": True},
    ],
)
def test_it_passes_the_checks_of_gymnasium_and_stable_baselines_with_one_warning(options):
    for check in (check_env, check_env_of_sb3):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            check(make(**options).unwrapped)
        said = [str(warning.message) for warning in caught]
        assert len(said) <= 1
        assert all("symmetric and normalized" in words for words in said)


def test_it_is_registered_with_a_time_limit_of_fifty_jumps():
    env = gym.make("stairlab/UpTheStairs-v1")
    assert stairlab.__version__
    assert env.spec.max_episode_steps == 50
    low, high = env.action_space.low, env.action_space.high
    assert (low.tolist(), high.tolist()) == ([50, 1], [1000, 89])


def test_version_1_is_in_three_dimensions_unless_it_is_told_otherwise():
    assert isinstance(gym.make("stairlab/UpTheStairs-v1").unwrapped.world, TumblingWorld)
    assert isinstance(gym.make("stairlab/UpTheStairs-v1", world="plane").unwrapped.world, StairWorld)
    world = make(world="tumbling", rocking=0.5, friction=0.7).unwrapped.world
    assert (world.rocking, world.friction, world.staircase) == (0.5, 0.7, Staircase(15, last_run=10.0))


def test_version_0_is_still_the_plane_and_gymnasium_names_the_new_one():
    with pytest.warns(DeprecationWarning, match="UpTheStairs-v0 is out of date.*v1"):
        old = gym.make("stairlab/UpTheStairs-v0")
    assert isinstance(old.unwrapped.world, StairWorld)
    assert rollout(old, seed=4) == rollout(make(), seed=4)


@pytest.mark.parametrize("motions", [None, [[330.0, 68.0], [50.0, 89.0]]])
def test_make_env_makes_the_latest_version_in_the_plane_unless_a_world_is_named(motions):
    for options, kind in (({}, StairWorld), ({"n_steps": 3}, StairWorld), (IN_3D, TumblingWorld)):
        env = make_env(motions, **options)
        assert isinstance(env.unwrapped.world, kind)
        assert env.spec.id.endswith("UpTheStairs-v1")
        assert env.spec.max_episode_steps == MAX_JUMPS
        assert isinstance(env.action_space, gym.spaces.Box if motions is None else gym.spaces.Discrete)


@pytest.mark.parametrize(
    "options",
    [{}, {"actuation_noise": 0.05, "x_drift": True}, IN_3D, IN_3D | {"as_published": True, "actuation_noise": 0.05}],
)
def test_equal_seeds_give_equal_rollouts_step_by_step(options):
    assert rollout(make(**options), seed=4) == rollout(make(**options), seed=4)


def test_noise_and_drift_follow_the_seed_and_are_off_by_default():
    options = {"actuation_noise": 0.05, "x_drift": True}
    noisy, other = (make(**options) for _ in range(2))
    noisy.reset(seed=1)
    other.reset(seed=2)
    assert noisy.step(CLIMB)[0].tolist() != other.step(CLIMB)[0].tolist()
    plain, again = make(), make()
    plain.reset(seed=1)
    again.reset(seed=2)
    assert plain.step(CLIMB)[0].tolist() == again.step(CLIMB)[0].tolist()


def test_the_rocking_of_the_tumbling_world_follows_the_seed_of_the_episode():
    def end_of(seed, **options):
        env = make(world="tumbling", observation="full", **options)
        env.reset(seed=seed)
        return env.step(CLIMB)[0].tolist()

    assert end_of(1) == end_of(1) != end_of(2)
    assert end_of(1, rocking=0.0) == end_of(2, rocking=0.0)
    randomness = [({}, False), (IN_3D, True), (IN_3D | {"rocking": 0.0}, False), ({"x_drift": True}, True)]
    randomness += [({"actuation_noise": 0.1}, True)]
    for options, random in randomness:
        assert make(**options).unwrapped.random is random


def test_the_observation_is_that_of_the_world():
    env, world = make(observation="full"), StairWorld(Staircase(15, last_run=10.0))
    first, _ = env.reset(seed=0)
    np.testing.assert_allclose(first, world.reset(), atol=1e-6)
    np.testing.assert_allclose(env.step(CLIMB)[0], world.jump(*map(float, CLIMB)).end, atol=1e-6)
    assert make().reset()[0].tolist() == pytest.approx([0, 0.25, 0.05, 0.35], abs=1e-6)


@pytest.mark.parametrize("options", [{"x_drift": True}, IN_3D, IN_3D | {"as_published": True, "observation": "full"}])
def test_observations_stay_within_their_bounds(options):
    env = make(**options)
    for seed in range(5):
        for observation, *_ in rollout(env, seed, jumps=40):
            assert env.observation_space.contains(np.array(observation, dtype=env.observation_space.dtype))


def test_a_cube_that_falls_off_the_side_ends_the_episode_within_the_bounds_of_the_observation():
    env = make(world="tumbling", observation="full")
    env.reset(seed=0)
    world = env.unwrapped.world
    world.reset(world.state_at(6.0, 4.3, x=2.52, rotation=0.3))
    observation, reward, terminated, _, info = env.step(HOP)
    assert observation[0] > 2.5
    assert reward < -12
    assert (terminated, info["on_map"]) == (True, False)
    assert env.observation_space.contains(observation)


def test_a_step_up_pays_one_and_info_tells_where_the_cube_is():
    env = make()
    env.reset()
    _, reward, terminated, truncated, info = env.step(CLIMB)
    assert (reward, terminated, truncated) == (1.0, False, False)
    assert info["steps"] == 1
    assert info["height"] == pytest.approx(0.3, abs=1e-3)
    assert info["on_map"] is True
    assert info["duration"] >= 1


def test_resting_on_the_top_ends_the_episode():
    env = make(n_steps=1)
    env.reset()
    _, reward, terminated, _, info = env.step(CLIMB)
    assert (reward, terminated, info["steps"]) == (1.0, True, 1)


def test_leaving_the_map_ends_the_episode():
    env = make(n_steps=1)
    env.reset()
    env.unwrapped.world.reset(env.unwrapped.world.state_at(1.0, 0.35))
    *_, terminated, _, info = env.step(np.array([1000, 30], dtype=np.float32))
    assert terminated or info["on_map"]
    env = UpTheStairs(n_steps=1)
    env.reset()
    env.world.reset(env.world.state_at(env.world.staircase.end - 0.5, 0.35))
    *_, terminated, _, info = env.step(np.array([1000, 45], dtype=np.float32))
    assert (terminated, info["on_map"]) == (True, False)


def test_the_time_limit_truncates_after_fifty_jumps():
    env = make()
    env.reset()
    for jump in range(1, 51):
        *_, terminated, truncated, _ = env.step(np.array([50, 89], dtype=np.float32))
        assert (terminated, truncated) == (False, jump == 50)


# the readings of the published wrappers


@pytest.mark.parametrize("world", ["plane", "tumbling"])
@pytest.mark.parametrize(
    ("options", "ends"), [({}, False), ({"time_outs_end": True}, True), ({"as_published": True}, True)]
)
def test_a_time_out_is_reported_as_an_end_only_where_that_is_asked_for(world, options, ends):
    env = make(world=world, **options)
    for _ in range(2):  # the count begins anew with each episode
        env.reset(seed=0)
        for jump in range(1, MAX_JUMPS + 1):
            *_, terminated, truncated, _ = env.step(HOP)
            assert (terminated, truncated) == (ends and jump == MAX_JUMPS, jump == MAX_JUMPS)


@pytest.mark.parametrize("world", ["plane", "tumbling"])
@pytest.mark.parametrize("options", [{"half_precision": True}, {"as_published": True}])
def test_half_precision_rounds_observations_and_nothing_else(world, options):
    half, single = make(world=world, observation="full", **options), make(world=world, observation="full")
    assert half.observation_space.dtype == np.float16
    assert single.observation_space.dtype == np.float32
    first, _ = half.reset(seed=3)
    rounded, _ = single.reset(seed=3)
    assert first.dtype == np.float16
    np.testing.assert_array_equal(first, rounded.astype(np.float16))
    for _ in range(3):
        (observation, *rest), (exact, *exact_rest) = half.step(CLIMB), single.step(CLIMB)
        assert half.observation_space.contains(observation)
        np.testing.assert_allclose(observation, exact, rtol=2**-11, atol=1e-6)
        assert rest == exact_rest
    assert half.unwrapped.world.state.tobytes() == single.unwrapped.world.state.tobytes()


@pytest.mark.parametrize("world", ["plane", "tumbling"])
@pytest.mark.parametrize(
    ("options", "goes_on"), [({}, False), ({"top_goes_on": True}, True), ({"as_published": True}, True)]
)
def test_on_the_top_the_episode_goes_on_to_10_metres_only_where_that_is_asked_for(world, options, goes_on):
    ends = []
    for y in (7.0, 9.95, 10.05):
        *_, terminated, truncated, info = on_the_top(y, world=world, **options).step(HOP)
        assert (truncated, info["on_map"], info["steps"]) == (False, True, 15)
        ends.append(terminated)
    assert ends == ([False, False, True] if goes_on else [True, True, True])


def test_leaving_the_map_from_the_top_ends_the_episode_under_each_reading():
    for options in ({}, {"top_goes_on": True}):
        env = on_the_top(9.5, **options)
        *_, terminated, _, _ = env.step(np.array([1000, 45], dtype=np.float32))
        assert terminated
    env = make(top_goes_on=True)
    env.reset(seed=0)
    world = env.unwrapped.world
    world.reset(world.state_at(-0.02, 0.05))
    *_, terminated, _, info = env.step(HOP)
    assert (terminated, info["on_map"]) == (True, False)


def test_as_published_is_the_three_readings_together_and_leaves_the_jumps_as_they_are():
    together = make(world="tumbling", as_published=True)
    each = make(world="tumbling", time_outs_end=True, half_precision=True, top_goes_on=True)
    for env in (together, each):
        assert (env.unwrapped.time_outs_end, env.unwrapped.top_goes_on) == (True, True)
    assert together.observation_space == each.observation_space
    assert rollout(together, seed=6, jumps=20) == rollout(each, seed=6, jumps=20)
    plain = make(world="tumbling").unwrapped
    assert (plain.time_outs_end, plain.top_goes_on, plain.observation_space.dtype) == (False, False, np.float32)


def test_a_frame_shows_stairs_cube_and_the_last_path():
    env = make(render_mode="rgb_array")
    env.reset()
    before = env.render()
    env.step(CLIMB)
    after = env.render()
    assert before.shape == after.shape == (600, 900, 3)
    assert before.dtype == np.uint8
    assert (before != after).any()
    assert np.abs(after.astype(int) - (192, 57, 43)).sum(axis=2).min() < 60  # the path is drawn


@pytest.mark.parametrize("world", ["plane", "tumbling"])
def test_rendering_changes_no_outcome(world):
    shown, plain = make(world=world, render_mode="rgb_array"), make(world=world)
    assert rollout(shown, seed=2) == rollout(plain, seed=2)
    assert shown.render().shape == (600, 900, 3)


def test_a_display_is_refused_with_what_to_use_instead():
    with pytest.raises(ValueError, match='use render_mode="rgb_array"'):
        make(render_mode="human")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"n_steps": 0}, "n_steps must be at least 1"),
        ({"observation": "camera"}, "observation must be one of 'paper', 'full'"),
        ({"actuation_noise": -0.1}, "actuation_noise must be between 0 and 1"),
        ({"render_mode": "ansi"}, "render_mode must be one of 'rgb_array'"),
        ({"world": "cube"}, "world must be one of 'plane', 'tumbling', not 'cube'"),
        ({"rocking": 0.5}, "The plane world has no rocking, but it is 0.5"),
        ({"world": "plane", "friction": 0.5}, "The plane world has no friction"),
        ({"world": "tumbling", "x_drift": True}, "The tumbling world has no x_drift"),
        ({"world": "tumbling", "restitution": 0.1}, "staircase must have no restitution in the tumbling world"),
        ({"world": "tumbling", "rocking": -1}, "rocking must be between 0 and 10, not -1"),
    ],
)
def test_bad_options_are_refused_by_name(options, message):
    with pytest.raises(ValueError, match=message):
        UpTheStairs(**options)


def test_actions_outside_the_space_are_refused():
    env = UpTheStairs()
    env.reset()
    with pytest.raises(ValueError, match="magnitude must be between 50 and 1000"):
        env.step(np.array([2000, 45]))
    with pytest.raises(ValueError, match="action must be finite"):
        env.step(np.array([np.nan, 45]))
    with pytest.raises(ValueError, match="action must hold a magnitude and an angle, not 3 numbers"):
        env.step(np.array([500, 45, 1]))


def test_noise_does_not_hide_an_action_outside_the_space():
    env = UpTheStairs(actuation_noise=0.1)
    env.reset(seed=0)
    with pytest.raises(ValueError, match="magnitude must be between 50 and 1000, not 2000"):
        env.step(np.array([2000, 45]))
    with pytest.raises(ValueError, match="angle must be between 1 and 89, not 90"):
        env.step(np.array([500, 90]))
    with pytest.raises(ValueError, match="action must hold a magnitude and an angle, not 3 numbers"):
        env.step(np.array([500, 45, 1]))
    assert env.step(np.array([1000, 1]))[4]["on_map"] is True  # noise may not lead out of it either


def test_a_motion_set_becomes_discrete_actions():
    prototypes = uniform_prototypes(StairWorld())
    env = DiscreteMotions(make(), prototypes)
    assert env.action_space == gym.spaces.Discrete(16)
    direct = make()
    env.reset()
    direct.reset()
    for action in (3, 9, 6):
        one, other = env.step(action), direct.step(prototypes.motions[action].astype(np.float32))
        assert one[0].tolist() == other[0].tolist()
        assert one[1:4] == other[1:4]


def test_any_environment_with_a_box_of_actions_can_be_made_discrete():
    env = DiscreteMotions(gym.make("Pendulum-v1"), [[-2.0], [0.0], [2.0]])
    env.reset(seed=0)
    assert env.action_space == gym.spaces.Discrete(3)
    assert len(env.step(2)) == 5


@pytest.mark.parametrize("action", [-1, 2, 0.0, None, [0]])
def test_what_is_no_index_of_the_set_is_refused(action):
    env = DiscreteMotions(make(), [[500, 45], [300, 75]])
    env.reset()
    with pytest.raises(ValueError, match="action must be a whole number from 0 to 1, not"):
        env.step(action)


@pytest.mark.parametrize(
    ("motions", "message"),
    [
        (np.empty((0, 2)), "prototypes must have at least 1 row"),
        ([[500, 45, 1]], r"prototypes must have the shape \(n, 2\)"),
        ([[500, 45], [500, 45]], "more than once"),
        ([[500, 45], [2000, 45]], "but motion 1 is"),
        ([[np.nan, 45]], "prototypes must be finite"),
    ],
)
def test_bad_motion_sets_are_refused(motions, message):
    with pytest.raises(ValueError, match=message):
        DiscreteMotions(make(), motions)


def test_an_environment_without_a_box_of_actions_is_refused():
    with pytest.raises(ValueError, match="env must have a Box action space"):
        DiscreteMotions(gym.make("CartPole-v1"), [[1.0]])


# What training leans on below the environment: jumps that are remembered, and how a riser rebounds


def gap_after(restitution, magnitude=300, angle=1):
    """Return the gap to the riser after a jump that hits it flush, low over the ground [m]."""
    end = StairWorld(Staircase(restitution=restitution)).jump(magnitude, angle).end
    return end[7] - 0.05


def test_a_remembered_jump_equals_a_fresh_one_to_the_bit():
    def episode():
        env = make(observation="full")
        env.reset()
        steps = [env.step(np.array(motion, dtype=np.float32)) for motion in [(330, 68), (700, 30), (400, 80), (50, 89)]]
        return [observation.tobytes() for observation, *_ in steps], env.unwrapped.world.state.tobytes()

    recall_or_fly.cache_clear()
    fresh = episode()
    flown = recall_or_fly.cache_info().misses
    assert episode() == fresh
    assert recall_or_fly.cache_info().hits == recall_or_fly.cache_info().misses == flown == 4
    recall_or_fly.cache_clear()
    assert episode() == fresh


def test_a_cube_ends_at_a_riser_that_gives_nothing_back_and_farther_from_one_that_does():
    assert abs(gap_after(0)) < 1e-4
    assert gap_after(0) < gap_after(0.3) < gap_after(0.6)
    assert gap_after(0.6) / gap_after(0.3) == pytest.approx(4, rel=0.05)  # it slides back for v² / (2 g)


def test_a_jump_is_not_remembered_for_stairs_of_another_restitution():
    recall_or_fly.cache_clear()
    first = [gap_after(restitution) for restitution in (0, 0.3, None)]
    assert len(set(first)) == 3
    assert [gap_after(restitution) for restitution in (0, 0.3, None)] == first
    assert recall_or_fly.cache_info().misses == 3


def test_a_jump_that_is_never_over_climbs_from_nowhere(monkeypatch):
    monkeypatch.setattr("stairlab.physics.MAX_STEPS", 1)
    recall_or_fly.cache_clear()
    try:
        assert trap_width(Staircase.fifteen(), [[500, 88]]) == np.inf
    finally:
        recall_or_fly.cache_clear()


def test_a_frame_of_the_tumbling_world_shows_the_turned_cube():
    """Seen from the side, a cube that is turned by 45 degrees is wider by a factor of the square root of 2."""

    def width(yaw):
        env = gym.make("stairlab/UpTheStairs-v1", n_steps=1, render_mode="rgb_array")
        env.reset(seed=0)
        world = env.unwrapped.world
        world.reset(world.state_at(0.3, 0.05, yaw=yaw))
        frame = env.render().astype(int)
        cube = np.abs(frame - (64, 200, 192)).sum(axis=2) < 30
        return np.ptp(np.flatnonzero(cube.any(axis=0)))

    assert width(np.pi / 4) / width(0.0) == pytest.approx(np.sqrt(2), rel=0.2)


def test_a_frame_of_the_tumbling_world_shows_the_last_path():
    env = gym.make("stairlab/UpTheStairs-v1", render_mode="rgb_array")
    env.reset(seed=0)
    before = env.render()
    env.step(CLIMB)
    assert (env.render() != before).any()
    assert np.abs(env.render().astype(int) - (192, 57, 43)).sum(axis=2).min() < 60
