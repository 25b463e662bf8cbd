"""Up The Stairs: the learning task of the paper (section 4) as a Gymnasium environment, and motion sets as discrete actions."""

from __future__ import annotations

from typing import Any, SupportsFloat

import gymnasium as gym
import numpy as np
from gymnasium import spaces

from stairlab._validation import finite_array, finite_number, one_of, whole_number
from stairlab.physics import CUBE_EDGE, NO_RISER, Staircase
from stairlab.planning import MAX_JUMPS, jump_reward, on_top
from stairlab.prototypes import Prototypes
from stairlab.tumbling import stair_world
from stairlab.world import FEATURES, Jump

FRAME = (9.0, 6.0)
""" Size of a rendered frame, in hundreds of pixels """
HEADROOM = 2.0
""" Height that a frame shows above the top of the stairs [m] """
LAST_RUN = 10.0
""" Depth of the last tread [m] """
PAPER_OBSERVATION = ("x", "y", "z", "d_obs")
OBSERVATIONS = {"paper": PAPER_OBSERVATION, "full": FEATURES}
FARTHEST_JUMP = 15.0
""" No jump leads farther than this beyond the stairs [m] """
FARTHEST_ASIDE = {"plane": 3.0, "tumbling": 20.0}
""" An episode ends when the cube is 2.46 m aside. In the plane no jump drifts by more than 0.3 m; a cube that tumbles off the side may
roll on for metres [m] """
PUBLISHED_END = 10.0
""" Where episodes go on on the top, they end at this y [m], as published """


