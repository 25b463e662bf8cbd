"""The world of the paper (section 4, figure 1): a cube that jumps before, and up, a staircase.

The robot is a cube of 1 kg that can do one thing: push itself off with a force of some magnitude and angle. The simulation is
rigid-body physics in the y-z plane (Pymunk), tuned against jumps that the paper's authors recorded in Gazebo.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import pymunk

from stairlab._validation import finite_array, finite_number, whole_number

GRAVITY = 9.81
""" Gravitational acceleration [m/s²] """
TIME_STEP = 0.001
""" Time step of the simulation [s] """
CUBE_EDGE = 0.1
""" Edge of the cube [m] """
CUBE_MASS = 1.0
""" Mass of the cube [kg] """
CUBE_INERTIA = 0.0016667
""" Moment of inertia of the cube about an axis through its centre [kg m²] """
PUSH_STEPS = 10
""" The force acts for 10 steps, 0.01 s """
TIME_LIMIT = 20.0
""" A jump that takes longer is an error [s] """

# Contact. The values belong to the physics engine behind the recorded jumps; each was read off those jumps.
FRICTION = 1.0
""" Coulomb friction between cube and stairs: cubes that slide over the ground stop after v² / (2 g) """
FLUSH_RISER_FRICTION = 0.475
""" Friction when a whole face meets a riser at once: the recorded impulse along the riser is at most 0.47 to 0.48 of the
impulse against it, while edges and corners grip with 1 """
REBOUND_SPEED = 0.01
""" Speed at which a riser gives the cube back [m/s]. It is the same for every impact, because that engine pushes bodies that
overlap apart no faster than this: the gap that a cube leaves to the riser is this speed times the time it then falls """
SOLVER_ITERATIONS = 50
""" Iterations of the contact solver a step, as many as the recorded engine makes: fewer leave a flush impact half solved """
CONTACT_SLOP = 5e-6
""" Overlap that is not corrected [m]: far below the gaps, and enough to keep a contact alive while the cube rests """
SLOWEST_IMPACT = 0.02
""" Below this speed a contact is resting, not an impact: no rebound [m/s] """
RELEASE_VELOCITY = -GRAVITY * TIME_STEP / 2
""" Vertical velocity at the first step of the force [m/s]. Half a step of gravity ahead (leapfrog), the positions at the steps lie on
the exact parabola. The recorded flights scatter about it, by whole steps: some last one step longer, some one shorter """

# Rest, and how far ahead free flight is computed at once.
REST_STEPS = 50
""" The cube rests when its pose has changed by less than REST_SHIFT [m] and REST_TURN [rad] over these steps """
REST_SHIFT = 1e-5
REST_TURN = 1e-4
POLL_TIME = 1.0
""" The published rule polls once a second; a jump's duration is reported by that rule [s] """
CHECK_STEPS = 10
""" Steps between two looks at whether the cube flies free or rests """
CUBE_REACH = CUBE_EDGE / math.sqrt(2) + 0.001
""" Radius of a circle about the centre that holds the cube in every rotation, and a margin [m] """
DEEPEST_START = 0.01
""" A state may overlap the stairs by this much [m] """
GROUND_REACH = 1000.0
""" The ground goes on for this far to both sides of the cube: farther than any jump within the time limit [m] """
FARTHEST = 1e6
""" Positions beyond it are refused: a micrometre would be lost among the digits of a number [m] """
MAX_STEPS = round(TIME_LIMIT / TIME_STEP)
STEPS = np.arange(MAX_STEPS + 1, dtype=float)
FALL = -GRAVITY * TIME_STEP**2 * STEPS * (STEPS - 1) / 2
""" Height gained after n steps from rest by the integrator's recurrence z += v dt, then v -= g dt [m] """

NO_RISER = 10.0
""" d_obs where no riser is ahead [m] """
FEATURES = ("x", "y", "z", "qx", "qy", "qz", "qw", "d_obs")
START_Y = 0.25
""" Start pose: y of the cube's centre [m] """
MAP_MARGIN_Y = 0.04
""" The map ends this far before the end of the last tread [m] """
MAP_HALF_WIDTH = 2.46
""" The map's extent in x, to both sides [m] """
MAP_MARGIN_Z = 0.001
""" A cube on the map is at most this far above resting on the top tread [m] """

