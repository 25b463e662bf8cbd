import ast
import inspect
import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from stairlab import study_plots as plots
from stairlab.agents import PUBLISHED_SETTINGS
from stairlab.drawing import COLORS, alt_text, png
from stairlab.results import StudyResults
from stairlab.study import METHODS

SEEDS = {"effect": 8, "uniform": 7, "random": 6, "sac": 3}
STEPS = (500, 1000, 1500, 2000)
SAMPLED = ("effect", "effect-reliable", "fixed")


def study(seeds: Mapping[str, int] = SEEDS, quick: bool = False, **dqn: int) -> StudyResults:
    """Return made-up results with the given numbers of seeds."""
    tables = _tables(tuple(seeds.items()))
    return StudyResults(
        *tables,
        description={"settings": {"quick": quick, "dqn": dqn, "restitution": None, "world": "plane"}, "own": {}},
    )


@lru_cache
def _tables(seeds: tuple[tuple[str, int], ...]) -> tuple[pd.DataFrame, ...]:
    runs, evaluations, episodes = [], [], []
    for method, count in seeds:
        for seed in range(count):
            rng = np.random.default_rng([*method.encode(), seed])
            returns = np.sort(rng.integers(-2, 14, len(STEPS))).astype(float)
            key = {"method": method, "seed": seed}
            allowed = None if method == "sac" else float(rng.integers(12, 16))
            samples = 2000 if method in SAMPLED else 0
            runs.append({**key, "score": returns[-1], "actions": 14, "samples": samples, "best_return": allowed})
            evaluations += [
                {**key, "step": step, "episode": 0, "return": value, "length": 50, "climbed": 3}
                for step, value in zip(STEPS, returns, strict=True)
            ]
            episodes += [{**key, **jump} for jump in episode(steps=seed)]
    motions = pd.DataFrame(columns=["method", "seed"])
    return pd.DataFrame(runs), pd.DataFrame(evaluations), motions, pd.DataFrame(episodes)


def episode(steps: int, moves: float = 0.0, jumps: int = 8) -> list[dict[str, float]]:
    """Return an episode that climbs at its first jump and then moves by so much [m] with each."""
    return [
        {"jump": i, "magnitude": 500.0, "angle": 60.0, "y": 1 + moves * i, "z": 0.05 + 0.3 * steps, "steps": steps, "reward": 0.0}
        for i in range(1, jumps + 1)
    ]  # fmt: skip


FIGURES: dict[str, Callable[[StudyResults], Figure]] = {
    "learning curves": plots.plot_learning_curves,
    "learning certainty": plots.plot_learning_certainty,
    "scores": plots.plot_study_scores,
    "improvement": plots.plot_improvement,
    "last episodes": plots.plot_last_episodes,
}
every_figure = pytest.mark.parametrize("draw", FIGURES.values(), ids=FIGURES)


def line_of(ax: Axes, method: str) -> Line2D:
    return next(line for line in ax.lines if line.get_label() == plots.method_style(method).label)


def lines_like(ax: Axes, **properties: object) -> list[Line2D]:
    return [line for line in ax.lines if all(getattr(line, f"get_{k}")() == v for k, v in properties.items())]


def band_at(band, x: float) -> tuple[float, float]:
    """Return the lower and upper edge of a filled band."""
    points = band.get_paths()[0].vertices
    y = points[points[:, 0] == x, 1]
    return y.min(), y.max()


# All figures


@every_figure
def test_every_figure_can_be_drawn_and_says_in_words_what_each_method_does(draw) -> None:
    figure = draw(study())
    assert png(figure, dpi=40).startswith(b"\x89PNG")
    for method in SEEDS:
        assert plots.method_style(method).label in alt_text(figure)
    assert "nan" not in alt_text(figure)


