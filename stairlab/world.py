"""The world of the paper (section 4, figure 1): a cube that jumps before, and up, a staircase.

The robot is a cube of 1 kg that can do one thing: push itself off with a force of some magnitude and angle. How it then flies
and lands in the plane is in ``physics.py``; in three dimensions, in ``tumbling.py``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from stairlab._validation import finite_array, finite_number, read_only
from stairlab.physics import CUBE_EDGE, TIME_LIMIT, Flight, Staircase, Trajectory, interrupts_wait, overlap

FEATURES = ("x", "y", "z", "qx", "qy", "qz", "qw", "d_obs")
START_Y = 0.25
""" Start pose: y of the cube's centre [m] """
MAP_MARGIN_Y = 0.04
""" The map ends this far before the end of the last tread [m] """
MAP_HALF_WIDTH = 2.46
""" The map's extent in x, to both sides [m] """
MAP_MARGIN_Z = 0.001
""" A cube on the map is at most this far above resting on the top tread [m] """

# Drift in x (off by default): what a jump does to the side, each kind with its shares and its |dx|, after the recorded jumps.
DRIFT_KINDS = ("upright", "creeps", "rolls", "tumbles")
""" |dx|: exponential with DRIFT_SCALE; uniform up to CREEP; one edge, 0.1 m, give or take 1 cm; uniform over TUMBLE """
DRIFT_SHARES = {"ground": (0.93, 0.07, 0, 0), "climb": (0.60, 0, 0.30, 0.10), "four steps": (0.18, 0.22, 0.27, 0.33)}
""" Shares of the kinds for jumps that stay on their level, climb one to three steps, or more """
DRIFT_SCALE = {"ground": 0.0002, "climb": 0.0008, "four steps": 0.0008}
""" Mean |dx| of an upright jump [m] """
CREEP = {"ground": 0.03, "climb": 0.09, "four steps": 0.09}
""" Largest |dx| of a creeping jump [m] """
TUMBLE = (0.14, 0.28)
""" Range of |dx| of a tumbling jump [m] """
DEEPEST_START = 0.01
""" A state may overlap the stairs by this much [m] """
FARTHEST = 1e6
""" Positions beyond it are refused: a micrometre would be lost among the digits of a number [m] """
REMEMBERED_JUMPS = 2**15
""" Jumps kept in memory, some 20 MB: in learning, every third to second jump is one that was made before """


def check_world(world: World) -> World:
    """Return ``world`` if it has what a world needs.

    Raises
    ------
    TypeError
        If it has not.
    """
    lacks = [name for name in ("motion_low", "reset", "perform", "state") if not hasattr(world, name)]
    if isinstance(world, type) or lacks:
        raise TypeError(f"world must be a world, such as StairWorld(), not {world!r}.")
    return world


def yaw_of(qx: float, qy: float, qz: float, qw: float) -> float:
    """Return the angle by which a cube's faces are turned about the vertical, from -45 to 45 degrees.

    It is that of the body axis after the most vertical one (cyclically), projected on the ground; a quarter turn leaves a cube as it
    was.
    """
    up = (2 * (qx * qz - qw * qy), 2 * (qy * qz + qw * qx), 1 - 2 * (qx * qx + qy * qy))
    vertical = max(range(3), key=lambda axis: abs(up[axis]))
    along_x, along_y = (
        (2 * (qx * qy - qw * qz), 1 - 2 * (qx * qx + qz * qz)),  # of body axis y
        (2 * (qx * qz + qw * qy), 2 * (qy * qz - qw * qx)),  # of body axis z
        (1 - 2 * (qy * qy + qz * qz), 2 * (qx * qy + qw * qz)),  # of body axis x
    )[vertical]
    return (math.degrees(math.atan2(along_y, along_x)) + 45) % 90 - 45


