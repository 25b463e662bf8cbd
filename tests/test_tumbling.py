"""The world in three dimensions, against closed forms, oracles from SciPy, and symmetries."""

import copy
import itertools
import json
import math
import os
import pickle
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from stairlab.physics import CUBE_EDGE, GRAVITY, PUSH_STEPS, TIME_STEP, Staircase
from stairlab.sampling import sample_motions
from stairlab.tumbling import (
    FIXED_ROCKING,
    HALF_EDGE,
    INVERSE_INERTIA,
    MAX_STEPS,
    PUSH_OUT,
    ROCKING,
    Cube,
    TumblingWorld,
    add_contacts,
    empty_contacts,
    find_contacts,
    least_overlap,
    rotation_matrix,
    simulate,
    stair_world,
    step,
    turn,
)
from stairlab.world import StairWorld, yaw_of

UPRIGHT = (0.0, 0.0, 0.0, 1.0)
FLAT_GROUND = TumblingWorld(Staircase(first_riser=100.0)).stairs
SIGNS = np.array(list(itertools.product((-1, 1), repeat=3)))
MOTIONS = [(600, 70), (312.5, 33.3), (1000, 89), (50, 1), (850, 60), (431, 77), (330, 68), (700, 81)]

properties = settings(derandomize=True, deadline=None, max_examples=100)
seeds = st.integers(0, 2**32 - 1)
seconds = st.floats(0, 3)


def rotation_of(seed):
    return Rotation.random(random_state=seed).as_quat()


def thrown(rng, staircase=None):
    """Return a cube above the stairs in any rotation, moving and spinning in any direction."""
    start = TumblingWorld(staircase).draw_start(rng)
    centre = np.array([0.0, start[1], start[2] + rng.uniform(0.1, 0.6)])
    twist = np.concatenate([rng.normal(0, 2, 3), rng.normal(0, 10, 3)])
    return Cube(centre, rotation_of(rng.integers(2**32)), twist)


def placed(z, quaternion=UPRIGHT, twist=(0.0,) * 6):
    return Cube(np.array([0.0, 0.25, z]), np.array(quaternion, dtype=float), np.array(twist, dtype=float))


def steps(cube, n, stairs=FLAT_GROUND, friction=1.0):
    """Make n steps without a force; yield the contacts and their number after each."""
    contacts = empty_contacts()
    for _ in range(n):
        yield contacts, step(cube, stairs, contacts, friction, 0.0, 0.0)


def settled(cube, n=3000, stairs=FLAT_GROUND, friction=1.0):
    for _ in steps(cube, n, stairs, friction):
        pass
    return cube


def speed(twist):
    """Root of twice the kinetic energy of 1 kg, which impulses change as they change a speed."""
    return math.sqrt(np.sum(twist[:3] ** 2) + np.sum(twist[3:] ** 2) / INVERSE_INERTIA)


def energy(cube):
    """Energy at the end of a step; a step uses the velocity of its middle, half a step of gravity earlier."""
    now = cube.twist - [0, 0, GRAVITY * TIME_STEP / 2, 0, 0, 0]
    return speed(now) ** 2 / 2 + GRAVITY * cube.centre[2]


def highest_face(quaternion):
    """Cosine between the vertical and the axis of the cube that is nearest to it: 1 on a face, 0.71 on an edge, 0.58 on a corner."""
    return np.abs(Rotation.from_quat(quaternion).as_matrix()[2]).max()


def outcome_class(jump):
    return round((jump.end[2] - HALF_EDGE) / 0.3) if jump.on_map else -1


def jump(world, motion, rng=None, **how):
    world.reset()
    return world.jump(*motion, rng, **how)


@pytest.fixture(scope="module")
def walks():
    """500 jumps on fifteen steps, each from a drawn pose and five of them on from where the last one ended, with their paths."""
    world, rng = TumblingWorld(Staircase.fifteen()), np.random.default_rng(0)
    jumps = []
    for walk in range(100):
        world.reset(world.draw_start(rng) if walk % 2 else None)
        jumps += [world.jump(*rng.uniform(world.motion_low, world.motion_high), rng, trajectory=True) for _ in range(5)]
    return jumps


# --- rotation ---


@properties
@given(seeds)
def test_the_rotation_matrix_is_orthonormal_and_that_of_scipy(seed):
    quaternion = rotation_of(seed)
    axes = rotation_matrix(quaternion)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), rtol=0, atol=1e-14)
    assert np.linalg.det(axes) == pytest.approx(1, abs=1e-14)
    np.testing.assert_allclose(axes, Rotation.from_quat(quaternion).as_matrix(), rtol=0, atol=1e-14)


@properties
@given(seeds, seconds)
def test_a_constant_spin_turns_by_its_angle_about_its_axis_at_unit_length(seed, time):
    quaternion, spin = rotation_of(seed), np.random.default_rng(seed).normal(0, 10, 3)
    expected = Rotation.from_rotvec(spin * time) * Rotation.from_quat(quaternion)
    turn(quaternion, spin, time)
    assert np.linalg.norm(quaternion) == pytest.approx(1, abs=1e-15)
    assert (expected.inv() * Rotation.from_quat(quaternion)).magnitude() < 1e-13 * (1 + np.linalg.norm(spin) * time)


def test_no_spin_turns_nothing():
    quaternion = rotation_of(1)
    before = quaternion.copy()
    turn(quaternion, np.zeros(3), 0.5)
    np.testing.assert_allclose(quaternion, before, rtol=0, atol=1e-15)


