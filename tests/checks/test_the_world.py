"""What the checks of lesson 01 say of solutions, of usual mistakes, and of what else is special to them."""

import math

import numpy as np
import pytest

from stairlab import Staircase, StairWorld
from stairlab.checks import check_effect, check_height_at, check_velocity_after_push, check_ways_out

from .verdicts import answered, assert_right

G, TAU = 9.81, 0.01


def effect(start, end):
    return end - start


def velocity_after_push(magnitude, angle, mass):
    angle = math.radians(angle)
    return magnitude * math.cos(angle) / mass * TAU, (magnitude * math.sin(angle) / mass - G) * TAU


def height_at(speed, angle, distance):
    angle = math.radians(angle)
    time = distance / (speed * math.cos(angle))
    return speed * math.sin(angle) * time - G * time**2 / 2


def ways_out(motions, gap, rise, pull=G, radians=np.radians):
    magnitude, angle = motions.T
    v_y = magnitude * np.cos(radians(angle)) * TAU
    v_z = (magnitude * np.sin(radians(angle)) - pull) * TAU
    time = gap / v_y
    return v_z * time - G * time**2 / 2 > rise


SOLUTIONS = {
    check_effect: effect,
    check_velocity_after_push: velocity_after_push,
    check_height_at: height_at,
    check_ways_out: ways_out,
}


def mistaken(right, *, angle=lambda a: a, result=lambda r: r, **changed):
    """Return a solution with another idea of its angle, or of its result."""

    def function(first, second, third):
        return result(right(first, angle(second), third))

    return function


def tangent_rule(motions, gap, rise):
    return np.tan(np.radians(motions[:, 1])) > rise / gap


def without_root(motions, gap, rise):
    magnitude, angle = motions.T
    v_z = (magnitude * np.sin(np.radians(angle)) - G) * TAU
    return v_z**2 / (2 * G) > rise


def in_degrees(motions, gap, rise):
    return ways_out(motions, gap, rise, radians=np.asarray)


def without_gravity_in_the_push(motions, gap, rise):
    return ways_out(motions, gap, rise, pull=0.0)


def high_before_the_riser(motions, gap, rise):
    magnitude, angle = motions.T
    v_y = magnitude * np.cos(np.radians(angle)) * TAU
    v_z = (magnitude * np.sin(np.radians(angle)) - G) * TAU
    under_root = v_z**2 - 2 * G * rise
    time = (v_z - np.sqrt(np.maximum(under_root, 0))) / G
    return (under_root > 0) & (v_y * time < gap)


def heights(time_of, half=0.5):
    def function(speed, angle, distance):
        angle = math.radians(angle)
        time = time_of(speed, angle, distance)
        return distance * math.tan(angle) - half * G * time**2

    return function


MISTAKES = [
    (check_effect, lambda s, e: s - e, "wrong way round"),
    (check_effect, lambda s, e: abs(e - s), "sign"),
    (check_effect, lambda s, e: np.linalg.norm(e - s), "length"),
    (check_effect, lambda s, e: (e - s)[1:3], "dy and dz only"),
    (check_effect, lambda s, e: e.copy(), "where the jump ended"),
    (check_velocity_after_push, mistaken(velocity_after_push, angle=math.degrees), "radians"),
    (check_velocity_after_push, mistaken(velocity_after_push, angle=lambda a: 90 - a), "changed places"),
    (
        check_velocity_after_push,
        mistaken(velocity_after_push, result=lambda v: (v[0], v[1] + G * TAU)),
        "Gravity is missing",
    ),
    (check_velocity_after_push, mistaken(velocity_after_push, result=lambda v: math.hypot(*v)), "one number"),
    (check_velocity_after_push, lambda f, a, m: velocity_after_push(f, a, 1.0), "mass is missing"),
    (
        check_velocity_after_push,
        lambda f, a, m: (f * math.cos(math.radians(a)) * TAU / m, (f * math.sin(math.radians(a)) - G) * TAU / m),
        "divided by the mass",
    ),
    (check_height_at, mistaken(height_at, angle=math.degrees), "radians"),
    (check_height_at, heights(lambda v, a, x: x / (v * math.cos(a)), half=1.0), "half is missing"),
    (check_height_at, heights(lambda v, a, x: x / v), "forward part"),
    (check_height_at, heights(lambda v, a, x: x / (v * math.sqrt(math.cos(a)))), "squared"),
    (check_height_at, heights(lambda v, a, x: 0.0), "straight line"),
    (check_height_at, mistaken(height_at, result=lambda z: max(z, 0.0)), "negative"),
    (check_ways_out, tangent_rule, "fast push"),
    (check_ways_out, lambda m, g, h: tangent_rule(m, h, g), "upside down"),
    (check_ways_out, in_degrees, "radians"),
    (check_ways_out, high_before_the_riser, "come down again"),
    (check_ways_out, without_gravity_in_the_push, "during the push"),
    (check_ways_out, without_root, "must go"),
    (check_ways_out, lambda m, g, h: np.flatnonzero(ways_out(m, g, h)), "row numbers"),
]


@pytest.mark.parametrize(("check", "solution"), SOLUTIONS.items())
def test_the_solution_is_right_also_for_further_inputs(check, solution):
    assert_right(check, solution)


@pytest.mark.parametrize(("check", "mistake", "words"), MISTAKES)
@pytest.mark.parametrize("more", [0, 20])
def test_a_usual_mistake_is_recognised_by_name(check, mistake, words, more):
    assert words in answered(check, mistake, more=more)


def test_an_effect_that_changes_its_input_is_not_right():
    def careless(start, end):
        end -= start
        return end

    assert "changes its input" in check_effect(careless).words


def test_ways_out_agrees_with_the_simulation_for_nearly_all_motions():
    world = StairWorld(Staircase.fifteen())
    rng = np.random.default_rng(0)
    motions = np.column_stack([rng.uniform(300, 1000, 60), rng.uniform(60, 89, 60)])
    simulated = []
    for motion in motions.tolist():
        world.reset(world.state_at(0.55 - 0.06, 0.05))
        simulated.append(world.jump(*motion).dz > 0.15)
    assert np.mean(ways_out(motions, 0.06, 0.3) == simulated) > 0.9
