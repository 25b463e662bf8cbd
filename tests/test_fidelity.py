import json
import math

import numpy as np
import pandas as pd
import pytest
from toy_world import PuckWorld

from stairlab.fidelity import (
    GAP_BINS,
    TREAD_COLUMNS,
    Compared,
    Rollouts,
    TreadMeasures,
    climb_table,
    corner_gaps,
    fidelity_table,
    jump_again,
    levels,
    measure_fidelity,
    measure_tread_fidelity,
    outcome_table,
    riser_gaps,
    roll_out,
    tread_fidelity_table,
    yaws,
)
from stairlab.sampling import Samples, sample_motions
from stairlab.tumbling import TumblingWorld
from stairlab.world import Staircase, StairWorld

FIFTEEN = Staircase.fifteen()


def measure(recorded, world=None, seed=0):
    return measure_fidelity(recorded, world, seed, progress=False)


@pytest.fixture(scope="module")
def own():
    return sample_motions(StairWorld(), n=60, seed=1, progress=False)


def changed(samples, row, **values):
    effects, on_map = samples.effects.copy(), samples.on_map.copy()
    for name, value in values.items():
        if name == "on_map":
            on_map[row] = value
        else:
            effects[row, samples.effect_names.index(name)] = value
    return Samples(samples.motions, samples.starts, effects, on_map)


@pytest.fixture(scope="module")
def against_gazebo(reference_csv):
    return measure(reference_csv)


def test_the_world_is_as_faithful_to_the_recorded_jumps_as_promised(against_gazebo):
    assert against_gazebo.n == 2000
    assert against_gazebo.agreement >= 0.985
    assert against_gazebo.agreement_se < 0.003
    assert against_gazebo.dy_error_median_mm <= 1.1
    assert against_gazebo.dy_error_p90_mm <= 14
    assert against_gazebo.gap_ks <= 0.20


def test_the_recorded_outcomes_are_counted_as_published(against_gazebo):
    counts = against_gazebo.confusion.sum(axis=1)
    assert list(counts.index) == ["off the map", "0 steps", "1 step", "2 steps", "3 steps", "4 steps"]
    published = np.array([1714, 6329, 769, 584, 455, 149]) / 10_000
    np.testing.assert_allclose(counts / 2000, published, atol=0.02)


def test_the_recorded_gaps_are_as_published(against_gazebo):
    """Shares of the gaps below 1 mm, 2 mm, 5 mm, 20 mm and 100 mm."""
    gaps = against_gazebo.gaps_recorded
    shares = [np.mean(gaps < limit) for limit in (1e-3, 2e-3, 5e-3, 20e-3, 100e-3)]
    np.testing.assert_allclose(shares, [0.173, 0.447, 0.546, 0.578, 0.702], atol=0.03)


@pytest.mark.parametrize(
    ("stairs", "start"),
    [(Staircase(), "fixed"), (Staircase(), "drawn"), (Staircase.fifteen(), "drawn"), (Staircase(2, 0.2), "fixed")],
)
def test_a_file_of_the_worlds_own_jumps_agrees_exactly(tmp_path, stairs, start):
    world = StairWorld(stairs)
    sample_motions(world, n=60, seed=2, start=start, progress=False).to_csv(tmp_path / "own.csv")
    fidelity = measure(tmp_path / "own.csv", world)
    assert fidelity.agreement == 1
    assert fidelity.agreement_se == 0
    assert fidelity.dy_error_median_mm == fidelity.dy_error_p90_mm == 0
    assert fidelity.gap_ks == 0
    assert np.trace(fidelity.confusion.to_numpy()) == 60
    assert {"off the map", f"{stairs.n_steps} steps"} <= set(fidelity.labels)


def test_falls_have_classes_of_their_own():
    world = StairWorld()
    drawn = sample_motions(world, n=20, seed=2, start="drawn", progress=False)
    row = int(np.flatnonzero(drawn.on_map)[0])
    fidelity = measure(changed(drawn, row, dz=-0.6), world)
    assert fidelity.labels == (
        "off the map",
        "-2 steps",
        "-1 step",
        "0 steps",
        "1 step",
        "2 steps",
        "3 steps",
        "4 steps",
    )
    assert fidelity.labels[fidelity.recorded[row]] == "-2 steps"


