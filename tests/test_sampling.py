import math
import re

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from toy_world import PuckWorld

from stairlab._files import read_table, write_whole
from stairlab.sampling import (
    PUBLISHED_COLUMNS,
    Samples,
    draw_motion,
    motion_grid,
    noisy_motions,
    sample_motions,
)
from stairlab.world import FEATURES, Staircase, StairWorld

properties = settings(derandomize=True, deadline=None, max_examples=30)


def sample(n=20, world=None, **how):
    return sample_motions(world or StairWorld(), n, progress=False, **how)


def assert_same_bits(one, two):
    for name in ("motions", "starts", "effects", "on_map"):
        assert getattr(one, name).tobytes() == getattr(two, name).tobytes(), name


@pytest.fixture(scope="module")
def few():
    """Return forty samples, from drawn starts so that no column is constant by chance."""
    return sample(40, start="drawn", seed=5)


# --- Algorithm 1 ---


@pytest.mark.parametrize("n", [1, 2, 49, 50, 51, 101])
def test_there_are_exactly_n_samples(n):
    assert len(sample(n, PuckWorld())) == n


def test_each_sample_is_the_jump_of_its_motion_from_its_start(few, world):
    for motion, start, effect, on_map in zip(few.motions, few.starts, few.effects, few.on_map, strict=True):
        world.reset(start)
        jump = world.perform(motion)
        np.testing.assert_array_equal(jump.effect, effect)
        assert jump.on_map == on_map


def test_the_first_100_of_2000_samples_are_the_100_samples_of_the_same_seed(samples):
    assert_same_bits(sample(100), samples[:100])


def test_a_seed_sequence_is_as_good_as_its_number_and_is_not_used_up():
    seed = np.random.SeedSequence(7)
    assert_same_bits(sample(seed=seed), sample(seed=7))
    assert_same_bits(sample(seed=seed), sample(seed=7))


def test_other_seeds_give_other_samples():
    assert not np.isin(sample(seed=0).motions, sample(seed=1).motions).any()


@pytest.mark.slow
@pytest.mark.parametrize("how", [{}, {"start": "drawn"}, {"distribution": "gaussian"}])
def test_samples_do_not_depend_on_the_number_of_processes(how):
    world = StairWorld(x_drift=True)
    assert_same_bits(sample(120, world, n_jobs=2, **how), sample(120, world, **how))


def test_the_world_stays_in_its_state(world):
    state = world.jump(600, 70).end
    sample(3, world, start="drawn")
    np.testing.assert_array_equal(world.state, state)


def test_with_drift_each_sample_drifts_by_itself():
    world = StairWorld(x_drift=True)
    drift = sample(30, world).effect("dx")
    assert len(np.unique(drift)) == 30
    np.testing.assert_array_equal(sample(10, world).effect("dx"), drift[:10])


def test_about_1670_of_2000_samples_end_on_the_map(samples):
    """So do 83 % of the recorded jumps."""
    assert samples.on_map.mean() == pytest.approx(0.83, abs=0.03)
    assert len(samples.on_the_map()) == samples.on_map.sum()
    assert samples.on_the_map().on_map.all()


def test_outcomes_are_distributed_like_the_recorded_ones(samples):
    recorded = np.array([1714, 6329, 769, 584, 455, 149]) / 10_000
    steps = np.round(samples.on_the_map().effect("dz")[:, 0] / 0.3)
    ours = np.append(np.sum(~samples.on_map), [np.sum(steps == k) for k in range(5)]) / len(samples)
    np.testing.assert_allclose(ours, recorded, atol=0.035)


# --- where motions and starts come from ---


def test_uniform_motions_fill_the_motion_space_evenly(samples):
    low, high = StairWorld().motion_low, StairWorld().motion_high
    unit = (samples.motions - low) / (high - low)
    assert unit.min() >= 0
    assert unit.max() <= 1
    np.testing.assert_allclose(unit.mean(axis=0), 0.5, atol=0.02)
    np.testing.assert_allclose(unit.std(axis=0), 1 / math.sqrt(12), atol=0.01)
    assert abs(np.corrcoef(unit.T)[0, 1]) < 0.05


