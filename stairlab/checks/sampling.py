"""Checks of lesson 02, sampling."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from stairlab.checks._judge import Mistake, Verdict, attempt_call, described, judge, same

FARTHEST_FROM_UNIFORM = 3.0
""" A sample of n numbers is not uniform if its distribution function is off by more than this over the root of n """
SPACES = (
    (np.array([50.0, 1.0]), np.array([1000.0, 89.0])),
    (np.array([-2.0, 10.0, 0.0]), np.array([3.0, 12.0, 0.5])),
)
""" Motion spaces that samplers are tried on: that of the cube, and one of three parameters """


def check_effects_on_map(function: Any, more: int = 0) -> Verdict:
    """Check ``effects_on_map(starts, ends, on_map)``: dy and dz of the jumps that ended on the map, shape (n_on_map, 2).

    The usual mistakes: the difference the wrong way round; all jumps; those off the map; equation 1 read as the difference of
    consecutive rows; x and y instead of y and z; y and z exchanged; all eight features; the size without the sign.
    """

    def right(starts: np.ndarray, ends: np.ndarray, on_map: np.ndarray) -> np.ndarray:
        return (ends - starts)[on_map][:, 1:3]

    rng = np.random.default_rng(20)
    cases = [_some_jumps(rng, n) for n in (4, 7, 12, *rng.integers(4, 30, more).tolist())]
    mistakes = [
        Mistake(
            "This is start minus end: a jump that gains height must have a positive dz.",
            lambda starts, ends, on_map: right(ends, starts, on_map),
        ),
        Mistake(
            "These are the effects of all jumps; those that ended off the map are left out: effects[on_map].",
            lambda starts, ends, on_map: right(starts, ends, np.ones_like(on_map)),
        ),
        Mistake(
            "These are the jumps that ended off the map: the mask is the wrong way round.",
            lambda starts, ends, on_map: right(starts, ends, ~on_map),
        ),
        Mistake(
            "This subtracts each end from the next one. The index t of equation 1 counts within one jump: the cube is put back before "
            "every jump, so subtract that jump's own start.",
            lambda starts, ends, on_map: right(ends[:-1], ends[1:], on_map[1:]),
        ),
        Mistake(
            "These are dx and dy. The features are x, y, z, ..., counted from 0: dy and dz are the columns 1 and 2.",
            lambda starts, ends, on_map: (ends - starts)[on_map][:, :2],
        ),
        Mistake(
            "The columns are exchanged: dy comes first, then dz.",
            lambda starts, ends, on_map: right(starts, ends, on_map)[:, ::-1],
        ),
        Mistake(
            "The signs are lost: a jump down has a negative dz, which the absolute value turns into a jump up.",
            lambda starts, ends, on_map: np.abs(right(starts, ends, on_map)),
        ),
        Mistake(
            "This has all eight features; the clustering gets dy and dz only.",
            lambda starts, ends, on_map: (ends - starts)[on_map],
        ),
        Mistake(
            "This is where the jumps ended, s', not what they changed, s' - s.",
            lambda starts, ends, on_map: ends[on_map][:, 1:3],
        ),
    ]
    return judge("effects_on_map", function, right, cases, mistakes, "This is what the clustering gets to see.")


def _some_jumps(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Draw made-up starts, ends and flags of ``n`` jumps, some on the map and some off."""
    starts = np.round(rng.uniform(0, 2, (n, 8)), 2)
    ends = np.round(rng.uniform(0, 3, (n, 8)), 2)
    on_map = rng.permutation(np.arange(n) < 2 * n // 3)
    return starts, ends, on_map


def check_draw_motions(function: Any, more: int = 0) -> Verdict:
    """Check ``draw_motions(n, low, high, rng)``: n motions, uniform over the motion space, shape (n, n_parameters).

    As it draws, only the distribution is checked, and that it comes from ``rng``. The usual mistakes: n + 1 motions; whole numbers, or
    steps; one random number for all parameters; a normal distribution; a range from 0; the global generator; a generator made anew.
    """
    name = "draw_motions"
    for seed in range(2 + more):
        low, high = SPACES[seed % 2]
        n = 1500 + 7 * seed
        rng = np.random.default_rng(seed)
        drawn = []
        for generator in (rng, np.random.default_rng(seed), rng):  # twice from the same seed, then further on
            bounds = low.copy(), high.copy()
            attempt = attempt_call(name, function, (n, *bounds, generator))
            if attempt.problem:
                return Verdict(False, attempt.problem)
            if not same(bounds, (low, high)):
                return Verdict(False, f"Not yet: {name} changes its limits low and high. Work on a copy.")
            drawn.append(attempt.value)
        if problem := _shape_problem(drawn[0], n, len(low)) or _generator_problem(*drawn):
            return Verdict(False, problem)
        if problem := _uniformity_problem(np.asarray(drawn[0], float), low, high):
            return Verdict(False, problem)
    return Verdict(True, "Right. Every motion is as likely as any other, and equal seeds give equal motions.")


def _shape_problem(drawn: Any, n: int, parameters: int) -> str:
    try:
        array = np.asarray(drawn, dtype=float)
    except Exception:  # not numbers, or an object of a student's that fails
        return f"Not yet: draw_motions must return an array of numbers, not {described(drawn)}."
    if array.shape == (n + 1, parameters):
        return (
            f"Not yet. These are {n + 1} motions where {n} were asked for: a turn too many, as Algorithm 1 is printed."
        )
    if array.shape == (n - 1, parameters):
        return f"Not yet. These are {n - 1} motions where {n} were asked for: the loop makes one turn too few."
    if array.shape == (parameters, n):
        return f"Not yet. The shape is ({parameters}, {n}), a row for each parameter; it must be a row for each motion."
    if array.shape != (n, parameters):
        return f"Not yet: the shape must be ({n}, {parameters}), a row for each motion, not {array.shape}."
    return "" if np.isfinite(array).all() else "Not yet: there are numbers among the motions that are not finite."


def _generator_problem(first: Any, again: Any, later: Any) -> str:
    if not same(first, again):
        return (
            "Not yet. Two generators with the same seed gave different motions: every random number must come from rng, none from "
            "np.random or the module random."
        )
    if same(first, later):
        return (
            "Not yet. Two calls, one after the other, gave the same motions: the function makes a generator of its own each "
            "time. Draw from the rng that it is given."
        )
    return ""


def _uniformity_problem(drawn: np.ndarray, low: np.ndarray, high: np.ndarray) -> str:
    if (drawn < low).any() or (drawn > high).any():
        if ((drawn >= 0) & (drawn <= high - low)).all():
            return "Not yet. The motions begin at 0: scale by high - low, and add low."
        worst = np.argwhere((drawn < low) | (drawn > high))[0]
        return f"Not yet: the motion {described(drawn[worst[0]])} lies outside the limits {described(low)} to {described(high)}."
    u = (drawn - low) / (high - low)
    if len(np.unique(drawn, axis=0)) < len(drawn) / 20:
        return "Not yet. The same motion comes again and again: draw anew for each of them."
    if (whole := (drawn % 1 == 0).all(axis=0)).any():
        return (
            f"Not yet. Parameter {int(np.argmax(whole))} (counted from 0) is drawn in whole numbers: between two of them lie "
            "motions that are never tried. Draw real numbers, as with rng.uniform or rng.random."
        )
    if (stepped := np.array([len(np.unique(column)) < 0.9 * len(column) for column in drawn.T])).any():
        return (
            f"Not yet. Parameter {int(np.argmax(stepped))} (counted from 0) is drawn in steps: between two of its values lie motions "
            "that are never tried. Draw real numbers, as with rng.uniform or rng.random."
        )
    if np.abs(np.corrcoef(u.T)[0, 1]) > 0.9:
        return (
            "Not yet. One random number is used for all parameters of a motion, so that all lie on a diagonal of the motion space: "
            "draw one for each parameter."
        )
    heights = np.arange(1, len(u) + 1)[:, None] / len(u)
    if np.abs(np.sort(u, axis=0) - heights).max() > FARTHEST_FROM_UNIFORM / np.sqrt(len(u)):
        if u.std(axis=0).max() < 0.25:
            return "Not yet. The motions gather about the middle: a normal distribution, or a mean of several numbers, is not uniform."
        return "Not yet. The motions are not uniform: some parts of the motion space are drawn more often than others."
    return ""


class _Track:
    """A small world for Algorithm 1: a thing that slides, by less the farther out it is; it notes what is done to it.

    Whoever gets it finds it somewhere, and not in its initial state.
    """

    motion_names = ("push", "turn")
    feature_names = ("a", "b")

    def __init__(self, most: int) -> None:
        self.motion_low = np.array([1.0, -2.0])
        self.motion_high = np.array([5.0, 2.0])
        self.performed: list[np.ndarray] = []
        self.most = most
        self._state = self.found

    def __repr__(self) -> str:
        return "a small world"

    @property
    def start(self) -> np.ndarray:
        return np.array([0.25, 0.05])

    @property
    def found(self) -> np.ndarray:
        return np.array([1.5, -0.75])

    @property
    def state(self) -> np.ndarray:
        return self._state.copy()

    def reset(self, state: np.ndarray | None = None) -> np.ndarray:
        self._state = self.start if state is None else np.array(state, dtype=float)
        return self.state

    def perform(self, motion: np.ndarray, rng: np.random.Generator | None = None) -> _Slide:
        if len(self.performed) >= self.most:
            raise RuntimeError(f"the world has performed {self.most} motions by now: does the loop end?")
        self.performed.append(np.array(motion, dtype=float))
        before = self.state
        self._state = self.end_of(motion, before)
        return _Slide(before, self.state)

    def jump(self, *motion: float) -> _Slide:
        return self.perform(np.array(motion))

    def end_of(self, motion: np.ndarray, state: np.ndarray) -> np.ndarray:
        """Return the state that a motion leads to."""
        return state + np.asarray(motion, float) / (1 + np.abs(state)) + 0.1


class _Slide:
    """What came of a motion."""

    on_map = True

    def __init__(self, start: np.ndarray, end: np.ndarray) -> None:
        self.start, self.end = start, end

    @property
    def effect(self) -> np.ndarray:
        return self.end - self.start


def check_motion_sampling(function: Any, more: int = 0) -> Verdict:
    """Check ``motion_sampling(world, n, rng)``: Algorithm 1, motions and effects as two arrays, a row for each sample.

    It is tried on a small world of the check's own. The usual mistakes: n + 1 motions; the world is not put back before each
    motion, or only after it; the effect is the end, or the wrong way round; the same motion again and again; random numbers from
    elsewhere.
    """
    name = "motion_sampling"
    for n in (5, 12, *range(3, 3 + more)):
        runs = []
        for _ in range(2):
            world = _Track(most=20 * n)
            attempt = attempt_call(name, function, (world, n, np.random.default_rng(n)))
            if attempt.problem:
                return Verdict(False, attempt.problem)
            runs.append((world, attempt.value))
        if problem := _sampling_problem(*runs[0], n):
            return Verdict(False, problem)
        if not same(np.array(runs[0][0].performed), np.array(runs[1][0].performed)):
            return Verdict(
                False, "Not yet. Equal seeds gave different motions: every random number must come from rng."
            )
    return Verdict(True, "Right. This is Algorithm 1, with N samples and not N + 1.")


def _sampling_problem(world: _Track, answer: Any, n: int) -> str:
    pair = _two_tables(answer)
    if pair is None:
        return f"Not yet: motion_sampling must return two arrays, motions and effects, not {described(answer)}."
    motions, effects = pair
    performed = np.array(world.performed).reshape(-1, 2)
    if len(performed) == n + 1:
        return (
            f"Not yet. {n + 1} motions were performed for N = {n}: the condition N >= i lets one turn too many through."
        )
    if len(performed) != n:
        return f"Not yet: {len(performed)} motions were performed for N = {n}."
    if motions.shape != (n, 2) or effects.shape != (n, 2):
        return (
            f"Not yet: motions and effects must have a row for each of {n} samples, but their shapes are {motions.shape} and "
            f"{effects.shape}."
        )
    if not same(motions, performed):
        return "Not yet. The motions that are returned are not those that the world performed."
    if n > 1 and (np.ptp(performed, axis=0) == 0).all():
        return "Not yet. The same motion is performed every time: draw a new one inside the loop."
    if (performed < world.motion_low).any() or (performed > world.motion_high).any():
        return f"Not yet: motions must lie between {described(world.motion_low)} and {described(world.motion_high)}."
    return _effects_problem(world, performed, effects)


def _effects_problem(world: _Track, performed: np.ndarray, effects: np.ndarray) -> str:
    ends = np.array([world.end_of(motion, world.start) for motion in performed])
    if same(effects, ends - world.start):
        return ""
    if same(effects, ends):
        return "Not yet. This stores where each motion ended, s'; the effect is s' - s."
    if same(effects, world.start - ends):
        return "Not yet. The difference is the wrong way round: the effect is s' - s."
    for first in (world.start, world.found):
        states = [first]
        for motion in performed:
            states.append(world.end_of(motion, states[-1]))
        walk = np.array(states)
        if any(same(effects, each) for each in (np.diff(walk, axis=0), walk[1:] - walk[0], walk[1:] - world.start)):
            return "Not yet. The world is not put back: every motion must start from the initial state, so reset it inside the loop."
    if same(effects[1:], (ends - world.start)[1:]):
        return (
            "Not yet. All effects but the first are right: the world is put back after each motion, but it need not be in its initial "
            "state when the function gets it. Reset it before each motion."
        )
    row = int(np.argmax(np.abs(effects - (ends - world.start)).max(axis=1)))
    return (
        f"Not yet: for the motion {described(performed[row])} came the effect {described(effects[row])}, expected was "
        f"{described(ends[row] - world.start)}."
    )


def _two_tables(answer: Any) -> tuple[np.ndarray, np.ndarray] | None:
    """Return an answer as two arrays of numbers, None if it is something else."""
    try:
        first, second = answer
        return np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    except Exception:  # whatever a student's object does
        return None


def check_standard_error(function: Any, more: int = 0) -> Verdict:
    r"""Check ``standard_error(hits)``: :math:`\sqrt{p (1 - p) / N}` of the share of True in an array.

    The usual mistakes: the variance; the spread of a single jump; N outside the root; N - 1; in percent; two standard errors.
    """

    def error(power: float = 0.5, per: Callable[[int], float] = float, times: float = 1.0) -> Callable[[Any], float]:
        def of(hits: np.ndarray) -> float:
            share = np.mean(hits)
            return float(times * (share * (1 - share) / per(len(hits))) ** power)

        return of

    rng = np.random.default_rng(21)
    cases = [(np.arange(100) < 20,), (np.array([True, False, False, True, False]),), (rng.random(2000) < 0.02,)]
    cases += [(rng.random(rng.integers(5, 500)) < rng.uniform(0.2, 0.8),) for _ in range(more)]
    mistakes = [
        Mistake("This is the variance of the share; the standard error is its square root.", error(power=1.0)),
        Mistake(
            "This is the spread of a single jump, sqrt(p (1 - p)); a share of N jumps scatters less, by sqrt(N).",
            error(per=lambda n: 1.0),
        ),
        Mistake(
            "N stands outside the root here. It belongs under it: four times as many jumps halve the error.",
            error(per=lambda n: float(n) ** 2),
        ),
        Mistake(
            "This divides by N - 1, as one does to estimate the spread of single values; the lesson's formula has N.",
            error(per=lambda n: n - 1.0),
        ),
        Mistake("This is in percent; p is a share from 0 to 1, and so is its error.", error(times=100.0)),
        Mistake("These are two standard errors, half the width of an interval of 95 %.", error(times=2.0)),
    ]
    return judge("standard_error", function, error(), cases, mistakes, "To halve it takes four times as many jumps.")
