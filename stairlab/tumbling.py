r"""The same stairs in three dimensions: a world in which the cube turns and rolls (section 4 and figure 1 of the paper).

The paper's simulator is three-dimensional. A cube that lands on an edge there may end up turned or aside, and from such a pose its
next jump is another one. The plane of ``StairWorld`` cannot show that. This module simulates one rigid cube among axis-aligned
boxes, in steps of a millisecond. Read it from top to bottom:

1. *Rotation*: :func:`rotation_matrix`, :func:`turn`.
2. *Contacts* of two boxes: :func:`least_overlap` (separating axes), :func:`edge_contact`, :func:`face_contact` (clipping),
   :func:`find_contacts`.
3. *Impulses* that keep contacts apart and rub: :func:`write_rows`, :func:`solve` (sequential impulses).
4. *Time*: :func:`step`, :func:`simulate`.
5. *The world*: :class:`TumblingWorld`.

What makes it agree with the authors' simulator (``stairlab fidelity --world tumbling`` measures how well):

- *Two solutions in each step.* Overlap must go, but pushing bodies apart must not throw them. So the velocities are solved twice. The
  solution that moves the cube takes away the whole overlap at once. The solution that is kept for the next step takes away
  at most 0.01 m/s worth of it (``PUSH_OUT``), the rebound that the recorded jumps show.
- *Rocking.* In the authors' simulator a resting cube trembles a little, because the sweeps of its contact solver do not settle it.
  Started from exact rest, 1 % of the climbing jumps roll aside; started from such a trembling, a third, as recorded. Here
  the trembling is drawn before each jump from the jump's random generator: angular velocities about x and y.

Functions under ``@njit`` are compiled by Numba when they are first called, and the result is kept on disk. With the environment
variable ``NUMBA_DISABLE_JIT=1`` they run as plain Python and can be stepped through in a debugger.
"""

from __future__ import annotations

import math
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from inspect import signature
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from stairlab._validation import finite_number, one_of
from stairlab.physics import CUBE_EDGE, CUBE_INERTIA, GRAVITY, PUSH_STEPS, TIME_LIMIT, TIME_STEP, Staircase, Trajectory
from stairlab.world import CubeWorld, StairWorld

HALF_EDGE = CUBE_EDGE / 2
""" Half of the cube's edge [m] """
INVERSE_INERTIA = round(1 / CUBE_INERTIA)
""" Inverse moment of inertia of the cube, the same about every axis [1/(kg m²)]; its mass is 1 kg """
REACH = math.sqrt(3) * HALF_EDGE + 0.001
""" Radius of a sphere about the centre that holds the cube in every rotation, and a margin [m] """
HALF_WIDTH = 2.5
""" The steps extend so far to both sides [m] """
GROUND_REACH = 1000.0
""" The ground extends so far in all directions [m] """

SWEEPS = 50
""" Sweeps of the contact solver over all rows, as many as in the authors' simulator """
CONVERGED = 1e-12
""" A sweep that changes the impulses by less than this in all is the last one [N s] """
PUSH_OUT = 0.01
""" Overlap adds at most this to the velocity that is kept [m/s]: the recorded rebound from a riser, whatever the impact """
EDGE_PREFERENCE = 1.05
""" Two edges are the contact only if their overlap is smaller than any face's by this factor: faces give steadier contacts """
PARALLEL = 1e-6
""" Two axes whose sine is below this are parallel: they span no separating direction of their own """
MOST_CONTACTS = 32
""" Four boxes, eight points each """

ROCKING = (0.06, 0.12)
""" Before a jump the cube rocks with angular velocities up to these about x and y [rad/s], drawn uniformly. The authors' simulator
shows up to 0.1 rad/s at rest. With these, 28 to 32 % of the climbing jumps end more than 5 cm aside (recorded: 35 %) and 35 to 36 %
turned by more than 5 degrees (recorded: 23 %): five seeds, 2,000 recorded jumps """
FIXED_ROCKING = (0.03, 0.06)
""" A jump without a generator rocks with these about x and y [rad/s]: half of the largest """

