import re

import nbformat
import numpy as np
import pytest
from matplotlib.colors import to_hex

from stairlab import EffectClasses, Samples, StairWorld, TumblingWorld, alt_text, effect_prototypes, sample_motions
from stairlab.course import welcome
from stairlab.drawing import CUBE, FAINT, PATH


@pytest.fixture(scope="module")
def few() -> Samples:
    return sample_motions(StairWorld(), n=300, seed=0, progress=False)


@pytest.fixture(scope="module")
def classes(few):
    return EffectClasses.from_samples(few)


@pytest.fixture(scope="module")
def prototypes(classes):
    return effect_prototypes(classes)


# Play a jump


@pytest.mark.parametrize("magnitude", [50, 450, 1000])
@pytest.mark.parametrize("angle", [1, 65, 89])
def test_play_a_jump_says_what_the_world_does(world, magnitude, angle):
    jump = world.jump(magnitude, angle)
    figure = welcome.draw_play(magnitude, angle)
    assert f"{magnitude} N at {angle}°: {welcome.what_it_did(jump)}." in alt_text(figure)
    assert figure.axes[0].get_title(loc="left").startswith(welcome.what_it_did(jump))


def test_the_first_jump_that_is_shown_climbs_two_steps_and_has_both_arrows():
    figure = welcome.draw_play()
    assert "2 steps up. Its effect is Δy = +1.10 m, Δz = +0.60 m" in alt_text(figure)
    assert {"Δy", "Δz"} <= {text.get_text() for text in figure.axes[0].texts}


def test_a_jump_off_the_map_has_no_arrows_and_says_how_high_it_flew():
    figure = welcome.draw_play(1000, 80)
    texts = [text.get_text() for text in figure.axes[0].texts]
    assert texts == ["flies up to z = 4.9 m"]
    assert "off the map" in alt_text(figure)


def test_a_length_that_rounds_to_nothing_has_no_sign():
    assert "Δz = 0.00 m" in alt_text(welcome.draw_play(200, 45))


@pytest.mark.parametrize(
    ("dz", "words"), [(0.0, "no step"), (0.3, "1 step up"), (0.9, "3 steps up"), (-0.3, "1 step down")]
)
def test_what_a_jump_did_is_said_in_words(world, dz, words):
    jump = world.jump(450, 65)
    object.__setattr__(jump, "end", jump.start + np.array([0, 0, dz, 0, 0, 0, 0, 0]))
    assert welcome.what_it_did(jump) == words


def test_play_a_jump_can_be_played_in_three_dimensions():
    jump = TumblingWorld().jump(350, 70)
    assert abs(jump.end[0]) > 0.05
    figure = welcome.draw_play(350, 70, "three dimensions")
    assert f"350 N at 70° in three dimensions: {welcome.what_it_did(jump)}. Its effect is Δy" in alt_text(figure)
    assert f"aside Δx = {jump.end[0]:+.2f} m" in alt_text(figure)
    assert "aside" not in alt_text(welcome.draw_play(350, 70))
    with pytest.raises(ValueError, match="world must be one of 'plane', 'three dimensions'"):
        welcome.draw_play(world="tumbling")


# The method in pictures


@pytest.mark.parametrize("count", [1, 30, 300])
def test_the_first_jumps_are_counted_and_drawn_on_both_sides(few, count):
    figure = welcome.draw_first_jumps(few, count)
    assert f"the first {count} random jumps" in alt_text(figure)
    left, right = figure.axes
    assert len(left.patches) == 1 + int(few[:count].on_map.sum()) + 1  # the stairs, the ends, the start
    assert sum(len(line.get_xdata()) for line in right.lines) == count


def test_effects_are_drawn_plain_or_by_class(few, classes):
    plain, sorted_ = welcome.draw_effects(few), welcome.draw_effects(few, classes)
    assert len(plain.axes[0].lines) == 1
    assert len(sorted_.axes[0].lines) == classes.n_classes
    assert "204 at 0.0 m, 18 at 0.3 m" in alt_text(plain)
    assert f"in {classes.n_classes} classes" in alt_text(sorted_)


def test_noise_spares_a_solid_motion_and_not_a_narrow_one():
    assert "Of 20 replays with noise, 20 gain as much height" in alt_text(welcome.draw_noise((450, 80)))
    narrow = alt_text(welcome.draw_noise((593, 55.4)))
    assert int(re.search(r"noise, (\d+) gain", narrow).group(1)) < 10


def test_noise_at_the_rim_of_the_motion_space_stays_inside():
    assert "20 replays" in alt_text(welcome.draw_noise((1000, 89)))


def test_shares_of_outcomes_add_up_to_one(few):
    shares = welcome.outcome_shares(few)
    assert sum(shares.values()) == pytest.approx(1)
    assert list(shares) == ["no step", "1 step", "2 steps", "3 steps", "4 steps", "off the map"]
    assert "no step 68%" in alt_text(welcome.draw_outcomes(few))


# Climbing


def test_the_greedy_robot_reaches_the_top_and_the_careful_one_is_stuck(prototypes):
    bold, careful = welcome.climb(prototypes), welcome.climb(prototypes, careful=True)
    assert [round(jump.dz / 0.3) for jump in bold] == [4, 4, 4, 3]
    assert sum(round(jump.dz / 0.3) for jump in careful) == 5
    assert "the top" in alt_text(welcome.draw_climb(bold))
    assert "24 mm before the next riser" in alt_text(welcome.draw_climb(careful))


def test_a_climb_goes_on_where_the_jump_before_ended(prototypes):
    jumps = welcome.climb(prototypes)
    for before, after in zip(jumps, jumps[1:], strict=False):  # noqa: RUF007
        np.testing.assert_array_equal(before.end, after.start)


def test_motions_that_climb_nowhere_give_no_climb_and_a_picture_of_the_start():
    assert welcome.climb(np.array([[50.0, 45.0]])) == []
    assert "after 0 jumps: step 0 of 15, 300 mm" in alt_text(welcome.draw_climb([]))


def test_only_the_last_jump_of_a_climb_is_bold(prototypes):
    jumps = welcome.climb(prototypes)
    lines = welcome.draw_climb(jumps, 2).axes[0].lines
    assert [to_hex(line.get_color()) for line in lines] == [FAINT, PATH]


# The course


def test_the_map_names_all_ten_lessons_and_marks_one():
    figure = welcome.draw_map("06_growing_neural_gas")
    for number in range(1, 11):
        assert re.search(rf"\b{number} [a-z]", alt_text(figure))
    marked = [patch for patch in figure.axes[0].patches if to_hex(patch.get_facecolor()) == CUBE]
    assert len(marked) == 2  # the lesson, and the cube itself


def test_map_and_table_of_the_lesson_name_the_same_lessons_and_questions():
    from pathlib import Path

    path = Path(__file__).parents[2] / "notebooks" / "00_welcome.ipynb"
    text = "\n".join(cell.source for cell in nbformat.read(path, as_version=4).cells)
    rows = re.findall(r"^\| \[[^]]*\]\((\w+)\.ipynb\) \| ([^|]*) \|", text, re.MULTILINE)
    assert rows == [lesson for stage in welcome.STAGES for lesson in stage.lessons]


def test_the_cycle_shows_the_prediction_before_the_code():
    words = [text.get_text() for text in welcome.draw_cycle().axes[0].texts]
    assert words.index("your prediction") < words.index("code") < words.index("a picture")
