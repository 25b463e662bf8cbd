"""The figures of lesson 07, at their defaults and at the edges of their controls."""

import dataclasses
import math

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from matplotlib.path import Path

from stairlab import (
    EffectClasses,
    Prototypes,
    StairWorld,
    TumblingWorld,
    alt_text,
    effect_prototypes,
    reliability,
    replay_motions,
    uniform_prototypes,
)
from stairlab.course import Exploration, explore
from stairlab.course import action_prototypes as lesson


@pytest.fixture(scope="module")
def world():
    return StairWorld()


@pytest.fixture(scope="module")
def classes(samples):
    return EffectClasses.from_samples(samples)


@pytest.fixture(scope="module")
def prototypes(classes, world):
    return effect_prototypes(classes, world=world)


@pytest.fixture(scope="module")
def central(classes, world):
    return effect_prototypes(classes, world=world, refine="central")


def titles(figure):
    return " | ".join(ax.get_title() for ax in figure.axes)


def texts(ax):
    return [text.get_text() for text in ax.texts]


# Replays


def test_a_replay_gives_the_effects_in_the_clustered_dimensions_and_the_classes_reached(world, classes, prototypes):
    effects, reached = lesson.replay(world, prototypes.motions, classes)
    jumps = replay_motions(world, prototypes.motions)
    assert np.array_equal(effects, jumps.effect("dy", "dz"))
    assert reached.tolist() == classes.reached(jumps).tolist()


def test_prototypes_are_named_after_their_class(prototypes, world):
    names = lesson.prototype_names(prototypes)
    assert names[0] == "C1a"
    assert len(set(names)) == len(prototypes)
    assert [int(name[1]) for name in names] == prototypes.classes.tolist()
    assert lesson.prototype_names(uniform_prototypes(world)) == []


# Three linked panels


def test_three_views_say_whether_the_promise_is_kept(world, classes):
    kept = lesson.three_views(world, classes, np.array([450.0, 63.0]), 4)
    assert "stands for C4, ends in C4 ✓" in titles(kept)
    broken = lesson.three_views(world, classes, np.array([450.0, 63.0]), 3, name="this one")
    assert "this one stands for C3, ends in C4 ✗" in titles(broken)
    assert "this one, 450 N at 63°" in alt_text(broken)


def test_a_jump_off_the_map_is_shown_at_the_rim_and_called_so(world, classes):
    figure = lesson.three_views(world, classes, np.array([1000.0, 60.0]), 6)
    assert "off the map ✗" in titles(figure)
    (low, high), _ = lesson.EFFECT_LIMITS
    (plane,) = (ax for ax in figure.axes if ax.get_xlabel() == "Δy [m]")
    shown = plane.lines[-1].get_xdata()[0]
    assert shown == high > low


@pytest.mark.parametrize("motion", [(50, 1), (50, 89), (1000, 1), (1000, 89)])
def test_three_views_can_show_the_corners_of_the_motion_space(world, classes, motion):
    before = world.state
    assert "stands for C1, ends" in titles(lesson.three_views(world, classes, np.array(motion), 1))
    assert (world.state == before).all()


def test_the_linked_view_shows_each_prototype_of_each_set(world, classes, prototypes, central):
    draw = lesson.linked_view(world, classes, {"the paper": prototypes, "central": central})
    assert "C1a: 191 N at 53°" in titles(draw())
    names = lesson.prototype_names(prototypes)
    for place, name in enumerate(names):
        magnitude, angle = central.motions[place]
        figure = draw(name, "central")
        assert f"{name}: {magnitude:.0f} N at {angle:.0f}°" in titles(figure)
        assert f"ends in C{name[1]} ✓" in titles(figure)


def test_the_linked_view_can_be_explored_and_needs_no_kernel(world, classes, prototypes, central):
    names = lesson.prototype_names(prototypes)
    draw = lesson.linked_view(world, classes, {"the paper": prototypes, "central": central})
    exploration = explore(draw, prototype=names, which=["the paper", "central"])
    assert isinstance(exploration, Exploration)
    assert len(exploration.player(2)) <= 2
    dropdown, buttons, picture = exploration.widget().children
    before = picture.value
    dropdown.value = names[-1]
    assert names[-1] in picture.value != before
    buttons.value = "central"
    assert "ends in C6" in picture.value


def test_sets_that_stand_for_other_classes_are_not_linked(world, classes, prototypes):
    other = Prototypes(prototypes.motions[:2], prototypes.classes[:2])
    with pytest.raises(ValueError, match="same classes in the same order"):
        lesson.linked_view(world, classes, {"one": prototypes, "other": other})
    with pytest.raises(ValueError, match="same classes"):
        lesson.linked_view(world, classes, {"grid": uniform_prototypes(world)})