def test_gaussian_motions_lie_about_the_middle_and_never_outside():
    world, rng = StairWorld(), np.random.default_rng(0)
    motions = np.array([draw_motion(world, rng, "gaussian") for _ in range(3000)])
    low, high = world.motion_low, world.motion_high
    assert ((low <= motions) & (motions <= high)).all()
    np.testing.assert_allclose(motions.mean(axis=0), (low + high) / 2, rtol=0.02)
    np.testing.assert_allclose(motions.std(axis=0), (high - low) / 6, rtol=0.05)


def test_a_grid_holds_the_corners_and_equal_distances():
    motions = sample(25, distribution="grid").motions
    np.testing.assert_allclose(np.unique(motions[:, 0]), np.linspace(50, 1000, 5))
    np.testing.assert_allclose(np.unique(motions[:, 1]), np.linspace(1, 89, 5))
    assert len(np.unique(motions, axis=0)) == 25
    corners = {(m, a) for m in (50, 1000) for a in (1, 89)}
    assert corners <= set(map(tuple, motions.tolist()))


def test_a_grid_refuses_a_number_that_is_no_square_and_names_the_nearest():
    with pytest.raises(ValueError, match=r"n must be .* such as 2025, not 2000"):
        sample(2000, distribution="grid")
    with pytest.raises(ValueError, match=r"n must be .* such as 27, not 25"):
        sample(25, PuckWorld(), distribution="grid")


def test_drawn_starts_differ_and_fixed_starts_are_the_start_pose(few):
    np.testing.assert_array_equal(sample().starts, np.tile(StairWorld().start, (20, 1)))
    assert len(np.unique(few.starts[:, 1])) == 40
    assert len(np.unique(few.starts[:, 2])) == 5


def test_integer_angles_are_rounded_and_nothing_else():
    whole, real = sample(integer_angles=True).motions, sample().motions
    np.testing.assert_array_equal(whole[:, 1], np.round(real[:, 1]))
    np.testing.assert_array_equal(whole[:, 0], real[:, 0])


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"n": 0}, ValueError, "n must be at least 1, not 0"),
        ({"n": 2.5}, TypeError, "n must be a whole number"),
        ({"n": True}, TypeError, "n must be a whole number"),
        ({"seed": -1}, ValueError, "seed must be"),
        ({"seed": "0"}, TypeError, "seed must be"),
        ({"seed": None}, TypeError, "seed must be"),
        ({"n_jobs": 0}, ValueError, "n_jobs must be"),
        ({"n_jobs": 1.5}, TypeError, "n_jobs must be"),
        (
            {"distribution": "normal"},
            ValueError,
            "distribution must be one of 'uniform', 'gaussian', 'grid', not 'normal'",
        ),
        ({"start": "random"}, ValueError, "start must be one of 'fixed', 'drawn'"),
    ],
)
def test_wrong_arguments_are_refused_by_name(arguments, error, message):
    with pytest.raises(error, match=f"^{message}"):
        sample(**arguments)


# --- samples as a table ---


def test_effects_are_found_by_name(few):
    np.testing.assert_array_equal(few.effect("dz", "dy"), few.effects[:, [2, 1]])
    np.testing.assert_array_equal(few.effect(), few.effects)
    assert few.effect_names == ("dx", "dy", "dz", "dqx", "dqy", "dqz", "dqw", "dd_obs")
    with pytest.raises(ValueError, match=r"effect name must be one of 'dx', .* not 'y'"):
        few.effect("y")


@pytest.mark.parametrize("rows", [slice(3, 9), [5, 1, 1], np.arange(40) % 3 == 0, np.array([0, -1])])
def test_slices_masks_and_row_numbers_select_whole_samples(few, rows):
    part = few[rows]
    for name in ("motions", "starts", "effects", "on_map"):
        np.testing.assert_array_equal(getattr(part, name), getattr(few, name)[rows])


def test_a_single_row_number_gives_one_sample(few):
    assert len(few[-1]) == 1
    np.testing.assert_array_equal(few[-1].motions[0], few.motions[-1])