def test_a_jump_that_ended_elsewhere_costs_agreement_and_shows_in_the_confusion(own):
    row = int(np.flatnonzero(own.on_map & (np.abs(own.effects[:, 2]) < 0.01))[0])
    fidelity = measure(changed(own, row, dz=0.3))
    assert fidelity.agreement == pytest.approx(59 / 60)
    assert fidelity.agreement_se == pytest.approx(math.sqrt(59 / 60 * (1 / 60) / 60))
    assert fidelity.confusion.loc["1 step", "0 steps"] == 1
    assert (fidelity.labels[fidelity.recorded[row]], fidelity.labels[fidelity.replayed[row]]) == ("1 step", "0 steps")
    assert len(fidelity.dy_errors) == own.on_map.sum() - 1
    assert fidelity.confusion.to_numpy().sum() == 60


def test_dy_errors_count_where_the_class_agrees_and_the_jump_ends_on_the_map(own):
    row, off = int(np.flatnonzero(own.on_map)[0]), int(np.flatnonzero(~own.on_map)[0])
    shifted = changed(own, row, dy=own.effects[row, 1] - 0.005)
    fidelity = measure(changed(shifted, off, dy=99.0))
    assert fidelity.agreement == 1
    assert fidelity.dy_errors.max() == pytest.approx(0.005)
    assert len(fidelity.dy_errors) == own.on_map.sum()
    everything = measure(Samples(own.motions, own.starts, own.effects + 0.002 * np.eye(8)[1], own.on_map))
    assert everything.dy_error_median_mm == pytest.approx(2)
    assert everything.dy_error_p90_mm == pytest.approx(2)


def test_the_gap_is_measured_from_the_front_of_the_cube_to_the_riser_of_its_tread():
    starts = np.tile(StairWorld().start, (5, 1))
    ends = [(0.548, 0.05), (0.9, 0.35), (1.75, 0.95), (2.0, 1.25), (2.5, 0.05)]
    effects = np.zeros((5, 8))
    effects[:, 1:3] = np.array(ends) - starts[:, 1:3]
    samples = Samples(np.tile([600.0, 70.0], (5, 1)), starts, effects, np.array([True] * 4 + [False]))
    np.testing.assert_allclose(riser_gaps(samples), [0.002, 0.05, 0.0], atol=1e-12)


FIGURES = ["n", "agreement", "dy_error_median_mm", "dy_error_p90_mm", "gap_ks"]
CLIMBING = ["agreement_se", "n_climbing", "agreement_climbing", "agreement_climbing_se", "climbing"]


def test_the_summary_has_the_figures_as_json(own):
    summary = measure(own).summary()
    assert list(summary) == FIGURES + CLIMBING
    assert json.loads(json.dumps(summary)) == summary
    assert {name: summary[name] for name in FIGURES} == {**dict.fromkeys(FIGURES, 0.0), "n": 60, "agreement": 1.0}
    assert summary["agreement_climbing"] == 1
    assert summary["climbing"]["n_recorded"] == summary["climbing"]["n_replayed"] == summary["n_climbing"] > 5
    assert summary["climbing"]["gap_m"]["recorded"] == summary["climbing"]["gap_m"]["replayed"]
    assert type(summary["agreement"]) is float


def test_a_figure_that_no_jump_counts_for_is_null_in_the_summary(own):
    fidelity = measure(own[~own.on_map])
    assert math.isnan(fidelity.gap_ks)
    summary = fidelity.summary()
    assert {name: summary[name] for name in FIGURES} == {
        "n": int((~own.on_map).sum()),
        "agreement": 1.0,
        "dy_error_median_mm": None,
        "dy_error_p90_mm": None,
        "gap_ks": None,
    }
    assert summary["n_climbing"] == 0
    assert summary["agreement_climbing"] is summary["agreement_climbing_se"] is None
    assert summary["climbing"]["aside_m"] == {"ks": None, "recorded": [None] * 5, "replayed": [None] * 5}
    assert summary["climbing"]["share_turned"] == {"recorded": None, "replayed": None}


def test_the_world_stays_in_its_state(own, world):
    state = world.jump(600, 70).end
    measure(own[:3], world)
    np.testing.assert_array_equal(world.state, state)


def test_a_jump_that_cannot_be_replayed_is_named(own, world):
    motions = own.motions.copy()
    motions[4, 0] = 2000
    with pytest.raises(ValueError, match="Jump 5 of 60 cannot be replayed: magnitude must be"):
        measure(Samples(motions, own.starts, own.effects, own.on_map), world)
    starts = own.starts.copy()
    starts[7, 2] = 0.01
    with pytest.raises(ValueError, match="Jump 8 of 60 cannot be replayed: state must"):
        measure(Samples(own.motions, starts, own.effects, own.on_map), world)
    np.testing.assert_array_equal(world.state, world.start)


