import ast
import inspect
from functools import cache

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from small_run import small_run
from toy_world import PuckWorld

from stairlab import drawing, plots
from stairlab.effects import EffectClasses
from stairlab.fidelity import Fidelity, TreadFidelity, TreadMeasures, measure_fidelity, roll_out
from stairlab.pipeline import Run
from stairlab.prototypes import effect_prototypes, random_prototypes, uniform_prototypes
from stairlab.sampling import sample_motions
from stairlab.tumbling import TumblingWorld
from stairlab.world import Jump, Staircase, StairWorld


def in_worlds(run: Run) -> dict[str, Fidelity]:
    worlds = {"tumbling": TumblingWorld(), "plane": StairWorld()}
    return {name: measure_fidelity(run.samples[:60], world, progress=False) for name, world in worlds.items()}


@cache
def on_treads() -> dict[str, TreadFidelity]:
    """The plane's own rollouts, and the tumbling world's, against other rollouts of the tumbling world."""
    plane, tumbling = StairWorld(Staircase.fifteen()), TumblingWorld(Staircase.fifteen())
    other, *own = (
        TreadMeasures.of(roll_out(world, 20, seed, progress=False))
        for world, seed in ((tumbling, 1), (tumbling, 0), (plane, 0))
    )
    return {
        name: TreadFidelity(other, measures, measures)
        for name, measures in zip(("tumbling", "plane"), own, strict=True)
    }


SETS = ("effect", "fixed", "random", "uniform")
FIGURES = {
    "world": lambda run: plots.plot_world(run.world),
    "jump": lambda run: plots.plot_world(run.example),
    "effect classes": lambda run: plots.plot_effect_classes(run.classes),
    "prototypes": lambda run: plots.plot_prototypes([run.prototypes[name] for name in SETS], run.classes),
    "trajectories": lambda run: plots.plot_prototype_trajectories(run.world, run.prototypes["effect"], run.classes),
    "distributions": lambda run: plots.plot_effect_distributions(run.samples),
    "features": lambda run: plots.plot_feature_comparison(run.classes, run.classes_x),
    "scores": lambda run: plots.plot_score_curve(run.presets),
    "counts": lambda run: plots.plot_prototype_counts(run.counts),
    "reliability": lambda run: plots.plot_reliability(run.summary()),
    "fidelity": lambda run: plots.plot_fidelity(measure_fidelity(run.samples[:60], progress=False)),
    "fidelity of worlds": lambda run: plots.plot_fidelity(in_worlds(run)),
    "treads": lambda run: plots.plot_tread_fidelity(on_treads()),
}  # fmt: skip


@pytest.fixture(params=FIGURES)
def figure(request: pytest.FixtureRequest) -> Figure:
    return FIGURES[request.param](small_run())


def test_every_figure_can_be_drawn_has_alternative_text_and_labels_on_all_axes(figure: Figure) -> None:
    assert drawing.png(figure, dpi=40).startswith(b"\x89PNG")
    assert len(drawing.alt_text(figure)) > 40
    assert "$" not in drawing.alt_text(figure)
    for ax in figure.axes:
        assert ax.get_xlabel()
        assert ax.get_ylabel() or ax.get_yticklabels()[0].get_text()


@pytest.mark.parametrize(
    "name",
    [
        *("world", "jump", "effect classes", "prototypes", "trajectories", "distributions", "features"),
        *("fidelity", "fidelity of worlds", "treads"),
    ],
)
def test_axes_name_their_units(name: str) -> None:
    for ax in FIGURES[name](small_run()).axes:
        assert all("[" in label or "jumps" in label for label in (ax.get_xlabel(), ax.get_ylabel()))


def test_figures_leave_no_trace_in_pyplot() -> None:
    before, settings = plt.get_fignums(), dict(plt.rcParams)
    for draw in FIGURES.values():
        draw(small_run())
    assert plt.get_fignums() == before
    assert dict(plt.rcParams) == settings


def test_plots_neither_imports_pyplot_nor_chooses_a_backend() -> None:
    names = [
        ast.unparse(node)
        for module in (plots, drawing)
        for node in ast.walk(ast.parse(inspect.getsource(module)))
        if isinstance(node, ast.Import | ast.ImportFrom)
    ]
    assert names
    assert not any("pyplot" in name or "backend" in name for name in names)