@every_figure
def test_every_panel_has_axes_with_units_unless_its_neighbour_has_the_same(draw) -> None:
    panels = draw(study()).axes
    assert all("[" in ax.get_xlabel() for ax in panels)
    assert "[" in panels[0].get_ylabel() or panels[0].get_yticklabels()[0].get_text()
    assert all(ax.get_ylabel() or ax.get_ylim() == panels[0].get_ylim() for ax in panels)


@every_figure
def test_a_quick_study_says_so_in_every_figure_and_a_real_one_does_not(draw) -> None:
    quick = draw(study(quick=True))
    assert quick.get_suptitle() == plots.QUICK_BANNER
    assert alt_text(quick).startswith(plots.QUICK_BANNER)
    real = draw(study())
    assert not real.get_suptitle()
    assert plots.QUICK_BANNER not in alt_text(real)


@every_figure
@pytest.mark.parametrize("seeds", [1, 5])
def test_few_seeds_are_drawn_without_an_interval_and_without_a_warning(draw, seeds) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure = draw(study({"effect": seeds, "uniform": seeds}))
        png(figure, dpi=40)
    legends = [*figure.legends, *(ax.get_legend() for ax in figure.axes if ax.get_legend())]
    words = [text.get_text() for legend in legends for text in legend.get_texts()]
    assert not any("95 %" in text for text in [*words, *(ax.get_xlabel() for ax in figure.axes)])


@every_figure
def test_sac_alone_and_a_set_of_ones_own_can_be_drawn(draw) -> None:
    assert "SAC" in alt_text(draw(study({"sac": 2, "mine": 2, "effect": 2})))
    if draw is not plots.plot_improvement:
        assert "SAC" in alt_text(draw(study({"sac": 6})))


def test_figures_leave_no_trace_in_pyplot() -> None:
    before, settings = plt.get_fignums(), dict(plt.rcParams)
    for draw in FIGURES.values():
        draw(study({"effect": 2, "sac": 1}, quick=True))
    assert plt.get_fignums() == before
    assert dict(plt.rcParams) == settings
    imports = [n for n in ast.walk(ast.parse(inspect.getsource(plots))) if isinstance(n, ast.Import | ast.ImportFrom)]
    assert imports
    assert not any("pyplot" in ast.unparse(node) for node in imports)


def test_figures_draw_into_given_axes_and_join_their_words_and_banner() -> None:
    own = Figure()
    own.suptitle("My study")
    one, *four = own.subplots(5, 1)
    assert plots.plot_study_scores(study(quick=True), ax=one) is own
    assert plots.plot_last_episodes(study(quick=True), axes=four) is own
    assert own.get_suptitle() == f"My study\n{plots.QUICK_BANNER}"
    assert "Scores by method" in alt_text(own)
    assert "last greedy episodes end" in alt_text(own)
    assert all(ax.get_xlabel() and ax.get_ylabel() for ax in four)


def test_panels_stand_in_rows_of_similar_length_and_share_their_limits() -> None:
    figure = plots.plot_learning_certainty(study(dict.fromkeys((*METHODS, "mine"), 2)))
    assert figure.axes[0].get_gridspec().ncols == 3
    assert len({(ax.get_xlim(), ax.get_ylim()) for ax in figure.axes}) == 1
    assert [bool(ax.get_xlabel()) for ax in figure.axes] == [False] * 6 + [True] * 3
    assert [bool(ax.get_ylabel()) for ax in figure.axes] == [True, False, False] * 3


# How a method looks


def test_every_method_of_a_study_has_a_look_of_its_own() -> None:
    own = ("one", "two", "three")
    looks = [plots.method_style(method, own) for method in (*METHODS, *own)]
    for part in zip(*looks, strict=True):
        assert len(set(part)) == len(looks)
    assert looks[len(METHODS)].label == "one"
    assert {look.color for look in looks[: len(METHODS)]} <= set(COLORS)  # which are tested with any colour vision