# --- free flight ---


@properties
@given(seeds)
def test_free_flight_keeps_momentum_spin_and_energy_and_follows_the_closed_form(seed):
    rng = np.random.default_rng(seed)
    cube = Cube(np.array([0.0, -3.0, 50.0]), rotation_of(seed), rng.normal(0, 5, 6))
    before = copy.deepcopy(cube)
    n = 1000
    assert all(count == 0 for _, count in steps(cube, n))
    np.testing.assert_array_equal(cube.twist[[0, 1, 3, 4, 5]], before.twist[[0, 1, 3, 4, 5]])
    assert energy(cube) == pytest.approx(energy(before), rel=1e-12)
    fallen = [0, 0, -GRAVITY * TIME_STEP**2 * n * (n + 1) / 2]
    np.testing.assert_allclose(cube.centre, before.centre + before.twist[:3] * TIME_STEP * n + fallen, atol=1e-11)
    expected = Rotation.from_rotvec(before.twist[3:] * TIME_STEP * n) * Rotation.from_quat(before.quaternion)
    assert (expected.inv() * Rotation.from_quat(cube.quaternion)).magnitude() < 1e-11


@properties
@given(st.floats(50, 1000), st.floats(20, 89))
def test_a_jump_is_in_the_air_where_the_plane_has_it_one_step_later_and_half_a_step_of_gravity_lower(magnitude, angle):
    """Both worlds integrate the same parabola: y agrees to rounding, z to 5 micrometres times the steps made."""
    here = TumblingWorld(rocking=0).jump(magnitude, angle, trajectory=True).trajectory
    plane = StairWorld().jump(magnitude, angle, trajectory=True).trajectory
    n = min(len(here.y), len(plane.y) - 1)
    free = (here.z[:n] > HALF_EDGE + 1e-4) & (here.y[:n] < 0.5)
    air = slice(PUSH_STEPS, PUSH_STEPS + int(np.argmin(free[PUSH_STEPS:])))
    assert air.stop - air.start > 10
    later = slice(air.start + 1, air.stop + 1)
    lower = GRAVITY * TIME_STEP**2 / 2 * np.arange(later.start, later.stop)
    np.testing.assert_allclose(here.y[air], plane.y[later], rtol=0, atol=1e-12)
    np.testing.assert_allclose(here.z[air], plane.z[later] + lower, rtol=0, atol=1e-12)
    assert (here.x[air] == 0).all()
    assert (here.quaternions[air] == UPRIGHT).all()


def test_the_force_does_not_turn_with_the_cube():
    world = TumblingWorld(rocking=0)
    upright = world.jump(300, 80, trajectory=True).trajectory
    world.reset(world.state_at(0.25, HALF_EDGE, math.pi / 2, yaw=0.5))
    turned = world.jump(300, 80, trajectory=True).trajectory
    for path in ("x", "y", "z"):
        np.testing.assert_allclose(getattr(turned, path)[:400], getattr(upright, path)[:400], rtol=0, atol=1e-12)


# --- contacts ---


def drawn_pair(seed, nearness):
    """Return centre and axes of a cube, and centre and half edges of a box, near each other; every third cube stands square to it."""
    rng = np.random.default_rng(seed)
    box, half = rng.normal(0, 1, 3), rng.uniform(0.02, 0.5, 3)
    quaternion = rotation_of(seed) if seed % 3 else Rotation.from_euler("z", rng.uniform(0, 6)).as_quat()
    centre = box + rng.uniform(-1, 1, 3) * (half + nearness)
    return centre, rotation_matrix(quaternion), box, half


def corners(centre, axes, half):
    return centre + (SIGNS * half) @ axes.T


def depth_of(points, others):
    """Depth to which two convex bodies overlap, by the hull of all differences of their corners; negative if they are apart."""
    hull = ConvexHull((points[:, None] - others).reshape(-1, 3))
    return -hull.equations[:, 3].max()


def share_a_point(points, others):
    """Whether the hulls of two sets of corners share a point, by a linear program in its weights."""
    n, m = len(points), len(others)
    same = np.vstack([np.hstack([points.T, -others.T]), np.repeat([[1, 0], [0, 1]], (n, m), axis=1)])
    return linprog(np.zeros(n + m), A_eq=same, b_eq=[0, 0, 0, 1, 1]).status == 0


def inside(point, centre, axes, half):
    """How far a point lies outside a box; 0 or less if it lies in it."""
    return (np.abs(axes.T @ (point - centre)) - half).max()


@properties
@given(seeds, st.floats(0.02, 0.12))
def test_the_least_overlap_is_that_of_the_convex_hulls(seed, nearness):
    """A pair of edges must be better than a face by 5 % to be taken, so the overlap may exceed the least by so much."""
    centre, axes, box, half = drawn_pair(seed, nearness)
    overlap, kind, *normal = least_overlap(centre - box, axes, half)
    cube, other = corners(centre, axes, HALF_EDGE), corners(box, np.eye(3), half)
    depth = depth_of(cube, other)
    assert math.hypot(*normal) == pytest.approx(1, abs=1e-12)
    assert np.dot(normal, centre - box) >= -1e-12
    assert 0 <= kind < 15
    if depth < -1e-9:
        assert overlap < 0
    elif depth > 1e-9:
        assert depth - 1e-9 <= overlap <= 1.05 * depth + 1e-9
        cube += (overlap + 1e-9) * np.array(normal)  # along the normal, they come apart by it
        assert depth_of(cube, other) < 0