REST_STEPS = 80
""" The cube rests when over these steps no coordinate has moved by REST_SHIFT [m], no quaternion component by REST_TURN """
REST_SHIFT = 2e-5
REST_TURN = 1e-4
POLL_STEPS = 1000
""" Steps between two polls of the published rule, one second """
POLL_SHIFT = 1e-3
""" By the published rule a jump is over when |dx| + |dy| + |dz| between two polls is below this [m] """
CREEP_SHIFT = 0.01
""" At the time limit a cube that moved by less than this in one of the last two seconds counts as at rest [m]. A jump in some 500,000
ends on a tread with a tremor of four steps that moves the cube aside by 1.4 mm in a second, a little too much for the published rule.
One in some ten million slides down a riser that it leans on, and begins to tip over in the last second """
MAX_STEPS = round(TIME_LIMIT / TIME_STEP)

SLOW_START = 1.5
""" A first jump that takes longer than this is being compiled, and the reader is told [s] """


class Stairs(NamedTuple):
    """The stairs as compiled functions need them: see ``Staircase``; lengths in metres."""

    n_steps: int
    rise: float
    run: float
    first_riser: float
    end: float


class Cube(NamedTuple):
    """The cube: centre [m], unit quaternion x y z w, and twist: velocity [m/s] and angular velocity [rad/s], six numbers."""

    centre: np.ndarray
    quaternion: np.ndarray
    twist: np.ndarray


class Contacts(NamedTuple):
    """Points where the cube overlaps the stairs [m], normals towards the cube, depths of overlap [m]; and room for the solver."""

    points: np.ndarray
    normals: np.ndarray
    depths: np.ndarray
    rows: np.ndarray
    impulses: np.ndarray
    polygons: np.ndarray


@njit(cache=True)
def empty_contacts() -> Contacts:
    """Make room for the contacts of a step."""
    return Contacts(
        np.zeros((MOST_CONTACTS, 3)),
        np.zeros((MOST_CONTACTS, 3)),
        np.zeros(MOST_CONTACTS),
        np.zeros((MOST_CONTACTS, 3, 7)),
        np.zeros((2, MOST_CONTACTS, 3)),
        np.zeros((2, 16, 3)),
    )


# 1. Rotation


@njit(cache=True)
def rotation_matrix(quaternion: np.ndarray) -> np.ndarray:
    r"""Return the rotation matrix of a unit quaternion; its columns are the cube's axes in the world, shape (3, 3).

    .. math:: R = I + 2 w [q]_\times + 2 [q]_\times^2
    """
    x, y, z, w = quaternion
    axes = np.empty((3, 3))
    axes[0, 0], axes[0, 1], axes[0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)
    axes[1, 0], axes[1, 1], axes[1, 2] = 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)
    axes[2, 0], axes[2, 1], axes[2, 2] = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)
    return axes


@njit(cache=True)
def turn(quaternion: np.ndarray, spin: np.ndarray, time: float) -> None:
    r"""Turn a quaternion by a constant angular velocity [rad/s] for a time [s], exactly.

    .. math:: q(t) = \left(\frac{\omega}{|\omega|} \sin\frac{|\omega| t}{2}, \; \cos\frac{|\omega| t}{2}\right) q(0)
    """
    x, y, z, w = quaternion
    speed = math.sqrt(spin[0] ** 2 + spin[1] ** 2 + spin[2] ** 2)
    scale = math.sin(0.5 * speed * time) / speed if speed > 0 else 0.0
    a, b, c, d = scale * spin[0], scale * spin[1], scale * spin[2], math.cos(0.5 * speed * time)
    quaternion[0] = d * x + a * w + b * z - c * y
    quaternion[1] = d * y - a * z + b * w + c * x
    quaternion[2] = d * z + a * y - b * x + c * w
    quaternion[3] = d * w - a * x - b * y - c * z
    norm = math.sqrt(quaternion[0] ** 2 + quaternion[1] ** 2 + quaternion[2] ** 2 + quaternion[3] ** 2)
    for i in range(4):
        quaternion[i] /= norm


# 2. Contacts


