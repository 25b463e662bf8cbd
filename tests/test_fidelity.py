import json
import math

import numpy as np
import pytest
from toy_world import PuckWorld

from stairlab.fidelity import measure_fidelity, riser_gaps
from stairlab.sampling import Samples, sample_motions
from stairlab.world import Staircase, StairWorld


def measure(recorded, world=None):
    return measure_fidelity(recorded, world, progress=False)


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