def test_a_method_looks_the_same_in_every_study_and_figure() -> None:
    look = plots.method_style("uniform")
    for results in (study(), study({"mine": 2, "effect": 2, "uniform": 2})):
        line = line_of(plots.plot_learning_curves(results).axes[0], "uniform")
        assert (line.get_color(), line.get_marker()) == (look.color, look.marker)
        for draw in (plots.plot_study_scores, plots.plot_improvement):
            drawn = lines_like(draw(results).axes[0], marker=look.marker, color=look.color)
            assert any(line.get_markeredgewidth() > 0 for line in drawn)
        panel = plots.plot_learning_certainty(results, "uniform").axes[0]
        assert len(lines_like(panel, marker=look.marker, color=look.color)) == 1


# Figure 4


def test_the_curves_are_means_over_seeds_and_begin_after_each_methods_samples() -> None:
    results = study()
    panel = plots.plot_learning_curves(results).axes[0]
    for method in SEEDS:
        line = line_of(panel, method)
        np.testing.assert_array_equal(line.get_xdata(), np.array(STEPS) + (2000 if method == "effect" else 0))
        np.testing.assert_allclose(line.get_ydata(), results.curves(method).to_numpy().mean(axis=1))


def test_the_bands_are_one_standard_deviation_to_either_side() -> None:
    results = study()
    panel = plots.plot_learning_curves(results, ["effect", "uniform", "random"]).axes[0]
    assert len(panel.collections) == 3
    for method, band in zip(("effect", "uniform", "random"), panel.collections, strict=True):
        assert tuple(band.get_facecolor()[0][:3]) == to_rgba(plots.method_style(method).color)[:3]
        for step, returns in results.curves(method).iterrows():
            middle, spread = returns.mean(), returns.std(ddof=1)
            edges = band_at(band, step + results.shift(method))
            np.testing.assert_allclose(edges, (middle - spread, middle + spread))


def test_of_many_methods_the_standard_deviations_stand_beside_the_curves() -> None:
    results = study(dict.fromkeys(METHODS, 2), learning_starts=300)
    panel = plots.plot_learning_curves(results).axes[0]
    assert not panel.collections
    end = STEPS[-1] + 2000
    bars = [line for line in panel.lines if len(line.get_xdata()) == 2 and min(line.get_xdata()) > end]
    assert [bar.get_color() for bar in bars] == [plots.method_style(method).color for method in METHODS]
    for bar, method in zip(bars, METHODS, strict=True):
        last = results.curves(method).iloc[-1]
        np.testing.assert_allclose(bar.get_ydata(), last.mean() + last.std(ddof=1) * np.array([-1, 1]))
    assert max(panel.get_xticks()) <= end


def test_a_blue_and_a_red_line_mark_where_dqn_begins_to_learn() -> None:
    assert PUBLISHED_SETTINGS["dqn"]["learning_starts"] == plots.LEARNING_STARTS
    panel = plots.plot_learning_curves(study()).axes[0]
    for color, x in ((plots.BLUE, 3000), (plots.PATH, 5000)):
        (line,) = [one for one in lines_like(panel, color=color, linestyle="--") if len(set(one.get_xdata())) == 1]
        assert line.get_xdata()[0] == x
    assert "a red line at 5,000" in alt_text(panel.figure)


@pytest.mark.parametrize("methods", [["sac", "effect"], "effect"])
def test_no_blue_line_marks_a_begin_that_no_method_in_the_figure_has(methods) -> None:
    figure = plots.plot_learning_curves(study(), methods)
    assert not [line for line in lines_like(figure.axes[0], color=plots.BLUE) if 3000 in line.get_xdata()]
    assert "blue" not in alt_text(figure)
    assert "a red line at 5,000" in alt_text(figure)


def test_the_lines_follow_the_studys_settings_and_the_methods_drawn() -> None:
    quick = alt_text(plots.plot_learning_curves(study(quick=True, learning_starts=300)))
    assert "a blue line at 300" in quick
    assert "a red line at 2,300" in quick
    assert "red" not in alt_text(plots.plot_learning_curves(study(), ["uniform", "random"]))
    assert "blue" not in alt_text(plots.plot_learning_curves(study(), "sac"))