def test_there_are_no_empty_samples(few):
    with pytest.raises(ValueError, match="motions must have at least 1 row, not 0"):
        few[:0]
    off = Samples(few.motions, few.starts, few.effects, np.zeros(40, dtype=bool))
    with pytest.raises(ValueError, match="none of the 40 did"):
        off.on_the_map()


def test_a_data_frame_holds_everything_under_its_name(few):
    frame = few.to_frame()
    assert list(frame)[:4] == ["magnitude", "angle", "start_x", "start_y"]
    assert len(frame) == 40
    np.testing.assert_array_equal(frame[["dy", "dz"]], few.effect("dy", "dz"))
    np.testing.assert_array_equal(frame["start_d_obs"], few.starts[:, 7])
    assert frame["on_map"].dtype == bool


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("motions", np.ones((40, 3)), "motions must have the shape \\(n, 2\\), not \\(40, 3\\)"),
        ("motions", np.ones((39, 2)), "must be of one length"),
        ("starts", np.ones(8), "starts must have the shape"),
        ("effects", np.full((40, 8), np.nan), "effects must be finite, but row 0"),
        ("effects", np.full((40, 8), np.inf), "effects must be finite"),
        ("on_map", ["False"] * 40, "on_map must hold True or False"),
        ("on_map", [[True]] * 40, "on_map must hold True or False"),
        ("on_map", True, "on_map must hold True or False"),
    ],
)
def test_samples_refuse_what_does_not_fit_together(few, name, value, message):
    parts = {part: getattr(few, part) for part in ("motions", "starts", "effects", "on_map")}
    with pytest.raises(ValueError, match=message):
        Samples(**{**parts, name: value})


# --- files ---


def test_samples_come_back_from_a_file_to_the_bit(few, tmp_path):
    few.to_csv(tmp_path / "own.csv")
    back = Samples.from_csv(tmp_path / "own.csv")
    np.testing.assert_array_equal(back.motions, few.motions)
    np.testing.assert_array_equal(back.starts, few.starts)
    np.testing.assert_array_equal(back.on_map, few.on_map)
    np.testing.assert_array_equal(back.effects[:, :7], few.effects[:, :7])
    np.testing.assert_allclose(back.effects[:, 7], few.effects[:, 7], atol=1e-12)
    assert back.feature_names == FEATURES


@properties
@given(
    st.tuples(*[st.floats(-1e3, 1e3)] * 3, *[st.floats(-1, 1)] * 4, st.floats(-1e3, 1e3), st.floats(50, 1000)),
    st.booleans(),
)
def test_any_numbers_in_their_limits_survive_a_file(tmp_path_factory, numbers, on_map):
    path = tmp_path_factory.mktemp("csv") / "any.csv"
    start, effect = np.zeros((1, 8)), np.zeros((1, 8))
    start[0, :7], effect[0, 0] = numbers[:7], numbers[7]
    Samples(np.array([[numbers[8], 1.0]]), start, effect, np.array([on_map])).to_csv(path)
    back = Samples.from_csv(path)
    np.testing.assert_array_equal(back.starts[:, :7], start[:, :7])
    assert (back.effects[0, 0], back.motions[0, 0], back.on_map[0]) == (numbers[7], numbers[8], on_map)


def test_a_written_file_has_the_published_columns_and_a_row_number(few, tmp_path):
    few.to_csv(tmp_path / "own.csv")
    header, first = (tmp_path / "own.csv").read_text().splitlines()[:2]
    assert header == "," + ",".join(PUBLISHED_COLUMNS)
    assert header == (
        ",magnitude,angle,env_x,env_y,env_z,env_rot_x,env_rot_y,env_rot_z,env_rot_w,"
        "dx,dy,dz,d_rot_x,d_rot_y,d_rot_z,d_rot_w,robot_in_map"
    )
    assert first.startswith("0,")
    assert first.rsplit(",", 1)[1] in ("True", "False")
    assert not (tmp_path / "own.csv").read_bytes().count(b"\r")