def test_a_walk_begins_and_ends_well_and_fails_between(world, classes):
    motions = classes.motions_of(6)
    first, second = motions[motions[:, 0].argmin()], motions[motions[:, 0].argmax()]
    draw = lesson.walk(world, classes, first, second, 6)
    assert ["✓" in titles(draw(share)) for share in (0, 0.5, 1)] == [True, False, True]
    assert "50% of the way" in alt_text(draw(0.5))


def test_paths_of_all_classes_are_on_the_same_axes(world, classes, prototypes):
    figures = [lesson.plot_paths(world, prototypes, classes, number) for number in classes.numbers]
    assert len({(figure.axes[0].get_xlim(), figure.axes[0].get_ylim()) for figure in figures}) == 1
    assert all(f"C{number}" in alt_text(figure) for number, figure in zip(classes.numbers, figures, strict=True))


# Promises


def test_promises_have_an_arrow_for_each_that_is_broken(world, classes, prototypes):
    effects, reached = lesson.replay(world, prototypes.motions, classes)
    figure = lesson.plot_promises(prototypes, effects, reached, classes)
    broken = int((reached != prototypes.classes).sum())
    arrows = [text for text in figure.axes[0].texts if text.get_text() == ""]
    assert len(arrows) == broken
    assert f"{broken} of {len(prototypes)} end elsewhere" in alt_text(figure)
    assert "C1a" in " ".join(texts(figure.axes[0]))


def test_where_all_promises_are_kept_there_is_no_arrow(world, classes, central):
    effects, reached = lesson.replay(world, central.motions, classes)
    figure = lesson.plot_promises(central, effects, reached, classes)
    assert not figure.axes[0].texts
    assert "end elsewhere: none" in alt_text(figure)


def test_shares_stand_beside_prototypes_and_do_not_cover_each_other(classes, prototypes):
    shares = np.linspace(0, 1, len(prototypes))
    figure = lesson.plot_kept(prototypes, shares, classes, "the title")
    figure.canvas.draw()
    assert f"C1a {shares[0]:.0%}" in texts(figure.axes[0])
    boxes = [text.get_window_extent() for text in figure.axes[0].texts]
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[:i])
    assert "the title" in alt_text(figure)


def test_the_confusion_table_counts_every_prototype_once():
    figure = lesson.plot_confusion(np.array([1, 1, 2, 3]), np.array([1, 2, 2, 0]), 3)
    assert sorted(texts(figure.axes[0])) == ["1", "1", "1", "1"]
    assert "2 of 4 prototypes are on its diagonal, 1 end off the map" in alt_text(figure)


def test_bars_are_divided_by_the_class_reached():
    figure = lesson.plot_reached({"a": np.array([0, 1, 1, 6]), "b": np.array([2])}, 6)
    widths = [patch.get_width() for patch in figure.axes[0].patches]
    assert sum(widths) == pytest.approx(2)
    assert {"$C_1$ 2", "off 1", "$C_2$ 1"} <= set(texts(figure.axes[0]))
    assert "a: off the map 1, C1 2, C6 1; b: C2 1" in alt_text(figure)


def test_small_shares_have_a_number_only_and_tiny_ones_none():
    reached = np.array([1] * 95 + [2] * 4 + [0])
    words = texts(lesson.plot_reached({"a": reached}, 6).axes[0])
    assert words == ["$C_1$ 95", "4"]


# Noise


def test_noisy_replays_are_all_counted(world, classes, prototypes):
    figure = lesson.plot_noise(world, classes, prototypes.motions[2], 3, "C3a")
    counts = [int(part.split(": ")[1]) for part in figure.axes[1].get_title().split("end: ")[1].split(", ")]
    assert sum(counts) == 20
    assert "C3a" in alt_text(figure)


def test_without_noise_the_sweep_is_the_exact_reliability(world, classes, prototypes, central):
    table = lesson.noise_sweep(world, classes, {"paper": prototypes, "central": central}, scales=(0, 4), replays=3)
    assert table.loc["paper", 0] == pytest.approx(reliability(world, prototypes, classes, replays=1).exact)
    assert table.loc["central", 0] == 1 > table.loc["central", 4]
    figure = lesson.plot_noise_sweep(table)
    assert [line.get_label() for line in figure.axes[0].lines] == ["paper", "central"]
    assert "central 100%" in alt_text(figure)


# Why a mean may be bad


def test_a_convex_class_has_no_strangers_and_a_bow_has(samples, classes):
    magnitude, angle = samples.motions.T
    inside = (magnitude > 300) & (magnitude < 700) & (angle > 30) & (angle < 60)
    box = dataclasses.replace(classes, labels=np.where(inside, 1, 2))
    assert lesson.strangers_in_hull(box, 1) == 0
    assert lesson.strangers_in_hull(classes, 6) > 0.5


