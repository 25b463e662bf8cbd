import itertools
import math
import re
from pathlib import Path

import nbformat
import numpy as np
import pytest

from stairlab import Samples, Staircase, StairWorld, TumblingWorld, alt_text, riser_gaps
from stairlab.course import the_world
from stairlab.physics import FALL

PROJECT = Path(__file__).parents[2]


@pytest.fixture
def jump(world):
    return world.jump(450, 65, trajectory=True)


def words_in(figure):
    return " ".join(
        text.get_text()
        for ax in figure.axes
        for text in [*ax.texts, ax.title, *ax.get_children()]
        if hasattr(text, "get_text")
    )


# Closed forms against the simulation


def test_a_push_alone_gives_force_times_time_over_mass():
    v_y, v_z = the_world.pushed(450, 60)
    assert math.hypot(v_y, v_z) == pytest.approx(4.5)
    assert float(v_z / v_y) == pytest.approx(math.sqrt(3))


def test_the_flight_is_the_closed_form_up_to_rounding_until_the_first_contact(jump):
    d_y, d_z = the_world.flight_error(jump)
    flying = (jump.trajectory.time > 0.01) & (jump.trajectory.time < 0.58)
    assert np.abs(d_y[flying]).max() < 1e-12
    assert np.abs(d_z[flying]).max() < 1e-12


@pytest.mark.parametrize("magnitude", [100, 450, 1000])
@pytest.mark.parametrize("angle", [8, 20, 45, 70, 89])
def test_a_jump_on_level_ground_goes_as_far_as_flight_and_slide_say(magnitude, angle):
    level = StairWorld(Staircase(first_riser=100.0))
    flight, slide = the_world.level_jump(magnitude, angle)
    assert level.jump(magnitude, angle).dy == pytest.approx(float(flight + slide), abs=0.0008 * magnitude / 100)


def test_a_cube_that_is_not_high_enough_never_comes_down_to_a_height():
    assert np.isnan(the_world.time_of_fall(1.0, 0.3))
    assert float(the_world.time_of_fall(4.0)) == pytest.approx((4 + math.sqrt(16 - 9.81 * 4 * 0.01)) / 9.81)


@pytest.mark.parametrize("magnitude", [200, 250, 300, 340])
def test_a_cube_that_flies_into_a_riser_leaves_the_gap_of_the_closed_form(world, magnitude):
    jump = the_world.jump_from(world, 0.25, magnitude, 45)
    assert the_world.riser_gap(jump) == pytest.approx(float(the_world.gap_by_formula(magnitude, 45)), abs=4e-5)


def test_a_cube_that_lands_before_the_riser_has_no_gap_by_formula():
    assert np.isnan(the_world.gap_by_formula(100, 45))


def test_the_gap_to_climb_from_tends_to_rise_over_tangent_for_fast_pushes():
    assert float(the_world.gap_to_climb(1e6, 80)) == pytest.approx(0.3 / math.tan(math.radians(80)), rel=1e-3)
    assert float(the_world.gap_to_climb(500, 80)) > 0.3 / math.tan(math.radians(80))
    assert the_world.gap_to_climb(100, 80) == math.inf


def test_phases_follow_each_other_without_a_break(jump):
    parts = the_world.phases(jump)
    assert [name for name, _, _ in parts] == ["push", "flight", "contact", "rest"]
    assert parts[0][1] == 0
    assert parts[-1][2] == jump.duration
    assert all(a[2] == b[1] for a, b in itertools.pairwise(parts))
    assert 0.57 < parts[1][2] < 0.6


@pytest.mark.parametrize(
    ("motion", "start"), [((100, 45), 0.25), ((50, 5), 0.25), ((1000, 89), 0.25), ((600, 70), 0.25)]
)
def test_phases_are_in_order_for_jumps_of_all_kinds(world, motion, start):
    parts = the_world.phases(the_world.jump_from(world, start, *motion))
    assert all(begin <= end for _, begin, end in parts)


def test_a_jump_without_its_path_is_refused(world):
    with pytest.raises(ValueError, match="trajectory=True"):
        the_world.draw_phases(world.jump(450, 65))


def test_leapfrog_of_the_lesson_is_the_worlds_recurrence():
    steps = np.arange(5)
    np.testing.assert_allclose(FALL[:5], -9.81e-6 * steps * (steps - 1) / 2)


# What pictures show


@pytest.mark.parametrize("milliseconds", [0, 5, 300, 10_000])
def test_a_moment_shows_the_cube_at_that_time_and_the_force_only_while_it_acts(jump, milliseconds):
    figure = the_world.draw_moment(jump, milliseconds)
    assert len(figure.axes[0].patches) == 2  # the stairs and the cube
    arrows = [text for text in figure.axes[0].texts if text.arrow_patch is not None]
    assert len(arrows) == (1 if milliseconds < 10 else 0)
    assert "y = 1.35 m" in alt_text(figure) or milliseconds < 10_000


def test_the_picture_of_phases_names_all_four(jump):
    figure = the_world.draw_phases(jump)
    for phase in ("push", "flight", "contact", "rest"):
        assert phase in words_in(figure)
        assert phase in alt_text(figure)


