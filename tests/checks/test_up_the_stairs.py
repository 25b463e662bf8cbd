"""Checks of lesson 08."""

import numpy as np
import pytest

from stairlab.checks import check_better_reward, check_climb, check_env_is_right, check_reward_of_jump

from .verdicts import answered, assert_right

SINGLE, LEAP, HOP = np.float32([[300, 70], [600, 75], [50, 89]])


def reward_of_jump(dz, rise):
    if dz > 0.05:
        return 1.0
    return dz / rise if dz < -0.05 else 0.0


def better_reward(dz, rise):
    return dz / rise if abs(dz) > 0.05 else 0.0


def climb(observation, motions):
    gap = observation[3] - 0.05
    if gap < 0.01:
        return 7
    return 4 if gap < 0.1 else 1


def looks_at(*promises):
    """Return a test that looks at some of the promises only."""

    def env_is_right(env):
        kept = {}
        env.reset()
        played = [env.step(motion) for motion in (SINGLE, HOP, SINGLE, SINGLE)]
        kept["rewards"] = [reward for _, reward, *_ in played] == [1, 0, 1, 1]
        kept["after a climb"] = played[1][1] != 1
        heights = [observation[2] for observation, *_ in played]
        kept["observation"] = np.allclose(heights, [0.35, 0.35, 0.65, 0.95], atol=0.001)
        kept["end"] = [terminated for _, _, terminated, *_ in played] == [False, False, False, True]
        observation, _ = env.reset()
        kept["reset"] = np.allclose(observation[1:3], [0.25, 0.05], atol=0.001)
        kept["time"] = [env.step(HOP)[3] for _ in range(50)] == [False] * 49 + [True]
        env.reset()
        kept["leap"] = env.step(LEAP)[1] == 1
        return all(kept[promise] for promise in promises)

    return env_is_right


PROMISES = ("rewards", "after a climb", "observation", "end", "reset", "time", "leap")
SOLUTIONS = {
    check_reward_of_jump: reward_of_jump,
    check_better_reward: better_reward,
    check_climb: climb,
    check_env_is_right: looks_at(*PROMISES),
}


@pytest.mark.parametrize(("check", "solution"), SOLUTIONS.items())
def test_a_solution_is_right(check, solution):
    assert_right(check, solution)


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (lambda dz, rise: 1.0 if dz > 0 else -dz / rise, "equation 5 to the letter"),
        (lambda dz, rise: abs(reward_of_jump(dz, rise)), "Falling is rewarded"),
        (lambda dz, rise: 1.0 if dz > 0 else dz / rise, "The dead band is missing: a cube that hops"),
        (lambda dz, rise: 1.0 if dz > 0.05 else min(dz, 0) / rise, "The dead band is missing for falls"),
        (lambda dz, rise: dz / rise if abs(dz) > 0.05 else 0, "counts the steps of a climb"),
        (lambda dz, rise: (dz > 0.05) - (dz < -0.05), "Every fall costs 1"),
        (lambda dz, rise: reward_of_jump(dz, 0.3), "takes every step to be 0.3 m high"),
        (lambda dz, rise: round(reward_of_jump(dz, rise)), "count whole steps"),
        (lambda dz, rise: int(reward_of_jump(dz, rise)), "count whole steps"),
        (lambda dz, rise: 7.0, "expected was 1"),
    ],
)
@pytest.mark.parametrize("more", [0, 20])
def test_a_mistake_in_the_reward_is_named(function, words, more):
    assert words in answered(check_reward_of_jump, function, more=more)


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (reward_of_jump, "This is still the paper's reward"),
        (lambda dz, rise: dz / rise, "A change of 0.001 m is jitter and must earn 0; here it earns 0.003333"),
        (lambda dz, rise: dz / rise if dz > 0.05 else min(dz, 0), "A change of -0.001 m is jitter"),
        (lambda dz, rise: max(better_reward(dz, rise), 0), "Falls are free"),
        (lambda dz, rise: abs(better_reward(dz, rise)), "Falling is rewarded"),
        (lambda dz, rise: 0.5 * better_reward(dz, rise) if dz < 0 else better_reward(dz, rise), "go round and round"),
        (lambda dz, rise: better_reward(dz, rise) * abs(dz) / rise if dz > 0 else better_reward(dz, rise), "go round"),
        (lambda dz, rise: min(better_reward(dz, rise), 2), "3 single steps earn 3"),
        (lambda dz, rise: min(better_reward(dz, rise), 0), "must earn something"),
        (lambda dz, rise: float("nan"), "must be a finite number"),
    ],
)
def test_a_flaw_of_a_better_reward_is_named(function, words):
    assert words in answered(check_better_reward, function, more=2)