# Drift in x (off by default). Shares and scales follow the recorded jumps: those that climb roll over sideways in 30 % of the cases.
DRIFT_ON_GROUND = 0.0005
""" Scale of the exponential |dx| of a jump that does not climb [m] """
DRIFT_UPRIGHT = 0.003
""" Scale of the exponential |dx| of a climbing jump that does not roll [m] """
ROLL_SHARES = {"climbs": (0.58, 0.30, 0.12), "four steps or more": (0.25, 0.45, 0.30)}
""" Shares of climbing jumps that stay upright, roll over by one edge (0.1 m), tumble on (0.15 to 0.28 m) """


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

    feature_names: Sequence[str]
    motion_names: Sequence[str]
    motion_low: np.ndarray
    motion_high: np.ndarray

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


@dataclass(frozen=True)
class Staircase:
    """The geometry of the stairs (figure 1a of the paper). Step k has its riser at ``first_riser + (k - 1) run``.

    Parameters
    ----------
    n_steps : int
        Number of steps: 4 where the paper samples, 15 where it learns.
    rise, run : float
        Height and depth of a step [m].
    first_riser : float
        y of the first riser [m].
    last_run : float, optional
        Depth of the last tread [m], ``run`` by default. Behind it the ground goes on at z = 0.

    Raises
    ------
    ValueError, TypeError
        If a length is not positive and finite, or ``n_steps`` is not a whole number from 1 on.
    """

    n_steps: int = 4
    rise: float = 0.3
    run: float = 0.4
    first_riser: float = 0.6
    last_run: float | None = None

    def __post_init__(self) -> None:
        whole_number("n_steps", self.n_steps, low=1, high=200)
        for name in ("rise", "run", "first_riser"):
            finite_number(name, getattr(self, name), above=0)
        if self.last_run is None:
            object.__setattr__(self, "last_run", self.run)
        finite_number("last_run", self.last_run, above=0)

    @classmethod
    def fifteen(cls) -> Staircase:
        """Return the stairs of the learning task: fifteen steps, the last tread 10 m deep."""
        return cls(n_steps=15, last_run=10.0)

    @property
    def risers(self) -> np.ndarray:
        """y of each riser, shape (n_steps,) [m]."""
        return self.first_riser + self.run * np.arange(self.n_steps)

    @property
    def heights(self) -> np.ndarray:
        """Height of each tread, shape (n_steps,) [m]."""
        return self.rise * np.arange(1, self.n_steps + 1)

    @property
    def end(self) -> float:
        """y of the end of the last tread [m]."""
        return float(self.first_riser + self.run * (self.n_steps - 1) + (self.last_run or 0.0))

    @property
    def top(self) -> float:
        """Height of the last tread [m]."""
        return self.rise * self.n_steps

    @property
    def treads(self) -> np.ndarray:
        """Begin, end and height of each tread, shape (n_steps, 3) [m]."""
        return np.column_stack([self.risers, np.append(self.risers[1:], self.end), self.heights])

    def height_at(self, y: float) -> float:
        """Height of the stairs at ``y`` [m]."""
        return 0.0 if y >= self.end else self.rise * self.risers_before(y)

    def risers_before(self, y: float) -> int:
        """Count the risers at or before ``y``."""
        passed = math.floor((y - self.first_riser) / self.run + 1e-9) + 1
        return min(max(passed, 0), self.n_steps)

    def next_riser(self, y: float) -> float:
        """Return y of the next riser ahead of ``y``, infinity where there is none [m]."""
        passed = self.risers_before(y)
        return math.inf if passed == self.n_steps else self.first_riser + self.run * passed

    def d_obs(self, y: float) -> float:
        """Return the distance from ``y`` to the next riser, 10 where there is none [m]."""
        riser = self.next_riser(y)
        return NO_RISER if riser == math.inf else riser - y


@dataclass(frozen=True, eq=False)
class Trajectory:
    """The path of a jump, one entry a millisecond.

    Attributes
    ----------
    time : ndarray of shape (n,)
        Time since the force set in [s].
    y, z : ndarray of shape (n,)
        Centre of the cube [m].
    rotation : ndarray of shape (n,)
        Rotation about the x-axis, not wrapped [rad].
    """

    time: np.ndarray
    y: np.ndarray
    z: np.ndarray
    rotation: np.ndarray


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