def test_the_fan_has_a_parabola_for_each_angle_and_one_bold():
    figure = the_world.draw_fan(450, (15, 45, 75), highlight=45)
    widths = [line.get_linewidth() for line in figure.axes[0].lines[:3]]
    assert widths == [1, 2, 1]
    assert "45° 2.03 m" in alt_text(figure)


def test_where_formula_and_simulation_differ_is_ringed_and_counted():
    motions = np.array([[100.0, 30.0], [450.0, 65.0], [900.0, 60.0]])
    figure = the_world.draw_formula_against_simulation(motions, np.array([0, 2, -1]), np.array([0, 1, -1]))
    assert len(figure.axes) == 2
    assert "66.7%" in alt_text(figure)
    rings = figure.axes[0].collections[-1]
    assert len(rings.get_offsets()) == 1


@pytest.mark.parametrize("magnitude", [100, 200, 1000])
def test_level_jumps_show_flight_slide_and_the_simulation(magnitude):
    figure = the_world.draw_level_jumps(magnitude)
    assert [text.get_text() for text in figure.axes[0].get_legend().get_texts()] == [
        "flight, closed form",
        "slide, closed form",
        "simulated",
    ]
    off = float(alt_text(figure).split("at most ")[1].split(" mm")[0])
    assert off < magnitude / 100


@pytest.mark.parametrize("milliseconds", [0, 160, 10_000])
def test_the_picture_at_the_riser_says_the_gap(world, milliseconds):
    against = the_world.jump_from(world, 0.25, 280, 45)
    figure = the_world.draw_at_riser(against, milliseconds)
    assert "gap" in alt_text(figure)
    if milliseconds == 10_000:
        assert "gap 1.9 mm" in alt_text(figure)


def test_gaps_are_drawn_for_each_set_with_what_was_recorded():
    gaps = {"this world": np.array([0.0, 0.001, 0.3]), "another": np.array([0.01, 0.02, 0.03])}
    figure = the_world.draw_gaps(gaps, recorded=the_world.RECORDED_GAPS)
    assert [text.get_text() for text in figure.axes[0].get_legend().get_texts()] == [*gaps, "recorded in Gazebo"]
    assert "this world: 67% below 2.5 mm; another: 0% below 2.5 mm" in alt_text(figure)
    assert len(the_world.draw_gaps(gaps).axes[0].lines) == 2


def test_recorded_gaps_are_those_of_the_recorded_jumps(reference_csv):
    recorded = riser_gaps(Samples.from_csv(reference_csv))
    for gap, share in the_world.RECORDED_GAPS.items():
        assert np.mean(recorded < gap) == pytest.approx(share, abs=0.03)  # 2,000 of the 10,000


@pytest.mark.parametrize(("gap", "angle", "passes"), [(0.06, 75, False), (0.1, 80, True), (0.002, 89, False)])
def test_the_geometry_says_whether_the_line_passes_the_edge(gap, angle, passes):
    figure = the_world.draw_trap_geometry(gap, angle)
    assert ("does not pass" in alt_text(figure)) != passes
    assert (">" if passes else "<") in words_in(figure)


@pytest.mark.parametrize("gap", [2.0, 20.0, 100.0])
@pytest.mark.parametrize("angle", [60.0, 80.0, 89.0])
@pytest.mark.parametrize("name", ["plane", "tumbling"])
def test_the_trap_shows_what_the_rule_says_and_what_the_cube_does(gap, angle, name):
    figure = the_world.draw_trap(gap, angle, world=name)
    says = "out" if math.tan(math.radians(angle)) > 300 / gap else "trapped"
    assert the_world.WORLD_WORDS[name] in alt_text(figure)
    assert f"says: {says}" in alt_text(figure)
    assert "Simulated:" in alt_text(figure)


def test_a_bump_turns_the_cube_where_it_tumbles_only():
    assert "turned by" in alt_text(the_world.draw_trap(5.0, 60.0, world="tumbling"))
    assert "turned by" not in alt_text(the_world.draw_trap(5.0, 60.0))


def test_the_lower_front_edge_begins_and_ends_where_the_cube_has_it(world):
    for one, end in ((world, (1.40, 0.60)), (TumblingWorld(rocking=0), (1.40, 0.60))):
        path = one.jump(450, 65, trajectory=True).trajectory
        y, z = the_world.front_edge(path)
        assert (y[0], z[0]) == pytest.approx((0.3, 0), abs=1e-6)
        assert (y[-1], z[-1]) == pytest.approx(end, abs=2e-3)


def test_the_map_of_the_trap_counts_who_climbs():
    angles, gaps = (60, 75, 87), (0.002, 0.05, 0.15)
    climbs = the_world.climbs_from(500, angles, gaps)
    assert climbs.tolist() == [[False, False, False], [False, False, True], [False, True, True]]
    figure = the_world.draw_trap_map(500, angles, gaps, climbs)
    assert "3 climb" in alt_text(figure)
    assert "right for 100%" in alt_text(figure)