class UpTheStairs(gym.Env[np.ndarray, np.ndarray]):
    r"""Climb a staircase, one jump after the other.

    **Description**

    A cube stands before fifteen steps, in the plane or in three dimensions. In each step of the episode it makes one jump, from
    wherever the last one ended, and waits until it rests. Single steps pay most: a jump that gains three steps earns as much as one
    that gains one.

    **Action Space**

    ``Box([50, 1], [1000, 89], (2,), float32)``

    ===  ======================  ===  ====  =======
    Num  Action                  Min  Max   Unit
    ===  ======================  ===  ====  =======
    0    magnitude of the force  50   1000  N
    1    angle above +y          1    89    degrees
    ===  ======================  ===  ====  =======

    **Observation Space**

    ``Box(4,)``, float32, as in the published wrappers; with ``observation="full"`` the eight features of the paper's text,
    ``Box(8,)``.
    Bounds for fifteen steps (x in the tumbling world: -20 to 20):

    =====  ====  =========================================================  ====  ====  =====
    paper  full  Observation                                                Min   Max   Unit
    =====  ====  =========================================================  ====  ====  =====
    0      0     x, to the side                                             -3    3     m
    1      1     y, forward                                                 -15   31.2  m
    2      2     z, height of the centre                                    0     4.6   m
    \-     3     qx of the quaternion                                       -1    1     1
    \-     4     qy                                                         -1    1     1
    \-     5     qz                                                         -1    1     1
    \-     6     qw                                                         -1    1     1
    3      7     d_obs, distance to the next riser; 10 where there is none  0     10    m
    =====  ====  =========================================================  ====  ====  =====

    **Rewards**

    For a change of height dz in a jump (equation 5, read as the text means it, see below):

    - 1 if dz > 0.05 m, however many steps that is;
    - dz / 0.3 if dz < -0.05 m: falling costs 1 for each step fallen;
    - 0 else, because resting heights jitter.

    Equation 5 prints ``-dz / 0.3``, which would reward falling; the text ("punishes falling") and the published code have it
    negative. The best return is the number of steps, 15, and only single steps reach it (give or take some hundredths, as a cube
    may rest leaning on a riser).

    **Starting State**

    The cube stands upright and at rest at y = 0.25 m, before the first riser at y = 0.6 m.

    **Episode End**

    - Termination: the cube leaves the map (0 < y < end of the last tread - 0.04 m, ``|x|`` < 2.46 m), or rests on the last tread.
    - Truncation: after 50 jumps, by the ``TimeLimit`` wrapper of ``gymnasium.make``.

    **Arguments**

    - ``world``: "tumbling" (v1: three dimensions) or "plane" (v0).
    - ``rocking=1.0``, ``friction=1.0``: of the tumbling world, see ``TumblingWorld``.
    - ``as_published=False``: the three readings of the published wrappers below, together.
    - ``time_outs_end=False``: report an episode that runs out of jumps as terminated, too, so that agents do not bootstrap there.
    - ``half_precision=False``: observations of dtype float16, and with them an agent's memory.
    - ``top_goes_on=False``: the episode goes on on the top, until y = 10 m or the last jump.

    - ``n_steps=15``: steps of the staircase; the last tread is 10 m deep.
    - ``observation="paper"``: or ``"full"``.
    - ``actuation_noise=0.0``: standard deviation of the force, relative to it.
    - ``x_drift=False``: in the plane, let x drift by the model of ``StairWorld``.
    - ``restitution=None``: of the plane's risers, see ``Staircase``.
    - ``render_mode=None``: or ``"rgb_array"``.

    ``info`` holds ``steps`` (steps climbed, 0 on the ground), ``height`` [m], ``on_map``, and ``duration`` (simulated time
    of the jump [s]).

    ## Version History

    - v1: three dimensions by default; the readings of the published wrappers as options.
    - v0: first version, in the plane.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 2}  # noqa: RUF012

    def __init__(
        self,
        *,
        world: str = "plane",
        n_steps: int = 15,
        observation: str = "paper",
        actuation_noise: float = 0.0,
        x_drift: bool = False,
        restitution: float | None = None,
        rocking: float = 1.0,
        friction: float = 1.0,
        as_published: bool = False,
        time_outs_end: bool = False,
        half_precision: bool = False,
        top_goes_on: bool = False,
        render_mode: str | None = None,
    ) -> None:
        if render_mode == "human":
            raise ValueError(
                'render_mode "human" would need a display; use render_mode="rgb_array" and show the frames, as a notebook does.'
            )
        if render_mode is not None:
            one_of("render_mode", render_mode, self.metadata["render_modes"])
        names = OBSERVATIONS[one_of("observation", observation, OBSERVATIONS)]
        self.actuation_noise = finite_number("actuation_noise", actuation_noise, low=0, high=1)
        self.render_mode = render_mode
        staircase = Staircase(whole_number("n_steps", n_steps, low=1), last_run=LAST_RUN, restitution=restitution)
        self.world = stair_world(world, staircase, x_drift=x_drift, rocking=rocking, friction=friction)
        self.time_outs_end = time_outs_end or as_published
        self.top_goes_on = top_goes_on or as_published
        self.random = self.world.random or self.actuation_noise > 0
        self._dtype = np.float16 if half_precision or as_published else np.float32
        self._aside = FARTHEST_ASIDE[world]
        self._jumps = 0
        self.action_space = spaces.Box(
            self.world.motion_low.astype(np.float32), self.world.motion_high.astype(np.float32), dtype=np.float32
        )
        self._features = [FEATURES.index(name) for name in names]
        low, high = self._bounds()
        self.observation_space = spaces.Box(
            low[self._features].astype(self._dtype), high[self._features].astype(self._dtype), dtype=self._dtype
        )
        self._last_jump: Jump | None = None
        self._canvas: _Canvas | None = None

    def _bounds(self) -> tuple[np.ndarray, np.ndarray]:
        stairs = self.world.staircase
        low = [-self._aside, -FARTHEST_JUMP, 0.0, -1.0, -1.0, -1.0, -1.0, 0.0]
        high = [self._aside, stairs.end + FARTHEST_JUMP, stairs.top + CUBE_EDGE, 1.0, 1.0, 1.0, 1.0, NO_RISER]
        return np.array(low, dtype=np.float32), np.array(high, dtype=np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Put the cube into the start pose; see Gymnasium's ``Env.reset``."""
        super().reset(seed=seed)
        self._last_jump, self._jumps = None, 0
        return self._observe(self.world.reset()), self._info()

    def step(self, action: np.ndarray) -> tuple[np.ndarray, SupportsFloat, bool, bool, dict[str, Any]]:
        """Jump; see Gymnasium's ``Env.step``. Raises a ValueError for an action outside the space."""
        motion = finite_array("action", action, ndim=1)
        if len(motion) != 2:
            raise ValueError(f"action must hold a magnitude and an angle, not {len(motion)} numbers.")
        magnitude, angle = self._noisy(motion).tolist()
        shown = self.render_mode is not None
        jump = self._last_jump = self.world.jump(magnitude, angle, self.np_random, trajectory=shown)
        self._jumps += 1
        reward = jump_reward(jump.dz, self.world.staircase.rise)
        return self._observe(jump.end), reward, self._ends(jump), False, self._info()

    def _ends(self, jump: Jump) -> bool:
        if not jump.on_map or (self.time_outs_end and self._jumps >= MAX_JUMPS):
            return True
        return bool(jump.end[1] >= PUBLISHED_END) if self.top_goes_on else on_top(self.world.staircase, jump)

    def _noisy(self, motion: np.ndarray) -> np.ndarray:
        if self.actuation_noise:
            for name, value, low, high in zip(
                self.world.motion_names, motion.tolist(), self.world.motion_low, self.world.motion_high, strict=True
            ):
                finite_number(name, value, low=low, high=high)  # as the world does; the noise would hide it
            motion = motion * [1 + self.actuation_noise * self.np_random.standard_normal(), 1]
            motion = np.clip(motion, self.world.motion_low, self.world.motion_high)
        return motion

    def _observe(self, state: np.ndarray) -> np.ndarray:
        return state[self._features].astype(self._dtype)

    def _info(self) -> dict[str, Any]:
        state, jump = self.world.state, self._last_jump
        height = float(state[2]) - CUBE_EDGE / 2
        return {
            "steps": round(height / self.world.staircase.rise),
            "height": height,
            "on_map": self.world.on_map(state),
            "duration": jump.duration if jump else 0.0,
        }

    def render(self) -> np.ndarray | None:
        """Return a picture of stairs, cube and the path of the last jump, shape (600, 900, 3), uint8; None without a render mode."""
        if self.render_mode is None:
            gym.logger.warn('To see anything, make the environment with render_mode="rgb_array".')
            return None
        self._canvas = self._canvas or _Canvas(self.world.staircase)
        return self._canvas.frame(self.world.state, self._last_jump)