def test_other_things_than_jumps_on_stairs_are_refused(own, tmp_path):
    with pytest.raises(TypeError, match="samples_or_path must be Samples or the path"):
        measure(own.motions)
    with pytest.raises(TypeError, match="world must be a StairWorld or a TumblingWorld"):
        measure(own, PuckWorld())
    with pytest.raises(ValueError, match="samples_or_path must have the features"):
        measure(sample_motions(PuckWorld(), n=3, progress=False))
    with pytest.raises(FileNotFoundError):
        measure(tmp_path / "nowhere.csv")


# Jumps that climb, and worlds that are random


@pytest.fixture(scope="module")
def tumbling_against_gazebo(reference_csv):
    return measure(reference_csv, TumblingWorld())


def test_the_tumbling_world_is_as_faithful_to_the_recorded_jumps_as_promised(tumbling_against_gazebo):
    assert tumbling_against_gazebo.agreement >= 0.97
    assert tumbling_against_gazebo.agreement_climbing >= 0.88
    assert tumbling_against_gazebo.n_climbing == 406
    assert tumbling_against_gazebo.agreement_climbing_se < 0.015


def test_climbing_jumps_end_turned_too_often_and_aside_a_little_too_seldom_and_never_in_the_plane(
    tumbling_against_gazebo, against_gazebo
):
    """Of the climbing jumps, more than 5 cm aside are 28.3 to 32.2 % with seeds 0 to 4, turned by more than 5 degrees 34.8 to 36.2 %.

    Of the recorded ones it is 35.2 and 23.2 % (of the 406 among these 2,000).
    """
    aside, own_aside = tumbling_against_gazebo.aside.shares_above(0.05)
    turned, own_turned = tumbling_against_gazebo.yaw.shares_above(5)
    assert aside == pytest.approx(0.352, abs=0.001)
    assert turned == pytest.approx(0.232, abs=0.001)
    assert own_aside == pytest.approx(0.30, abs=0.04)
    assert own_turned == pytest.approx(0.355, abs=0.04)
    assert own_aside < aside
    assert own_turned > turned + 0.05
    assert against_gazebo.aside.shares_above(0.05) == (aside, 0)
    assert against_gazebo.yaw.shares_above(5) == (turned, 0)


def test_in_a_random_world_jump_i_draws_from_child_i_of_the_seed(own):
    fidelity = measure(own[:12], TumblingWorld(), seed=7)
    world, ends = TumblingWorld(), []
    for i, child in enumerate(np.random.SeedSequence(7).spawn(12)):
        world.reset(own.starts[i])
        ends.append(world.perform(own.motions[i], np.random.default_rng(child)).end)
    ends = np.array(ends)
    climbs = ends[:, 2] > 0.3
    assert climbs.any()
    np.testing.assert_array_equal(fidelity.aside.own, np.abs(ends[climbs, 0]))
    assert not np.array_equal(fidelity.aside.own, measure(own[:12], TumblingWorld(), seed=8).aside.own)


def test_the_replay_begins_turned_where_the_recorded_cube_was_turned():
    world = TumblingWorld(rocking=0)
    start = world.state_at(0.25, 0.05, yaw=math.radians(30), x=0.2)
    ends = []
    for magnitude in (400, 600, 800):
        world.reset(start)
        ends.append(world.jump(magnitude, 60))
    recorded = Samples(
        np.array([[jump.magnitude, jump.angle] for jump in ends]),
        np.tile(start, (3, 1)),
        np.array([jump.effect for jump in ends]),
        np.array([jump.on_map for jump in ends]),
    )
    fidelity = measure(recorded, world)
    assert fidelity.agreement == 1
    assert fidelity.dy_error_p90_mm == 0
    assert (fidelity.yaw.own > 1).any()
    np.testing.assert_allclose(fidelity.yaw.recorded, fidelity.yaw.own, atol=1e-9)


def test_climbing_jumps_are_measured_by_their_recorded_ends(own):
    """The recorded end is moved aside, and turned by 30 degrees about the vertical."""
    rows = np.flatnonzero(own.on_map & (own.effects[:, 2] > 0.29))
    half = math.radians(15)
    turned = np.array([0, 0, math.sin(half), math.cos(half)])
    values = dict(zip(("dqx", "dqy", "dqz", "dqw"), turned - own.starts[rows[0], 3:7], strict=True))
    fidelity = measure(changed(own, rows[0], dx=-0.2, **values))
    assert fidelity.n_climbing == len(rows)
    np.testing.assert_allclose(fidelity.aside.recorded, [0.2, *[0] * (len(rows) - 1)])
    assert fidelity.yaw.recorded[0] == pytest.approx(30)
    assert fidelity.aside.shares_above(0.05) == (1 / len(rows), 0)
    assert fidelity.aside.ks == pytest.approx(1 / len(rows))