@njit(cache=True)
def least_overlap(offset: np.ndarray, axes: np.ndarray, half: np.ndarray) -> tuple[float, int, float, float, float]:
    r"""Find the direction in which cube and box overlap least, by the separating axis theorem.

    Two boxes are apart exactly if they are apart along a face normal of one of them, or along the cross product of an edge of each.
    Along a unit direction l they overlap by

    .. math:: r_{box}(l) + r_{cube}(l) - |d \cdot l|, \quad r_{box}(l) = \sum_i b_i |l_i|, \quad r_{cube}(l) = h \sum_j |R_j \cdot l|

    with the offset d of the cube's centre from the box's, the half edges b and h, and the cube's axes R_j.

    Parameters
    ----------
    offset : ndarray of shape (3,)
        Centre of the cube minus centre of the box [m].
    axes : ndarray of shape (3, 3)
        The cube's axes, as columns.
    half : ndarray of shape (3,)
        Half edges of the box [m].

    Returns
    -------
    overlap : float
        The least overlap [m]; negative if they are apart.
    kind : int
        0 to 2: a face normal of the box; 3 to 5: of the cube; 6 + 3 i + j: edge i of the box and edge j of the cube.
    normal : three floats
        The unit direction, from the box to the cube.
    """
    least, kind = np.inf, -1
    n0, n1, n2 = 0.0, 0.0, 0.0
    for i in range(3):
        overlap = half[i] + HALF_EDGE * (abs(axes[i, 0]) + abs(axes[i, 1]) + abs(axes[i, 2])) - abs(offset[i])
        if overlap < least:
            side = 1.0 if offset[i] > 0 else -1.0
            least, kind = overlap, i
            n0, n1, n2 = side * (i == 0), side * (i == 1), side * (i == 2)
            if overlap < 0:
                return overlap, kind, n0, n1, n2
    for j in range(3):
        a0, a1, a2 = axes[0, j], axes[1, j], axes[2, j]
        along = offset[0] * a0 + offset[1] * a1 + offset[2] * a2
        overlap = half[0] * abs(a0) + half[1] * abs(a1) + half[2] * abs(a2) + HALF_EDGE - abs(along)
        if overlap < least:
            side = 1.0 if along > 0 else -1.0
            least, kind = overlap, 3 + j
            n0, n1, n2 = side * a0, side * a1, side * a2
            if overlap < 0:
                return overlap, kind, n0, n1, n2
    for i in range(3):
        u, v = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            sine = math.sqrt(axes[u, j] ** 2 + axes[v, j] ** 2)
            if sine < PARALLEL:
                continue
            lu, lv = -axes[v, j] / sine, axes[u, j] / sine  # unit vector along edge i of the box x edge j of the cube
            along = offset[u] * lu + offset[v] * lv
            extent = half[u] * abs(lu) + half[v] * abs(lv)
            for k in range(3):
                extent += HALF_EDGE * abs(axes[u, k] * lu + axes[v, k] * lv)
            overlap = extent - abs(along)
            if overlap < 0 or EDGE_PREFERENCE * overlap < least:
                side = 1.0 if along > 0 else -1.0
                least, kind = overlap, 6 + 3 * i + j
                normal = (0.0, side * lu, side * lv)  # in the cyclic order i, u, v
                n0, n1, n2 = normal[(3 - i) % 3], normal[(4 - i) % 3], normal[(5 - i) % 3]
                if overlap < 0:
                    return overlap, kind, n0, n1, n2
    return least, kind, n0, n1, n2


