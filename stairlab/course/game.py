"""Up The Stairs, played jump by jump: the readings of its reward, an episode, and what a motion does from a gap (lesson 08)."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Sequence

import numpy as np

from stairlab.physics import CUBE_EDGE, Staircase
from stairlab.planning import MAX_JUMPS, Plan, ends_episode, jump_reward
from stairlab.prototypes import Prototypes
from stairlab.world import FEATURES, CubeWorld, Jump, StairWorld, yaw_of

OBSERVED = [FEATURES.index(name) for name in ("x", "y", "z", "d_obs")]
MIDDLE = 7
""" Gaps are tried on this step of the fifteen: all treads but the last are alike """
STILL = 1e-7
""" A cube that moves by less does not move [m]: here differences are the rounding of numbers """


# Equation 5 and its readings


def reward_as_printed(dz: float, rise: float = 0.3) -> float:
    """Return the reward of a height gained ``dz`` [m] as equation 5 prints it: falling pays."""
    return 1.0 if dz > 0 else -dz / rise


def reward_sign_mended(dz: float, rise: float = 0.3) -> float:
    """Return the reward of a height gained ``dz`` [m] with the sign that the text means: falling costs, any rise pays."""
    return 1.0 if dz > 0 else dz / rise


READINGS: dict[str, Callable[[float, float], float]] = {
    "as printed": reward_as_printed,
    "sign mended": reward_sign_mended,
    "with dead band": jump_reward,
}
""" The three readings of equation 5; the last one is the environment's """


# Episodes


def gap_of(state: np.ndarray, staircase: Staircase) -> float:
    """Return the gap between the cube's front face, or its foremost corner if it is turned, and the riser ahead [m].

    It is infinite on the last tread. In the plane no cube is turned about the vertical.
    """
    y, yaw = float(state[1]), math.radians(abs(yaw_of(*state[3:7])))
    return float(staircase.next_riser(y) - y - CUBE_EDGE / 2 * (math.cos(yaw) + math.sin(yaw)))


def step_of(state: np.ndarray, staircase: Staircase) -> int:
    """Return the step that the cube rests on, 0 for the ground."""
    return round((float(state[2]) - CUBE_EDGE / 2) / staircase.rise)


class Game:
    """An episode of Up The Stairs with a set of motions, jump by jump; with undo.

    Rewards and end are those of the environment; its actions are rounded to single precision, and so are the motions here.

    Parameters
    ----------
    motions : Prototypes or array-like of shape (n_motions, 2)
        Magnitude [N] and angle [deg].
    staircase : Staircase or world of the stairs, optional
        The stairs, which are then those of the plane; fifteen steps by default. Or a world, such as ``TumblingWorld(staircase)``.
    max_jumps : int
        Jumps in an episode.
    seed : int, optional
        For a world that is random: jump i draws its rocking from this seed and i, so that undoing a jump does not change it. Without
        one, the cube rocks in the fixed way, as in ``best_return``.

    Attributes
    ----------
    motions : ndarray of shape (n_motions, 2)
        Magnitude [N] and angle [deg].
    states : list of ndarray of shape (8,)
        The start, and the state after each jump.
    actions : list of int
        The motion of each jump.
    rewards : list of float
        The reward of each jump.
    """

    def __init__(
        self,
        motions: Prototypes | np.ndarray,
        staircase: Staircase | CubeWorld | None = None,
        max_jumps: int = MAX_JUMPS,
        seed: int | None = None,
    ) -> None:
        given = motions.motions if isinstance(motions, Prototypes) else np.asarray(motions)
        self.motions = given.astype(np.float32).astype(float)
        self.max_jumps = max_jumps
        self.seed = seed
        world = staircase if isinstance(staircase, CubeWorld) else StairWorld(staircase or Staircase.fifteen())
        self._world = copy.copy(world)  # a jump replaces the state of the copy
        self.staircase = world.staircase
        self._paths: dict[tuple[float, ...], Jump] = {}
        self.restart()

    def restart(self) -> None:
        """Go back to the start."""
        self.states = [self._world.reset()]
        self.actions: list[int] = []
        self.rewards: list[float] = []
        self._ended = False

    def undo(self) -> None:
        """Take the last jump back; nothing at the start."""
        if self.actions:
            del self.states[-1], self.actions[-1], self.rewards[-1]
            self._ended = False
            self._world.reset(self.states[-1])

    def jump(self, action: int) -> Jump:
        """Perform a motion of the set from where the cube is.

        Raises
        ------
        ValueError
            If the episode is over, or there is no such motion.
        RuntimeError
            If the cube does not come to rest in time; nothing has changed then.
        """
        if self.over:
            raise ValueError("The episode is over: restart, or undo the last jump.")
        if not 0 <= action < len(self.motions):
            raise ValueError(f"action must be a whole number from 0 to {len(self.motions) - 1}, not {action!r}.")
        jump = self._world.perform(self.motions[action], self._rng(len(self.actions)))
        self.states.append(jump.end)
        self.actions.append(int(action))
        self.rewards.append(jump_reward(jump.dz, self.staircase.rise))
        self._ended = ends_episode(self.staircase, jump)
        return jump

    def lead(self, action: int) -> Jump | None:
        """Return the jump that a motion would make from here, without making it; None if it were not over in time."""
        try:
            return self._world.perform(self.motions[action], self._rng(len(self.actions)))
        except RuntimeError:
            return None
        finally:
            self._world.reset(self.states[-1])

    def path(self, number: int) -> Jump:
        """Return the jump ``number``, from 1, with its trajectory; kept, as the films of an episode draw each many times."""
        start, motion = self.states[number - 1], self.motions[self.actions[number - 1]]
        key = (number, *start.tolist(), *motion.tolist())
        if key not in self._paths:
            world = copy.copy(self._world)
            world.reset(start)
            magnitude, angle = motion.tolist()
            self._paths[key] = world.jump(magnitude, angle, self._rng(number - 1), trajectory=True)
        return self._paths[key]

    def _rng(self, jump: int) -> np.random.Generator | None:
        return None if self.seed is None else np.random.default_rng((self.seed, jump))

    def on_map(self, number: int) -> bool:
        """Whether the cube is on the map after jump ``number``."""
        return self._world.on_map(self.states[number])

    @property
    def tumbles(self) -> bool:
        """Whether it is played in a world in which the cube can end aside and turned."""
        return not isinstance(self._world, StairWorld)

    @property
    def over(self) -> bool:
        """Whether the episode is over: off the map, on the last tread, or out of jumps."""
        return self._ended or len(self.actions) >= self.max_jumps

    @property
    def observation(self) -> np.ndarray:
        """What an agent sees: x, y, z, d_obs [m], shape (4,), float32."""
        return self.states[-1][OBSERVED].astype(np.float32)

    @property
    def value(self) -> float:
        """The return so far: the sum of the rewards."""
        return float(sum(self.rewards))

    @property
    def heights(self) -> np.ndarray:
        """Height of the cube's centre at the start and after each jump [m], shape (n_jumps + 1,)."""
        return np.array([state[2] for state in self.states])

    @property
    def steps(self) -> np.ndarray:
        """The step that the cube rests on at the start and after each jump, shape (n_jumps + 1,), int."""
        return np.array([step_of(state, self.staircase) for state in self.states])

    @property
    def gains(self) -> np.ndarray:
        """Steps gained by each jump, shape (n_jumps,), int."""
        return np.diff(self.steps)

    @property
    def gaps(self) -> np.ndarray:
        """Gap to the riser ahead at the start and after each jump [m], shape (n_jumps + 1,); infinite on the last tread."""
        return np.array([gap_of(state, self.staircase) for state in self.states])

    @property
    def on_top(self) -> bool:
        """Whether the cube rests on the last tread."""
        return bool(self.steps[-1] >= self.staircase.n_steps)