def test_a_recorded_fall_costs_no_agreement_of_the_jumps_that_climb(own):
    rows = np.flatnonzero(own.on_map & (own.effects[:, 2] > 0.29))
    fidelity = measure(changed(own, rows[0], on_map=False))
    assert fidelity.agreement == pytest.approx(59 / 60)
    assert (fidelity.n_climbing, fidelity.agreement_climbing) == (len(rows) - 1, 1)
    higher = measure(changed(own, rows[0], dz=own.effects[rows[0], 2] + 0.3))
    share = 1 - 1 / len(rows)
    assert higher.agreement_climbing == pytest.approx(share)
    assert higher.agreement_climbing_se == pytest.approx(math.sqrt(share * (1 - share) / len(rows)))


def test_a_climbing_jump_must_end_in_a_unit_quaternion(own):
    row = int(np.flatnonzero(own.on_map & (own.effects[:, 2] > 0.29))[0])
    with pytest.raises(ValueError, match=rf"Jump {row + 1} of 60 must end in a unit quaternion"):
        measure(changed(own, row, dqw=1.0))


# Poses


def test_an_upright_cube_reaches_5_cm_and_a_turned_one_to_its_corner():
    world = StairWorld()
    states = [
        world.state_at(0.4, 0.05),
        world.state_at(0.4, 0.05, yaw=math.radians(30)),
        world.state_at(0.4, 0.05, yaw=math.radians(-45)),
        world.state_at(0.4, 0.05, rotation=math.pi / 2, yaw=math.radians(30)),
        world.state_at(0.4, 0.07, rotation=math.pi / 4),
        world.state_at(0.75, 0.35),
    ]
    reach = 0.05 * (math.cos(math.pi / 6) + 0.5)
    expected = [0.15, 0.2 - reach, 0.2 - 0.05 * math.sqrt(2), 0.2 - reach, 0.2 - 0.05 * math.sqrt(2), 0.2]
    np.testing.assert_allclose(corner_gaps(states), expected, atol=1e-12)
    opposite = np.array(states)[:, :7]
    opposite[:, 3:] *= -1  # the same rotations
    np.testing.assert_allclose(corner_gaps(opposite), expected, atol=1e-12)