@njit(cache=True)
def in_frame(vector: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Return the coordinates of a vector along the columns of ``axes``, shape (3,)."""
    coordinates = np.empty(3)
    for k in range(3):
        coordinates[k] = vector[0] * axes[0, k] + vector[1] * axes[1, k] + vector[2] * axes[2, k]
    return coordinates


@njit(cache=True)
def edge_contact(
    centre: np.ndarray, axes: np.ndarray, box: np.ndarray, half: np.ndarray, i: int, j: int, normal: np.ndarray
) -> np.ndarray:
    """Return the point midway between edge i of the box and edge j of the cube where they are nearest, shape (3,) [m]."""
    on_box, on_cube = box.copy(), centre.copy()
    for k in range(3):
        if k != i:  # the edge of the box that faces the cube
            on_box[k] += half[k] if normal[k] > 0 else -half[k]
        if k != j:  # the edge of the cube that faces the box
            on_cube -= axes[:, k] * (HALF_EDGE if np.sum(normal * axes[:, k]) > 0 else -HALF_EDGE)
    between = on_cube - on_box
    cosine = axes[i, j]
    along_box, along_cube = between[i], np.sum(axes[:, j] * between)
    on_box[i] += (along_box - cosine * along_cube) / (1 - cosine * cosine)
    on_cube += axes[:, j] * (cosine * along_box - along_cube) / (1 - cosine * cosine)
    return (on_box + on_cube) / 2


@njit(cache=True)
def face_contact(
    centre: np.ndarray,
    axes: np.ndarray,
    half: np.ndarray,
    other: np.ndarray,
    other_axes: np.ndarray,
    other_half: np.ndarray,
    face: int,
    side: float,
    contacts: Contacts,
    count: int,
) -> int:
    """Add the points of another box's face that lie behind a face of this one.

    The face of the other box that looks most against this one is clipped to a polygon above this face; its corners behind the
    face are the contacts, at most eight.

    Parameters
    ----------
    centre, axes, half
        The reference box: centre [m], axes as columns, half edges [m].
    other, other_axes, other_half
        The other one.
    face : int
        Which axis of the reference box is the normal of the reference face ...
    side : float
        ... and in which of its two directions, 1 or -1.
    contacts : Contacts
        Points and depths are added behind the first ``count``; the normals point out of the reference face.
    count : int
        Contacts so far.

    Returns
    -------
    int
        Contacts in all.
    """
    u, v = (face + 1) % 3, (face + 2) % 3
    offset, relative = in_frame(other - centre, axes), np.empty((3, 3))
    facing = 0
    for k in range(3):
        relative[k] = in_frame(other_axes[:, k], axes)
        if abs(relative[k, face]) > abs(relative[facing, face]):
            facing = k
    a, b = (facing + 1) % 3, (facing + 2) % 3
    towards = -other_half[facing] if relative[facing, face] * side > 0 else other_half[facing]
    polygon = contacts.polygons[0]
    for corner in range(4):
        p = other_half[a] if corner in (0, 3) else -other_half[a]
        q = other_half[b] if corner < 2 else -other_half[b]
        for k in range(3):
            polygon[corner, k] = offset[k] + towards * relative[facing, k] + p * relative[a, k] + q * relative[b, k]
    corners, last = clip(contacts.polygons, u, half[u], v, half[v])
    for corner in range(corners):
        point = contacts.polygons[last, corner]
        depth = half[face] - side * point[face]
        if depth >= 0:
            for k in range(3):
                contacts.points[count, k] = (
                    centre[k] + axes[k, 0] * point[0] + axes[k, 1] * point[1] + axes[k, 2] * point[2]
                )
                contacts.normals[count, k] = side * axes[k, face]
            contacts.depths[count] = depth
            count += 1
    return count


@njit(cache=True)
def clip(polygons: np.ndarray, u: int, limit_u: float, v: int, limit_v: float) -> tuple[int, int]:
    """Clip a four-cornered polygon to |coordinate u| <= limit_u, |coordinate v| <= limit_v (Sutherland and Hodgman).

    The polygon is ``polygons[0]``; each of the four cuts reads one of ``polygons`` and writes the other.

    Returns
    -------
    count, last : int
        Corners that are left, and which of ``polygons`` holds them.
    """
    count, last = 4, 0
    for cut in range(4):
        axis, limit = (u, limit_u) if cut < 2 else (v, limit_v)
        side = 1.0 if cut % 2 == 0 else -1.0
        given, kept, left = polygons[last], polygons[1 - last], 0
        for corner in range(count):
            here, there = given[corner], given[(corner + 1) % count]
            room, room_there = limit - side * here[axis], limit - side * there[axis]
            if room >= 0:
                kept[left] = here
                left += 1
            if (room >= 0) != (room_there >= 0):
                for k in range(3):
                    kept[left, k] = here[k] + (there[k] - here[k]) * room / (room - room_there)
                left += 1
        count, last = left, 1 - last
    return count, last


@njit(cache=True)
def add_contacts(
    centre: np.ndarray, axes: np.ndarray, box: np.ndarray, half: np.ndarray, contacts: Contacts, count: int
) -> int:
    """Add the contacts of the cube with one box, given by its centre and half edges [m]; return how many there are in all."""
    overlap, kind, n0, n1, n2 = least_overlap(centre - box, axes, half)
    if overlap < 0:
        return count
    cube_half, upright = np.array([HALF_EDGE, HALF_EDGE, HALF_EDGE]), np.eye(3)
    if kind < 3:  # a face of the box
        side = n0 + n1 + n2
        return face_contact(box, upright, half, centre, axes, cube_half, kind, side, contacts, count)
    normal = np.array([n0, n1, n2])
    if kind < 6:  # a face of the cube: its outer normal looks towards the box
        side = -1.0 if np.sum(normal * axes[:, kind - 3]) > 0 else 1.0
        first = count
        count = face_contact(centre, axes, cube_half, box, upright, half, kind - 3, side, contacts, count)
        contacts.normals[first:count] *= -1.0
        return count
    contacts.points[count] = edge_contact(centre, axes, box, half, (kind - 6) // 3, (kind - 6) % 3, normal)
    contacts.normals[count] = normal
    contacts.depths[count] = overlap
    return count + 1


@njit(cache=True)
def steps_in_reach(stairs: Stairs, y: float) -> tuple[int, int]:
    """Return the first step within the cube's reach of ``y`` and one more than the last, counted from 0."""
    first = math.floor((y - REACH - stairs.first_riser) / stairs.run)
    last = math.floor((y + REACH - stairs.first_riser) / stairs.run)
    if first >= stairs.n_steps and y - REACH < stairs.end:
        first = stairs.n_steps - 1
    return max(first, 0), min(last, stairs.n_steps - 1) + 1


@njit(cache=True)
def find_contacts(cube: Cube, stairs: Stairs, contacts: Contacts) -> int:
    """Write the contacts of the cube with the ground and each step in its reach; return their number."""
    centre, count = cube.centre, 0
    first, stop = steps_in_reach(stairs, centre[1])
    near_ground = centre[2] < REACH
    if not near_ground and (first >= stop or centre[2] - REACH > stairs.rise * stop):
        return 0
    axes = rotation_matrix(cube.quaternion)
    if near_ground:
        box, half = np.array([0.0, 0.0, -1.0]), np.array([GROUND_REACH, GROUND_REACH, 1.0])
        count = add_contacts(centre, axes, box, half, contacts, count)
    for k in range(first, stop):
        height = stairs.rise * (k + 1)
        begin = stairs.first_riser + stairs.run * k
        end = begin + stairs.run if k < stairs.n_steps - 1 else stairs.end
        if centre[2] - REACH < height:
            box = np.array([0.0, (begin + end) / 2, height / 2])
            half = np.array([HALF_WIDTH, (end - begin) / 2, height / 2])
            count = add_contacts(centre, axes, box, half, contacts, count)
    return count


# 3. Impulses


@njit(cache=True)
def write_rows(centre: np.ndarray, contacts: Contacts, count: int) -> None:
    r"""Write three rows for each contact: its normal, and two directions of friction across it.

    An impulse in direction u at the arm r from the centre changes the velocity there, in its own direction, by its size divided by

    .. math:: m_u = \left(1 + \frac{1}{I} |r \times u|^2\right)^{-1}

    for a mass of 1 kg and the inertia I of a cube. A row holds u, r x u and this effective mass m_u, seven numbers. The directions of
    friction lie along the world's axes where the normal does.
    """
    for i in range(count):
        n0, n1, n2 = contacts.normals[i]
        if abs(n2) > math.sqrt(0.5):
            length = math.sqrt(n1 * n1 + n2 * n2)
            t0, t1, t2 = 0.0, -n2 / length, n1 / length
        else:
            length = math.sqrt(n0 * n0 + n1 * n1)
            t0, t1, t2 = -n1 / length, n0 / length, 0.0
        r0, r1, r2 = contacts.points[i] - centre
        for k in range(3):
            if k == 0:
                u0, u1, u2 = n0, n1, n2
            elif k == 1:
                u0, u1, u2 = t0, t1, t2
            else:
                u0, u1, u2 = n1 * t2 - n2 * t1, n2 * t0 - n0 * t2, n0 * t1 - n1 * t0
            c0, c1, c2 = r1 * u2 - r2 * u1, r2 * u0 - r0 * u2, r0 * u1 - r1 * u0
            row = contacts.rows[i, k]
            row[0], row[1], row[2], row[3], row[4], row[5] = u0, u1, u2, c0, c1, c2
            row[6] = 1 / (1 + INVERSE_INERTIA * (c0 * c0 + c1 * c1 + c2 * c2))


@njit(cache=True)
def speed_along(row: np.ndarray, twist: tuple) -> float:
    """Return the velocity of a contact along a row: u v + (r x u) w [m/s]."""
    v0, v1, v2, w0, w1, w2 = twist
    return (row[0] * v0 + row[1] * v1) + (row[2] * v2 + row[3] * w0) + (row[4] * w1 + row[5] * w2)


@njit(cache=True)
def pushed(row: np.ndarray, impulse: float, twist: tuple) -> tuple:
    """Return the twist after an impulse along a row [N s]."""
    v0, v1, v2, w0, w1, w2 = twist
    turning = impulse * INVERSE_INERTIA
    return (
        v0 + impulse * row[0],
        v1 + impulse * row[1],
        v2 + impulse * row[2],
        w0 + turning * row[3],
        w1 + turning * row[4],
        w2 + turning * row[5],
    )


@njit(cache=True)
def solve(moving: np.ndarray, kept: np.ndarray, contacts: Contacts, count: int, friction: float) -> None:
    r"""Find impulses that keep the contacts apart, and let them act on the twist (sequential impulses, projected Gauss-Seidel).

    One row after the other is brought to its target velocity, as if it were alone. Its total impulse stays within its bounds:

    .. math:: \lambda_n \leftarrow \max\left(0, \; \lambda_n + m_n (v^* - v_n)\right), \qquad
              \lambda_t \leftarrow \min\left(\mu \lambda_n, \max\left(-\mu \lambda_n, \; \lambda_t - m_t v_t\right)\right)

    A sweep visits all normals first, then all friction rows. 50 sweeps come near the solution of all rows together.

    The two solutions differ in the target of the normals: d / dt for the one that moves the cube, which takes away the whole depth d
    of the overlap in this step, and at most ``PUSH_OUT`` for the one that is kept. They do not touch each other. Side by side
    they take hardly longer than one of them.

    Parameters
    ----------
    moving, kept : ndarray of shape (6,)
        Twist of each solution: velocity [m/s] and angular velocity [rad/s]; changed in place.
    contacts : Contacts
        With rows and depths; the impulses [N s] are left in ``contacts.impulses``, of shape (2, contacts, 3).
    count : int
        Number of contacts.
    friction : float
        Coefficient of friction mu.
    """
    m = (moving[0], moving[1], moving[2], moving[3], moving[4], moving[5])
    k = (kept[0], kept[1], kept[2], kept[3], kept[4], kept[5])
    of_moving, of_kept = contacts.impulses[0], contacts.impulses[1]
    of_moving[:count] = 0.0
    of_kept[:count] = 0.0
    for _ in range(SWEEPS):
        change = 0.0
        for i in range(count):
            row, target = contacts.rows[i, 0], contacts.depths[i] / TIME_STEP
            push = max(-of_moving[i, 0], row[6] * (target - speed_along(row, m)))
            push_kept = max(-of_kept[i, 0], row[6] * (min(target, PUSH_OUT) - speed_along(row, k)))
            of_moving[i, 0] += push
            of_kept[i, 0] += push_kept
            m, k = pushed(row, push, m), pushed(row, push_kept, k)
            change += abs(push) + abs(push_kept)
        for i in range(count):
            bound, bound_kept = friction * of_moving[i, 0], friction * of_kept[i, 0]
            for across in (1, 2):
                row, before, before_kept = contacts.rows[i, across], of_moving[i, across], of_kept[i, across]
                of_moving[i, across] = min(bound, max(-bound, before - row[6] * speed_along(row, m)))
                of_kept[i, across] = min(bound_kept, max(-bound_kept, before_kept - row[6] * speed_along(row, k)))
                push, push_kept = of_moving[i, across] - before, of_kept[i, across] - before_kept
                m, k = pushed(row, push, m), pushed(row, push_kept, k)
                change += abs(push) + abs(push_kept)
        if change < CONVERGED:
            break
    for i in range(6):
        moving[i], kept[i] = m[i], k[i]


# 4. Time


@njit(cache=True)
def step(cube: Cube, stairs: Stairs, contacts: Contacts, friction: float, force_y: float, force_z: float) -> int:
    r"""Move the cube by one time step (semi-implicit Euler: first the velocity, then with it the position).

    .. math:: v \leftarrow v + \Delta t \, (g + F / m) + \text{impulses} / m, \qquad x \leftarrow x + \Delta t \, v

    The impulses are solved for twice. What moves the cube takes away the whole overlap in this step; what is kept, at most
    ``PUSH_OUT`` worth of it.

    Parameters
    ----------
    cube : Cube
        Changed in place.
    stairs : Stairs
        Where it is.
    contacts : Contacts
        Room for its contacts.
    friction : float
        Coefficient of friction.
    force_y, force_z : float
        Force on the centre, in the world's axes [N].

    Returns
    -------
    int
        Number of contacts.
    """
    count = find_contacts(cube, stairs, contacts)
    cube.twist[1] += TIME_STEP * force_y
    cube.twist[2] += TIME_STEP * (force_z - GRAVITY)
    moving = cube.twist.copy()
    if count > 0:
        write_rows(cube.centre, contacts, count)
        solve(moving, cube.twist, contacts, count, friction)
    for k in range(3):
        cube.centre[k] += TIME_STEP * moving[k]
    turn(cube.quaternion, moving[3:], TIME_STEP)
    return count


@njit(cache=True)
def has_moved(cube: Cube, centre: np.ndarray, quaternion: np.ndarray) -> bool:
    """Whether the cube has left a pose by more than a resting cube does."""
    for k in range(3):
        if abs(cube.centre[k] - centre[k]) > REST_SHIFT:
            return True
    for k in range(4):  # noqa: SIM110
        if abs(cube.quaternion[k] - quaternion[k]) > REST_TURN:
            return True
    return False


@njit(cache=True)
def simulate(
    cube: Cube, stairs: Stairs, friction: float, force_y: float, force_z: float, path: np.ndarray
) -> tuple[int, int]:
    """Push the cube for PUSH_STEPS steps, and go on until it rests.

    A jump is over when the cube rests (see REST_STEPS), or by the published rule: when a poll finds it within a millimetre of the
    poll before. A cube that creeps, leaning on an edge, ends by that one, or at the time limit (see CREEP_SHIFT).

    Parameters
    ----------
    cube : Cube
        Changed in place.
    stairs : Stairs
        Where it is.
    friction : float
        Coefficient of friction.
    force_y, force_z : float
        The push [N].
    path : ndarray of shape (MAX_STEPS + 1, 7)
        Centre and quaternion after each step are written here; of shape (0, 7) where nobody asks for them.

    Returns
    -------
    steps : int
        Steps made; 0 if the time limit was reached and the jump is not over.
    seconds : int
        The poll that ends the jump by the published rule [s].
    """
    contacts = empty_contacts()
    centre, quaternion, since = cube.centre.copy(), cube.quaternion.copy(), 0
    polled, shift_before = cube.centre.copy(), math.inf
    for now in range(1, MAX_STEPS + 1):
        pushing = now <= PUSH_STEPS
        step(cube, stairs, contacts, friction, force_y if pushing else 0.0, force_z if pushing else 0.0)
        if len(path) > 0:
            path[now, :3], path[now, 3:] = cube.centre, cube.quaternion
        if has_moved(cube, centre, quaternion):
            centre[:], quaternion[:], since = cube.centre, cube.quaternion, now
        resting = now - since >= REST_STEPS
        if resting or now % POLL_STEPS == 0:
            shift = np.sum(np.abs(cube.centre - polled))
            if resting or min(shift, shift_before) < (POLL_SHIFT if now < MAX_STEPS else CREEP_SHIFT):
                return now, (now - 1) // POLL_STEPS + 1 + (resting and shift >= POLL_SHIFT)
            polled[:], shift_before = cube.centre, shift
    return 0, 0


# 5. The world


class TumblingWorld(CubeWorld):
    """A cube before a staircase, in three dimensions: it can turn, roll and end aside.

    The motions push in the y-z plane of the world, as in the plane, whatever the cube's rotation. Before each push the cube rocks a
    little (see ``ROCKING``); that is where its rolling aside comes from, and the only thing that is random. Equal state, motion
    and generator give equal jumps, to the bit.

    Parameters
    ----------
    staircase : Staircase, optional
        The stairs, 5 m wide; four steps by default. Its ``restitution`` must be None: how risers rebound here follows from the solver.
    rocking : float
        Times as much as ``ROCKING``; 0 for a cube at exact rest, which hardly leaves the plane. (Of 1,200 random jumps, x in metres or
        a component of the quaternion goes beyond 0.0001 in 4 %, and beyond 0.01 in 0.7 %: the cube balances on an edge, and swings
        out.)
    friction : float
        Coefficient of friction between cube and stairs.

    Attributes
    ----------
    feature_names : tuple of str
        The eight features of a state.
    motion_names, motion_low, motion_high
        The motion space: magnitude 50 to 1000 N, angle 1 to 89 degrees.
    random : bool
        Whether the cube rocks.

    Raises
    ------
    ValueError, TypeError
        If an argument is not as described.

    Examples
    --------
    >>> world = TumblingWorld()
    >>> jump = world.jump(600, 75, np.random.default_rng(0))
    >>> round(jump.dz, 2)
    0.9
    """

    def __init__(self, staircase: Staircase | None = None, *, rocking: float = 1.0, friction: float = 1.0) -> None:
        super().__init__(staircase)
        if self.staircase.restitution is not None:
            raise ValueError(
                f"staircase must have no restitution in the tumbling world, where the rebound follows from the solver, "
                f"not {self.staircase.restitution:g}."
            )
        self.rocking = finite_number("rocking", rocking, low=0, high=10)
        self.friction = finite_number("friction", friction, low=0, high=10)
        self.random = self.rocking > 0

    def __repr__(self) -> str:
        return f"TumblingWorld({self.staircase!r}, rocking={self.rocking:g}, friction={self.friction:g})"

    @property
    def stairs(self) -> Stairs:
        """The stairs as the compiled functions need them."""
        stairs = self.staircase
        return Stairs(int(stairs.n_steps), float(stairs.rise), float(stairs.run), float(stairs.first_riser), stairs.end)

    def _checked(self, quaternion: list[float]) -> list[float]:
        norm = math.hypot(*quaternion)
        if abs(norm - 1) > 1e-3:
            raise ValueError(f"state must hold a unit quaternion, not {quaternion} of length {norm:.4g}.")
        return [q / norm for q in quaternion] if abs(norm - 1) > 1e-12 else quaternion

    def _overlap(self, state: np.ndarray) -> float:
        contacts = empty_contacts()
        with _told_when_slow():
            count = find_contacts(Cube(state[:3].copy(), state[3:7].copy(), np.zeros(6)), self.stairs, contacts)
        return float(contacts.depths[:count].max(initial=0.0))

    def _move(
        self, magnitude: float, angle: float, rng: np.random.Generator | None, record: bool
    ) -> tuple[np.ndarray, float, Trajectory | None] | None:
        rocking = np.array(FIXED_ROCKING) if rng is None else rng.uniform(-1, 1, 2) * ROCKING
        twist = np.array([0.0, 0.0, 0.0, *(self.rocking * rocking), 0.0])
        cube = Cube(self._state[:3].copy(), self._state[3:7].copy(), twist)
        path = np.empty((MAX_STEPS + 1 if record else 0, 7))
        if record:
            path[0] = self._state[:7]
        direction = math.radians(angle)
        force_y, force_z = magnitude * math.cos(direction), magnitude * math.sin(direction)
        with _told_when_slow():
            steps, seconds = simulate(cube, self.stairs, self.friction, force_y, force_z, path)
        if steps == 0:
            return None
        end = self._complete(*cube.centre.tolist(), *cube.quaternion.tolist())
        return end, float(seconds), _trajectory(path[: steps + 1]) if record else None


def _trajectory(path: np.ndarray) -> Trajectory:
    x, y, z, qx, _, _, qw = path.T.copy()
    return Trajectory(TIME_STEP * np.arange(len(path)), y, z, np.unwrap(2 * np.arctan2(qx, qw)), x, path[:, 3:].copy())


@contextmanager
def _told_when_slow() -> Iterator[None]:
    """Tell the reader why the very first jump takes some seconds: it is being compiled."""
    if getattr(simulate, "signatures", True):  # compiled, or plain Python: there is nothing to wait for
        yield
        return
    note = "Compiling the tumbling world (about twenty seconds, once) ..."
    timer = threading.Timer(SLOW_START, print, (note,), {"file": sys.stderr, "flush": True})
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


WORLDS: dict[str, type[CubeWorld]] = {"plane": StairWorld, "tumbling": TumblingWorld}
""" The two worlds of the stairs, by name """


def stair_world(name: str, staircase: Staircase | None = None, **options: Any) -> CubeWorld:
    """Make a world by its name.

    Parameters
    ----------
    name : {"plane", "tumbling"}
        Which one.
    staircase : Staircase, optional
        The stairs; four steps by default.
    **options
        Of ``StairWorld`` or ``TumblingWorld``. One that only the other world has may be given with its default value.

    Raises
    ------
    ValueError
        If there is no such world, or the world has no such option.
    """
    kind = WORLDS[one_of("world", name, WORLDS)]
    known = {world: signature(world).parameters for world in WORLDS.values()}
    for option, value in list(options.items()):
        if option in known[kind]:
            continue
        default = next((of[option].default for of in known.values() if option in of), None)
        if default is None or value != default:
            raise ValueError(f"The {name} world has no {option}, but it is {value!r}; it has {', '.join(known[kind])}.")
        del options[option]
    return kind(staircase, **options)