@settings(properties, max_examples=50)
@given(seeds, st.floats(0.02, 0.12))
def test_two_boxes_are_apart_exactly_if_no_point_is_in_both(seed, nearness):
    centre, axes, box, half = drawn_pair(seed, nearness)
    overlap, *_ = least_overlap(centre - box, axes, half)
    assume(abs(overlap) > 1e-6)
    assert (overlap > 0) == share_a_point(corners(centre, axes, HALF_EDGE), corners(box, np.eye(3), half))


def overlapping_pair(seed, deep):
    """Return a pair that overlaps by about ``deep``, with the least overlap, its kind, the normal and the contacts."""
    centre, axes, box, half = drawn_pair(seed, 0.03)
    overlap, _, *normal = least_overlap(centre - box, axes, half)
    centre = centre + (overlap - deep) * np.array(normal)
    overlap, kind, *normal = least_overlap(centre - box, axes, half)
    contacts = empty_contacts()
    count = add_contacts(centre, axes, box, half, contacts, 0)
    found = contacts.points[:count], contacts.normals[:count], contacts.depths[:count]
    return centre, axes, box, half, overlap, kind, np.array(normal), found


def outside_most(points, centre, axes, box, half):
    """How far the contacts lie outside cube or box at most."""
    return max(max(inside(point, centre, axes, HALF_EDGE), inside(point, box, np.eye(3), half)) for point in points)


@settings(properties, max_examples=300)
@given(seeds, st.floats(1e-6, 0.02))
def test_contacts_lie_between_both_boxes_and_are_at_most_eight(seed, deep):
    centre, axes, box, half, overlap, kind, normal, (points, normals, depths) = overlapping_pair(seed, deep)
    assume(overlap > 1e-9)
    assert 1 <= len(points) <= (8 if kind < 6 else 1)
    np.testing.assert_allclose(normals, np.tile(normal, (len(points), 1)), rtol=0, atol=1e-12)
    assert ((depths >= 0) & (depths <= overlap + 1e-12)).all()
    surface = box @ normal + half @ np.abs(normal)  # of the box, along the normal
    assert (points @ normal <= surface + 1e-9).all()
    assert (points @ normal >= surface - overlap - 1e-9).all()
    if kind < 6:  # of a face, in both
        assert outside_most(points, centre, axes, box, half) < 1e-9
    else:  # of two edges, midway between them
        assert depths[0] == pytest.approx(overlap, abs=1e-12)
        assert points[0] @ normal == pytest.approx(surface - overlap / 2, abs=1e-9)


def test_two_edges_touch_beyond_their_ends_in_less_than_one_pair_of_a_thousand():
    """Where edges lie at an acute angle the place where their lines are nearest may be off the cube. Measured: 4 pairs in 10,000."""
    beyond = 0
    for seed in range(3000):
        centre, axes, box, half, overlap, kind, _, (points, _, _) = overlapping_pair(seed, 0.01)
        beyond += kind >= 6 and overlap > 0 and outside_most(points, centre, axes, box, half) > overlap + 1e-9
    assert beyond <= 3


def test_a_cube_flat_on_the_ground_touches_it_with_its_four_lower_corners():
    contacts = empty_contacts()
    assert find_contacts(placed(HALF_EDGE - 1e-6), FLAT_GROUND, contacts) == 4
    assert {tuple(point) for point in contacts.points[:4, :2].round(6)} == set(
        itertools.product((-0.05, 0.05), (0.2, 0.3))
    )
    np.testing.assert_array_equal(contacts.normals[:4], [[0, 0, 1]] * 4)
    np.testing.assert_allclose(contacts.depths[:4], 1e-6, rtol=1e-6)


def test_a_cube_on_its_edge_touches_the_ground_with_two_corners_and_on_its_corner_with_one():
    on_corner = Rotation.from_rotvec(np.array([1, -1, 0]) / math.sqrt(2) * math.acos(1 / math.sqrt(3))).as_quat()
    on_edge = Rotation.from_euler("x", 45, degrees=True).as_quat()
    for quaternion, reach, touching in ((on_edge, math.sqrt(2), 2), (on_corner, math.sqrt(3), 1)):
        contacts = empty_contacts()
        assert find_contacts(placed(HALF_EDGE * reach - 1e-4, quaternion), FLAT_GROUND, contacts) == touching
        np.testing.assert_allclose(contacts.depths[:touching], 1e-4, rtol=1e-9)


def test_a_cube_turned_by_an_eighth_over_the_end_of_a_tread_touches_it_with_a_clipped_face():
    world = TumblingWorld()
    state = world.state_at(world.staircase.end - 0.02, world.staircase.top + HALF_EDGE - 1e-5, yaw=math.pi / 4)
    contacts = empty_contacts()
    count = find_contacts(Cube(state[:3], state[3:7], np.zeros(6)), world.stairs, contacts)
    ends = contacts.points[:count, 1]
    assert count == 5  # three corners are on the tread; the fourth is cut off, and its two edges cross the end
    assert np.isclose(ends, world.staircase.end).sum() == 2
    assert (ends <= world.staircase.end + 1e-12).all()