def test_the_corner_gap_is_that_of_the_foremost_of_the_eight_corners():
    rng = np.random.default_rng(3)
    quaternions = rng.normal(size=(40, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    states = np.column_stack([np.zeros(40), rng.uniform(0.1, 0.5, 40), np.full(40, 0.05), quaternions])
    corners = 0.05 * np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, 8).T
    for state, gap in zip(states, corner_gaps(states), strict=True):
        u, w = state[3:6], state[6]
        turned = [c + 2 * np.cross(u, np.cross(u, c) + w * c) for c in corners]
        assert gap == pytest.approx(0.6 - state[1] - max(corner[1] for corner in turned), abs=1e-12)


def test_there_is_no_gap_on_the_last_tread():
    states = [StairWorld().state_at(2.0, 1.25), StairWorld().state_at(2.0, 0.95)]
    assert np.isnan(corner_gaps(states)).tolist() == [True, False]
    np.testing.assert_allclose(corner_gaps(states, FIFTEEN), [0.2 - 0.05 + 0.0, -0.25], atol=1e-12)
    assert len(corner_gaps(np.empty((0, 7)))) == len(yaws(np.empty((0, 7)))) == 0


def test_levels_are_counted_in_steps():
    states = np.zeros((5, 7))
    states[:, 2], states[:, 6] = [0.05, 0.0499, 0.3506, 4.55, -0.25], 1
    assert levels(states, FIFTEEN).tolist() == [0, 0, 1, 15, -1]


@pytest.mark.parametrize(
    ("turned", "yaw"), [(0, 0), (30, 30), (44, 44), (60, 30), (90, 0), (-10, 10), (180, 0), (275, 5)]
)
@pytest.mark.parametrize("rolled", [0, 90, 180, -90])
def test_a_yaw_is_folded_to_45_degrees_whatever_face_is_up(turned, yaw, rolled):
    state = StairWorld().state_at(0.4, 0.05, rotation=math.radians(rolled), yaw=math.radians(turned))
    assert yaws([state])[0] == pytest.approx(yaw, abs=1e-5)


def test_poses_have_seven_or_eight_columns():
    for measured in (corner_gaps, yaws, levels):
        with pytest.raises(ValueError, match="states must have the columns x, y, z"):
            measured(np.zeros((2, 3)))


def test_compared_says_how_far_two_distributions_are_apart():
    pair = Compared(np.array([1.0, 2, 3, 4]), np.array([3.0, 4, 5, 6, 7, 8]))
    assert pair.ks == pytest.approx(4 / 6)
    assert pair.shares_above(3) == (0.25, 5 / 6)
    assert pair.quantiles().loc["50 %"].tolist() == [2.5, 5.5]
    assert Compared(np.zeros(1), np.zeros(1)).ks == 0
    assert Compared(np.zeros(1), np.ones(1)).ks == 1
    empty = Compared(np.empty(0), np.ones(2))
    assert math.isnan(empty.ks)
    assert math.isnan(empty.shares_above(0)[0])
    assert empty.quantiles()["recorded"].isna().all()


# Rollouts


def pose(y, z, x=0.0, yaw=0.0):
    half = math.radians(yaw / 2)
    return [x, y, z, 0, 0, math.sin(half), math.cos(half)]


START, BELOW, ON_ONE, ON_TWO = pose(0.25, 0.05), pose(0.54, 0.05, 0.3, 20), pose(0.7, 0.35), pose(1.2, 0.65, 0.1, 40)
TOP, FALLEN = pose(8.0, 4.55), pose(3.0, 0.05, 2.6)


@pytest.fixture
def by_hand():
    """Return seven jumps: up and down and off, then stay, up to the top, and a jump on the top."""
    rows = [
        (0, 0, 600, 60, START, BELOW),
        (0, 1, 350, 55, BELOW, ON_ONE),  # from 0.54: gap 60 - 54 - reach of 20 degrees
        (0, 2, 650, 75, ON_ONE, FALLEN),
        (5, 0, 900, 80, START, ON_ONE),
        (5, 1, 500, 65, ON_ONE, ON_TWO),
        (5, 2, 649, 76, ON_TWO, TOP),  # climbs, but is not moderate
        (5, 3, 500, 60, TOP, TOP),  # from the top: no resting pose of interest
    ]
    rollout, jump, magnitude, angle, starts, ends = zip(*rows, strict=True)
    motions = np.column_stack([magnitude, angle]).astype(float)
    return Rollouts(np.array(rollout), np.array(jump), motions, np.array(starts), np.array(ends))


def test_rollouts_are_measured_as_the_reference_says(by_hand):
    measures = TreadMeasures.of(by_hand)
    assert (measures.n_jumps, measures.n_rollouts, len(measures.gaps)) == (7, 2, 4)
    reach = {yaw: 0.05 * (math.cos(math.radians(yaw)) + math.sin(math.radians(yaw))) for yaw in (0, 20, 40)}
    expected = [0.06 - reach[20], 0.3 - reach[0], 0.3 - reach[0], 0.2 - reach[40]]
    np.testing.assert_allclose(measures.gaps, expected, atol=1e-12)
    np.testing.assert_allclose(measures.yaws, [20, 0, 0, 40], atol=1e-9)
    np.testing.assert_allclose(measures.asides, [0.3, 0, 0, 0.1])
    assert measures.moderate.tolist() == [True, True, True, False]
    assert measures.climbed.tolist() == [True, False, True, True]
    assert measures.fell.tolist() == [False, False, False, False]
    assert measures.left.tolist() == [False, True, False, False]
    assert measures.climb == pytest.approx(2 / 3)
    assert measures.climb_se == pytest.approx(math.sqrt(2 / 9 / 3))
    assert measures.climb_all == 0.75
    assert measures.freed.tolist() == [True, False, True, True]
    assert measures.freed_share == 1  # of one cube, which stands at the riser
    assert measures.tops.tolist() == [1, 15]
    assert measures.top_quartiles == (4.5, 8, 11.5)


def test_the_probability_to_climb_is_counted_by_gap_and_yaw(by_hand):
    measures = TreadMeasures.of(by_hand)
    by_gap, by_yaw = measures.climb_by_gap(), measures.climb_by_yaw()
    assert by_gap.index.tolist() == [
        "0 to 3 cm", "3 to 6 cm", "6 to 10 cm", "10 to 15 cm", "15 to 20 cm", "20 to 40 cm",
    ]  # fmt: skip
    assert by_gap["n"].tolist() == [1, 0, 0, 0, 0, 2]
    np.testing.assert_array_equal(by_gap["climb"], [1, *[np.nan] * 4, 0.5])
    assert by_yaw["n"].tolist() == [2, 0, 0, 1]
    np.testing.assert_array_equal(by_yaw["climb"], [0.5, np.nan, np.nan, 1])


def test_a_cube_that_stays_close_to_a_riser_or_leaves_the_map_is_not_freed(by_hand):
    for end, freed in ((BELOW, 0), (pose(0.93, 0.35), 0), (pose(0.9, 0.35), 1), (FALLEN, 0), (TOP, 1)):
        ends = by_hand.ends.copy()
        ends[1] = end
        measures = TreadMeasures.of(Rollouts(by_hand.rollout, by_hand.jump, by_hand.motions, by_hand.starts, ends))
        assert measures.freed_share == freed


def test_an_end_off_the_map_is_no_climb_at_any_height(by_hand):
    for end in (pose(1.2, 0.65, 2.47), pose(-0.1, 0.65), pose(16.17, 4.55)):
        ends = by_hand.ends.copy()
        ends[4] = end
        measures = TreadMeasures.of(Rollouts(by_hand.rollout, by_hand.jump, by_hand.motions, by_hand.starts, ends))
        assert measures.climbed.tolist() == [True, False, False, True]


@pytest.fixture(scope="module")
def tumbling_rollouts():
    return roll_out(TumblingWorld(FIFTEEN), 12, seed=3, progress=False)


def test_a_rollout_goes_on_where_the_last_jump_ended_until_it_is_over(tumbling_rollouts):
    rolled = tumbling_rollouts
    first = rolled.jump == 0
    np.testing.assert_array_equal(rolled.starts[first], np.tile(StairWorld().start[:7], (12, 1)))
    np.testing.assert_array_equal(rolled.starts[~first], rolled.ends[:-1][~first[1:]])
    last = np.append(first[1:], True)
    x, y, z = rolled.ends[:, :3].T
    over = (y <= 0) | (y >= 16.16) | (np.abs(x) >= 2.46) | (z <= 0.02) | (z > 4.4)
    assert not over[~last].any()
    assert (over | (rolled.jump == 14))[last].all()
    assert over.any()
    assert rolled.jump.max() == 14


def test_half_of_the_motions_come_from_the_steep_range():
    rolled = roll_out(StairWorld(FIFTEEN), 40, progress=False)
    magnitude, angle = rolled.motions.T
    assert len(rolled) > 300
    assert ((magnitude >= 50) & (magnitude <= 1000) & (angle >= 1) & (angle <= 89)).all()
    steep = (magnitude >= 300) & (magnitude <= 700) & (angle >= 55)
    expected = 0.5 + 0.5 * 400 / 950 * 34 / 88  # some of the wide ones are steep
    assert steep.mean() == pytest.approx(expected, abs=4 * math.sqrt(0.25 / len(rolled)))


def test_rollout_r_draws_from_child_r_of_the_seed(tumbling_rollouts):
    fewer = roll_out(TumblingWorld(FIFTEEN), 5, seed=3, progress=False)
    np.testing.assert_array_equal(fewer.ends, tumbling_rollouts.ends[tumbling_rollouts.rollout < 5])
    other = roll_out(TumblingWorld(FIFTEEN), 5, seed=4, progress=False)
    assert not np.array_equal(other.motions[0], fewer.motions[0])
    rng, world = np.random.default_rng(np.random.SeedSequence(3).spawn(5)[4]), TumblingWorld(FIFTEEN)
    motion = rng.uniform([50, 1], [1000, 89]) if rng.random() < 0.5 else rng.uniform([300, 55], [700, 89])
    row = int(np.flatnonzero(fewer.rollout == 4)[0])
    np.testing.assert_array_equal(fewer.motions[row], motion)
    np.testing.assert_array_equal(fewer.ends[row], world.perform(motion, rng).end[:7])


def test_rollouts_leave_the_world_in_its_state():
    world = StairWorld(FIFTEEN)
    state = world.jump(600, 70).end
    roll_out(world, 2, progress=False)
    np.testing.assert_array_equal(world.state, state)
    with pytest.raises(ValueError, match="rollouts must be at least 1, not 0"):
        roll_out(world, 0)
    with pytest.raises(TypeError, match="world must be a StairWorld or a TumblingWorld"):
        roll_out(PuckWorld())


def write_rollouts(path, rollouts):
    columns = [rollouts.rollout, rollouts.jump, rollouts.motions, rollouts.starts, rollouts.ends]
    pd.DataFrame(np.column_stack(columns), columns=list(TREAD_COLUMNS)).to_csv(path, index=False)


def test_a_file_of_the_worlds_own_rollouts_agrees_exactly(tmp_path, tumbling_rollouts):
    write_rollouts(tmp_path / "own.csv", tumbling_rollouts)
    fidelity = measure_tread_fidelity(tmp_path / "own.csv", rollouts=12, seed=3, progress=False)
    assert fidelity.gap_ks == fidelity.yaw_ks == fidelity.x_ks == 0
    summary = fidelity.summary()
    assert {name: summary[name] for name in summary["reference"]} == summary["reference"]
    assert summary["n_jumps"] == len(tumbling_rollouts)
    assert json.loads(json.dumps(summary, allow_nan=False)) == summary


def test_a_file_without_resting_poses_has_no_distances(tmp_path, by_hand):
    first = by_hand.jump == 0
    parts = (by_hand.rollout, by_hand.jump, by_hand.motions, by_hand.starts, by_hand.ends)
    write_rollouts(tmp_path / "short.csv", Rollouts(*(part[first] for part in parts)))
    fidelity = measure_tread_fidelity(tmp_path / "short.csv", StairWorld(FIFTEEN), 2, progress=False)
    summary = fidelity.summary()
    assert summary["gap_ks"] is summary["yaw_ks"] is summary["x_ks"] is summary["reference"]["climb"] is None
    assert summary["reference"]["top_quartiles"] == [0.25, 0.5, 0.75]
    assert tread_fidelity_table({"plane": fidelity}).loc["gap: KS distance", "plane"] == "-"


def without(column):
    return lambda lines: [",".join(np.delete(line.split(","), TREAD_COLUMNS.index(column))) for line in lines]


def with_cell(column, text):
    def change(lines):
        cells = lines[3].split(",")
        cells[TREAD_COLUMNS.index(column)] = text
        return [*lines[:3], ",".join(cells), *lines[4:]]

    return change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (without("start_qz"), "bad.csv, line 1: the column start_qz must be there"),
        (with_cell("end_y", "nan"), "bad.csv, line 4, column end_y: expected a number from -1000 to 1000, found 'nan'"),
        (with_cell("magnitude", "5"), "bad.csv, line 4, column magnitude: expected a number from 50 to 1000"),
        (with_cell("jump", "1.5"), "bad.csv, line 4, column jump: expected a whole number, found 1.5"),
        (with_cell("end_qw", "0.2"), "bad.csv, line 4, columns end_qx to end_qw: expected a quaternion of length 1"),
        (lambda lines: [*lines[:3], lines[3][:40]], "bad.csv, line 4: expected 18 cells, found"),
        (lambda lines: lines[:1], "bad.csv must hold a line of column names and at least one row, but it has no row"),
        (lambda _: [], "bad.csv must hold a line of column names and at least one row, but it is empty"),
    ],
)
def test_a_bad_file_of_rollouts_is_refused_with_file_line_and_column(change, message, tmp_path, by_hand):
    write_rollouts(tmp_path / "good.csv", by_hand)
    assert len(Rollouts.from_csv(tmp_path / "good.csv")) == 7
    (tmp_path / "bad.csv").write_text("\n".join(change((tmp_path / "good.csv").read_text().splitlines())))
    with pytest.raises(ValueError, match=message):
        measure_tread_fidelity(tmp_path / "bad.csv")


