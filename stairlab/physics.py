"""The stairs, the cube, and how they meet: rigid-body physics in the y-z plane (Pymunk; its x is our y, its y our z).

The contact model was read off jumps that the paper's authors recorded in Gazebo; each constant says what shows it. A jump is stepped
by 1 ms, but free flight is computed at once by the integrator's own recurrence, and rest is seen as soon as it is there.
"""

from __future__ import annotations

import math
import signal
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

import numpy as np
import pymunk

from stairlab._validation import finite_number, whole_number

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

# Contact: what the recorded jumps show of the physics engine behind them.
FRICTION = 1.0
""" Coulomb friction between cube and stairs: cubes that slide over the ground stop after v² / (2 g) """
FLUSH_RISER_FRICTION = 0.475
""" Friction when a whole face meets a riser at once: the recorded impulse along the riser is at most 0.47 to 0.48 of the
impulse against it, while edges and corners grip with 1 """
REBOUND_SPEED = 0.01
""" Speed at which a riser gives the cube back [m/s], the same for every impact, as if bodies that overlap were pushed apart no faster:
the recorded gap between cube and riser is this speed times the time that the cube then falls, to a few micrometres """
SLIDING_RESTITUTION = 0.12
""" Share of its speed that a riser gives back to a cube that slides into it, in contact with the ground or a tread ... """
HARDEST_SLIDING_REBOUND = 2.9
""" ... up to this speed [m/s]: of the recorded cubes that slid faster, nearly all ended flush with the riser """
SOLVER_ITERATIONS = 50
""" Iterations of the contact solver in each step: 10 leave a flush impact half solved (median error in y 0.7 mm instead of 0.1) """
CONTACT_SLOP = 5e-6
""" Overlap that is not corrected [m]: far below the gaps, and enough to keep a contact alive while the cube rests """
SLOWEST_IMPACT = 0.02
""" Below this speed a contact is resting, not an impact: no rebound [m/s] """
STANDING = 1e-4
""" A cube whose lower face is as near to the ground or a tread as this stands on it [m] """
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
GROUND_REACH = 1000.0
""" The ground goes on for this far to both sides of the cube: farther than any jump within the time limit [m] """
MAX_STEPS = round(TIME_LIMIT / TIME_STEP)
STEPS = np.arange(MAX_STEPS + 1, dtype=float)
FALL = -GRAVITY * TIME_STEP**2 * STEPS * (STEPS - 1) / 2
""" Height gained after n steps from rest by the integrator's recurrence z += v dt, then v -= g dt [m] """
NO_RISER = 10.0
""" d_obs where no riser is ahead [m] """


@dataclass(frozen=True)
class Staircase:
    """The stairs (figure 1a of the paper): their geometry, and how their risers rebound. Riser k is at ``first_riser + (k - 1) run``.

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
    restitution : float, optional
        Share of its speed that a riser gives back to the cube at every impact, 0 to 1. By default it rebounds as the recorded jumps
        show (see ``REBOUND_SPEED`` and ``SLIDING_RESTITUTION``). Try other values to see whether a result depends on the rebound.

    Raises
    ------
    ValueError, TypeError
        If a length is not positive and finite, ``n_steps`` is not a whole number from 1 to 200, or ``restitution`` is not a
        number from 0 to 1.
    """

    n_steps: int = 4
    rise: float = 0.3
    run: float = 0.4
    first_riser: float = 0.6
    last_run: float | None = None
    restitution: float | None = None

    def __post_init__(self) -> None:
        whole_number("n_steps", self.n_steps, low=1, high=200)
        for name in ("rise", "run", "first_riser"):
            finite_number(name, getattr(self, name), above=0)
        if self.last_run is None:
            object.__setattr__(self, "last_run", self.run)
        finite_number("last_run", self.last_run, above=0)
        if self.restitution is not None:
            finite_number("restitution", self.restitution, low=0, high=1)

    @classmethod
    def fifteen(cls, restitution: float | None = None) -> Staircase:
        """Return the stairs of the learning task: fifteen steps, the last tread 10 m deep."""
        return cls(n_steps=15, last_run=10.0, restitution=restitution)

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
    x : ndarray of shape (n,), optional
        Centre of the cube, to the side [m]. None in the plane, where it stays what it was.
    quaternions : ndarray of shape (n, 4), optional
        Rotation as qx, qy, qz, qw. None in the plane, where ``rotation`` says all.
    """

    time: np.ndarray
    y: np.ndarray
    z: np.ndarray
    rotation: np.ndarray
    x: np.ndarray | None = None
    quaternions: np.ndarray | None = None


def build_space(staircase: Staircase, state: Sequence[float] | np.ndarray) -> tuple[pymunk.Space, pymunk.Body]:
    """Build the stairs and the cube at rest in ``state``, ready to be stepped; in Pymunk, x is our y and y is our z.

    Parameters
    ----------
    staircase : Staircase
        The stairs.
    state : sequence of 8 floats
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
    space.on_collision(begin=_meet_riser, data=staircase)
    return space, cube