def test_a_green_line_marks_the_highest_return_of_sac_wherever_the_study_has_it() -> None:
    results = study()
    highest = results.curves("sac").to_numpy().max()
    for methods in (None, ["effect", "uniform", "random"], ["sac", "effect"]):
        panel = plots.plot_learning_curves(results, methods).axes[0]
        (line,) = lines_like(panel, color=plots.GREEN, linestyle="--", marker="None")
        assert set(line.get_ydata()) == {highest}
    assert "green" not in alt_text(plots.plot_learning_curves(study({"effect": 2})))


# The modern reading


def test_the_interquartile_means_and_intervals_are_those_of_the_results() -> None:
    results = study()
    for panel, method in zip(plots.plot_learning_certainty(results).axes, SEEDS, strict=True):
        expected = results.iqm_curve(method)
        (line,) = lines_like(panel, color=plots.method_style(method).color)
        np.testing.assert_allclose(line.get_ydata(), expected["iqm"])
        np.testing.assert_array_equal(line.get_xdata(), expected.index + results.shift(method))
        assert len(panel.collections) == (0 if method == "sac" else 1)
        for band in panel.collections:
            for x, low, high in zip(line.get_xdata(), expected["low"], expected["high"], strict=True):
                np.testing.assert_allclose(band_at(band, x), (low, high))


def test_every_seeds_curve_stands_behind_its_method() -> None:
    results = study()
    for panel, method in zip(plots.plot_learning_certainty(results).axes, SEEDS, strict=True):
        seeds = lines_like(panel, color=plots.FAINT)
        np.testing.assert_array_equal([line.get_ydata() for line in seeds], results.curves(method).to_numpy().T)
        assert max(line.get_zorder() for line in seeds) < min(
            line.get_zorder() for line in panel.lines if line not in seeds
        )
        assert f"({SEEDS[method]} seeds)" in panel.get_title()


def test_a_dotted_line_is_what_the_sets_allow_on_average() -> None:
    results = study()
    for panel, method in zip(plots.plot_learning_certainty(results).axes, SEEDS, strict=True):
        allowed = results.runs[results.runs["method"] == method]["best_return"].dropna()
        assert [line.get_ydata()[0] for line in lines_like(panel, linestyle=":")] == (
            [] if method == "sac" else [pytest.approx(allowed.mean())]
        )


def test_scores_show_each_seed_the_interval_and_what_the_sets_allow() -> None:
    results = study()
    panel = plots.plot_study_scores(results).axes[0]
    for row, method in enumerate(SEEDS):
        color = plots.method_style(method).color
        mine = [
            line for line in panel.lines if np.size(line.get_ydata()) and abs(np.mean(line.get_ydata()) - row) < 0.5
        ]
        drawn = [np.ravel(line.get_xdata()).tolist() for line in mine if line.get_color() == color]
        estimate = results.iqm_score(method)
        assert results.scores(method).tolist() in drawn
        assert [estimate.value] in drawn
        assert ([estimate.low, estimate.high] in drawn) == (method != "sac")
        allowed = results.runs[results.runs["method"] == method]["best_return"].dropna()
        ticks = [line.get_xdata().tolist() for line in mine if line.get_marker() == "|"]
        assert ticks == ([] if method == "sac" else [allowed.tolist()])
        means = [line.get_xdata()[0] for line in mine if line.get_markerfacecolor() == "none"]
        assert means == ([] if method == "sac" else [pytest.approx(allowed.mean())])
    assert panel.get_yticklabels()[0].get_text() == "effect-based (8)"


def test_seeds_are_scattered_alike_each_time_and_never_into_another_row() -> None:
    jitter = plots._jitter(100)
    np.testing.assert_array_equal(jitter, plots._jitter(100))
    assert len(set(jitter)) == 100
    assert np.abs(jitter).max() <= 0.5
    assert png(plots.plot_study_scores(study()), 40) == png(plots.plot_study_scores(study()), 40)