def test_the_world_of_rollouts_must_have_their_stairs(tmp_path, by_hand):
    write_rollouts(tmp_path / "good.csv", by_hand)
    with pytest.raises(ValueError, match="world must have the stairs of the recorded rollouts"):
        measure_tread_fidelity(tmp_path / "good.csv", StairWorld())
    with pytest.raises(TypeError, match="world must be a StairWorld or a TumblingWorld"):
        measure_tread_fidelity(tmp_path / "good.csv", PuckWorld())
    with pytest.raises(FileNotFoundError):
        measure_tread_fidelity(tmp_path / "nowhere.csv")


def test_worlds_stand_side_by_side_in_the_tables(own, tmp_path, by_hand):
    start = {name: measure(own, world) for name, world in (("tumbling", TumblingWorld()), ("plane", StairWorld()))}
    table = fidelity_table(start)
    assert list(table.columns) == ["recorded", "tumbling", "plane"]
    assert table.loc["same outcome class, all jumps [%]"].tolist()[::2] == ["", "100.00 ± 0.00"]
    assert table.loc["|dx|: KS distance", "plane"] == "0.000"
    write_rollouts(tmp_path / "own.csv", by_hand)
    treads = {"plane": measure_tread_fidelity(tmp_path / "own.csv", StairWorld(FIFTEEN), 3, progress=False)}
    table = tread_fidelity_table(treads)
    assert list(table.columns) == ["reference", "plane"]
    assert table["reference"]["jumps in rollouts"] == "7 in 2"
    assert table["reference"]["climbs: 350 to 650 N at 55 to 75 degrees [%]"] == "66.67 ± 27.22"
    assert table["reference"]["highest step of a rollout, quartiles"] == "4.5, 8, 11.5"
    assert climb_table(treads)["reference"].tolist() == ["1.00 of 1", *["- of 0"] * 4, "0.50 of 2"]
    assert len(climb_table(treads)) == len(GAP_BINS) - 1
    assert climb_table(treads, "yaw").index.name == "yaw"
    table = outcome_table(treads)["reference"]
    assert table["moderate"] == "0.67, 0.00, 0.33 of 3"
    assert table["strong and steep"] == "-, -, - of 0"
    with pytest.raises(ValueError, match="by must be one of 'gap', 'yaw'"):
        climb_table(treads, "height")
    with pytest.raises(ValueError, match="fidelities must hold one world at least"):
        fidelity_table({})