@properties
@given(seeds, st.sampled_from([Staircase(), Staircase.fifteen(), Staircase(run=0.05, rise=0.05, last_run=0.02)]))
def test_the_boxes_in_reach_are_all_that_the_cube_touches(seed, staircase):
    rng = np.random.default_rng(seed)
    y = rng.uniform(-0.2, staircase.end + 0.2)
    cube = Cube(np.array([0, y, staircase.height_at(y) + rng.uniform(0, 0.1)]), rotation_of(seed), np.zeros(6))
    contacts, everywhere = empty_contacts(), empty_contacts()
    count = find_contacts(cube, TumblingWorld(staircase).stairs, contacts)
    axes, expected = rotation_matrix(cube.quaternion), 0
    for begin, end, height in [(-1000.0, 1000.0, 0.0), *staircase.treads.tolist()]:
        deep = 2.0 if height == 0 else height
        half = np.array([1000.0 if height == 0 else 2.5, (end - begin) / 2, deep / 2])
        box = np.array([0.0, (begin + end) / 2, height - deep / 2])
        expected = add_contacts(cube.centre, axes, box, half, everywhere, expected)
    assert count == expected
    np.testing.assert_allclose(contacts.points[:count], everywhere.points[:count], rtol=0, atol=1e-12)


# --- impulses and energy ---


@pytest.mark.parametrize("friction", [1.0, 0.5, 0.0])
def test_contacts_add_no_energy_and_no_impulse_leaves_its_bounds(friction):
    """Throws onto the stairs. Speeds gain at most the push-out, energy never exceeds that of the throw."""
    rng, stairs = np.random.default_rng(0), TumblingWorld(Staircase.fifteen()).stairs
    touched = 0
    for _ in range(20):
        cube = thrown(rng, Staircase.fifteen())
        at_first = lowest = energy(cube)
        before = cube.twist.copy()
        for contacts, count in steps(cube, 1000, stairs, friction):
            before[2] -= GRAVITY * TIME_STEP
            assert speed(cube.twist) <= speed(before) + PUSH_OUT
            assert energy(cube) <= at_first + 1e-9
            assert energy(cube) <= lowest + 0.005  # half a millimetre of height: to take overlap away raises the cube
            against, along = contacts.impulses[:, :count, 0], contacts.impulses[:, :count, 1:]
            assert (against >= 0).all()
            assert (np.abs(along) <= friction * against[..., None]).all()
            lowest, before, touched = min(lowest, energy(cube)), cube.twist.copy(), touched + count
    assert touched > 5000


@pytest.mark.parametrize("deep", [1e-6, 1e-4, 0.002])
def test_a_cube_that_begins_inside_the_ground_is_lifted_out_at_once_and_leaves_at_the_push_out_speed(deep):
    cube = placed(HALF_EDGE - deep)
    next(steps(cube, 1))
    assert cube.centre[2] == pytest.approx(HALF_EDGE, abs=1e-9)
    assert cube.twist[2] == pytest.approx(min(PUSH_OUT, deep / TIME_STEP), rel=1e-3)


def test_a_riser_gives_the_cube_back_at_the_push_out_speed_whatever_the_impact():
    for magnitude in (300, 500, 900):
        path = TumblingWorld(rocking=0).jump(magnitude, 8, trajectory=True).trajectory
        forward = np.diff(path.y) / TIME_STEP
        hit = int(np.argmax(path.y > 0.6 - HALF_EDGE - 1e-4))
        assert forward[hit - 2] > 1
        assert -1.5 * PUSH_OUT < forward[hit + 3] < 0


# --- limits ---


def test_a_cube_at_rest_stays_at_rest():
    """Its solver lets it tremble, by a micrometre; nothing adds up over five seconds."""
    for yaw in (0.0, 0.3):
        quaternion = Rotation.from_euler("z", yaw).as_quat()
        cube = settled(placed(HALF_EDGE, quaternion), 5000)
        np.testing.assert_allclose(cube.centre, [0, 0.25, HALF_EDGE], rtol=0, atol=1e-5)
        np.testing.assert_allclose(cube.quaternion, quaternion, rtol=0, atol=1e-4)


@pytest.mark.parametrize("yaw", [0.0, 0.3])
def test_a_cube_dropped_flat_stays_flat_where_it_fell(yaw):
    quaternion = Rotation.from_euler("z", yaw).as_quat()
    cube = settled(placed(0.5, quaternion))
    np.testing.assert_allclose(cube.centre, [0, 0.25, HALF_EDGE], rtol=0, atol=1e-5)
    np.testing.assert_allclose(cube.quaternion, quaternion, rtol=0, atol=1e-4)


@pytest.mark.parametrize("tilt", [1, 40, 44, 46, 50, 89])
@pytest.mark.parametrize("axis", ["x", "y"])
def test_a_cube_dropped_on_an_edge_falls_onto_the_face_that_its_centre_is_over(tilt, axis):
    lowest = HALF_EDGE * (math.sin(math.radians(tilt)) + math.cos(math.radians(tilt)))
    cube = placed(lowest + 0.001, Rotation.from_euler(axis, tilt, degrees=True).as_quat())
    before = energy(cube)
    settled(cube)
    assert cube.centre[2] == pytest.approx(HALF_EDGE, abs=1e-5)
    ended = Rotation.from_euler(axis, 0 if tilt < 45 else 90, degrees=True).inv() * Rotation.from_quat(cube.quaternion)
    assert ended.magnitude() < 0.002
    assert energy(cube) < before
    fell = cube.centre[1] - 0.25 if axis == "x" else -cube.centre[0]
    assert fell > 0 if 10 < tilt < 45 else fell < 0 if 45 < tilt < 80 else abs(fell) < 0.01
    assert abs(cube.centre[0] if axis == "x" else cube.centre[1] - 0.25) < 1e-4