@pytest.mark.parametrize("method", ["effect", "random"])
def test_improvement_compares_a_method_with_each_other_one(method) -> None:
    results = study()
    panel = plots.plot_improvement(results, method).axes[0]
    others = [name for name in SEEDS if name != method]
    assert [t.get_text() for t in panel.get_yticklabels()] == [f"than {plots.method_style(n).label}" for n in others]
    for row, other in enumerate(others):
        drawn = [
            np.ravel(line.get_xdata()).tolist() for line in panel.lines if set(np.ravel(line.get_ydata())) == {row}
        ]
        value, low, high = results.probability_of_improvement(method, other)
        assert drawn == ([[value]] if np.isnan(low) else [[low, high], [value]])
    (half,) = lines_like(panel, linestyle="--")
    assert set(half.get_xdata()) == {0.5}


def test_methods_that_always_score_the_same_can_be_compared() -> None:
    results = study({"effect": 6, "uniform": 6})
    results = replace(results, runs=results.runs.assign(score=1.0))
    assert "than uniform 50 % [50, 50]" in alt_text(plots.plot_improvement(results))
    plots.plot_study_scores(results)


# Where the last episodes end


def test_last_episodes_are_counted_by_step_and_by_what_the_end_was() -> None:
    ends = [
        episode(steps=15),  # on the top, in which it may rest
        episode(steps=4),
        episode(steps=4, moves=0.0009),
        episode(steps=4, moves=0.0011),
        episode(steps=0, jumps=5),  # the last five jumps are not known to have changed nothing
        [{**jump, "y": -0.1} for jump in episode(steps=0, jumps=2)],  # behind the map
    ]
    rows = [{"method": "effect", "seed": seed, **jump} for seed, jumps in enumerate(ends) for jump in jumps]
    results = replace(study({"effect": 6}), episodes=pd.DataFrame(rows))
    figure = plots.plot_last_episodes(results)
    (panel,) = figure.axes
    bars = [
        [(round(bar.get_x() + bar.get_width() / 2, 9), bar.get_y(), bar.get_height()) for bar in group]
        for group in panel.containers
    ]
    assert bars == [[(15, 0, 1)], [(0, 0, 1)], [(4, 0, 2)], [(0, 1, 1), (4, 2, 1)]]
    assert "of 6 episodes 1 on the top, 1 off the map, 2 stuck, median step 4" in alt_text(figure)
    assert panel.get_title() == "effect-based\n1 of 6 on top, 1 off the map"


def test_the_ends_are_told_apart_by_hatches_besides_colours() -> None:
    handles = plots.plot_last_episodes(study({"effect": 2})).legends[0].get_patches()
    looks = [(handle.get_facecolor(), handle.get_hatch()) for handle in handles]
    for part in zip(*looks, strict=True):
        assert len(set(part)) == 4


def test_a_study_without_episodes_has_empty_panels() -> None:
    results = study({"effect": 2})
    results = replace(results, episodes=results.episodes[:0])
    assert "of 0 episodes" in alt_text(plots.plot_last_episodes(results))


# Traps


CLIMBING, STUCK = [[400.0, 80.0], [300.0, 75.0]], [[50.0, 89.0], [1000.0, 1.0]]


def trapped(stuck: Mapping[str, int], quick: bool = False) -> StudyResults:
    """Return a study in which the first so many sets of a method never climb."""
    results = study(quick=quick)
    rows = [
        (method, seed, *motion)
        for method, seed in results.runs[["method", "seed"]].itertuples(index=False)
        if method != "sac"
        for motion in (STUCK if seed < stuck.get(method, 0) else CLIMBING)
    ]
    return replace(results, motions=pd.DataFrame(rows, columns=["method", "seed", "magnitude", "angle"]))