def reach_of(yaw: ArrayLike) -> np.ndarray:
    r"""Return how far the foremost corner of a cube that rests on a face is before its centre [m].

    .. math:: \tfrac{l}{2} (\cos \psi + \sin |\psi|)

    Parameters
    ----------
    yaw : array-like
        By how much its faces are turned about the vertical, -45 to 45 [deg].
    """
    turn = np.radians(np.abs(yaw))
    return CUBE_EDGE / 2 * (np.cos(turn) + np.sin(turn))


class Outcome(Protocol):
    """What any world tells of a performed motion."""

    @property
    def start(self) -> np.ndarray:
        """State before the motion, shape (n_features,)."""

    @property
    def end(self) -> np.ndarray:
        """State after the motion, shape (n_features,)."""

    @property
    def on_map(self) -> bool:
        """Whether the outcome counts."""


class World(Protocol):
    """What sampling, effects and prototypes need to know of a world: nothing about stairs."""

    motion_low: np.ndarray
    motion_high: np.ndarray

    @property
    def feature_names(self) -> Sequence[str]:
        """Names of the features of a state."""

    @property
    def motion_names(self) -> Sequence[str]:
        """Names of the parameters of a motion."""

    @property
    def state(self) -> np.ndarray:
        """The present state, shape (n_features,)."""

    def reset(self, state: np.ndarray | None = None) -> np.ndarray:
        """Put the world into ``state`` (its start state by default) and return that state."""

    def draw_start(self, rng: np.random.Generator) -> np.ndarray:
        """Draw a start state."""

    def perform(self, motion: np.ndarray, rng: np.random.Generator | None = None) -> Outcome:
        """Perform ``motion`` from the present state."""

    def noise_scale(self, motion: np.ndarray) -> np.ndarray:
        """Return the standard deviation of actuation noise on each parameter of ``motion``."""


@dataclass(frozen=True, eq=False)
class Jump:
    """One jump: what was done and what came of it.

    Attributes
    ----------
    magnitude, angle : float
        The motion m: force [N] and its direction above the +y axis [deg].
    start, end : ndarray of shape (8,)
        State before and after: x, y, z [m], quaternion qx, qy, qz, qw, distance to the next riser d_obs [m].
    on_map : bool
        Whether the jump ended on the map; the others are left out of the clustering.
    duration : float
        Simulated time until the jump was over, by the published rule that polls once a second [s].
    trajectory : Trajectory or None
        The path, if it was asked for.
    """

    magnitude: float
    angle: float
    start: np.ndarray
    end: np.ndarray
    on_map: bool
    duration: float
    trajectory: Trajectory | None = field(default=None, repr=False)

    @property
    def effect(self) -> np.ndarray:
        """Effect e = s' - s, shape (8,) (equation 1 of the paper)."""
        return self.end - self.start

    @property
    def dy(self) -> float:
        """Distance gained [m]."""
        return float(self.effect[1])

    @property
    def dz(self) -> float:
        """Height gained [m]."""
        return float(self.effect[2])


