"""Checks of lesson 01, the world."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from stairlab.checks._judge import Mistake, Verdict, judge

_GRAVITY = 9.81
_PUSH_TIME = 0.01
_STATES = (
    (0.0, 0.25, 0.05, 0.0, 0.0, 0.0, 1.0, 0.35),
    (0.0, 1.349, 0.65, 0.0, 0.0, 0.0, 1.0, 0.051),
    (0.02, 0.879, 0.35, 0.7071, 0.0, 0.0, 0.7071, 0.121),
)
""" States of a cube: at the start, two steps up, and one step up on its side """


def _effect(start: Any, end: Any) -> Any:
    return np.asarray(end) - np.asarray(start)


def check_effect(function: Any, more: int = 0) -> Verdict:
    """Check ``effect(start, end)``: the effect e = s' - s of a jump, all features, shape (8,) (equation 1).

    The usual mistakes: the difference the wrong way round; without its sign; one length instead of eight numbers; only some features.
    """
    rng = np.random.default_rng(10)
    first, second, third = (np.array(state) for state in _STATES)
    cases = [(first, second), (second, third), (third, first)]
    cases += [(rng.normal(size=8), rng.normal(size=8)) for _ in range(more)]
    mistakes = [
        Mistake(
            "This is s - s', the wrong way round: a jump that gains height must have a positive dz.",
            lambda start, end: _effect(end, start),
        ),
        Mistake(
            "This is without its sign: a fall and a climb of the same height would be the same effect.",
            lambda start, end: np.abs(_effect(start, end)),
        ),
        Mistake(
            "This is the length of the effect, one number; an effect has a number for each of the eight features.",
            lambda start, end: np.linalg.norm(_effect(start, end)),
        ),
        Mistake(
            "These are dy and dz only. Equation 1 takes the whole state; which features count is decided later.",
            lambda start, end: _effect(start, end)[1:3],
        ),
        Mistake(
            "This is where the jump ended, s', not what it changed.",
            lambda start, end: end,
        ),
    ]
    return judge(
        "effect", function, _effect, cases, mistakes, "This is equation 1, and all that later lessons see of a jump."
    )


def _velocity(magnitude: float, angle: float, mass: float) -> tuple[float, float]:
    forward, up = magnitude * math.cos(math.radians(angle)), magnitude * math.sin(math.radians(angle))
    return forward / mass * _PUSH_TIME, (up / mass - _GRAVITY) * _PUSH_TIME


def check_velocity_after_push(function: Any, more: int = 0) -> Verdict:
    """Check ``velocity_after_push(magnitude, angle, mass)``: (v_y, v_z) [m/s] after 0.01 s of a force and of gravity.

    The usual mistakes: degrees given to ``math.sin``; sine and cosine exchanged; gravity forgotten, or divided by the mass; the
    mass forgotten; the speed instead of its two parts.
    """
    rng = np.random.default_rng(11)
    cases = [(450.0, 65.0, 1.0), (200.0, 30.0, 2.0), (100.0, 80.0, 0.5)]
    cases += [tuple(rng.uniform((100, 15, 0.5), (1000, 85, 2.0)).tolist()) for _ in range(more)]

    def turned(magnitude: float, angle: float, mass: float) -> tuple[float, float]:
        v_y, v_z = _velocity(magnitude, 90 - angle, mass)
        return v_y, v_z

    mistakes = [
        Mistake(
            "math.sin and math.cos take radians, the angle is in degrees: math.radians(angle) converts.",
            lambda magnitude, angle, mass: _velocity(magnitude, math.degrees(angle), mass),
        ),
        Mistake(
            "Sine and cosine have changed places: the angle is measured from the ground, so that the forward part has the cosine.",
            turned,
        ),
        Mistake(
            "Gravity is missing: while the force acts, it takes g τ off the upward part.",
            lambda magnitude, angle, mass: _shifted(_velocity(magnitude, angle, mass), _GRAVITY * _PUSH_TIME),
        ),
        Mistake(
            "Gravity is divided by the mass, but it accelerates light and heavy cubes alike: its part is g τ.",
            lambda magnitude, angle, mass: _shifted(
                _velocity(magnitude, angle, mass), _GRAVITY * _PUSH_TIME * (1 - 1 / mass)
            ),
        ),
        Mistake(
            "The mass is missing: the same force makes a heavy cube slower.",
            lambda magnitude, angle, mass: _velocity(magnitude, angle, 1.0),
        ),
        Mistake(
            "This is the speed, one number; the velocity has a forward and an upward part.",
            lambda magnitude, angle, mass: math.hypot(*_velocity(magnitude, angle, mass)),
        ),
    ]
    praise = "For the strongest push gravity's share is one hundredth; for the weakest it decides whether the cube takes off."
    return judge("velocity_after_push", function, _velocity, cases, mistakes, praise)


def _shifted(velocity: tuple[float, float], up: float) -> tuple[float, float]:
    return velocity[0], velocity[1] + up


def _height(gravity: float = _GRAVITY / 2, power: int = 2) -> Callable[[float, float, float], float]:
    """Return the right function, or with other numbers a mistaken one."""

    def height(speed: float, angle: float, distance: float) -> float:
        steep, flat = math.tan(math.radians(angle)), math.cos(math.radians(angle))
        return distance * steep - gravity * distance**2 / (speed**2 * flat**power)

    return height


def check_height_at(function: Any, more: int = 0) -> Verdict:
    """Check ``height_at(speed, angle, distance)``: how high above its start a thrown point is after a way forward [m].

    The usual mistakes: degrees given to ``math.tan``; the half of g t²/2 forgotten; the whole speed taken for the forward one; no
    gravity; no height below the start.
    """
    rng = np.random.default_rng(12)
    cases = [(4.0, 60.0, 0.3), (3.0, 45.0, 1.2), (6.0, 30.0, 2.0)]
    cases += [tuple(rng.uniform((2, 5, 0.1), (10, 85, 2)).tolist()) for _ in range(more)]
    right = _height()
    mistakes = [
        Mistake(
            "math.tan and math.cos take radians, the angle is in degrees: math.radians(angle) converts.",
            lambda speed, angle, distance: right(speed, math.degrees(angle), distance),
        ),
        Mistake(
            "The half is missing: in the time t, gravity pulls the cube down by g t² / 2.",
            _height(gravity=_GRAVITY),
        ),
        Mistake(
            "The time is distance / speed here, but only the forward part of the speed counts: v cos α.",
            _height(power=0),
        ),
        Mistake(
            "The cosine must be squared, as the time is: t = distance / (v cos α), and gravity takes g t² / 2.",
            _height(power=1),
        ),
        Mistake(
            "Below the start the height is negative; nothing stops a point that is thrown over an edge.",
            lambda speed, angle, distance: max(right(speed, angle, distance), 0.0),
        ),
        Mistake(
            "This is the straight line of the push; gravity takes g t² / 2 off it.",
            _height(gravity=0.0),
        ),
    ]
    praise = "Where it is 0 again, at v² sin(2α) / g, is the range."
    return judge("height_at", function, right, cases, mistakes, praise)


def _ways_out(motions: Any, gap: float, rise: float, light: float = 0.0) -> np.ndarray:
    v_y, v_z = _parts(motions, light)
    time = gap / v_y
    return v_z * time - _GRAVITY * time**2 / 2 > rise


def _parts(motions: Any, light: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return the velocity after the push, forward and up; ``light``: without that share of gravity."""
    magnitude, angle = np.asarray(motions, dtype=float).T
    forward, up = magnitude * np.cos(np.radians(angle)), magnitude * np.sin(np.radians(angle))
    return forward * _PUSH_TIME, (up - (1 - light) * _GRAVITY) * _PUSH_TIME