@pytest.mark.parametrize("tilted", [(0.0, 0.0, 0.0), (0.05, 0.02, 0.0), (-0.1, 0.1, 0.3)])
def test_a_cube_dropped_on_a_corner_ends_on_a_face_with_less_energy(tilted):
    on_corner = Rotation.from_rotvec(np.array([1, -1, 0]) / math.sqrt(2) * math.acos(1 / math.sqrt(3)))
    cube = placed(HALF_EDGE * math.sqrt(3) + 0.001, (on_corner * Rotation.from_rotvec(tilted)).as_quat())
    before = energy(cube)
    assert highest_face(cube.quaternion) < 0.7
    settled(cube, 6000)
    assert highest_face(cube.quaternion) == pytest.approx(1, abs=1e-6)
    assert cube.centre[2] == pytest.approx(HALF_EDGE, abs=1e-5)
    assert energy(cube) < before


@pytest.mark.parametrize(("friction", "tolerance"), [(1.0, 0.05), (0.5, 0.015), (0.25, 0.015)])
@pytest.mark.parametrize("start", [0.5, 1.0, 3.0])
def test_a_cube_slides_for_v_squared_over_twice_the_friction_times_g(friction, tolerance, start):
    """Within 1.5 %; at a friction of 1 within 5 %, because there a sliding cube is about to tip over its front edge."""
    cube = settled(placed(HALF_EDGE, twist=(0, start, 0, 0, 0, 0)), 2000, friction=friction)
    assert cube.centre[1] - 0.25 == pytest.approx(
        start**2 / (2 * friction * GRAVITY), rel=tolerance, abs=start * TIME_STEP
    )
    assert cube.centre[2] == pytest.approx(HALF_EDGE, abs=1e-5)


def test_a_cube_slides_as_far_in_any_direction_along_the_axes_of_friction():
    ahead, aside, back = (
        settled(placed(HALF_EDGE, twist=(*velocity, 0, 0, 0, 0)), 1000, friction=0.5).centre - [0, 0.25, 0]
        for velocity in ((0, 1), (1, 0), (0, -1))
    )
    assert aside[0] == pytest.approx(ahead[1], rel=0.01)
    assert back[1] == pytest.approx(-ahead[1], rel=0.01)


