"""Checks of lesson 08, up the stairs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from stairlab.checks._judge import Mistake, Verdict, attempt_call, described, judge
from stairlab.course.game import Game, gap_of, reward_as_printed, reward_sign_mended
from stairlab.physics import Staircase
from stairlab.planning import DEAD_BAND, MAX_JUMPS, jump_reward
from stairlab.prototypes import random_prototypes
from stairlab.world import StairWorld

RISE = 0.3
""" Height of a step [m] """
SKIPPED = 3
""" A good climb of fifteen steps may skip so many; of more steps, as large a share """
STUCK = 5
""" So many jumps that move the cube by less than a millimetre are called stuck """
STEPS = 15
""" Steps of the real stairs """
TOLERANCE = 1e-6
""" Rewards that differ by less are equal """
_STEPS_IN_TEST = 3


def check_reward_of_jump(function: Any, more: int = 0) -> Verdict:
    """Check ``reward_of_jump(dz, rise)``: equation 5 as its text means it, with a dead band of 0.05 m.

    The usual mistakes: the printed sign; no dead band; both; paying for each step of a leap; falls that cost 1 however deep; a step
    that is always 0.3 m high; whole steps only.
    """
    rng = np.random.default_rng(8)
    cases = [(0.3, 0.3), (0.6, 0.3), (-0.3, 0.3), (-0.6, 0.3), (0.001, 0.3), (-0.02, 0.3), (0.0, 0.3), (0.06, 0.3)]
    cases += [(0.5, 0.25), (-0.5, 0.25), (-0.45, 0.3), (-0.4, 0.25)]
    cases += [(float(rng.uniform(-1.5, 1.5)), float(rng.uniform(0.15, 0.45))) for _ in range(more)]
    mistakes = [
        Mistake(
            "This is equation 5 to the letter, with the misprint: it pays for falling. A fall of two steps must come to -2, and "
            "changes of up to 0.05 m to 0.",
            reward_as_printed,
        ),
        Mistake(
            "Falling is rewarded: that is the misprint of equation 5. dz is negative for a fall, so dz / rise is a cost already.",
            lambda dz, rise: abs(jump_reward(dz, rise)),
        ),
        Mistake(
            "The dead band is missing: a cube that hops on the spot would be paid for the jitter of its height. Changes of up to "
            "0.05 m, up or down, earn 0.",
            reward_sign_mended,
        ),
        Mistake(
            "The dead band is missing for falls: a change of -0.02 m is jitter too, and costs nothing.",
            lambda dz, rise: dz / rise if dz <= 0 else jump_reward(dz, rise),
        ),
        Mistake(
            "This counts the steps of a climb. A jump that climbs earns 1 here, however far; only falls count their steps.",
            lambda dz, rise: dz / rise if abs(dz) > DEAD_BAND else 0.0,
        ),
        Mistake(
            "Every fall costs 1 here; it should cost 1 for each step fallen, which is dz / rise.",
            lambda dz, rise: max(jump_reward(dz, rise), -1.0) if dz > -DEAD_BAND else -1.0,
        ),
        Mistake(
            "This takes every step to be 0.3 m high; its height is the argument rise.",
            lambda dz, rise: jump_reward(dz, RISE),
        ),
        *(
            Mistake(
                "You count whole steps; a fall of a step and a half costs 1.5, so divide and do not round.",
                lambda dz, rise, whole=whole: whole(jump_reward(dz, rise)),
            )
            for whole in (round, math.trunc, math.floor)
        ),
    ]
    praise = "A climb earns 1, a fall costs its steps, and jitter is nothing."
    return judge("reward_of_jump", function, jump_reward, cases, mistakes, praise)


def check_better_reward(function: Any, more: int = 0) -> Verdict:
    """Check ``better_reward(dz, rise)`` by its properties: leaps are as good as single steps, and going round earns nothing.

    The usual mistakes: the paper's own reward, which makes leaps earn less; falls that are free or cheap, so that climbing and
    falling again and again pays; no dead band; the misprint.
    """
    rng = np.random.default_rng(9)
    rises = [RISE, 0.25, *rng.uniform(0.15, 0.45, more).tolist()]
    for number, rise in enumerate(rises):
        rewards: dict[float, float] = {}
        jitter = [0.0, 0.001, -0.001, 0.04, -0.04]
        for dz in (*jitter, *(steps * rise for steps in (1, 2, 3, 4, -1, -2, -3, -4))):
            attempt = attempt_call("better_reward", function, (dz, rise))
            if attempt.problem:
                return Verdict(False, attempt.problem)
            value = _number(attempt.value)
            if value is None:
                came = described(attempt.value)
                return Verdict(
                    False, f"Not yet: better_reward{described((dz, rise))} must be a finite number, not {came}."
                )
            rewards[dz] = value
        by_steps = {steps: rewards[steps * rise] for steps in (1, 2, 3, 4, -1, -2, -3, -4)}
        words = _flaw({dz: rewards[dz] for dz in jitter}, by_steps, rise, _loops(rng, 5 if number < 2 else 20))
        if words:
            return Verdict(False, f"Not yet. {words}")
    return Verdict(
        True,
        "Right. Leaps earn no less than single steps now, and going round earns nothing.",
    )


def _flaw(jitter: dict[float, float], reward: dict[int, float], rise: float, loops: Iterator[list[int]]) -> str:
    """Say what is wrong with a reward, by what it gives for jitter and for whole steps."""
    for dz, value in jitter.items():
        if abs(value) > TOLERANCE:
            return f"A change of {dz:g} m is jitter and must earn 0; here it earns {_shown(value)}. The dead band is 0.05 m."
    if reward[-1] >= 0 or reward[-2] >= 0:
        falls = f"one step earns {_shown(reward[-1])}, and one of two steps {_shown(reward[-2])}"
        if max(reward[-1], reward[-2]) > 0:
            return f"Falling is rewarded: a fall of {falls}. That is the misprint of equation 5."
        return f"Falls are free: a fall of {falls}. So a cube that climbs a step and falls again, over and over, earns without end."
    if reward[1] <= 0:
        return f"A climb of one step ({rise:.3g} m) must earn something, but it earns {_shown(reward[1])}."
    for steps in (2, 3, 4):
        if reward[steps] < steps * reward[1] - TOLERANCE:
            own = "This is still the paper's reward, or like it: " if reward[steps] == reward[1] else ""
            return (
                f"{own}{'a' if own else 'A'} leap of {steps} steps earns {_shown(reward[steps])}, and {steps} single steps earn "
                f"{_shown(steps * reward[1])}. The leap must not earn less."
            )
    for loop in loops:
        earned = sum(reward[steps] for steps in loop)
        if earned > TOLERANCE:
            path = ", ".join(f"{steps:+d}" for steps in loop)
            return (
                f"The jumps {path} lead back to where they began, and earn {_shown(earned)}: an agent could go round and round "
                "instead of climbing. Falls must cost at least what the climb has earned."
            )
    return ""


def _loops(rng: np.random.Generator, count: int) -> Iterator[list[int]]:
    """Yield sequences of steps gained that lead back to where they began: some by hand, ``count`` at random."""
    yield from ([1, -1], [2, -2], [2, -1, -1], [1, 1, -2], [4, -1, -3], [3, -4, 1], [1, 1, 1, -3], [4, -4])
    for _ in range(count):
        loop = rng.choice([-4, -3, -2, -1, 1, 2, 3, 4], 4).tolist()
        while left := -sum(loop):
            loop.append(max(-4, min(4, left)))
        yield loop


def check_climb(function: Any, more: int = 0) -> Verdict:
    """Check ``climb(observation, motions)``: a policy that climbs fifteen steps with ten random motions, mostly one at a time.

    The usual mistakes: to return a motion instead of its number; to leap (the top is reached, the return is not); to get stuck
    before a riser.
    """
    motions = random_prototypes(StairWorld(), seed=0).motions
    rng = np.random.default_rng(10)
    for n_steps in (STEPS, *rng.integers(5, 26, more).tolist()):
        game = Game(motions, Staircase(n_steps, last_run=10.0), MAX_JUMPS * max(n_steps, STEPS) // STEPS)
        while not game.over:
            attempt = attempt_call("climb", function, (game.observation, motions.copy()))
            if attempt.problem:
                return Verdict(False, attempt.problem)
            if words := _no_choice(attempt.value, motions):
                return Verdict(False, f"Not yet: for the observation {described(game.observation)}, {words}")
            try:
                game.jump(int(attempt.value))
            except RuntimeError:
                return Verdict(
                    False, f"Not yet: jump {len(game.actions) + 1}, with motion {attempt.value}, did not come to rest."
                )
        if words := _no_climb(game):
            stairs = "" if n_steps == STEPS else f"On stairs of {n_steps} steps: "
            return Verdict(False, f"Not yet. {stairs}{words}")
        if n_steps == STEPS:
            best = f"It is on the top after {len(game.actions)} jumps, with a return of {game.value:.0f}"
    return Verdict(True, f"Right. {best}; a random policy returns about 1.")


def _no_choice(value: Any, motions: np.ndarray) -> str:
    """Say why a value is not the number of a motion; nothing if it is."""
    if (isinstance(value, (list, tuple)) and len(value) == 2) or (isinstance(value, np.ndarray) and value.size == 2):
        return f"climb returned the motion {described(value)} itself. Return its number, from 0 to {len(motions) - 1}."
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)):
        return f"climb returned {described(value)}, which is not a whole number."
    if not 0 <= value < len(motions):
        return f"climb returned {described(value)}; the motions have the numbers 0 to {len(motions) - 1}."
    return ""


def _no_climb(game: Game) -> str:
    """Say what is wrong with an episode; nothing if it is on the top with a good return."""
    count, n_steps = len(game.actions), game.staircase.n_steps
    wanted = n_steps - SKIPPED * max(n_steps, STEPS) // STEPS
    if game.on_top:
        if game.value >= wanted:
            return ""
        return (
            f"The cube is on the top after {count} jumps, but in leaps: the return is {game.value:.0f}. A jump earns 1 however far it "
            f"goes, so climb one step at a time; {wanted} or more is wanted."
        )
    where = f"step {game.steps[-1]}"
    if count < game.max_jumps:
        return f"Jump {count}, with motion {game.actions[-1]}, left the stairs from step {game.steps[-2]}."
    places = np.array([state[1:3] for state in game.states])
    moved = np.abs(np.diff(places, axis=0)).sum(axis=1)
    if (moved[-STUCK:] < 0.001).all():
        gap = gap_of(game.states[-1], game.staircase)
        return (
            f"The cube is stuck on {where}, {1000 * gap:.1f} mm before the riser, where motion {game.actions[-1]} leads "
            "nowhere. What else could it do from such a gap? d_obs tells: the gap is d_obs - 0.05 m."
        )
    return f"After {count} jumps the cube is on {where}, with a return of {game.value:.0f}: out of jumps."


def check_env_is_right(function: Any, more: int = 0) -> Verdict:
    """Check ``env_is_right(env)``: a test that calls Up The Stairs with three steps right, and each of several broken ones wrong.

    The usual mistakes: a test that is content with everything; one that is content with nothing; one that does not look at what
    comes after the first jump.
    """
    broken = dict(list(_BROKEN.items())[: None if more else 5])
    missed = []
    for plant in ("", *broken, ""):
        attempt = attempt_call("env_is_right", function, (_environment(plant),))
        if attempt.problem:
            return Verdict(False, attempt.problem)
        if not isinstance(attempt.value, (bool, np.bool_)):
            return Verdict(False, f"Not yet: env_is_right must return True or False, not {described(attempt.value)}.")
        if not plant and not attempt.value:
            return Verdict(
                False,
                "Not yet: it calls the environment wrong that keeps all its promises. Which of your tests fails there?",
            )
        if plant and attempt.value:
            missed.append(plant)
    if len(missed) == len(broken):
        return Verdict(
            False,
            f"Not yet: it is content with every environment, also with one that {_BROKEN[missed[0]]}. A test that cannot fail tests "
            "nothing.",
        )
    if missed:
        caught = len(broken) - len(missed)
        return Verdict(
            False,
            f"Not yet: it catches {caught} of {len(broken)} broken environments, but calls one right that {_BROKEN[missed[0]]}.",
        )
    return Verdict(True, f"Right. It catches all {len(broken)} broken environments, and leaves the right one alone.")


_BROKEN = {
    "again": "pays once more, for a hop on the spot, what was climbed before",
    "late": "shows the cube where it was before the jump",
    "endless": "goes on after the cube has come to rest on the last tread",
    "timeless": "lets an episode go on after 50 jumps",
    "stays": "leaves the cube where it is when it is reset",
    "counts": "pays a leap of three steps three times as much as a single step",
    "costs": "takes a little for a hop on the spot, which should earn nothing",
}
""" What is broken; the last two only in the hidden tests """


def _environment(plant: str) -> Any:
    """Return Up The Stairs with three steps; ``plant`` says what is broken, nothing if it is empty."""
    from gymnasium.wrappers import TimeLimit

    from stairlab.envs import UpTheStairs

    class Stairs(UpTheStairs):
        """Up The Stairs, with what was planted."""

        def reset(self, *, seed: Any = None, options: Any = None) -> Any:
            before = self.world.state
            observation, info = super().reset(seed=seed, options=options)
            if plant == "stays":
                observation = self._observe(self.world.reset(before))
            return observation, info

        def step(self, action: Any) -> Any:
            before = self.world.state
            observation, reward, terminated, truncated, info = super().step(action)
            after = self.world.state
            if plant == "again":
                reward = jump_reward(float(after[2] - self.world.start[2]), RISE)
            elif plant == "late":
                observation = self._observe(before)
            elif plant == "endless":
                terminated = terminated and not info["on_map"]
            elif plant == "counts":
                reward = max(float(reward), float(round((after[2] - before[2]) / RISE)))
            elif plant == "costs" and reward == 0:
                reward = -0.1
            return observation, reward, terminated, truncated, info

    env = Stairs(n_steps=_STEPS_IN_TEST)
    return env if plant == "timeless" else TimeLimit(env, 50)


def _number(value: Any) -> float | None:
    """Return a value as a number, None if it is none that is finite."""
    try:
        number = float(value)
    except Exception:
        return None
    return number if math.isfinite(number) and not isinstance(value, str) else None


def _shown(value: float) -> str:
    return f"{value:.4g}"