class CubeWorld:
    """A cube before a staircase: what the plane (``StairWorld``) and three dimensions (``TumblingWorld``) have in common.

    ``jump`` acts on the present state and leaves the world in the state the jump ends in; ``reset`` goes back to the start, or to
    any state. A jump depends on nothing but the state, the motion and the generator. A world says how its cube moves in ``_checked``,
    which looks at a given state, and ``_move``, which makes a jump.
    """

    feature_names: Sequence[str] = FEATURES
    motion_names: Sequence[str] = ("magnitude", "angle")
    random: bool
    """ Whether a jump that is given a generator draws from it """

    def __init__(self, staircase: Staircase | None = None) -> None:
        if staircase is not None and not isinstance(staircase, Staircase):
            raise TypeError(f"staircase must be a Staircase, not {staircase!r}.")
        self.staircase = staircase or Staircase()
        if self.staircase.first_riser < START_Y + CUBE_EDGE / 2:
            raise ValueError(
                f"staircase must leave the start pose free, with a first_riser of {START_Y + CUBE_EDGE / 2:g} m or more, "
                f"not {self.staircase.first_riser:g}."
            )
        self.motion_low = read_only(np.array([50.0, 1.0]))
        self.motion_high = read_only(np.array([1000.0, 89.0]))
        self._state = self.start

    @property
    def start(self) -> np.ndarray:
        """The start pose: y = 0.25 m, upright on the ground, at rest; shape (8,)."""
        return self.state_at(START_Y, CUBE_EDGE / 2)

    @property
    def state(self) -> np.ndarray:
        """A copy of the present state, shape (8,); give it to ``reset`` to come back to it exactly."""
        return self._state.copy()

    def state_at(self, y: float, z: float, rotation: float = 0.0, x: float = 0.0, yaw: float = 0.0) -> np.ndarray:
        """Return the state of a cube at ``y``, ``z``, ``x`` [m], rotated about the x-axis, then turned about the vertical [rad].

        Returns
        -------
        ndarray of shape (8,)
        """
        qx, qw = math.sin(rotation / 2), math.cos(rotation / 2)
        if yaw == 0:
            return self._complete(x, y, z, qx, 0.0, 0.0, qw)
        sine, cosine = math.sin(yaw / 2), math.cos(yaw / 2)
        return self._complete(x, y, z, cosine * qx, sine * qx, sine * qw, cosine * qw)

    def _complete(self, x: float, y: float, z: float, qx: float, qy: float, qz: float, qw: float) -> np.ndarray:
        """Give the quaternion its canonical sign (qw >= 0) and append d_obs."""
        first = next((q for q in (qw, qx, qy, qz) if q != 0), 1.0)
        sign = math.copysign(1.0, first)
        turned = [sign * q + 0.0 for q in (qx, qy, qz, qw)]
        return np.array([x, y, z, *turned, self.staircase.d_obs(y)])

    def reset(self, state: np.ndarray | None = None) -> np.ndarray:
        """Put the cube at rest into the start pose, or into ``state``.

        Parameters
        ----------
        state : array-like of shape (8,), optional
            A state as ``world.state`` gives it. d_obs is computed from the position.

        Returns
        -------
        ndarray of shape (8,)
            The state.

        Raises
        ------
        ValueError
            If the state is not finite, its quaternion is not of length 1 (in the plane: not a rotation about the x-axis), or the cube
            would stand inside the stairs.
        """
        if state is None:
            self._state = self.start
            return self.state
        values = finite_array("state", state, ndim=1)
        if len(values) != len(FEATURES):
            raise ValueError(f"state must have the {len(FEATURES)} entries {', '.join(FEATURES)}, not {len(values)}.")
        x, y, z, *quaternion = values[:7].tolist()
        checked = self._complete(x, y, z, *self._checked(quaternion))
        if max(abs(x), abs(y), abs(z)) > FARTHEST:
            raise ValueError(f"state must lie within {FARTHEST:g} m of the origin, not at {values[:3]}.")
        if z < 0 or (depth := self._overlap(checked)) > DEEPEST_START:
            raise ValueError(
                f"state must leave the cube above the stairs, but at y = {y:g} m, z = {z:g} m it stands "
                f"{'below the ground' if z < 0 else f'{depth:.3f} m inside them'}; upright on the tread there, z is "
                f"{self.staircase.height_at(y) + CUBE_EDGE / 2:g} m."
            )
        self._state = checked
        return self.state

    def _checked(self, quaternion: list[float]) -> list[float]:
        """Return a quaternion of length 1 that the cube of this world can have; raise a ValueError for another one."""
        raise NotImplementedError

    def _overlap(self, state: np.ndarray) -> float:
        """Depth to which a cube in ``state`` would stand inside the stairs [m]."""
        raise NotImplementedError

    def _move(
        self, magnitude: float, angle: float, rng: np.random.Generator | None, record: bool
    ) -> tuple[np.ndarray, float, Trajectory | None] | None:
        """Return end state, duration and path of a jump from the present state; None if it is not over within the time limit."""
        raise NotImplementedError

    def draw_start(self, rng: np.random.Generator) -> np.ndarray:
        """Draw a start: tread uniform over ground and all treads on which the cube fits, y uniform where it does; upright, at rest.

        Returns
        -------
        ndarray of shape (8,)
        """
        treads = np.vstack([[0.0, self.staircase.first_riser, 0.0], self.staircase.treads])
        treads = treads[treads[:, 1] - treads[:, 0] > 1.001 * CUBE_EDGE]
        begin, end, height = treads[rng.integers(len(treads))]
        return self.state_at(rng.uniform(begin + CUBE_EDGE / 2, end - CUBE_EDGE / 2), height + CUBE_EDGE / 2)

    def on_map(self, state: np.ndarray) -> bool:
        """Whether a state counts: 0 < y < end of the last tread - 0.04 m, ``|x|`` < 2.46 m, not above resting on the top."""
        x, y, z = (float(value) for value in state[:3])
        highest = self.staircase.top + CUBE_EDGE / 2 + MAP_MARGIN_Z
        return 0 < y < self.staircase.end - MAP_MARGIN_Y and abs(x) < MAP_HALF_WIDTH and 0 < z <= highest

    def perform(self, motion: np.ndarray, rng: np.random.Generator | None = None) -> Jump:
        """``jump`` for a motion given as an array of shape (2,): magnitude [N] and angle [deg]."""
        values = finite_array("motion", motion, ndim=1)
        if len(values) != 2:
            raise ValueError(f"motion must hold a magnitude and an angle, not {len(values)} numbers.")
        magnitude, angle = values.tolist()
        return self.jump(magnitude, angle, rng)

    def noise_scale(self, motion: np.ndarray) -> np.ndarray:
        """Return the standard deviation of actuation noise: 2 % of the magnitude [N] and 1 degree; shape (2,)."""
        return np.array([0.02 * motion[0], 1.0])

    def jump(
        self,
        magnitude: float,
        angle: float,
        rng: np.random.Generator | None = None,
        *,
        trajectory: bool = False,
    ) -> Jump:
        """Jump from the present state: a force at the centre of mass for 0.01 s, then flight, landing, and rest.

        Parameters
        ----------
        magnitude : float
            Force [N], 50 to 1000.
        angle : float
            Direction of the force above the +y axis in the y-z plane [deg], 1 to 89; it does not turn with the cube.
        rng : numpy.random.Generator, optional
            For what is random: the rocking of the tumbling world, the drift in x of the plane. Without it nothing is.
        trajectory : bool
            Whether to record the path. The outcome is the same to the bit.

        Returns
        -------
        Jump

        Raises
        ------
        ValueError
            If the motion lies outside the motion space.
        RuntimeError
            If the cube does not come to rest within 20 simulated seconds.
        """
        for name, value, low, high in zip(
            self.motion_names, (magnitude, angle), self.motion_low, self.motion_high, strict=True
        ):
            finite_number(name, value, low=low, high=high)
        if rng is not None and not isinstance(rng, np.random.Generator):
            raise TypeError(f"rng must be a numpy.random.Generator, not {rng!r}.")
        start = self.state
        moved = self._move(float(magnitude), float(angle), rng, trajectory)
        if moved is None:
            raise RuntimeError(
                f"The jump with {magnitude:g} N at {angle:g} degrees from the state {np.round(start, 4).tolist()} was not over after "
                f"{TIME_LIMIT:g} simulated seconds."
            )
        end, duration, path = moved
        self._state = end
        return Jump(float(magnitude), float(angle), start, end.copy(), self.on_map(end), duration, path)