def test_without_friction_a_cube_does_not_slow_down():
    cube = settled(placed(HALF_EDGE, twist=(0.3, 1.0, 0, 0, 0, 0)), 3000, friction=0.0)
    np.testing.assert_allclose(cube.twist[:2], [0.3, 1.0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(cube.centre, [0.9, 3.25, HALF_EDGE], rtol=0, atol=1e-6)


# --- mirror image in x: what lies across the mirror plane changes its sign; axial vectors the other way round ---

MIRROR_CENTRE, MIRROR_QUATERNION = np.array([-1, 1, 1]), np.array([1, -1, -1, 1])
MIRROR_TWIST = np.array([-1, 1, 1, 1, -1, -1])


def mirrored(cube):
    return Cube(cube.centre * MIRROR_CENTRE, cube.quaternion * MIRROR_QUATERNION, cube.twist * MIRROR_TWIST)


def sorted_rows(points):
    return points[np.lexsort(points.round(9).T)]


def test_a_mirrored_cube_has_the_mirrored_contacts_and_nearly_the_mirrored_impulses():
    """The sweeps of the solver visit the contacts in another order and end before they agree: 1 % of the steps differ by 10 µm/s."""
    rng, stairs, contacts = np.random.default_rng(0), TumblingWorld(Staircase.fifteen()).stairs, empty_contacts()
    differences, single = [], []
    for _ in range(25):
        cube = thrown(rng, Staircase.fifteen())
        for _ in range(800):
            image = mirrored(cube)
            count = step(cube, stairs, contacts, 1.0, 0.0, 0.0)
            points = contacts.points[:count].copy()
            assert step(image, stairs, contacts, 1.0, 0.0, 0.0) == count
            image_points = contacts.points[:count] * MIRROR_CENTRE
            np.testing.assert_allclose(sorted_rows(points), sorted_rows(image_points), rtol=0, atol=1e-12)
            difference = np.abs(mirrored(image).twist - cube.twist).max()
            (single if count <= 1 else differences).append(difference)
    assert max(single) == 0  # no contact, or one: to the bit
    assert len(differences) > 1000
    assert np.median(differences) < 1e-5
    assert np.quantile(differences, 0.95) < 1e-4


def test_a_mirrored_jump_ends_mirrored():
    """Of 300 jumps in any yaw, all but a few: what the sweeps differ by grows where a cube lands on an edge. Measured: 93 % end
    within a millimetre of the mirror image and 99.8 % in the same class.
    """
    world, rng, none = TumblingWorld(Staircase.fifteen()), np.random.default_rng(0), np.empty((0, 7))
    apart, same = [], []
    for _ in range(300):
        y, z = world.draw_start(rng)[1:3]
        state = world.state_at(y, z, yaw=rng.uniform(-3, 3), x=rng.uniform(-0.5, 0.5))
        magnitude, angle = rng.uniform(world.motion_low, world.motion_high)
        force = magnitude * math.cos(math.radians(angle)), magnitude * math.sin(math.radians(angle))
        cube = Cube(state[:3], state[3:7], np.array([0, 0, 0, *rng.uniform(-1, 1, 2) * ROCKING, 0]))
        image = mirrored(cube)  # rocks about x alike, about y the other way
        for body in (cube, image):
            simulate(body, world.stairs, 1.0, *force, none)
        apart.append(np.abs(mirrored(image).centre - cube.centre).max())
        same.append(round((image.centre[2] - HALF_EDGE) / 0.3) == round((cube.centre[2] - HALF_EDGE) / 0.3))
    assert np.mean(np.array(apart) < 1e-3) > 0.85
    assert np.mean(same) > 0.98


# --- without rocking, the plane ---


def test_without_rocking_a_centred_cube_hardly_leaves_the_plane_and_agrees_with_the_plane():
    """Of 300 random jumps, measured: 99 % the same class; median |dy difference| 0.4 mm, 90 % below 6 mm. Out of the plane
    (x in metres, qy, qz) the median is 1e-8 and 96 % stay below 1e-4, since the sweeps of the solver go from one side of the cube to
    the other. One jump in 300 swings out, balanced on an edge.
    """
    here, plane, rng = TumblingWorld(rocking=0), StairWorld(), np.random.default_rng(0)
    same, differences, aside = [], [], []
    for motion in rng.uniform(here.motion_low, here.motion_high, (300, 2)):
        one, other = jump(here, motion, trajectory=True), jump(plane, motion)
        same.append(outcome_class(one) == outcome_class(other))
        differences.append(abs(one.dy - other.dy))
        path = one.trajectory
        aside.append(max(np.abs(path.x).max(), np.abs(path.quaternions[:, 1:3]).max()))
    assert np.mean(same) >= 0.97
    assert np.median(differences) < 0.001
    assert np.quantile(differences, 0.9) < 0.012
    assert np.median(aside) < 1e-6
    assert np.quantile(aside, 0.9) < 1e-3


@pytest.mark.slow
def test_with_rocking_climbing_jumps_end_turned_too_often_and_aside_a_little_too_seldom():
    """Of the recorded climbing jumps, 30 to 34 % end more than 5 cm aside and 24 % turned by more than 5 degrees.

    Here it is 27 to 30 % and 34 to 38 % (5,000 jumps with each of the seeds 0 to 3).
    """
    samples = sample_motions(TumblingWorld(), 5000, seed=0, progress=False)
    climbs = samples.on_map & (samples.effects[:, 2] > 0.15)
    ends = samples.starts + samples.effects
    aside = np.mean(np.abs(ends[climbs, 0]) > 0.05)
    turned = np.mean([abs(yaw_of(*end[3:7])) > 5 for end in ends[climbs]])
    assert climbs.sum() > 900
    assert aside == pytest.approx(0.28, abs=0.04)
    assert turned == pytest.approx(0.36, abs=0.04)


# --- a jump depends on nothing but state, motion and generator ---


def ends_of(world, order):
    return {place: jump(world, MOTIONS[place], np.random.default_rng(place)).end.tobytes() for place in order}


def test_jumps_are_bit_identical_alone_after_others_in_any_order_and_in_a_copy():
    order = range(len(MOTIONS))
    alone = {place: ends_of(TumblingWorld(), [place])[place] for place in order}
    world = TumblingWorld()
    for other in (order, order[::-1], [*order[3:], *order[:3]]):
        assert ends_of(world, other) == alone
    world.jump(600, 70)
    for twin in (copy.deepcopy(world), pickle.loads(pickle.dumps(world))):
        assert twin.jump(300, 40).end.tobytes() == copy.deepcopy(world).jump(300, 40).end.tobytes()
        assert ends_of(twin, order) == alone


@pytest.mark.slow
def test_samples_do_not_depend_on_the_number_of_processes():
    one, two = (sample_motions(TumblingWorld(), 300, seed=3, n_jobs=n_jobs, progress=False) for n_jobs in (1, 2))
    assert one.effects.tobytes() == two.effects.tobytes()


def test_the_generator_alone_decides_how_the_cube_rocks():
    drawn = [jump(TumblingWorld(), (500, 70), np.random.default_rng(seed)).end.tobytes() for seed in (0, 0, 1)]
    assert drawn[0] == drawn[1] != drawn[2]
    still = [jump(TumblingWorld(rocking=0), (500, 70), np.random.default_rng(seed)).end.tobytes() for seed in (0, 1)]
    assert still[0] == still[1]


@pytest.mark.parametrize("times", [1.0, 0.5])
@pytest.mark.parametrize("seed", [None, 7])
def test_a_jump_begins_with_the_drawn_rocking_or_without_a_generator_the_fixed_one(seed, times):
    world, none = TumblingWorld(rocking=times), np.empty((0, 7))
    about = FIXED_ROCKING if seed is None else np.random.default_rng(seed).uniform(-1, 1, 2) * ROCKING
    state = world.state
    cube = Cube(state[:3], state[3:7], np.array([0, 0, 0, times * about[0], times * about[1], 0]))
    direction = math.radians(70)
    simulate(cube, world.stairs, 1.0, 500 * math.cos(direction), 500 * math.sin(direction), none)
    end = world.jump(500, 70, None if seed is None else np.random.default_rng(seed)).end
    np.testing.assert_array_equal(end[:3], cube.centre)


def test_a_recorded_jump_ends_in_the_same_bits_and_its_path_ends_there(walks):
    world = TumblingWorld(Staircase.fifteen())
    for recorded in walks[:25]:
        world.reset(recorded.start)
        told = world.jump(recorded.magnitude, recorded.angle, np.random.default_rng(5), trajectory=True)
        world.reset(recorded.start)
        plain = world.jump(recorded.magnitude, recorded.angle, np.random.default_rng(5))
        assert plain.trajectory is None
        assert (told.end.tobytes(), told.duration) == (plain.end.tobytes(), plain.duration)
    for done in walks:
        path = done.trajectory
        positions = np.column_stack([path.x, path.y, path.z])
        np.testing.assert_array_equal(positions[[0, -1]], [done.start[:3], done.end[:3]])
        np.testing.assert_array_equal(path.quaternions[0], done.start[3:7])
        assert path.quaternions[-1].tolist() in (done.end[3:7].tolist(), (-done.end[3:7]).tolist())
        np.testing.assert_allclose(path.time, TIME_STEP * np.arange(len(path.y)), rtol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(path.quaternions, axis=1), 1, rtol=0, atol=1e-14)
        assert np.linalg.norm(np.diff(positions, axis=0), axis=1).max() < 0.05
        assert np.abs(np.diff(path.rotation)).max() <= math.pi


# --- any walk ---


def test_every_jump_comes_to_rest_above_the_stairs_after_the_seconds_of_the_published_rule(walks):
    for done in walks:
        path = done.trajectory
        assert len(path.y) <= MAX_STEPS
        positions = np.column_stack([path.x, path.y, path.z])
        polled = np.vstack([positions[::1000], done.end[:3], done.end[:3]])
        moved = np.abs(np.diff(polled, axis=0)).sum(axis=1)
        assert done.duration == 1 + np.argmax(moved < 1e-3)
        assert 0 < done.end[2] < Staircase.fifteen().top + 0.1


def test_an_end_is_a_canonical_state_to_which_the_world_goes_back_to_the_bit(walks):
    world = TumblingWorld(Staircase.fifteen())
    for done in walks:
        end = done.end
        assert end[6] >= 0
        assert np.linalg.norm(end[3:7]) == pytest.approx(1, abs=1e-14)
        assert end[7] == world.staircase.d_obs(end[1])
        assert done.on_map == world.on_map(end)
        assert world.reset(end).tobytes() == end.tobytes()
        np.testing.assert_array_equal(world.reset(end * [1, 1, 1, -1, -1, -1, -1, 1]), end)


def test_a_cube_can_roll_off_the_side_and_lands_on_the_ground():
    world = TumblingWorld()
    world.reset(world.state_at(1.2, 0.65, x=2.48, yaw=0.4))
    world.jump(100, 60)
    end = world.jump(300, 89).end
    assert world.state.tolist() == end.tolist()
    world.reset(world.state_at(1.2, 0.7, x=2.52, rotation=0.3))
    fallen = world.jump(50, 89)
    assert fallen.end[0] > 2.5
    assert fallen.end[2] < 0.1
    assert not fallen.on_map


@pytest.mark.parametrize(
    "staircase",
    [
        Staircase(n_steps=1),
        Staircase(n_steps=100),
        Staircase(rise=0.001),
        Staircase(rise=CUBE_EDGE),
        Staircase(rise=3.0),
        Staircase(n_steps=50, rise=0.03, run=0.03),
        Staircase(last_run=0.02),
        Staircase(first_riser=0.3),
    ],
    ids=repr,
)
def test_odd_stairs_carry_the_cube_too(staircase):
    world, rng = TumblingWorld(staircase), np.random.default_rng(2)
    for walk in range(3):
        world.reset(world.draw_start(rng) if walk else None)
        for motion in rng.uniform(world.motion_low, world.motion_high, (10, 2)):
            end = world.jump(*motion, rng).end
            np.testing.assert_array_equal(world.reset(end), end)  # refused if it were inside the stairs


LEANING = [-0.35591003232245483, 1.9712864680570135, 1.2499933187774739]
LEANING += [-6.4669450943707654e-09, 2.78690765899015e-06, 0.00230407733489041, 0.9999973456064112]
""" From this pose, 1,000 N at 89 degrees with a rocking of -0.0310 and -0.0633 rad/s end in a slide of 17 s down a riser """


def test_a_cube_that_slides_down_a_riser_until_the_time_limit_counts_as_at_rest_also_if_it_begins_to_tip_over():
    world = TumblingWorld(Staircase.fifteen())
    world.reset([*LEANING, 0])

    class Rocking(np.random.Generator):
        def uniform(self, *_):
            return np.array([-0.031036406077850777, -0.06332281643457077]) / ROCKING

    jump = world.jump(1000, 89, Rocking(np.random.PCG64(0)))
    assert jump.duration == 20
    assert 1.52 < jump.end[2] < 1.6
    np.testing.assert_array_equal(world.reset(jump.end), jump.end)


def test_a_jump_that_takes_longer_than_the_limit_is_an_error_and_leaves_the_world_as_it_was():
    world = TumblingWorld()
    world.reset(world.state_at(0.25, 5000.0))
    with pytest.raises(RuntimeError, match=r"400 N at 45 degrees from the state \[0.0, 0.25, 5000.0.*20 simulated"):
        world.jump(400, 45)
    assert world.state[2] == 5000.0


# --- options and errors ---


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({1: math.nan}, "state must be finite"),
        ({2: -0.2}, "below the ground"),
        ({2: 0.02}, "0.030 m inside them"),
        ({1: 0.62}, "inside them; upright on the tread there, z is 0.35 m"),
        ({3: 0.5}, r"unit quaternion, not \[0.5, 0.0, 0.0, 1.0\] of length 1.118"),
        ({6: 0.0}, "unit quaternion"),
        ({0: 1e9}, "within 1e\\+06 m of the origin"),
    ],
)
def test_impossible_states_are_refused_and_leave_the_world_as_it_was(change, message):
    world = TumblingWorld()
    state = world.state
    for place, value in change.items():
        state[place] = value
    with pytest.raises(ValueError, match=message):
        world.reset(state)
    np.testing.assert_array_equal(world.state, world.start)


