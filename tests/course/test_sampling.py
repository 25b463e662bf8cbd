"""The pictures of lesson 02, and what they count."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from stairlab import StairWorld, alt_text
from stairlab.course import explore
from stairlab.course import sampling as lesson
from stairlab.drawing import png
from stairlab.plots import class_style
from stairlab.sampling import sample_motions


@pytest.fixture(scope="module")
def some():
    """Return 150 jumps of seed 0, with some of each outcome but the rarest."""
    return sample_motions(StairWorld(), n=150, seed=0, progress=False)


@pytest.fixture(scope="module")
def jumps() -> list:
    world, made = StairWorld(), []
    for magnitude, angle in ((600, 70), (200, 20), (600, 60)):
        world.reset()
        made.append(world.jump(magnitude, angle, trajectory=True))
    return made


@pytest.fixture
def few(monkeypatch, some):
    """Let the widget use 150 jumps instead of 2,000."""
    monkeypatch.setattr(lesson, "samples_of", lambda seed: some)


def drawn(figure: Figure) -> str:
    assert png(figure, dpi=40).startswith(b"\x89PNG")
    for ax in figure.axes:
        assert ax.get_xlabel()
    return alt_text(figure)


def test_outcomes_are_steps_gained_and_minus_one_off_the_map(some):
    outcomes = lesson.outcomes_of(some)
    np.testing.assert_array_equal(outcomes == -1, ~some.on_map)
    np.testing.assert_allclose(some.effect("dz")[some.on_map, 0], 0.3 * outcomes[some.on_map], atol=0.05)
    assert lesson.outcome_counts(some).sum() == len(some)
    assert lesson.outcome_counts(some)[0] == (~some.on_map).sum()


def test_the_published_outcomes_are_ten_thousand():
    assert sum(lesson.PUBLISHED_OUTCOMES) == 10_000
    assert len(lesson.PUBLISHED_OUTCOMES) == len(lesson.OUTCOMES)


def test_an_outcome_looks_like_the_class_that_climbs_as_high():
    assert lesson.outcome_style(1) == class_style(3)
    assert lesson.outcome_style(-1) not in [lesson.outcome_style(steps) for steps in range(5)]


def test_samples_are_simulated_once_for_a_seed_and_are_fewer_in_a_hurry(monkeypatch):
    monkeypatch.setenv("STAIRLAB_FAST", "1")
    lesson.samples_of.cache_clear()
    first = lesson.samples_of(7)
    assert len(first) == 500
    assert lesson.samples_of(7) is first
    lesson.samples_of.cache_clear()


def test_holes_are_where_no_value_lies():
    values = np.array([0.5, 0.0, 0.01, 0.02, 0.49, 0.6])
    np.testing.assert_allclose(lesson.holes_between(values), [[0.02, 0.49], [0.5, 0.6]])
    assert len(lesson.holes_between(values, least=1.0)) == 0
    assert len(lesson.holes_between(values[:1])) == 0


def test_a_state_change_names_all_eight_effects(jumps):
    words = drawn(lesson.plot_state_change(jumps[0]))
    assert "y +1.75" in words
    assert "d_obs +9.65" in words
    figure = lesson.plot_state_change(jumps[0])
    assert "10: none ahead" in [text.get_text() for text in figure.axes[0].texts]
    assert "10: none ahead" not in [text.get_text() for text in lesson.plot_state_change(jumps[1]).axes[0].texts]


def test_motions_of_one_set_or_of_several_are_drawn(some):
    assert "150" in drawn(lesson.plot_motions(some.motions))
    words = drawn(lesson.plot_motions({"first": some.motions[:3], "second": some.motions[:5], "third": some.motions}))
    assert "first: 3; second: 5; third: 150" in words


def test_motions_can_be_drawn_into_axes_of_ones_own(some):
    from stairlab import new_figure

    figure, panels = new_figure("Two panels.", panels=2)
    assert lesson.plot_motions(some.motions[:7], ax=panels[1]) is figure
    assert alt_text(figure).startswith("Two panels.")
    assert not panels[0].collections
    assert len(panels[1].collections) == 1


@pytest.mark.parametrize("step", [0, 1, 2])
def test_a_turn_of_the_loop_shows_motion_and_jump(jumps, step):
    words = drawn(lesson.plot_sampling_step(jumps, step))
    assert f"Turn i = {step}" in words
    assert f"{step + 1} stored" in words
    assert ("off the map" in words) == (not jumps[step].on_map)


def test_a_turn_without_a_path_is_drawn_too():
    jump = StairWorld().jump(300, 45)
    assert "Turn i = 0" in drawn(lesson.plot_sampling_step([jump], 0))


@pytest.mark.parametrize("plot", [lesson.plot_explored, lesson.plot_ends, lesson.plot_effect_plane])
def test_samples_are_drawn_by_outcome_with_a_legend(some, plot):
    figure = plot(some)
    assert drawn(figure)
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert f"0 steps ({lesson.outcome_counts(some)[1]})" in words


def test_all_effects_says_which_never_change(some):
    figure = lesson.plot_all_effects(some)
    assert "Always 0: dx, dqy, dqz" in drawn(figure)
    assert len(figure.axes) == 8


@pytest.mark.parametrize("width", [0.5, 0.05, 0.01])
def test_finer_bins_of_the_height_stay_few(some, width):
    dy, dz = some.on_the_map().effect("dy", "dz").T
    assert f"bins of {1000 * width:.0f} mm" in drawn(lesson.plot_bins(dy, width))
    used = int(alt_text(lesson.plot_bins(dz, width, "Δz")).split(": ")[1].split(" ")[0])
    assert used <= 8


def test_a_running_share_ends_at_the_share(some):
    hits = lesson.outcomes_of(some) >= 1
    words = drawn(lesson.plot_running_share({"seed 0": hits, "the first half": hits[:75]}, 0.2))
    assert f"seed 0 {100 * hits.mean():.1f} %" in words


def test_shares_are_drawn_beside_each_other(some):
    figure = lesson.plot_shares({"ours": lesson.outcome_counts(some), "published": lesson.PUBLISHED_OUTCOMES})
    assert "published: off the map 17.1 %, 0 steps 63.3 %" in drawn(figure)
    assert len(figure.axes[0].patches) == 12


@pytest.mark.parametrize("n", [1, 20, 150, 2000])
def test_the_widget_counts_the_first_jumps_of_a_seed(few, some, n):
    words = drawn(lesson.draw_sample_size(n, seed=3))
    shown = min(n, len(some))
    assert f"The first {shown} jumps of seed 3" in words
    assert f"0 steps {lesson.outcome_counts(some[:shown])[1]}" in words


def test_the_widget_can_be_explored(few):
    exploration = explore(lesson.draw_sample_size, n=[20, 100, 2000], seed=range(2))
    assert exploration.start == {"n": 100, "seed": 0}
    assert exploration.widget().children[-1].value.startswith("<img")