@pytest.fixture(scope="module")
def tread_csv(reference_csv):
    path = reference_csv.with_name("tread_jumps.csv")
    if not path.is_file():
        pytest.skip(f"The recorded rollouts are not at {path}; STAIRLAB_REFERENCE can name the folder that holds them.")
    return path


@pytest.fixture(scope="module")
def against_rollouts(tread_csv):
    return measure_tread_fidelity(tread_csv, rollouts=600, progress=False)


@pytest.mark.slow
def test_the_file_of_rollouts_is_measured_as_its_readme_says(against_rollouts):
    reference = against_rollouts.reference
    assert (reference.n_jumps, reference.n_rollouts) == (6003, 476)
    assert reference.climb == pytest.approx(0.330, abs=0.0005)
    assert reference.climb_se == pytest.approx(0.013, abs=0.0005)
    assert reference.top_quartiles == (4, 7, 12)


@pytest.mark.slow
def test_the_tumbling_world_is_as_faithful_on_treads_as_promised(against_rollouts):
    assert against_rollouts.gap_ks <= 0.06
    assert against_rollouts.yaw_ks <= 0.06
    assert against_rollouts.x_ks <= 0.06
    assert against_rollouts.own.climb == pytest.approx(0.345, abs=0.04)
    quartiles = (against_rollouts.own.top_quartiles, against_rollouts.reference.top_quartiles)
    np.testing.assert_allclose(*quartiles, atol=1)