def test_the_published_file_loads_as_it_is(reference_csv):
    recorded = Samples.from_csv(reference_csv)
    frame = pd.read_csv(reference_csv)
    assert len(recorded) == len(frame) == 2000
    np.testing.assert_array_equal(recorded.motions, frame[["magnitude", "angle"]])
    np.testing.assert_allclose(recorded.effect("dy", "dz"), frame[["dy", "dz"]], rtol=1e-15)
    np.testing.assert_array_equal(recorded.on_map, frame["robot_in_map"])
    np.testing.assert_allclose(recorded.starts[:, 7], 0.35, atol=1e-4)
    assert recorded.on_map.mean() == pytest.approx(0.83, abs=0.01)


def test_d_obs_of_a_file_belongs_to_the_stairs_that_are_named(tmp_path):
    world = StairWorld(Staircase.fifteen())
    own = sample(60, world, start="drawn")
    own.to_csv(tmp_path / "own.csv")
    np.testing.assert_allclose(Samples.from_csv(tmp_path / "own.csv", world).effects, own.effects, atol=1e-12)
    assert not np.allclose(Samples.from_csv(tmp_path / "own.csv").starts, own.starts)


def damaged(tmp_path, few, damage):
    path = tmp_path / "bad.csv"
    few.to_csv(path)
    lines = path.read_text().splitlines()
    damage(lines)
    path.write_text("\n".join(lines) + "\n")
    return path


def set_cell(lines, line, column, text):
    cells = lines[line - 1].split(",")
    cells[lines[0].split(",").index(column)] = text
    lines[line - 1] = ",".join(cells)


@pytest.mark.parametrize(
    ("line", "column", "text", "expected"),
    [
        (2, "magnitude", "nan", "a number from 50 to 1000"),
        (7, "dy", "inf", "a number from -1000 to 1000"),
        (41, "env_rot_w", "one", "a number from -1.001 to 1.001"),
        (3, "dz", "", "a number from -1000 to 1000"),
        (5, "magnitude", "-5", "a number from 50 to 1000"),
        (6, "angle", "95", "a number from 1 to 89"),
        (4, "robot_in_map", "yes", "True or False"),
        (5, "robot_in_map", "", "True or False"),
    ],
)
def test_a_bad_cell_is_named_by_file_line_and_column(few, tmp_path, line, column, text, expected):
    path = damaged(tmp_path, few, lambda lines: set_cell(lines, line, column, text))
    message = f"{path}, line {line}, column {column}: expected {expected}, found {text!r}."
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        Samples.from_csv(path)


@properties
@given(
    line=st.integers(2, 41), column=st.sampled_from(PUBLISHED_COLUMNS), text=st.text("abc!?-. ", min_size=1, max_size=5)
)
def test_any_text_in_any_cell_is_found(tmp_path_factory, few, line, column, text):
    path = damaged(tmp_path_factory.mktemp("csv"), few, lambda lines: set_cell(lines, line, column, text))
    with pytest.raises(ValueError, match=f"line {line}, column {column}: expected"):
        Samples.from_csv(path)


def test_a_missing_column_is_named(few, tmp_path):
    path = damaged(tmp_path, few, lambda lines: lines.__setitem__(0, lines[0].replace("dz", "height")))
    with pytest.raises(ValueError, match=r"bad\.csv, line 1: the column dz must be there; found .*height"):
        Samples.from_csv(path)


def test_a_row_that_is_cut_off_is_named(few, tmp_path):
    path = damaged(tmp_path, few, lambda lines: lines.__setitem__(-1, lines[-1].rsplit(",", 4)[0]))
    with pytest.raises(ValueError, match=r"bad\.csv, line 41: expected 18 cells, found 14\. Is the file cut off\?"):
        Samples.from_csv(path)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b"\n\n", "is empty"),
        (b",magnitude,angle\n", "no row"),
        (b"\x80\x04\x95\xff\x00binary", "is not a CSV file"),
        (b"a,b\n1,2\n", "line 1: the columns magnitude, angle"),
        (b"\x89PNG\r\n\x1a\n\x00\x00", "is not a CSV file"),
    ],
)
def test_a_file_that_is_no_table_is_refused_with_its_name(tmp_path, content, message):
    path = tmp_path / "no-table.csv"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=f"no-table.csv.*{message}"):
        Samples.from_csv(path)