def play(
    motions: Prototypes | np.ndarray,
    policy: Callable[[np.ndarray], int],
    staircase: Staircase | CubeWorld | None = None,
    max_jumps: int = MAX_JUMPS,
    seed: int | None = None,
) -> Game:
    """Play an episode by a policy.

    Parameters
    ----------
    motions : Prototypes or array-like of shape (n_motions, 2)
        Magnitude [N] and angle [deg].
    policy : callable
        Takes the observation (x, y, z, d_obs) [m] and returns the number of a motion.
    staircase : Staircase or world of the stairs, optional
        As of ``Game``.
    max_jumps : int
        Jumps in an episode.
    seed : int, optional
        As of ``Game``.

    Returns
    -------
    Game
    """
    game = Game(motions, staircase, max_jumps, seed)
    while not game.over:
        game.jump(policy(game.observation))
    return game


def repeat(motion: Sequence[float], staircase: Staircase | None = None) -> Game:
    """Play an episode of one motion in the plane, again and again; it stops early where the cube does not move any more.

    Returns
    -------
    Game
        Its value is that of the whole episode, as what is left earns nothing.
    """
    game = Game(np.array([motion]), staircase)
    while not game.over:
        game.jump(0)
        if np.abs(game.states[-1][1:3] - game.states[-2][1:3]).sum() < STILL:
            break
    return game


def replay_plan(motions: Prototypes | np.ndarray, plan: Plan, staircase: Staircase | CubeWorld | None = None) -> Game:
    """Return the episode that a search found, played from the start in the world that was searched."""
    game = Game(motions, staircase, int(plan.settings["max_jumps"]))
    for action in plan.motions.tolist():
        game.jump(action)
    return game


# What a motion does from a gap


def from_gap(motion: np.ndarray, gap: float, staircase: Staircase | None = None) -> tuple[int, float]:
    """Perform a motion from upright at a gap before a riser in the middle of the stairs, in the plane.

    Parameters
    ----------
    motion : array-like of shape (2,)
        Magnitude [N] and angle [deg].
    gap : float
        Between the cube's front face and the riser ahead [m].
    staircase : Staircase, optional
        Fifteen steps by default.

    Returns
    -------
    gained : int
        Steps.
    gap : float
        The gap to the riser that is now ahead [m]; infinite where none is.
    """
    stairs = staircase or Staircase.fifteen()
    below = min(MIDDLE, stairs.n_steps - 1)
    world = StairWorld(stairs)
    world.reset(world.state_at(stairs.risers[below] - gap - CUBE_EDGE / 2, stairs.rise * below + CUBE_EDGE / 2))
    jump = world.perform(np.asarray(motion, dtype=np.float32))
    return round(jump.dz / stairs.rise), gap_of(jump.end, stairs)


def widest_after(motions: Prototypes | np.ndarray, gap: float) -> float:
    """Return the widest gap that any motion of a set leaves from a gap [m]; infinite if one climbs."""
    values = motions.motions if isinstance(motions, Prototypes) else np.asarray(motions)
    ends = [from_gap(motion, gap) for motion in values]
    return max(math.inf if steps > 0 else after for steps, after in ends)