def _block(space: pymunk.Space, begin: float, end: float, height: float) -> pymunk.Poly:
    block = pymunk.Poly(space.static_body, [(begin, -1.0), (end, -1.0), (end, height), (begin, height)])
    block.friction = FRICTION  # Pymunk multiplies the frictions of the two shapes; the cube's is 1
    return block


def overlap(staircase: Staircase, state: np.ndarray) -> float:
    """Depth to which a cube in ``state`` would stand inside the stairs [m]."""
    space, cube = build_space(staircase, state)
    meetings = [meeting for shape in cube.shapes for meeting in space.shape_query(shape)]
    return max((-point.distance for meeting in meetings for point in meeting.contact_point_set.points), default=0.0)


def _meet_riser(arbiter: pymunk.Arbiter, space: pymunk.Space, staircase: Staircase) -> None:
    """Let the cube rebound from a riser, by how it meets it, and grip it less when a whole face does."""
    contacts = arbiter.contact_point_set
    normal_y, normal_z = contacts.normal
    if abs(normal_y) < 0.7:  # the ground or a tread
        return
    cube = next(body for shape in arbiter.shapes if (body := shape.body) and body is not space.static_body)
    (y, z), (vy, vz), spin = cube.position, cube.velocity, cube.angular_velocity
    corners = [point.point_a for point in contacts.points]
    speed = max(abs((vy - spin * (cz - z)) * normal_y + (vz + spin * (cy - y)) * normal_z) for cy, cz in corners)
    if speed > SLOWEST_IMPACT and staircase.restitution is not None:
        arbiter.restitution = staircase.restitution
    elif speed > SLOWEST_IMPACT:
        stands = abs(z - CUBE_EDGE / 2 - staircase.height_at(y)) < STANDING and abs(vz) < SLOWEST_IMPACT
        slides = stands and speed < HARDEST_SLIDING_REBOUND
        arbiter.restitution = SLIDING_RESTITUTION if slides else REBOUND_SPEED / speed
    if len(corners) == 2 and math.dist(*corners) > 0.99 * CUBE_EDGE:
        arbiter.friction = FLUSH_RISER_FRICTION


@contextmanager
def interrupts_wait() -> Iterator[None]:
    """Let Ctrl-C wait until the block is left, some milliseconds: raised inside a callback of Pymunk, it would be lost."""
    handler = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(handler):
        yield
        return
    caught: list[tuple[int, FrameType | None]] = []
    signal.signal(signal.SIGINT, lambda *arguments: caught.append(arguments))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
        if caught:
            handler(*caught[0])


class Flight:
    """A jump under way: steps the space, but computes free flight at once and sees rest early."""

    def __init__(self, staircase: Staircase, state: Sequence[float], record: bool) -> None:
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
        """Time of the poll that ends the jump, at rest: the first that finds the cube within 1 mm of the poll before [s]."""
        (y, z), (last_y, last_z) = self.body.position, self.polls[-1]
        moved = abs(y - last_y) + abs(z - last_z) >= 1e-3
        return POLL_TIME * (len(self.polls) + moved)

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