class StairWorld:
    """A cube before a staircase, in the y-z plane.

    ``jump`` acts on the present state and leaves the world in the state the jump ends in; ``reset`` goes back to the start, or to
    any state. A jump depends on nothing but the state, the motion and, with drift, the generator: each is computed in a
    space of its own.

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

    Examples
    --------
    >>> world = StairWorld()
    >>> jump = world.jump(600, 75)
    >>> round(jump.dz, 2)
    0.9
    """

    feature_names = FEATURES
    motion_names = ("magnitude", "angle")

    def __init__(self, staircase: Staircase | None = None, *, x_drift: bool = False) -> None:
        if staircase is not None and not isinstance(staircase, Staircase):
            raise TypeError(f"staircase must be a Staircase, not {staircase!r}.")
        self.staircase = staircase or Staircase()
        if self.staircase.first_riser < START_Y + CUBE_EDGE / 2:
            raise ValueError(
                f"staircase must leave the start pose free, with a first_riser of {START_Y + CUBE_EDGE / 2:g} m or more, "
                f"not {self.staircase.first_riser:g}."
            )
        self.x_drift = bool(x_drift)
        self.motion_low = np.array([50.0, 1.0])
        self.motion_high = np.array([1000.0, 89.0])
        self._state = self.start

    def __repr__(self) -> str:
        return f"StairWorld({self.staircase!r}, x_drift={self.x_drift})"

    @property
    def start(self) -> np.ndarray:
        """The start pose: y = 0.25 m, upright on the ground, at rest; shape (8,)."""
        return self.state_at(START_Y, CUBE_EDGE / 2)

    @property
    def state(self) -> np.ndarray:
        """A copy of the present state, shape (8,); give it to ``reset`` to come back to it exactly."""
        return self._state.copy()

    def state_at(self, y: float, z: float, rotation: float = 0.0, x: float = 0.0) -> np.ndarray:
        """Return the state of a cube at ``y``, ``z``, ``x`` [m], rotated by ``rotation`` about the x-axis [rad]; shape (8,)."""
        qx, qw = math.sin(rotation / 2), math.cos(rotation / 2)
        return self._complete(x, y, z, qx, qw)

    def _complete(self, x: float, y: float, z: float, qx: float, qw: float) -> np.ndarray:
        """Give the quaternion its canonical sign (qw >= 0) and append d_obs."""
        sign = -1.0 if qw < 0 or (qw == 0 and qx < 0) else 1.0
        return np.array([x, y, z, sign * qx + 0.0, 0.0, 0.0, sign * qw + 0.0, self.staircase.d_obs(y)])

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
            If the state is not finite, its rotation is not one about the x-axis, or the cube would stand inside the stairs.
        """
        self._state = self.start if state is None else self._checked(state)
        return self.state

    def _checked(self, state: np.ndarray) -> np.ndarray:
        values = finite_array("state", state, ndim=1)
        if len(values) != len(FEATURES):
            raise ValueError(f"state must have the {len(FEATURES)} entries {', '.join(FEATURES)}, not {len(values)}.")
        x, y, z, qx, qy, qz, qw, _ = values.tolist()
        if abs(qy) > 1e-3 or abs(qz) > 1e-3 or abs(math.hypot(qx, qw) - 1) > 1e-3:
            raise ValueError(f"state must hold a unit quaternion that rotates about x, not {values[3:7]}.")
        if abs((norm := math.hypot(qx, qw)) - 1) > 1e-12:
            qx, qw = qx / norm, qw / norm
        checked = self._complete(x, y, z, qx, qw)
        if max(abs(x), abs(y), abs(z)) > FARTHEST:
            raise ValueError(f"state must lie within {FARTHEST:g} m of the origin, not at {values[:3]}.")
        if z < 0 or (depth := _overlap(self.staircase, checked)) > DEEPEST_START:
            raise ValueError(
                f"state must leave the cube above the stairs, but at y = {y:g} m, z = {z:g} m it stands "
                f"{'below the ground' if z < 0 else f'{depth:.3f} m inside them'}; upright on the tread there, z is "
                f"{self.staircase.height_at(y) + CUBE_EDGE / 2:g} m."
            )
        return checked

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
        """Whether a state counts: 0 < y < end of the last tread - 0.04 m, |x| < 2.46 m, not above resting on the top."""
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
            For the drift in x. Without it, or in a world without drift, x stays as it is.
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
        flight = _Flight(self.staircase, start, trajectory)
        flight.push(float(magnitude), math.radians(angle))
        if not flight.until_rest():
            raise RuntimeError(
                f"The jump with {magnitude:g} N at {angle:g} degrees from the state {np.round(start, 4).tolist()} was not over after "
                f"{TIME_LIMIT:g} simulated seconds."
            )
        y, z, rotation = flight.pose
        end = self.state_at(y, z, rotation, float(start[0]))
        if self.x_drift and rng is not None:
            end[0] += self._drift(round((z - float(start[2])) / self.staircase.rise), rng)
        self._state = end
        return Jump(
            float(magnitude),
            float(angle),
            start,
            end.copy(),
            self.on_map(end),
            flight.duration,
            flight.trajectory,
        )

    @staticmethod
    def _drift(steps: int, rng: np.random.Generator) -> float:
        """Draw dx for a jump that gained ``steps`` steps [m]: next to nothing on the ground; climbing, it may roll over sideways."""
        shares = ROLL_SHARES["four steps or more" if steps >= 4 else "climbs"]
        kind = rng.choice(3, p=shares)
        candidates = (rng.exponential(DRIFT_UPRIGHT), rng.normal(CUBE_EDGE, 0.005), rng.uniform(0.15, 0.28))
        size = candidates[kind] if steps > 0 else rng.exponential(DRIFT_ON_GROUND)
        return float(rng.choice((-1.0, 1.0)) * size)


def build_space(staircase: Staircase, state: np.ndarray) -> tuple[pymunk.Space, pymunk.Body]:
    """Build the stairs and the cube at rest in ``state``, ready to be stepped; in Pymunk, x is our y and y is our z.

    Parameters
    ----------
    staircase : Staircase
        The stairs.
    state : ndarray of shape (8,)
        State of the cube.

    Returns
    -------
    space : pymunk.Space
        With gravity, the ground, the steps and the cube.
    body : pymunk.Body
        The cube.
    """
    here = float(state[1])
    space = pymunk.Space()
    space.gravity = (0.0, -GRAVITY)
    space.iterations = SOLVER_ITERATIONS
    space.collision_slop = CONTACT_SLOP
    space.collision_bias = 0.0  # an overlap is taken back within one step, without leaving the cube any speed
    space.add(
        *(
            _block(space, begin, end, height)
            for begin, end, height in [(here - GROUND_REACH, here + GROUND_REACH, 0.0), *staircase.treads.tolist()]
        )
    )
    cube = pymunk.Body(CUBE_MASS, CUBE_INERTIA)
    shape = pymunk.Poly.create_box(cube, (CUBE_EDGE, CUBE_EDGE))
    shape.friction = 1.0
    space.add(cube, shape)
    cube.position = float(state[1]), float(state[2])
    cube.angle = 2 * math.atan2(state[3], state[6])
    space.on_collision(begin=_meet_riser)
    return space, cube


def _block(space: pymunk.Space, begin: float, end: float, height: float) -> pymunk.Poly:
    block = pymunk.Poly(space.static_body, [(begin, -1.0), (end, -1.0), (end, height), (begin, height)])
    block.friction = FRICTION  # Pymunk multiplies the frictions of the two shapes; the cube's is 1
    return block


def _overlap(staircase: Staircase, state: np.ndarray) -> float:
    """Depth to which a cube in ``state`` would stand inside the stairs [m]."""
    space, cube = build_space(staircase, state)
    meetings = [meeting for shape in cube.shapes for meeting in space.shape_query(shape)]
    return max((-point.distance for meeting in meetings for point in meeting.contact_point_set.points), default=0.0)


def _meet_riser(arbiter: pymunk.Arbiter, space: pymunk.Space, data: object) -> None:
    """Let the cube rebound from a riser with REBOUND_SPEED, and grip it less when a whole face meets it."""
    contacts = arbiter.contact_point_set
    normal_y, normal_z = contacts.normal
    if abs(normal_y) < 0.7:  # the ground or a tread
        return
    cube = next(body for shape in arbiter.shapes if (body := shape.body) and body is not space.static_body)
    (y, z), (vy, vz), spin = cube.position, cube.velocity, cube.angular_velocity
    corners = [point.point_a for point in contacts.points]
    speed = max(abs((vy - spin * (cz - z)) * normal_y + (vz + spin * (cy - y)) * normal_z) for cy, cz in corners)
    if speed > SLOWEST_IMPACT:
        arbiter.restitution = REBOUND_SPEED / speed
    if len(corners) == 2 and math.dist(*corners) > 0.99 * CUBE_EDGE:
        arbiter.friction = FLUSH_RISER_FRICTION


class _Flight:
    """One jump under way: steps the space, but computes free flight at once and sees rest early."""

    def __init__(self, staircase: Staircase, state: np.ndarray, record: bool) -> None:
        self.space, self.body = build_space(staircase, state)
        self.staircase = staircase
        self.steps = 0
        self.polls = [self.body.position]
        self.path: list[np.ndarray] | None = [] if record else None
        if self.path is not None:
            self.path.append(np.array([[0, *self.pose]]))

    @property
    def pose(self) -> tuple[float, float, float]:
        """y, z [m] and rotation [rad]."""
        (y, z), rotation = self.body.position, self.body.angle
        return y, z, rotation

    @property
    def duration(self) -> float:
        """Time of the first poll that finds the cube no more than 1 mm from where it was at the poll before [s]."""
        here = self.body.position
        moved = [
            abs(a.x - b.x) + abs(a.y - b.y) >= 1e-3 for a, b in zip(self.polls, [*self.polls[1:], here], strict=True)
        ]
        return POLL_TIME * (len(moved) + 1 if moved[-1] else len(moved))

    @property
    def trajectory(self) -> Trajectory | None:
        """The path so far, if it is recorded."""
        if self.path is None:
            return None
        steps, y, z, rotation = np.vstack(self.path).T
        return Trajectory(steps * TIME_STEP, y, z, rotation)

    def push(self, magnitude: float, angle: float) -> None:
        """Apply the force for PUSH_STEPS steps."""
        self.body.velocity = (0.0, RELEASE_VELOCITY)
        force = (magnitude * math.cos(angle), magnitude * math.sin(angle))
        for _ in range(PUSH_STEPS):
            self.body.apply_force_at_world_point(force, self.body.position)
            self.step(1)

    def until_rest(self) -> bool:
        """Go on until the cube rests; False if it does not within the time limit."""
        pose, since = self.pose, self.steps
        while self.steps < MAX_STEPS:
            self.fly()
            self.step(CHECK_STEPS)
            y, z, rotation = self.pose
            if abs(y - pose[0]) + abs(z - pose[1]) > REST_SHIFT or abs(rotation - pose[2]) > REST_TURN:
                pose, since = (y, z, rotation), self.steps
            elif self.steps - since >= REST_STEPS:
                return True
        return False

    def step(self, count: int) -> None:
        """Make ``count`` steps of the simulation."""
        for _ in range(count):
            self.space.step(TIME_STEP)
            self.steps += 1
            if self.path is not None:
                self.path.append(np.array([[self.steps, *self.pose]]))
            if self.steps % 1000 == 0:
                self.polls.append(self.body.position)

    def fly(self) -> None:
        """Jump ahead while nothing is in the cube's reach, by the closed form of the integrator's recurrence.

        .. math:: y_n = y_0 + n v_y \\Delta t, \\quad z_n = z_0 + n v_z \\Delta t - g \\Delta t^2 n (n - 1) / 2
        """
        (y, z), (vy, vz), spin = self.body.position, self.body.velocity, self.body.angular_velocity
        clearance = z - CUBE_REACH - self.ground_below(y)
        if clearance <= 0 or (steps := self.free_steps(y, z, vy, vz)) < CHECK_STEPS:
            return
        ahead = STEPS[: steps + 1]
        path_y, path_z = y + ahead * (vy * TIME_STEP), z + ahead * (vz * TIME_STEP) + FALL[: steps + 1]
        rotation = self.body.angle + ahead * (spin * TIME_STEP)
        for poll in range(1000 - self.steps % 1000, steps + 1, 1000):
            self.polls.append(pymunk.Vec2d(path_y[poll], path_z[poll]))
        if self.path is not None:
            self.path.append(np.column_stack([self.steps + ahead, path_y, path_z, rotation])[1:])
        self.body.position = float(path_y[-1]), float(path_z[-1])
        self.body.velocity = vy, vz - GRAVITY * TIME_STEP * steps
        self.body.angle = float(rotation[-1])
        self.steps += steps

    def ground_below(self, y: float) -> float:
        """Height of the highest tread within the cube's reach of ``y`` [m]."""
        if y - CUBE_REACH >= self.staircase.end:
            return 0.0
        return self.staircase.rise * self.staircase.risers_before(y + CUBE_REACH)

    def free_steps(self, y: float, z: float, vy: float, vz: float) -> int:
        """Count the steps until the cube could touch anything."""
        until_ground = (vz + math.sqrt(vz * vz + 2 * GRAVITY * max(z - CUBE_REACH, 0.0))) / GRAVITY
        last = min(math.ceil(until_ground / TIME_STEP) + 1, MAX_STEPS - self.steps)
        ahead = STEPS[: last + 1]
        path_y = y + ahead * (vy * TIME_STEP)
        path_z = z + ahead * (vz * TIME_STEP) + FALL[: last + 1]
        stairs = self.staircase
        passed = np.floor((path_y + (CUBE_REACH - stairs.first_riser)) / stairs.run + 1e-9) + 1
        below = stairs.rise * np.clip(passed, 0, stairs.n_steps)
        below[path_y - CUBE_REACH >= stairs.end] = 0.0
        touching = path_z - CUBE_REACH <= below
        return max(int(np.argmax(touching)) - 1, 0) if touching.any() else last - 1