def test_two_steep_jumps_lead_out_of_the_trap_and_two_flat_ones_do_not():
    assert "After the first the gap is 20.0 mm, at the same height; the second gains 1 step" in alt_text(
        the_world.draw_two_jumps()
    )
    assert "the second gains 0 step" in alt_text(the_world.draw_two_jumps(first=30.0, second=30.0, magnitude=300.0))


@pytest.mark.parametrize("magnitude", [50, 450, 1000])
@pytest.mark.parametrize("angle", [5, 65, 89])
@pytest.mark.parametrize("start", [the_world.FIELD[0], 0.25, the_world.FIELD[-1]])
@pytest.mark.parametrize("name", ["plane", "tumbling"])
def test_the_explorer_draws_one_motion_from_the_whole_field(magnitude, angle, start, name):
    figure = the_world.draw_field(magnitude, angle, start, name)
    assert the_world.WORLD_WORDS[name] in alt_text(figure)
    assert f"{magnitude} N at {angle}° from y = {start:g} m" in alt_text(figure)
    assert f"of {len(the_world.FIELD)} start positions" in alt_text(figure)
    cubes = len(figure.axes[0].patches) - 1
    assert cubes == len(the_world.FIELD) + 1  # where each ends, and the start of one


def test_the_explorer_starts_at_the_paper_s_jump():
    assert "2 steps, 0.8 mm before the riser; Δy = +1.10 m, Δz = +0.60 m" in alt_text(the_world.draw_field())


@pytest.mark.parametrize(
    ("magnitude", "name", "climb"), [(1000, "plane", 6), (975, "tumbling", 6), (1000, "tumbling", 3)]
)
def test_the_best_motions_of_the_explorer_climb_from_as_many_places_as_the_lesson_says(magnitude, name, climb):
    assert f"From {climb} of 8 start" in alt_text(the_world.draw_field(magnitude, 89, world=name))


def test_a_jump_is_said_in_words(world):
    assert the_world.outcome_words(the_world.jump_from(world, 0.25, 1000, 60)) == "off the map"
    assert the_world.gap_words(the_world.jump_from(world, 0.25, 1000, 60)) == ""
    assert the_world.outcome_words(the_world.jump_from(world, 0.25, 100, 60)) == "0 steps"
    down = world.jump(100, 60)
    object.__setattr__(down, "end", down.end - np.array([0, 0, 0.6, 0, 0, 0, 0, 0]))
    assert the_world.outcome_words(down) in {"off the map", "2 steps down"}


# The plane and three dimensions


@pytest.mark.parametrize("draw", [0, 1])
@pytest.mark.parametrize("magnitude", [300, 500, 700])
def test_either_world_is_drawn_with_what_its_jump_did(magnitude, draw):
    jump = TumblingWorld().jump(magnitude, 70, np.random.default_rng(draw))
    figure = the_world.draw_in_either_world("tumbling", magnitude, draw)
    assert f"In three dimensions, draw {draw}." in alt_text(figure)
    assert f"It is {100 * abs(jump.end[0]):.0f} cm aside" in alt_text(figure)
    assert the_world.outcome_words(jump) in words_in(figure)
    flat = the_world.draw_in_either_world("plane", magnitude, draw)
    assert "It is 0 cm aside, turned by 0°" in alt_text(flat)
    assert [ax.axis() for ax in flat.axes] == [ax.axis() for ax in figure.axes]


def test_a_draw_changes_nothing_in_the_plane():
    def path(world, draw):
        return the_world.draw_in_either_world(world, 500, draw).axes[0].lines[0].get_xydata()

    np.testing.assert_array_equal(path("plane", 0), path("plane", 1))
    assert len(path("tumbling", 0)) != len(path("tumbling", 1))


def test_the_explorer_of_both_worlds_starts_with_a_jump_that_rolls_aside():
    assert "It is 12 cm aside, turned by 30° about the vertical" in alt_text(the_world.draw_in_either_world())


def test_both_views_of_the_explorer_have_one_scale():
    figure = the_world.draw_in_either_world()
    figure.canvas.draw()
    side, above = (ax.get_window_extent() for ax in figure.axes)
    assert (side.x0, side.x1) == pytest.approx((above.x0, above.x1), abs=1)


def test_a_moment_of_a_tumbling_jump_shows_the_turned_cube():
    rolled = TumblingWorld().jump(500, 70, np.random.default_rng(0), trajectory=True)
    *_, cube = the_world.draw_moment(rolled, 800).axes[0].patches
    assert len(cube.get_xy()) - 1 == 6


def test_the_lesson_s_table_of_both_worlds_has_the_figures_of_the_readme():
    lesson = nbformat.read(PROJECT / "notebooks" / "01_the_world.ipynb", as_version=4)
    (text,) = (cell.source for cell in lesson.cells if cell.id == "01-measured")
    cells = [cell.strip() for row in re.findall(r"^\|(.*)\|$", text, re.M)[2:] for cell in row.split("|")[1:]]
    readme = (PROJECT / "README.md").read_text().split("## How faithful the world is")[1].split("\n## ")[0]
    known = {cell.strip() for cell in re.sub(r" ± [\d.]+", "", readme).split("|")}
    assert len(cells) == 27
    assert [cell for cell in cells if cell not in known] == []