def test_a_state_may_overlap_the_stairs_by_a_centimetre_and_no_more():
    world = TumblingWorld()
    world.reset(world.state_at(0.25, HALF_EDGE - 0.0099))
    with pytest.raises(ValueError, match=r"0\.010 m inside them"):
        world.reset(world.state_at(0.25, HALF_EDGE - 0.0101))


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"rocking": -0.1}, ValueError, "rocking must be between 0 and 10, not -0.1"),
        ({"rocking": math.nan}, ValueError, "rocking must be finite"),
        ({"rocking": "1"}, TypeError, "rocking must be a number"),
        ({"rocking": None}, TypeError, "rocking must be a number"),
        ({"rocking": True}, TypeError, "rocking must be a number"),
        ({"friction": -1}, ValueError, "friction must be between 0 and 10"),
        ({"friction": math.inf}, ValueError, "friction must be finite"),
        ({"friction": [1]}, TypeError, "friction must be a number"),
        ({"staircase": 4}, TypeError, "staircase must be a Staircase"),
        ({"staircase": Staircase(restitution=0.1)}, ValueError, "staircase must have no restitution .* not 0.1"),
        ({"staircase": Staircase(first_riser=0.29)}, ValueError, r"first_riser of 0\.3 m or more"),
    ],
)
def test_bad_options_are_refused_by_name(options, error, message):
    with pytest.raises(error, match=message):
        TumblingWorld(**options)