def make_up_the_stairs(**options: Any) -> UpTheStairs:
    """Make the environment for ``gymnasium.make``, which hands on "human" to a function (to be refused in words), not to a class."""
    return UpTheStairs(**options)


class _Canvas:
    """Draws the stairs once, and for each frame only what moves."""

    def __init__(self, staircase: Staircase) -> None:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        from stairlab import plots

        self.plots = plots
        self.agg = FigureCanvasAgg(Figure(figsize=FRAME, dpi=100, layout="tight"))
        self.ax = self.agg.figure.add_subplot()
        plots.draw_stairs(self.ax, staircase, staircase.top + HEADROOM, 0.0)
        (self.path,) = self.ax.plot([], [], color=plots.PATH, linewidth=1.5, animated=True)
        self.cube = plots.draw_cube(self.ax, 0.0, 0.0, 0.0, animated=True)
        self.agg.draw()
        self.stairs = self.agg.copy_from_bbox(self.agg.figure.bbox)

    def frame(self, state: np.ndarray, jump: Jump | None) -> np.ndarray:
        path = jump.trajectory if jump else None
        self.path.set_data(([], []) if path is None else (path.y, path.z))
        self.cube.set_xy(self.plots.cube_corners(*self.plots.pose(state)))
        self.agg.restore_region(self.stairs)
        self.ax.draw_artist(self.path)
        self.ax.draw_artist(self.cube)
        return np.asarray(self.agg.buffer_rgba())[..., :3].copy()


class DiscreteMotions(gym.ActionWrapper[np.ndarray, np.int64, np.ndarray]):
    """Let an agent choose among the motions of a set: the action i performs motion i.

    Parameters
    ----------
    env : gymnasium.Env
        Any environment with a Box action space of one dimension.
    prototypes : Prototypes or array-like of shape (n_motions, n_parameters)
        The motions, all different, in the units of the environment's actions.

    Raises
    ------
    ValueError
        If the set is empty, has equal motions, has another number of parameters, or leaves the action space; or the action space
        is not a Box of one dimension.
    """

    def __init__(self, env: gym.Env, prototypes: Prototypes | np.ndarray) -> None:
        super().__init__(env)
        box = env.action_space
        if not isinstance(box, spaces.Box) or len(box.shape) != 1:
            raise ValueError(f"env must have a Box action space of one dimension, not {box}.")
        motions = prototypes.motions if isinstance(prototypes, Prototypes) else prototypes
        motions = finite_array("prototypes", motions, columns=box.shape[0])
        self.motions = motions.astype(box.dtype)
        outside = ((self.motions < box.low) | (self.motions > box.high)).any(axis=1)
        if outside.any():
            raise ValueError(
                f"prototypes must lie in {box}, but motion {int(np.argmax(outside))} is {motions[np.argmax(outside)]}."
            )
        if len(np.unique(self.motions, axis=0)) < len(motions):
            raise ValueError("prototypes must all be different, but some motions are there more than once.")
        self.action_space = spaces.Discrete(len(motions))

    def action(self, action: np.int64) -> np.ndarray:
        """Return the motion of an action, shape (n_parameters,). Raises a ValueError for an action outside the space."""
        if not self.action_space.contains(action):
            raise ValueError(f"action must be a whole number from 0 to {len(self.motions) - 1}, not {action!r}.")
        return self.motions[action]