def marks(ax: Axes, method: str) -> np.ndarray:
    look = plots.method_style(method)
    (line,) = lines_like(ax, color=look.color, marker=look.marker)
    return line.get_xydata()


def test_each_run_stands_at_its_sets_trap_and_score() -> None:
    results = trapped({})
    figure = plots.plot_traps(results)
    (panel,) = figure.axes
    for method, traps in results.traps().groupby("method"):
        x, y = marks(panel, method).T
        np.testing.assert_allclose(x, 1000 * traps["trap"], rtol=0.03)  # moved a little apart
        assert y.tolist() == traps["score"].tolist()
        assert f"{plots.method_style(method).label}: median trap 45 mm, mean score" in alt_text(figure)
    assert plots.NO_WAY_UP not in [tick.get_text() for tick in panel.get_xticklabels()]
    assert "SAC" not in alt_text(figure)
    assert "[mm]" in panel.get_xlabel()
    assert plots.QUICK_BANNER in alt_text(plots.plot_traps(trapped({}, quick=True)))


def test_sets_that_never_climb_stand_apart_and_are_named_instead_of_measured() -> None:
    figure = plots.plot_traps(trapped({"effect": 2, "random": SEEDS["random"]}))
    (panel,) = figure.axes
    (border,) = lines_like(panel, linestyle=":")
    for method, stuck in (("effect", 2), ("random", SEEDS["random"]), ("uniform", 0)):
        assert (marks(panel, method)[:, 0] > border.get_xdata()[0]).sum() == stuck
    figure.draw_without_rendering()
    labels = {tick.get_loc(): tick.label1.get_text() for tick in panel.xaxis.get_major_ticks()}
    assert {x for x, text in labels.items() if text == plots.NO_WAY_UP} == {plots.ENDLESS}
    assert all(x <= border.get_xdata()[0] for x, text in labels.items() if text != plots.NO_WAY_UP)
    words = alt_text(figure)
    assert "effect-based: median trap 45 mm, with 2 of 8 sets no jump gets up, mean score" in words
    assert "random: with 6 of 6 sets no jump gets up, mean score" in words
    assert "600" not in words
    assert "inf" not in words


def test_some_of_the_scale_can_be_seen_where_no_set_climbs() -> None:
    (panel,) = plots.plot_traps(trapped(SEEDS)).axes
    low, high = panel.get_xlim()
    assert len([x for x in panel.get_xticks() if low <= x <= high]) > 2


def test_a_study_without_sets_has_no_traps_to_draw() -> None:
    with pytest.raises(ValueError, match="results must hold sets of motions, but sac has none"):
        plots.plot_traps(study({"sac": 2}))


# Bad input


@every_figure
def test_what_is_no_study_is_refused(draw) -> None:
    with pytest.raises(TypeError, match="results must be StudyResults, not DataFrame"):
        draw(study().runs)
    with pytest.raises(ValueError, match="axes must be"):
        draw(study(), **{list(inspect.signature(draw).parameters)[-1]: 3})


@pytest.mark.parametrize("draw", [plots.plot_learning_curves, plots.plot_learning_certainty, plots.plot_last_episodes])
def test_methods_must_be_some_of_the_study(draw) -> None:
    with pytest.raises(ValueError, match="a method must be one of 'effect', 'uniform', 'random', 'sac', not 'fixed'"):
        draw(study(), ["effect", "fixed"])
    with pytest.raises(ValueError, match="methods must name at least one of 'effect'"):
        draw(study(), [])
    with pytest.raises(TypeError, match="methods must be Iterable, not int"):
        draw(study(), 3)
    assert draw(study(), ["sac", "sac"]).axes[0].get_xlabel()


def test_an_improvement_needs_a_method_of_the_study_and_another() -> None:
    with pytest.raises(ValueError, match="method must be one of 'effect'"):
        plots.plot_improvement(study(), "fixed")
    with pytest.raises(ValueError, match="'effect' with, but it is the only one"):
        plots.plot_improvement(study({"effect": 6}))