@pytest.mark.parametrize(
    ("motion", "error", "message"),
    [
        ((49.9, 45), ValueError, "magnitude must be between 50 and 1000, not 49.9"),
        ((100, 89.1), ValueError, "angle must be between 1 and 89"),
        ((math.nan, 45), ValueError, "magnitude must be finite"),
        ((600, 70, 0), TypeError, "rng must be a numpy"),
    ],
)
def test_motions_outside_the_motion_space_are_refused_by_name(motion, error, message):
    with pytest.raises(error, match=message):
        TumblingWorld().jump(*motion)


def test_a_world_says_whether_it_is_random():
    assert TumblingWorld().random
    assert not TumblingWorld(rocking=0).random
    assert not StairWorld().random
    assert StairWorld(x_drift=True).random


def test_a_world_is_made_by_its_name_and_takes_the_options_that_only_the_other_has_at_their_defaults():
    stairs = Staircase.fifteen()
    tumbling = stair_world("tumbling", stairs, rocking=0.5, friction=0.8, x_drift=False)
    assert isinstance(tumbling, TumblingWorld)
    assert (tumbling.staircase, tumbling.rocking, tumbling.friction) == (stairs, 0.5, 0.8)
    plane = stair_world("plane", stairs, rocking=1.0, friction=1.0, x_drift=True)
    assert isinstance(plane, StairWorld)
    assert (plane.staircase, plane.x_drift) == (stairs, True)
    assert repr(tumbling) == f"TumblingWorld({stairs!r}, rocking=0.5, friction=0.8)"


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("cube", {}, "world must be one of 'plane', 'tumbling', not 'cube'"),
        ("plane", {"rocking": 0.5}, "The plane world has no rocking, but it is 0.5; it has staircase, x_drift"),
        ("plane", {"friction": 0.5}, "The plane world has no friction"),
        ("tumbling", {"x_drift": True}, "The tumbling world has no x_drift, but it is True"),
        ("tumbling", {"gravity": 1.6}, "The tumbling world has no gravity"),
        ("tumbling", {"rocking": -1}, "rocking must be between"),
    ],
)
def test_a_world_that_there_is_not_and_options_that_it_has_not_are_refused(name, options, message):
    with pytest.raises(ValueError, match=message):
        stair_world(name, **options)


def test_plain_python_makes_the_same_jumps_as_compiled_code():
    """With NUMBA_DISABLE_JIT=1 the world can be stepped through in a debugger."""
    motions = [(50, 1), (50, 89), (100, 80)]
    program = (
        "import json, sys; from stairlab.tumbling import TumblingWorld, step; world = TumblingWorld(); ends = []\n"
        "for motion in json.loads(sys.argv[1]):\n    world.reset(); ends.append(world.jump(*motion).end.tolist())\n"
        "print(json.dumps([hasattr(step, 'signatures'), ends]))"
    )
    told = subprocess.run(
        [sys.executable, "-c", program, json.dumps(motions)],
        env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    compiled, ends = json.loads(told.stdout)
    assert not compiled
    assert told.stderr == ""
    np.testing.assert_allclose(ends, [jump(TumblingWorld(), motion).end for motion in motions], rtol=0, atol=1e-6)
