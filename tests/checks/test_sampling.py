"""What the checks of lesson 02 say of solutions, of usual mistakes, and of what else is special to them."""

import random
from functools import partial

import numpy as np
import pytest

from stairlab import StairWorld
from stairlab.checks import check_draw_motions, check_effects_on_map, check_motion_sampling, check_standard_error

from .verdicts import answered, assert_right


def effects_on_map(starts, ends, on_map):
    return (ends - starts)[on_map][:, 1:3]


def draw_motions(n, low, high, rng):
    return low + (high - low) * rng.random((n, len(low)))


def motion_sampling(world, n, rng, *, resets=True, effect=lambda s, e: e - s, turns=0):
    motions, effects = [], []
    for _ in range(n + turns):
        if resets:
            world.reset()
        motion = rng.uniform(world.motion_low, world.motion_high)
        outcome = world.perform(motion)
        motions.append(motion)
        effects.append(effect(outcome.start, outcome.end))
    return np.array(motions), np.array(effects)


def standard_error(hits):
    share = np.mean(hits)
    return np.sqrt(share * (1 - share) / len(hits))


SOLUTIONS = {
    check_effects_on_map: effects_on_map,
    check_draw_motions: draw_motions,
    check_motion_sampling: motion_sampling,
    check_standard_error: standard_error,
}


@pytest.mark.parametrize(("check", "solution"), SOLUTIONS.items())
def test_the_solution_is_right(check, solution):
    assert_right(check, solution)


def loops(n, low, high, rng):
    return [[rng.uniform(a, b) for a, b in zip(low, high, strict=True)] for _ in range(n)]


def by_uniform(n, low, high, rng):
    return rng.uniform(low, high, (n, len(low)))


def columns_first(n, low, high, rng):
    return np.column_stack([rng.uniform(a, b, n) for a, b in zip(low, high, strict=True)])


@pytest.mark.parametrize("sampler", [loops, by_uniform, columns_first])
def test_any_way_to_draw_uniformly_is_right(sampler):
    assert check_draw_motions(sampler, more=3)


def with_jump(world, n, rng):
    pairs = []
    for _ in range(n):
        before = world.reset()
        motion = draw_motions(1, world.motion_low, world.motion_high, rng)[0]
        pairs.append((motion, world.jump(*motion).end - before))
    return [motion for motion, _ in pairs], [effect for _, effect in pairs]


def test_a_loop_that_jumps_and_returns_lists_is_right_and_works_in_the_world_of_the_stairs():
    assert check_motion_sampling(with_jump, more=5)
    motions, effects = motion_sampling(StairWorld(), 3, np.random.default_rng(0))
    assert motions.shape == (3, 2)
    assert effects.shape == (3, 8)


def scaled(u, low, high):
    return low + (high - low) * u


def walking(world, n, rng):
    """The effect is measured from the very first state, and nothing is put back."""
    first = world.reset()
    return motion_sampling(world, n, rng, resets=False, effect=lambda s, e: e - first)


def put_back_afterwards(world, n, rng):
    class Late:
        motion_low, motion_high = world.motion_low, world.motion_high

        def perform(self, motion):
            outcome = world.perform(motion)
            world.reset()
            return outcome

    return motion_sampling(Late(), n, rng, resets=False)


def of_one_motion(world, n, rng):
    motion = rng.uniform(world.motion_low, world.motion_high)
    outcomes = []
    for _ in range(n):
        world.reset()
        outcomes.append(world.perform(motion))
    return np.tile(motion, (n, 1)), np.array([one.end - one.start for one in outcomes])


def of_other_motions(world, n, rng):
    motions, effects = motion_sampling(world, n, rng)
    return motions + 0.1, effects


def of_no_generator(world, n, rng):
    return motion_sampling(world, n, np.random.default_rng())


def without_last(world, n, rng):
    motions, effects = motion_sampling(world, n, rng)
    return motions[:-1], effects[:-1]


def too_wide(world, n, rng):
    class Wide:
        motion_low, motion_high = world.motion_low - 9, world.motion_high
        reset, perform = world.reset, world.perform

    return motion_sampling(Wide(), n, rng)


def fresh(n, low, high, rng):
    return draw_motions(n, low, high, np.random.default_rng(0))


def of_the_global_generator(n, low, high, rng):
    return scaled(np.array([[random.random() for _ in low] for _ in range(n)]), low, high)