def _high_before(motions: Any, gap: float, rise: float) -> np.ndarray:
    """Whether the cube is as high as the step at any time before it meets the riser."""
    v_y, v_z = _parts(motions)
    under_root = v_z**2 - 2 * _GRAVITY * rise
    time = (v_z - np.sqrt(np.maximum(under_root, 0))) / _GRAVITY
    return (under_root > 0) & (v_y * time < gap)


def check_ways_out(function: Any, more: int = 0) -> Verdict:
    """Check ``ways_out(motions, gap, rise)``: which motions pass the edge of a riser, True or False for each, shape (n,).

    The usual mistakes: the rule for a fast push, which lets weak ones out; its ratio upside down; degrees given to ``np.sin``; high
    enough, but too late or only before the riser; no gravity during the push; row numbers instead of True and False.
    """
    rng = np.random.default_rng(13)
    some = np.array(
        [(250, 81), (260, 75), (260, 86), (260, 89), (500, 75), (500, 89), (1000, 45), (1000, 89)], dtype=float
    )
    cases = [(some, 0.02, 0.3), (some, 0.1, 0.3), (some, 0.1, 0.05)]
    for _ in range(more):
        motions = np.column_stack([rng.uniform(50, 1000, 20), rng.uniform(30, 89, 20)])
        cases.append((motions, float(rng.uniform(0.01, 0.2)), float(rng.uniform(0.1, 0.5))))

    def steep(motions: np.ndarray, ratio: float) -> np.ndarray:
        return np.tan(np.radians(motions[:, 1])) > ratio

    mistakes = [
        Mistake(
            "This is the rule for a fast push, tan α > h/g. A weak push does not get as high as the step at all, and gravity "
            "bends the paths of the others: find out how high the cube is when it comes to the riser.",
            lambda motions, gap, rise: steep(motions, rise / gap),
        ),
        Mistake(
            "The ratio is upside down: the smaller the gap, the steeper a motion must be. (And gravity is missing.)",
            lambda motions, gap, rise: steep(motions, gap / rise),
        ),
        Mistake(
            "np.sin and np.cos take radians, the angles are in degrees: np.radians(angles) converts.",
            lambda motions, gap, rise: _ways_out(
                np.column_stack([motions[:, 0], np.degrees(motions[:, 1])]), gap, rise
            ),
        ),
        Mistake(
            "These are the motions that are as high as the step at some time before they meet the riser. The weak and steep of them "
            "come down again before it: what counts is the height at the riser.",
            _high_before,
        ),
        Mistake(
            "Gravity acts during the push, too: v_z is less by g τ, as in exercise 2.",
            lambda motions, gap, rise: _ways_out(motions, gap, rise, light=1.0),
        ),
        Mistake(
            "These are the motions that get as high as the step; those that meet the riser before must go.",
            lambda motions, gap, rise: _high_before(motions, math.inf, rise),
        ),
        Mistake(
            "These are the row numbers of the right motions. Return True or False for each motion instead.",
            lambda motions, gap, rise: np.flatnonzero(_ways_out(motions, gap, rise)),
        ),
    ]
    praise = "The simulation agrees for nearly all motions; a cube that catches the edge may still tip over it."
    return judge("ways_out", function, _ways_out, cases, mistakes, praise)