class StairWorld(CubeWorld):
    """A cube before a staircase, in the y-z plane.

    Each jump is computed in a space of its own (see ``physics.py``); nothing is random unless x drifts.

    Parameters
    ----------
    staircase : Staircase, optional
        The stairs; four steps by default.
    x_drift : bool
        Let x drift by a small random model, for jumps that are given a generator. Off by default.

    Attributes
    ----------
    feature_names : tuple of str
        The eight features of a state.
    motion_names, motion_low, motion_high
        The motion space: magnitude 50 to 1000 N, angle 1 to 89 degrees.
    random : bool
        Whether x drifts.

    Examples
    --------
    >>> world = StairWorld()
    >>> jump = world.jump(600, 75)
    >>> round(jump.dz, 2)
    0.9
    """

    def __init__(self, staircase: Staircase | None = None, *, x_drift: bool = False) -> None:
        super().__init__(staircase)
        if not isinstance(x_drift, bool):
            raise TypeError(f"x_drift must be True or False, not {x_drift!r}.")
        self.x_drift = self.random = x_drift

    def __repr__(self) -> str:
        return f"StairWorld({self.staircase!r}, x_drift={self.x_drift})"

    def _checked(self, quaternion: list[float]) -> list[float]:
        qx, qy, qz, qw = quaternion
        norm = math.hypot(qx, qw)
        if abs(qy) > 1e-3 or abs(qz) > 1e-3 or abs(norm - 1) > 1e-3:
            raise ValueError(
                f"state must hold a unit quaternion that rotates about x, not {quaternion}: the plane has no other rotation."
            )
        if abs(norm - 1) > 1e-12:
            qx, qw = qx / norm, qw / norm
        return [qx, 0.0, 0.0, qw]

    def _overlap(self, state: np.ndarray) -> float:
        return overlap(self.staircase, state)

    def _move(
        self, magnitude: float, angle: float, rng: np.random.Generator | None, record: bool
    ) -> tuple[np.ndarray, float, Trajectory | None] | None:
        start = self._state
        fly = _fly if record else recall_or_fly
        flight = fly(self.staircase, tuple(start.tolist()), magnitude, angle, record)
        if flight is None:
            return None
        (y, z, rotation), duration, path = flight
        end = self.state_at(y, z, rotation, float(start[0]))
        if self.x_drift and rng is not None:
            end[0] += self._drift(round((z - float(start[2])) / self.staircase.rise), rng)
        return end, duration, path

    @staticmethod
    def _drift(steps: int, rng: np.random.Generator) -> float:
        """Draw dx for a jump that gained ``steps`` steps [m]: next to nothing on the ground; climbing, it may roll over sideways."""
        height = "ground" if steps < 1 else "climb" if steps < 4 else "four steps"
        kind = rng.choice(DRIFT_KINDS, p=DRIFT_SHARES[height])
        sizes = {
            "upright": rng.exponential(DRIFT_SCALE[height]),
            "creeps": rng.uniform(0, CREEP[height]),
            "rolls": rng.normal(CUBE_EDGE, 0.01),
            "tumbles": rng.uniform(*TUMBLE),
        }
        return float(rng.choice((-1.0, 1.0)) * sizes[kind])


def _fly(
    staircase: Staircase, state: tuple[float, ...], magnitude: float, angle: float, record: bool
) -> tuple[tuple[float, float, float], float, Trajectory | None] | None:
    """Return pose at rest, duration and path of a jump; None if it is not over within the time limit."""
    with interrupts_wait():
        flight = Flight(staircase, state, record)
        flight.push(magnitude, math.radians(angle))
        return (flight.pose, flight.duration, flight.trajectory) if flight.until_rest() else None


# A constant of physics.py that is changed in a running session has no effect on remembered jumps: call recall_or_fly.cache_clear().
recall_or_fly = lru_cache(maxsize=REMEMBERED_JUMPS)(_fly)