@pytest.mark.parametrize(
    "function",
    [
        lambda dz, rise: round(dz / rise),
        lambda dz, rise: 10 * better_reward(dz, rise),
        lambda dz, rise: better_reward(dz, rise) * (2 if dz < 0 else 1),
        lambda dz, rise: np.float64(better_reward(dz, rise)),
    ],
)
def test_there_is_more_than_one_better_reward(function):
    assert check_better_reward(function, more=10)


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (lambda observation, motions: motions[1], "returned the motion"),
        (lambda observation, motions: 1.0, "not a whole number"),
        (lambda observation, motions: True, "not a whole number"),
        (lambda observation, motions: 10, "the numbers 0 to 9"),
        (lambda observation, motions: -1, "the numbers 0 to 9"),
        (lambda observation, motions: 7, "in leaps: the return is 3"),
        (lambda observation, motions: 1, "stuck on step"),
        (lambda observation, motions: 6, "stuck on step 0"),
        (lambda observation, motions: 7 if observation[3] < 0.06 else 1, "out of jumps"),
    ],
)
def test_a_mistake_in_a_policy_is_named(function, words):
    assert words in answered(check_climb, function)


def test_a_policy_that_is_a_zero_dimensional_array_counts_as_its_number():
    assert check_climb(lambda observation, motions: np.array(climb(observation, motions)))


def test_a_policy_for_fifteen_steps_only_is_found_out_on_other_stairs():
    def from_the_ground(observation, motions):
        return climb(observation, motions) if observation[2] < 2 or observation[1] > 3 else 0

    def up_to_fifteen(observation, motions):
        return climb(observation, motions) if observation[2] < 4.5 else 0

    assert check_climb(up_to_fifteen)
    assert "On stairs of" in check_climb(up_to_fifteen, more=20).words
    assert not check_climb(lambda observation, motions: 9 if observation[2] > 1 else climb(observation, motions))
    assert check_climb(from_the_ground)


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (lambda env: True, "content with every environment"),
        (lambda env: False, "calls the environment wrong that keeps all its promises"),
        (lambda env: 1, "must return True or False"),
        (looks_at("rewards", "observation", "end", "time"), "leaves the cube where it is when it is reset"),
        (looks_at("rewards", "observation", "end", "reset"), "go on after 50 jumps"),
        (
            looks_at("rewards", "observation", "reset", "time"),
            "goes on after the cube has come to rest on the last tread",
        ),
        (looks_at("rewards", "end", "reset", "time"), "where it was before the jump"),
        (looks_at("observation", "end", "reset", "time"), "pays once more"),
    ],
)
def test_a_test_that_misses_a_bug_is_told_which(function, words):
    assert words in answered(check_env_is_right, function)


@pytest.mark.parametrize(
    ("left_out", "words"), [("leap", "three times as much"), ("rewards", "takes a little for a hop")]
)
def test_the_hidden_tests_have_two_more_broken_environments(left_out, words):
    test = looks_at(*(promise for promise in PROMISES if promise != left_out))
    assert check_env_is_right(test)
    assert words in check_env_is_right(test, more=20).words


def test_a_test_that_raises_in_a_broken_environment_is_told_not_raised():
    def asserts(env):
        env.reset()
        assert env.step(SINGLE)[0][2] > 0.3
        return True

    assert "AssertionError" in check_env_is_right(asserts).words