def test_a_file_that_is_not_there_is_an_os_error(tmp_path):
    with pytest.raises(FileNotFoundError):
        Samples.from_csv(tmp_path / "nowhere.csv")


def test_a_table_is_read_past_comments_blank_lines_and_a_byte_order_mark(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("# made by hand\na,b,flag\n1,2,True\n\n# more\n3,4e-1,false\n", encoding="utf-8-sig")
    np.testing.assert_array_equal(read_table(path).numbers(("b", "flag"), flags=("flag",)), [[2, 1], [0.4, 0]])
    path.write_text("a,b\n1,2\n", encoding="utf-8-sig")
    np.testing.assert_array_equal(read_table(path).numbers(("a", "b")), [[1, 2]])


def test_a_write_that_fails_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "table.csv"
    write_whole(path, lambda file: file.write("old"))

    def fail(file):
        file.write("half")
        raise RuntimeError("the disk is full")

    with pytest.raises(RuntimeError, match="the disk is full"):
        write_whole(path, fail)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(RuntimeError, match="the disk is full"):
        write_whole(tmp_path / "new.csv", fail)
    assert list(tmp_path.iterdir()) == [path]


# --- a world without stairs ---


def test_another_world_is_sampled_without_any_change():
    puck = PuckWorld()
    pushes = sample(200, puck, seed=3)
    assert pushes.motions.shape == (200, 3)
    assert pushes.effect_names == ("deast", "dnorth", "dheight")
    assert 0 < pushes.on_map.sum() < 200
    assert set(np.round(pushes.effect("dheight")[:, 0], 9)) == {0.0, 0.2}
    speed = pushes.motions[:, 0]
    free = pushes.on_map & (np.abs(pushes.effects[:, 1]) < 0.49)
    np.testing.assert_allclose(np.hypot(*pushes.effect("deast", "dnorth")[free].T), speed[free] ** 2 / 4, atol=1e-12)
    assert list(pushes.to_frame())[:4] == ["speed", "heading", "lift", "start_east"]


def test_another_world_is_sampled_on_a_grid_and_from_drawn_starts():
    grid = motion_grid(PuckWorld(), 3)
    assert grid.shape == (27, 3)
    np.testing.assert_array_equal(sample(27, PuckWorld(), distribution="grid").motions, grid)
    assert len(np.unique(sample(9, PuckWorld(), start="drawn").starts[:, 0])) == 9


def test_integer_angles_mean_nothing_to_a_world_without_angle():
    assert_same_bits(sample(9, PuckWorld(), integer_angles=True), sample(9, PuckWorld()))


@pytest.mark.slow
def test_another_world_is_sampled_in_other_processes_alike():
    assert_same_bits(sample(120, PuckWorld(), n_jobs=2), sample(120, PuckWorld()))


def test_samples_of_another_world_refuse_the_published_columns(tmp_path):
    with pytest.raises(ValueError, match=r"samples must have the features .* not \('east', 'north', 'height'\)"):
        sample(3, PuckWorld()).to_csv(tmp_path / "puck.csv")
    assert not list(tmp_path.iterdir())


def test_noise_is_as_large_as_the_world_says_and_stays_in_the_motion_space(world):
    meant = np.tile([500.0, 60.0], (4000, 1))
    tries = noisy_motions(world, meant, np.random.default_rng(0))
    assert tries.mean(axis=0) == pytest.approx([500, 60], rel=0.01)
    assert tries.std(axis=0) == pytest.approx([10, 1], rel=0.05)
    assert (noisy_motions(world, meant, np.random.default_rng(0), scale=0) == meant).all()
    far = noisy_motions(world, np.tile([1000.0, 89.0], (50, 1)), np.random.default_rng(0), scale=10)
    assert (far <= world.motion_high).all()
    assert (far >= world.motion_low).all()