def test_each_mean_lies_in_the_hull_of_its_class(classes):
    figure = lesson.plot_hulls(classes)
    assert len(figure.axes) == classes.n_classes
    for ax, number in zip(figure.axes, classes.numbers, strict=True):
        (hull,) = ax.patches
        assert Path(hull.get_xy()).contains_point(classes.motions_of(number).mean(axis=0))
    assert "Strangers inside: C1" in alt_text(figure)


def test_a_free_flight_with_that_force_comes_down_at_the_place():
    for angle, distance, height in ((60.0, 0.8, 0.3), (80.0, 1.2, 0.6), (70.0, 0.5, 0.0)):
        speed = float(lesson.flight_magnitude(np.array([angle]), distance, height)[0]) * 0.01
        v_y, v_z = speed * math.cos(math.radians(angle)), speed * math.sin(math.radians(angle))
        time = distance / v_y
        assert v_z * time - 9.81 * time**2 / 2 == pytest.approx(height)
        assert v_z - 9.81 * time < 0


def test_where_a_flight_would_pass_on_its_way_up_there_is_no_force():
    force = lesson.flight_magnitude(np.array([20.0, 40.0, 57.0, 59.0]), 0.75, 0.6)  # tan 58° = 2 x 0.6 / 0.75
    assert np.isnan(force).tolist() == [True, True, True, False]
    assert np.isfinite(lesson.flight_magnitude(np.array([1.0, 89.0]), 1.0, 0.0)).all()


# Repairs


def test_motions_are_pointed_out_with_their_words(classes):
    figure = lesson.plot_motions(classes, 1, {"one": np.array([200.0, 50.0]), "many": classes.motions_of(1)}, "title")
    assert [text.get_text() for text in figure.axes[0].get_legend().get_texts()] == ["one", "many"]
    assert "one at 200 N and 50°" in alt_text(figure)
    one, many = figure.axes[0].lines[-2:]
    assert one.get_markersize() > many.get_markersize()
    assert isinstance(lesson.plot_motions(classes, None, {"one": np.array([200.0, 50.0])}), Figure)


def test_long_lists_of_motions_do_not_make_the_words_endless(classes):
    assert len(alt_text(lesson.plot_motions(classes, 1, {"many": classes.motions_of(1)}))) < 400


def test_values_colour_the_motions_of_a_class(classes):
    values = np.linspace(0, 1, classes.sizes[4])
    chosen = classes.motions_of(5)[:2]
    figure = lesson.plot_values(classes, 5, values, "a value", chosen)
    assert figure.axes[1].get_ylabel() == "a value"
    assert np.allclose(figure.axes[0].collections[0].get_array(), values)
    assert "from 0 to 1" in alt_text(figure)


def test_the_trade_is_drawn_with_a_mark_and_a_name_for_each_set():
    table = pd.DataFrame({"under noise": [0.5, 0.9], "distance": [0.6, 0.7]}, index=["a", "b"])
    figure = lesson.plot_trade(table)
    assert texts(figure.axes[0]) == ["a", "b"]
    assert "a: 50%, 0.60" in alt_text(figure)
    assert isinstance(lesson.plot_trade(table[:1]), Figure)


def test_the_two_planes_show_every_sample(classes):
    figure = Figure()
    left, right = figure.subplots(1, 2)
    lesson.draw_motions(left, classes)
    assert sum(len(line.get_xdata()) for line in left.lines) == len(classes.samples)
    lesson.draw_effects(right, classes, 3)
    assert sum(len(line.get_xdata()) for line in right.lines) == classes.sizes.sum() + classes.n_classes


# Three dimensions


def test_the_linked_view_lets_one_choose_among_worlds(world, classes, prototypes):
    tumbling = TumblingWorld()
    draw = lesson.linked_view({"the plane": world, "three dimensions": tumbling}, classes, {"the paper": prototypes})
    assert titles(draw()) == titles(draw("C1a", "the paper", "the plane"))
    assert "C1a: 191 N" in titles(draw())
    solid = draw("C4a", where="three dimensions")
    assert "C4a in three dimensions stands for C4, ends in C4" in titles(solid)
    (stairs,) = (ax for ax in solid.axes if ax.get_xlabel() == "y [m]")
    magnitude, angle = prototypes.of_class(4)[0].tolist()
    jump = tumbling.jump(magnitude, angle, trajectory=True)
    assert stairs.lines[0].get_ydata() == pytest.approx(jump.trajectory.z)


def test_three_views_start_from_the_start_pose_and_leave_the_world_as_it_was(classes):
    world = TumblingWorld()
    world.reset(world.state_at(0.45, 0.05, yaw=0.3))
    before = world.state
    figure = lesson.three_views(world, classes, np.array([450.0, 65.0]), 4)
    assert (world.state == before).all()
    (stairs,) = (ax for ax in figure.axes if ax.get_xlabel() == "y [m]")
    assert stairs.lines[0].get_xdata()[0] == 0.25