MISTAKES = [
    (check_effects_on_map, lambda s, e, m: effects_on_map(e, s, m), "start minus end"),
    (check_effects_on_map, lambda s, e, m: (e - s)[:, 1:3], "of all jumps"),
    (check_effects_on_map, lambda s, e, m: (e - s)[~m][:, 1:3], "off the map"),
    (check_effects_on_map, lambda s, e, m: np.diff(e, axis=0)[m[1:]][:, 1:3], "from the next one"),
    (check_effects_on_map, lambda s, e, m: (e - s)[m][:, :2], "dx and dy"),
    (check_effects_on_map, lambda s, e, m: (e - s)[m][:, [2, 1]], "exchanged"),
    (check_effects_on_map, lambda s, e, m: np.abs(e - s)[m][:, 1:3], "signs are lost"),
    (check_effects_on_map, lambda s, e, m: (e - s)[m], "all eight"),
    (check_effects_on_map, lambda s, e, m: e[m][:, 1:3], "where the jumps ended"),
    (check_draw_motions, lambda n, a, b, rng: draw_motions(n + 1, a, b, rng), "a turn too many"),
    (check_draw_motions, lambda n, a, b, rng: draw_motions(n - 1, a, b, rng), "one turn too few"),
    (check_draw_motions, lambda n, a, b, rng: draw_motions(n, a, b, rng).T, "a row for each parameter"),
    (check_draw_motions, lambda n, a, b, rng: draw_motions(n, a, b, rng).ravel(), "the shape must be"),
    (check_draw_motions, lambda n, a, b, rng: rng.integers(a, b + 1, (n, len(a))), "whole numbers"),
    (check_draw_motions, lambda n, a, b, rng: scaled(rng.integers(0, 101, (n, len(a))) / 100, a, b), "in steps"),
    (check_draw_motions, lambda n, a, b, rng: scaled(rng.random((n, 1)), a, b), "on a diagonal"),
    (check_draw_motions, lambda n, a, b, rng: scaled(rng.normal(0.5, 1 / 6, (n, len(a))).clip(0, 1), a, b), "middle"),
    (check_draw_motions, lambda n, a, b, rng: scaled(rng.random((n, len(a))) ** 2, a, b), "not uniform"),
    (check_draw_motions, lambda n, a, b, rng: (b - a) * rng.random((n, len(a))), "begin at 0"),
    (check_draw_motions, lambda n, a, b, rng: a + b * rng.random((n, len(a))), "outside the limits"),
    (check_draw_motions, lambda n, a, b, rng: np.tile(draw_motions(1, a, b, rng), (n, 1)), "same motion comes again"),
    (check_draw_motions, lambda n, a, b, rng: draw_motions(n, a, b, rng) / 0 * 0, "not finite"),
    (check_draw_motions, fresh, "a generator of its own"),
    (check_draw_motions, of_the_global_generator, "must come from rng"),
    (check_motion_sampling, partial(motion_sampling, turns=1), "N >= i"),
    (check_motion_sampling, partial(motion_sampling, turns=-1), "4 motions were performed for N = 5"),
    (check_motion_sampling, partial(motion_sampling, resets=False), "not put back"),
    (check_motion_sampling, walking, "not put back"),
    (check_motion_sampling, put_back_afterwards, "Reset it before each motion"),
    (check_motion_sampling, partial(motion_sampling, effect=lambda s, e: e), "where each motion ended"),
    (check_motion_sampling, partial(motion_sampling, effect=lambda s, e: s - e), "wrong way round"),
    (check_motion_sampling, partial(motion_sampling, effect=lambda s, e: 2 * (e - s)), "came the effect"),
    (check_motion_sampling, of_one_motion, "same motion"),
    (check_motion_sampling, of_other_motions, "not those that the world performed"),
    (check_motion_sampling, of_no_generator, "must come from rng"),
    (check_motion_sampling, without_last, "a row for each"),
    (check_motion_sampling, too_wide, "must lie between"),
    (check_standard_error, lambda hits: standard_error(hits) ** 2, "variance"),
    (check_standard_error, lambda hits: np.std(hits), "a single jump"),
    (check_standard_error, lambda hits: np.std(hits) / len(hits), "outside the root"),
    (check_standard_error, lambda hits: np.std(hits, ddof=1) / np.sqrt(len(hits)), "N - 1"),
    (check_standard_error, lambda hits: 100 * standard_error(hits), "percent"),
    (check_standard_error, lambda hits: 2 * standard_error(hits), "two standard errors"),
]


@pytest.mark.filterwarnings("ignore:divide by zero", "ignore:invalid value")
@pytest.mark.parametrize(("check", "mistake", "words"), MISTAKES, ids=[words for _, _, words in MISTAKES])
@pytest.mark.parametrize("more", [0, 20])
def test_usual_mistakes_are_recognised(check, mistake, words, more):
    assert words in answered(check, mistake, more=more)


def test_sampling_without_end_is_stopped_by_the_world():
    def endless(world, n, rng):
        while True:
            world.perform(rng.uniform(world.motion_low, world.motion_high))

    assert "does the loop end?" in repr(check_motion_sampling(endless))


def test_an_answer_that_changes_its_input_is_told_so():
    def shifted(n, low, high, rng):
        high -= low
        return low + high * rng.random((n, len(low)))

    def careless(starts, ends, on_map):
        ends -= starts
        return ends[on_map][:, 1:3]

    assert "Work on a copy" in repr(check_draw_motions(shifted))
    assert "Work on a copy" in repr(check_effects_on_map(careless))