@pytest.mark.slow
def test_motions_that_a_grid_of_motions_lives_by_end_as_in_the_engine(against_rollouts):
    again, reference = (one.outcomes_by_motion() for one in (against_rollouts.again, against_rollouts.reference))
    assert (again["n"] == reference["n"]).all()
    for share in ("climb", "fall", "left"):
        error = np.sqrt(2 * reference[share] * (1 - reference[share]) / reference["n"])
        assert (abs(again[share] - reference[share]) < 2 * error + 0.01).all()


def test_recorded_jumps_are_made_again_from_their_poses_and_in_the_plane_from_their_gaps(by_hand):
    for world in (TumblingWorld(FIFTEEN), StairWorld(FIFTEEN)):
        again = jump_again(by_hand, world, progress=False)
        assert again.motions.tolist() == by_hand.motions[[1, 2, 4, 5]].tolist()
        np.testing.assert_array_equal(again.starts, by_hand.starts[[1, 2, 4, 5]])
        np.testing.assert_array_equal(world.state, world.start)
    y = 1.0 - corner_gaps(by_hand.starts[2:3], FIFTEEN)[0] - 0.05
    world.reset(world.state_at(y, 0.35))
    np.testing.assert_array_equal(again.ends[1], world.jump(650, 75).end[:7])


@pytest.mark.slow
def test_the_plane_is_far_off_on_treads_but_not_in_what_a_gap_does(tread_csv, against_rollouts):
    """A plane that replays start jumps to 99 % leaves nine of ten cubes at a riser; from equal gaps it climbs as the others do."""
    plane = measure_tread_fidelity(tread_csv, StairWorld(FIFTEEN), 600, progress=False)
    assert plane.gap_ks > 0.5
    assert min(plane.yaw_ks, plane.x_ks) > 0.9
    assert plane.own.climb < 0.1
    assert np.mean(plane.own.gaps < 0.03) > 0.85
    assert plane.own.freed_share < 0.05 < 0.4 < against_rollouts.own.freed_share
    assert against_rollouts.own.freed_share == pytest.approx(against_rollouts.reference.freed_share, abs=0.05)
    measures = (plane.own, plane.reference, against_rollouts.own)
    climb = np.array([measure.climb_by_gap()["climb"] for measure in measures])
    assert (climb[:, 0] == 0).all()
    assert (climb[:, -1] > 0.95).all()
    assert np.ptp(climb, axis=0).max() < 0.25