def test_a_notebook_gets_one_picture_with_its_alternative_text() -> None:
    figure = plots.plot_world(small_run().example)
    shown = figure._repr_html_()
    assert shown.count("<img") == 1
    assert drawing.alt_text(figure) in shown


def test_a_class_has_the_same_colour_and_marker_in_every_figure() -> None:
    run = small_run()
    color, marker = plots.class_style(3)
    scattered = plots.plot_effect_classes(run.classes).axes[0].get_legend().legend_handles[2]
    compared = plots.plot_feature_comparison(run.classes, run.classes_x).axes[0].get_legend().legend_handles[2]
    listed = plots.plot_prototypes(run.prototypes["effect"], run.classes).legends[0].legend_handles[2]
    for handle in (scattered, compared, listed):
        assert (handle.get_color(), handle.get_marker()) == (color, marker)
    bars = plots.plot_prototype_counts(run.counts).axes[1].patches
    assert to_hex(bars[2].get_facecolor()) == color.lower()
    lines = plots.plot_prototype_trajectories(run.world, run.prototypes["effect"], run.classes, [3]).axes[0].lines
    assert {line.get_color() for line in lines} == {color}


def test_twenty_classes_look_different() -> None:
    assert len({plots.class_style(number) for number in range(1, 21)}) == 20


