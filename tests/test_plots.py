import ast
import inspect

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
from stairlab.fidelity import measure_fidelity
from stairlab.pipeline import Run
from stairlab.prototypes import effect_prototypes, random_prototypes, uniform_prototypes
from stairlab.sampling import sample_motions
from stairlab.world import Staircase, StairWorld

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
    "name", ["world", "jump", "effect classes", "prototypes", "trajectories", "distributions", "features", "fidelity"]
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
        (lambda run: plots.plot_world("stairs"), TypeError, "world_or_jump must be StairWorld or Jump, not str"),
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