def _seen_by(color: str, vision: list[list[float]]) -> np.ndarray:
    """Return a colour in CIE Lab as it looks to somebody whose cones are described by ``vision`` (Machado and others, 2009)."""
    rgb = np.array(to_rgb(color))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    xyz = to_xyz @ np.clip(np.array(vision) @ linear, 0, 1) / [0.9505, 1, 1.089]
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize(
    "vision",
    [
        [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
    ],
    ids=["full colour vision", "no green cones", "no red cones", "no blue cones"],
)
def test_class_colours_can_be_told_apart_with_any_colour_vision(vision: list[list[float]]) -> None:
    seen = [_seen_by(color, vision) for color in plots.COLORS]
    assert min(np.linalg.norm(a - b) for i, a in enumerate(seen) for b in seen[:i]) > 10


def test_classes_are_described_by_the_steps_they_gain() -> None:
    run = small_run()
    glosses = plots.class_glosses(run.classes)
    assert list(glosses) == list(run.classes.numbers)
    assert {"1 step", "2 steps"} <= {gloss.split(",")[0] for gloss in glosses.values()}
    merged = EffectClasses.from_samples(run.samples, k_range=(2, 2))
    assert any(" to " in gloss or " or " in gloss for gloss in plots.class_glosses(merged).values())


def test_classes_of_another_world_are_named_by_number_alone() -> None:
    samples = sample_motions(PuckWorld(), n=60, progress=False)
    classes = EffectClasses.from_samples(samples, ("deast", "dheight"))
    assert plots.class_names(classes)[1] == "$C_{1}$"
    with pytest.raises(ValueError, match="two motion parameters, not with 3: speed, heading, lift"):
        plots.plot_effect_classes(classes)


def test_figures_draw_into_given_axes_and_return_their_figure() -> None:
    own = Figure()
    top, bottom = own.subfigures(2)
    assert plots.plot_prototypes(uniform_prototypes(StairWorld()), small_run().classes, axes=top.subplots()) is own
    assert plots.plot_effect_distributions(small_run().samples, axes=bottom.subplots(1, 2)) is own
    assert "uniform grid" in drawing.alt_text(own)
    assert "histograms" in drawing.alt_text(own)


def test_prototypes_lie_where_the_set_has_them() -> None:
    sets = {"a": random_prototypes(StairWorld(), seed=1), "b": small_run().prototypes["effect"]}
    for ax, prototypes in zip(plots.plot_prototypes(sets, small_run().classes).axes, sets.values(), strict=True):
        drawn = [line.get_xydata()[0] for line in ax.lines if line.get_markersize() == 11]
        np.testing.assert_array_equal(drawn, prototypes.motions)


def test_trajectories_leave_the_world_as_it_was_and_say_where_jumps_end() -> None:
    run, world = small_run(), StairWorld()
    world.reset(world.state_at(0.4, 0.05))
    before = world.state
    figure = plots.plot_prototype_trajectories(world, run.prototypes["effect"], run.classes, [1, 2])
    np.testing.assert_array_equal(world.state, before)
    reached = run.reliability["effect"].table.query("`class` in (1, 2)")["reached"]
    assert [f"ends in C{number}" in drawing.alt_text(figure) for number in reached if number] == [True] * int(
        (reached > 0).sum()
    )


def test_the_long_stairs_and_jumps_without_a_path_can_be_drawn() -> None:
    world = StairWorld(Staircase.fifteen())
    assert "15 steps" in drawing.alt_text(plots.plot_world(world))
    assert "comes to rest" in drawing.alt_text(plots.plot_world(world.jump(500, 60), world.staircase))


def test_the_chosen_k_is_ringed() -> None:
    classes = small_run().classes
    ring = plots.plot_score_curve(classes).axes[0].lines[1]
    assert ring.get_xdata().tolist() == [classes.n_classes]
    assert ring.get_ydata().tolist() == [classes.scores["score"].max()]


def test_several_seeds_of_one_method_are_drawn_around_their_mean() -> None:
    table = pd.DataFrame({"method": ["a", "a", "b"], "exact": [0.5, 0.7, np.nan], "under noise": [0.4, 0.6, np.nan]})
    assert "a: ends in its own class 60 %, ends in its own class, under noise 50 %" in drawing.alt_text(
        plots.plot_reliability(table)
    )


def test_a_saved_figure_appears_whole_or_not_at_all(tmp_path, monkeypatch) -> None:
    figure = plots.plot_world(StairWorld())
    for name in ("a.png", "a.svg", "a.pdf"):
        drawing.save_figure(figure, tmp_path / name)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.pdf", "a.png", "a.svg"]
    with pytest.raises(ValueError, match="xyz"):
        drawing.save_figure(figure, tmp_path / "b.xyz")
    monkeypatch.setattr("os.replace", lambda *_: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(OSError, match="disk full"):
        drawing.save_figure(figure, tmp_path / "c.png")
    assert len(list(tmp_path.iterdir())) == 3


def trajectories(run: Run, name: str, numbers: list[int] | None = None) -> Figure:
    return plots.plot_prototype_trajectories(run.world, run.prototypes[name], run.classes, numbers)


@pytest.mark.parametrize(
    ("draw", "error", "message"),
    [
        (lambda run: plots.plot_world("stairs"), TypeError, "world_or_jump must be CubeWorld or Jump, not str"),
        (lambda run: plots.plot_effect_classes(run.samples), TypeError, "classes must be EffectClasses, not Samples"),
        (lambda run: plots.plot_prototypes([], run.classes), ValueError, "sets must hold at least one"),
        (lambda run: plots.plot_prototypes([1], run.classes), TypeError, "sets must be Prototypes, not int"),
        (lambda run: plots.plot_prototypes(3, run.classes), TypeError, "sets must be"),
        (lambda run: plots.plot_effect_classes(run.classes, ax=3), ValueError, "axes must be 1 matplotlib Axes"),
        (lambda run: plots.plot_effect_distributions(run.samples, axes=[Figure().subplots()]), ValueError, "axes must be 2"),
        (lambda run: trajectories(run, "random"), ValueError, "must have classes"),
        (lambda run: trajectories(run, "effect", [99]), ValueError, "numbers must be one or more classes"),
        (lambda run: plots.plot_score_curve({}), ValueError, "classes must hold at least one"),
        (lambda run: plots.plot_score_curve(EffectClasses.from_samples(run.samples, "dy")), ValueError, "must come from K-Means"),
        (lambda run: plots.plot_prototype_counts(run.classes.to_frame()), TypeError, "counts must be a table with the columns"),
        (lambda run: plots.plot_reliability(run.summary()[:0]), TypeError, "table must have rows"),
        (lambda run: plots.plot_fidelity({}), TypeError, "fidelity must be Fidelity, not dict"),
        (lambda run: plots.plot_fidelity({"plane": 3}), TypeError, "each fidelity must be Fidelity, not int"),
        (lambda run: plots.plot_tread_fidelity({}), TypeError, "fidelity must be TreadFidelity, not dict"),
        (lambda run: plots.plot_tread_fidelity(on_treads()["plane"], axes=3), ValueError, "axes must be 4 matplotlib Axes"),
        (lambda run: drawing.alt_text(Figure()), ValueError, "no alternative text"),
    ],
)  # fmt: skip
def test_what_cannot_be_drawn_is_refused_by_name(draw, error, message) -> None:
    with pytest.raises(error, match=message):
        draw(small_run())


def test_one_prototype_for_each_of_twelve_classes_can_be_drawn() -> None:
    classes = EffectClasses.from_samples(small_run().samples, k_range=(12, 12))
    figure = plots.plot_prototypes(effect_prototypes(classes, fixed=1), classes)
    assert "12 prototypes" in drawing.alt_text(figure)


# Three dimensions


@pytest.fixture(scope="module")
def rolled() -> Jump:
    """A jump that ends three steps up, turned and aside."""
    jump = TumblingWorld().jump(500, 70, np.random.default_rng(0), trajectory=True)
    assert abs(jump.end[0]) > 0.1
    return jump


def corners_of(polygon) -> np.ndarray:
    return polygon.get_xy()[:-1]


def test_a_quaternion_about_x_has_the_outline_of_the_same_rotation_in_the_plane() -> None:
    for rotation in (0.0, 0.3, 1.2, -2.0):
        flat = plots.cube_corners(0.4, 0.9, rotation)
        turned = plots.cube_corners(0.4, 0.9, np.array([np.sin(rotation / 2), 0, 0, np.cos(rotation / 2)]))
        distances = np.linalg.norm(flat[:, None] - turned, axis=2)
        assert distances.min(axis=1).max() < 1e-9
        assert distances.min(axis=0).max() < 1e-9


def test_a_cube_that_stands_on_a_corner_has_a_hexagon_as_outline() -> None:
    rng = np.random.default_rng(0)
    for quaternion in rng.standard_normal((20, 4)):
        outline = plots.cube_outline(quaternion / np.linalg.norm(quaternion))
        assert len(outline) == 6
        np.testing.assert_allclose(
            outline, -np.roll(outline, 3, axis=0), atol=1e-12
        )  # it is symmetric about its centre
        assert 0.05 - 1e-12 <= np.linalg.norm(outline, axis=1).min() <= np.linalg.norm(outline, axis=1).max() < 0.0867


def test_a_turn_about_the_vertical_is_seen_from_above_and_widens_the_side(world) -> None:
    quaternion = world.state_at(0.5, 0.05)[3:7] * 0 + [0, 0, np.sin(np.pi / 8), np.cos(np.pi / 8)]  # 45 degrees
    assert np.ptp(plots.cube_outline(quaternion, plots.SIDE), axis=0) == pytest.approx([0.1 * np.sqrt(2), 0.1])
    assert np.ptp(plots.cube_outline(quaternion, plots.ABOVE), axis=0) == pytest.approx([0.1 * np.sqrt(2)] * 2)


def test_a_tumbling_jump_is_drawn_from_the_side_with_its_turned_cube(rolled) -> None:
    figure = plots.plot_world(rolled)
    assert "Δx = +0.12 m" in drawing.alt_text(figure)
    (end,) = [
        patch for patch in figure.axes[0].patches if corners_of(patch).mean(axis=0) == pytest.approx(rolled.end[1:3])
    ]
    assert np.ptp(corners_of(end)[:, 0]) == pytest.approx(
        0.1 * (np.sin(np.radians(30)) + np.cos(np.radians(30))), abs=1e-3
    )
    world = TumblingWorld()
    world.reset(rolled.end)
    assert "the cube at y = 1.46 m, z = 0.95 m" in drawing.alt_text(plots.plot_world(world))


def test_two_views_of_a_jump_show_how_far_it_went_aside_and_turned(rolled) -> None:
    figure = plots.plot_jump_views(rolled)
    side, above = figure.axes
    assert (side.get_xlabel(), side.get_ylabel(), above.get_ylabel()) == ("y [m]", "z [m]", "x [m]")
    assert (
        "comes to rest: Δx = +0.12 m, Δy = +1.21 m, Δz = +0.90 m. It is 12 cm aside, turned by 30°"
        in drawing.alt_text(figure)
    )
    np.testing.assert_array_equal(
        above.lines[0].get_xydata(), np.column_stack([rolled.trajectory.y, rolled.trajectory.x])
    )
    np.testing.assert_allclose(corners_of(above.patches[-1]).mean(axis=0), rolled.end[[1, 0]], atol=1e-9)
    assert above.get_ylim()[0] > above.get_ylim()[1]  # x points down, as the robot's right hand does
    assert side.get_xlim() == above.get_xlim()


def test_two_views_at_a_time_show_the_path_so_far_on_the_same_axes(rolled) -> None:
    whole, early = plots.plot_jump_views(rolled), plots.plot_jump_views(rolled, time=0.3)
    assert len(early.axes[1].lines[0].get_xdata()) == 301
    assert [ax.axis() for ax in early.axes] == [ax.axis() for ax in whole.axes]
    assert whole.get_size_inches().tolist() == early.get_size_inches().tolist()
    assert "shown 0.300 s after the push" in drawing.alt_text(early)
    assert "12 cm aside" in drawing.alt_text(plots.plot_jump_views(rolled, time=99.0))


def test_two_views_of_a_jump_in_the_plane_stay_on_a_line(world) -> None:
    figure = plots.plot_jump_views(world.jump(450, 65, trajectory=True))
    assert set(figure.axes[1].lines[0].get_ydata()) == {0.0}
    assert "0 cm aside, turned by 0°" in drawing.alt_text(figure)


def test_two_views_on_long_stairs_show_what_is_around_the_jump() -> None:
    world = TumblingWorld(Staircase.fifteen())
    side, _ = plots.plot_jump_views(world.jump(338, 69, trajectory=True), world.staircase).axes
    assert np.ptp(side.get_xlim()) < 3


def test_two_views_can_be_drawn_into_axes_of_ones_own(rolled) -> None:
    own = Figure()
    assert plots.plot_jump_views(rolled, axes=own.subplots(2, 1)) is own


def test_two_views_need_a_path_and_a_time_that_is_not_negative(rolled) -> None:
    with pytest.raises(ValueError, match="jump must have its path"):
        plots.plot_jump_views(StairWorld().jump(450, 65))
    with pytest.raises(ValueError, match="time must be"):
        plots.plot_jump_views(rolled, time=-1.0)


def test_prototypes_are_performed_in_the_world_that_is_given() -> None:
    run, world = small_run(), TumblingWorld()
    figure = plots.plot_prototype_trajectories(world, run.prototypes["effect"], run.classes, [3])
    motions = run.prototypes["effect"].of_class(3).tolist()
    for line, motion in zip(figure.axes[0].lines, motions, strict=True):
        world.reset()
        np.testing.assert_array_equal(line.get_ydata(), world.jump(*motion, trajectory=True).trajectory.z)


def test_worlds_are_told_apart_by_more_than_their_colours() -> None:
    for figure, panels in (
        (plots.plot_tread_fidelity(on_treads()), 3),
        (plots.plot_fidelity(in_worlds(small_run())), 4),
    ):
        drawn = [[line for line in ax.get_lines() if not line.get_label().startswith("_")] for ax in figure.axes]
        assert [len(lines) for lines in drawn if lines] == [3] * panels
        for lines in drawn:
            assert (
                len({line.get_linestyle() for line in lines})
                == len({line.get_marker() for line in lines})
                == len(lines)
            )


def test_fidelity_on_treads_shows_the_distributions_that_were_measured() -> None:
    treads = on_treads()
    figure = plots.plot_tread_fidelity(treads)
    gap, yaw, _, climb = figure.axes
    curves = {line.get_label(): line.get_xdata() for line in gap.get_lines()}
    assert list(curves) == ["reference", "tumbling", "plane"]
    np.testing.assert_allclose(np.unique(curves["plane"]), 100 * np.unique(treads["plane"].own.gaps))
    assert f"tumbling {treads['tumbling'].yaw_ks:.2f}, plane {treads['plane'].yaw_ks:.2f}" in yaw.get_title()
    labels = climb.get_legend_handles_labels()[1]
    assert f"plane: {100 * treads['plane'].own.climb:.0f} % over all gaps" in labels
    words = drawing.alt_text(figure)
    assert f"plane {treads['plane'].gap_ks:.3f}" in words
    assert "nan" not in words


def test_one_world_alone_can_be_drawn() -> None:
    treads, start = on_treads()["plane"], in_worlds(small_run())["plane"]
    assert len(plots.plot_tread_fidelity(treads).axes) == 4
    assert len(plots.plot_fidelity({"plane": start}).axes) == 5
    assert len(plots.plot_fidelity(start).axes) == 2
    axes = Figure().subplots(2, 2)
    assert plots.plot_tread_fidelity(treads, axes.ravel()).axes == list(axes.ravel())
