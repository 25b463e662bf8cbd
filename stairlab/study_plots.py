"""The figures of a learning study: figure 4 of the paper, and the modern reading of the same runs beside it.

The conventions are those of ``stairlab.plots``. Two more hold here.

- **A method looks the same everywhere**: one colour, marker and line for each (``method_style``).
- **A quick study says so in every figure**: its budgets are too small for the numbers to mean anything.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FixedLocator, LogLocator, MaxNLocator, NullLocator, PercentFormatter

from stairlab._validation import one_of
from stairlab.drawing import (
    COLORS,
    FAINT,
    GRID,
    INK,
    PATH,
    expect,
    figure_legend,
    finish,
    legend_below,
    make_axes,
    marker_handle,
)
from stairlab.estimates import Estimate
from stairlab.planning import GAPS
from stairlab.results import TOP_STEP, StudyResults

QUICK_BANNER = "QUICK STUDY: small budgets, the numbers say nothing"
LEARNING_STARTS = 3000
""" Jumps after which DQN begins to learn, where a study's settings say nothing else """
BLUE, GREEN = COLORS[1], COLORS[2]
CROWD = 4
""" Bands of more methods than this, over each other, cannot be read """
PANELS_IN_A_ROW = 4
ENDLESS = 2000 * GAPS[-1]
""" Where sets stand of which no motion climbs from any gap [mm] """
NO_WAY_UP = "no jump\ngets up"
RETURN = "greedy return [reward]"
STEPS = "samples and training steps [jumps]"
END_LOOKS: dict[str, dict[str, Any]] = {
    "top": {"label": "on the top", "facecolor": GREEN},
    "off": {"label": "off the map", "facecolor": COLORS[5], "hatch": "xxxx"},
    "stuck": {"label": "stuck: the last jumps change nothing", "facecolor": COLORS[4], "hatch": "////"},
    "other": {"label": "otherwise: time's up", "facecolor": "white", "hatch": "...."},
}
""" How the ends of ``StudyResults.ends`` are drawn """


class MethodStyle(NamedTuple):
    """How a method of a study is drawn, in every figure."""

    color: str
    marker: str
    line: str | tuple[float, Sequence[float]]
    label: str


_STYLES = {
    "effect": MethodStyle(COLORS[4], "o", "-", "effect-based"),
    "effect-reliable": MethodStyle(COLORS[3], "D", (0, (7, 1.5)), "effect-based, reliable"),
    "fixed": MethodStyle(COLORS[9], "P", (0, (5, 1.5, 1, 1.5)), "five a class"),
    "uniform": MethodStyle(COLORS[1], "s", (0, (4, 1.5)), "uniform"),
    "random": MethodStyle(COLORS[5], "^", (0, (6, 1.5, 1.5, 1.5)), "random"),
    "uniform-matched": MethodStyle(COLORS[0], "X", (0, (2, 1)), "uniform, same size"),
    "random-matched": MethodStyle(COLORS[8], "v", (0, (4, 1, 1, 1, 1, 1)), "random, same size"),
    "along-stairs": MethodStyle(COLORS[6], "h", ":", "along the stairs"),
    "uniform-shifted": MethodStyle(COLORS[1], "D", (0, (1, 1)), "uniform, shifted"),
    "uniform-no-corners": MethodStyle(COLORS[0], "H", (0, (3, 1, 1, 1)), "uniform, no corners"),
    "effect-plus-steep": MethodStyle(COLORS[4], "d", (0, (8, 2, 2, 2)), "effect-based and a steep one"),
    "authors": MethodStyle(INK, "p", (0, (9, 1, 1, 1)), "the authors' set"),
    "sac": MethodStyle(COLORS[2], "*", (0, (10, 1.5)), "SAC"),
}
_OWN_COLORS = (COLORS[7], INK, "#777777")
_OWN_MARKERS = ("<", ">", "p", "h")
_OWN_LINES: tuple[str | tuple[float, Sequence[float]], ...] = (":", (0, (3, 1, 1, 1)), (0, (9, 1, 1, 1)))


def method_style(method: str, methods: Iterable[str] = ()) -> MethodStyle:
    """Return how a method is drawn.

    Parameters
    ----------
    method : str
        A method of the study, or the name of a set of one's own.
    methods : iterable of str
        All methods of the study: sets of one's own get the looks that are left, in this order.

    Returns
    -------
    MethodStyle
        Colour, marker, line and label.
    """
    if method in _STYLES:
        return _STYLES[method]
    own = [name for name in methods if name not in _STYLES]
    place = own.index(method) if method in own else 0
    color, marker = _OWN_COLORS[place % len(_OWN_COLORS)], _OWN_MARKERS[place % len(_OWN_MARKERS)]
    return MethodStyle(color, marker, _OWN_LINES[place % len(_OWN_LINES)], method)


# Figure 4


def plot_learning_curves(
    results: StudyResults, methods: str | Sequence[str] | None = None, ax: Axes | None = None
) -> Figure:
    """Draw how the agents learn: mean over seeds and its standard deviation (figure 4 of the paper).

    The standard deviation is a band around the mean; of more than four methods, it stands at the right for the end of training, since
    so many bands over each other cannot be read.

    Each curve begins after the samples that its set was made from. Figure 4 (a) has the methods effect, uniform and random,
    (b) has sac and effect. The blue line is where DQN begins to learn with the sets that are made without samples, the red one the
    same after the samples of the effect-based sets, the green one the highest return that any seed of SAC had in an evaluation.

    Parameters
    ----------
    results : StudyResults
        The study.
    methods : str or sequence of str, optional
        What to draw; all methods of the study by default.
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    matplotlib Figure
    """
    chosen = _chosen(results, methods)
    (panel,) = make_axes(ax, 1, (8.0, 5.0 + 0.1 * len(chosen)))
    words = [_draw_mean(panel, results, method, place, len(chosen)) for place, method in enumerate(chosen)]
    words += _draw_starts(panel, results, chosen)
    if "sac" in results.methods:
        best = float(results.curves("sac").to_numpy().max())
        panel.axhline(
            best, color=GREEN, linestyle="--", linewidth=1.4, zorder=2, label=f"highest return of SAC: {best:.3g}"
        )
        words.append(f"a green line at {best:.3g}, the highest return of SAC")
    panel.set(xlabel=STEPS, ylabel=RETURN)
    panel.set_xlim(left=0)
    _tidy(panel)
    if len(chosen) > CROWD:
        _draw_spreads(panel, results, chosen)
    legend_below(panel, ncols=3, handlelength=3.2)
    return _done([panel], results, f"Mean greedy return against training steps. {'; '.join(words)}.")


def _draw_mean(ax: Axes, results: StudyResults, method: str, place: int, count: int) -> str:
    curves = results.curves(method)
    x, mean, sd = curves.index + results.shift(method), curves.mean(axis=1), curves.std(axis=1, ddof=1)
    look = method_style(method, results.methods)
    ax.plot(x, mean, label=look.label, zorder=4, **_line(look, len(x), place / count))
    if count <= CROWD:
        ax.fill_between(x, mean - sd, mean + sd, color=look.color, alpha=0.18, linewidth=0.6, zorder=1)
    spread = f", standard deviation {sd.iloc[-1]:.1f}" if len(curves.columns) > 1 else ""
    return (
        f"{look.label} ({_seeds(curves)}): at the end {mean.iloc[-1]:.1f}{spread}, at most {mean.max():.1f} after "
        f"{x[mean.argmax()]:,} samples and steps"
    )


def _draw_spreads(ax: Axes, results: StudyResults, methods: Sequence[str]) -> None:
    """Draw the standard deviations at the end of training side by side, at the right of the curves."""
    curves = [results.curves(method) for method in methods]
    end = max(table.index[-1] + results.shift(method) for method, table in zip(methods, curves, strict=True))
    for place, (method, table) in enumerate(zip(methods, curves, strict=True), 1):
        look = method_style(method, results.methods)
        x, mean, sd = end * (1 + 0.02 * place), table.iloc[-1].mean(), table.iloc[-1].std(ddof=1)
        ax.plot([x, x], [mean - sd, mean + sd], color=look.color, linewidth=2, zorder=3)
        ax.plot(x, mean, zorder=4, **(_line(look, 1) | {"linestyle": "none"}))
    label = "standard deviation at the end, at the right"
    ax.plot([], [], "|", color=INK, markersize=11, markeredgewidth=2, label=label)
    ax.set_xlim(right=end * (1 + 0.02 * (len(methods) + 1)))
    ax.set_xticks([tick for tick in ax.get_xticks() if tick <= end])


def _draw_starts(ax: Axes, results: StudyResults, methods: Sequence[str]) -> list[str]:
    """Draw where the DQNs among these methods begin to learn: at once, or after the samples of their sets."""
    starts = int(results.description["settings"].get("dqn", {}).get("learning_starts", LEARNING_STARTS))
    lines = []
    for shift in sorted({results.shift(method) for method in methods if method != "sac"}):
        if shift:
            lines.append((starts + shift, PATH, "red", f"DQN begins after {shift:,} samples: {starts + shift:,}"))
        else:
            lines.append((starts, BLUE, "blue", f"DQN begins to learn: {starts:,}"))
    for x, color, _, label in lines:
        ax.axvline(x, color=color, linestyle="--", linewidth=1.4, zorder=2, label=label)
    return [f"a {name} line at {x:,}: {label.partition(':')[0]}" for x, _, name, label in lines]


# The modern reading


def plot_learning_certainty(
    results: StudyResults, methods: str | Sequence[str] | None = None, axes: Axes | Sequence[Axes] | None = None
) -> Figure:
    """Draw how sure the curves are: interquartile mean with its 95 % bootstrap interval, and every seed's curve.

    Parameters
    ----------
    results : StudyResults
        The study. With five seeds or fewer there is no interval.
    methods : str or sequence of str, optional
        What to draw, a panel for each; all methods of the study by default.
    axes : matplotlib Axes or a sequence of them, optional
        One for each method; a new figure by default.

    Returns
    -------
    matplotlib Figure
    """
    chosen = _chosen(results, methods)
    panels = _small_multiples(axes, len(chosen), 2.5)
    drawn = [_draw_certainty(panel, results, name) for panel, name in zip(panels, chosen, strict=True)]
    _share_limits(panels)
    _label_outside(panels, STEPS, RETURN, own=axes is None)
    handles: list[Any] = [
        Line2D([], [], color=INK, linewidth=2, label="interquartile mean over seeds"),
        Line2D([], [], color=FAINT, linewidth=0.8, label="every seed"),
    ]
    if any(estimated for estimated, _ in drawn):
        handles.insert(1, Patch(color=INK, alpha=0.25, linewidth=0, label="95 % bootstrap interval"))
    if any(_best_returns(results, method).size for method in chosen):
        allowed = "best return found by search, a lower bound (mean)"
        handles.append(Line2D([], [], color=INK, linestyle=":", linewidth=1.8, label=allowed))
    _shared_legend(panels[0], handles, ncols=4 if len(chosen) > 2 else 2)
    words = "; ".join(text for _, text in drawn)
    return _done(panels, results, f"Interquartile mean of the greedy return against training steps. {words}.")


def _draw_certainty(ax: Axes, results: StudyResults, method: str) -> tuple[bool, str]:
    """Draw a method; return whether there is an interval, and what is shown in words."""
    curves, iqm = results.curves(method), results.iqm_curve(method)
    x, look = curves.index + results.shift(method), method_style(method, results.methods)
    ax.plot(x, curves.to_numpy(), color=FAINT, linewidth=0.7, alpha=0.55, zorder=1)
    estimated = bool(iqm["low"].notna().all())
    if estimated:
        ax.fill_between(x, iqm["low"], iqm["high"], color=look.color, alpha=0.3, linewidth=0, zorder=2)
    ax.plot(x, iqm["iqm"], zorder=4, **(_line(look, len(x)) | {"linestyle": "-", "linewidth": 2.0}))
    ax.set_title(f"{look.label} ({_seeds(curves)})", fontsize=10)
    best = _best_returns(results, method)
    if best.size:
        ax.axhline(best.mean(), color=INK, linestyle=":", linewidth=1.8, zorder=3)
    _tidy(ax)
    end = Estimate(*iqm.iloc[-1])
    allowed = f"; its sets allow {best.mean():.1f} on average" if best.size else ""
    return estimated, f"{look.label} ({_seeds(curves)}): {end} at the end{allowed}"


def plot_study_scores(results: StudyResults, ax: Axes | None = None) -> Figure:
    """Draw each seed's score, the interquartile mean with its 95 % interval, and what the sets would allow.

    Parameters
    ----------
    results : StudyResults
        The study. With five seeds or fewer there is no interval.
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    matplotlib Figure
    """
    methods = _chosen(results, None)
    (panel,) = make_axes(ax, 1, (8.0, 1.9 + 0.56 * len(methods)))
    estimates = [results.iqm_score(method) for method in methods]
    words = []
    for row, (method, estimate) in enumerate(zip(methods, estimates, strict=True)):
        look, scores, best = method_style(method, methods), results.scores(method), _best_returns(results, method)
        _draw_estimate(panel, row, estimate, look)
        seeds = row + 0.25 + 0.2 * _jitter(len(scores))
        panel.plot(scores, seeds, look.marker, color=look.color, markersize=_size(look, 5), alpha=0.6,
                   markeredgewidth=0, zorder=3)  # fmt: skip
        panel.plot(best, np.full(best.size, row - 0.3), "|", color=FAINT, markersize=7, zorder=3)
        if best.size:
            panel.plot(best.mean(), row - 0.3, "v", zorder=4, **_OPEN)
        allowed = f", its sets allow {best.mean():.1f} on average" if best.size else ""
        words.append(f"{look.label} {estimate}, seeds from {scores.min():.1f} to {scores.max():.1f}{allowed}")
    names = [f"{method_style(name, methods).label} ({len(results.scores(name))})" for name in methods]
    _rows(panel, names, "score: mean greedy return of the last evaluations [reward]")
    panel.margins(x=0.03)
    handles = [
        marker_handle(INK, "o", "a seed's score", markersize=5, alpha=0.6),
        marker_handle(INK, "o", f"interquartile mean over seeds{_with_interval(estimates)}", markersize=9),
    ]
    if any(_best_returns(results, method).size for method in methods):
        words_for_bound = "best return found by search for a seed's set (lower bound)"
        handles.append(marker_handle(FAINT, "|", words_for_bound, markersize=8, markeredgewidth=1))
        handles.append(marker_handle(INK, "v", "mean of these", **_OPEN))
    _shared_legend(panel, handles, ncols=2)
    return _done([panel], results, f"Scores by method, interquartile mean over seeds. {'; '.join(words)}.")


def plot_improvement(results: StudyResults, method: str = "effect", ax: Axes | None = None) -> Figure:
    """Draw how probable it is that a run of one method scores higher than one of each other method.

    Parameters
    ----------
    results : StudyResults
        The study, of two methods or more. With five seeds or fewer there is no interval.
    method : str
        The method that is compared with the others.
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    matplotlib Figure
    """
    methods = _chosen(results, None)
    one_of("method", method, methods)
    others = [name for name in methods if name != method]
    if not others:
        raise ValueError(f"results must hold a method to compare {method!r} with, but it is the only one.")
    (panel,) = make_axes(ax, 1, (8.0, 1.4 + 0.5 * len(others)))
    estimates = [results.probability_of_improvement(method, name) for name in others]
    for row, (name, estimate) in enumerate(zip(others, estimates, strict=True)):
        _draw_estimate(panel, row, estimate, method_style(name, methods))
    panel.axvline(0.5, color=INK, linestyle="--", linewidth=1.2, zorder=1)
    mine = method_style(method, methods).label
    names = [f"than {method_style(name, methods).label}" for name in others]
    _rows(panel, names, f"probability that a run of {mine} scores higher{_with_interval(estimates)} [%]")
    panel.set_xlim(-0.02, 1.02)
    panel.xaxis.set_major_formatter(PercentFormatter(1, symbol=""))
    for x, side, text in ((0.48, "right", "← the other is ahead"), (0.52, "left", f"{mine} is ahead →")):
        panel.annotate(text, (x, 1), (0, 3), ("data", "axes fraction"), "offset points", ha=side, fontsize=9)
    words = "; ".join(f"{name} {_percent(estimate)}" for name, estimate in zip(names, estimates, strict=True))
    return _done([panel], results, f"Probability that a run of {mine} scores higher: {words}. A line marks 50 %.")


def _percent(estimate: Estimate) -> str:
    value, low, high = (100 * number for number in estimate)
    return f"{value:.0f} %" + ("" if np.isnan(low) else f" [{low:.0f}, {high:.0f}]")


# What the agents end up doing


def plot_last_episodes(
    results: StudyResults, methods: str | Sequence[str] | None = None, axes: Axes | Sequence[Axes] | None = None
) -> Figure:
    """Draw where the trained agents' last greedy episodes end: on which step, and whether on the top, off the map or stuck.

    Stuck is an agent whose last five jumps each move the cube by less than 1 mm; in the tumbling world, whose last ten jumps leave it
    on its step. See ``StudyResults.ends``.

    Parameters
    ----------
    results : StudyResults
        The study.
    methods : str or sequence of str, optional
        What to draw, a panel for each; all methods of the study by default.
    axes : matplotlib Axes or a sequence of them, optional
        One for each method; a new figure by default.

    Returns
    -------
    matplotlib Figure
    """
    chosen = _chosen(results, methods)
    panels = _small_multiples(axes, len(chosen), 2.4)
    ends = results.ends().reindex(columns=["method", "step", "end"])
    words = []
    for panel, method in zip(panels, chosen, strict=True):
        words.append(_draw_ends(panel, ends[ends["method"] == method], method_style(method, results.methods).label))
    _share_limits(panels)
    for panel in panels:
        panel.set_ylim(top=1.05 * panel.get_ylim()[1])
        panel.set(xlim=(-0.7, TOP_STEP + 0.7), xticks=range(0, TOP_STEP + 1, 5))
        panel.yaxis.set_major_locator(MaxNLocator(integer=True, nbins=5))
    _label_outside(panels, "the last jump ends on step [number]", "episodes [count]", own=axes is None)
    handles: list[Any] = [Patch(edgecolor=INK, linewidth=0.6, **look) for look in END_LOOKS.values()]
    _shared_legend(panels[0], handles, ncols=2 if len(chosen) > 1 else 1)
    return _done(panels, results, f"Where the last greedy episodes end. {'; '.join(words)}.")


def _draw_ends(ax: Axes, ends: pd.DataFrame, label: str) -> str:
    bottom = np.zeros(TOP_STEP + 1)
    for end, look in END_LOOKS.items():
        counts = np.bincount(ends.loc[ends["end"] == end, "step"].astype(int), minlength=len(bottom))
        there = np.flatnonzero(counts)
        ax.bar(there, counts[there], 0.8, bottom[there], edgecolor=INK, linewidth=0.6, **look)
        bottom += counts
    top, off, stuck = (int((ends["end"] == end).sum()) for end in ("top", "off", "stuck"))
    ax.set_title(f"{label}\n{top} of {len(ends)} on top, {off} off the map", fontsize=10)
    ax.spines[["top", "right"]].set_visible(False)
    median = f", median step {ends['step'].median():g}" if len(ends) else ""
    return f"{label}: of {len(ends)} episodes {top} on the top, {off} off the map, {stuck} stuck{median}"


def plot_traps(results: StudyResults, ax: Axes | None = None) -> Figure:
    """Draw the score of each run against the width of its set's trap: the gap to a riser below which no motion of the set climbs.

    Sets of which no motion climbs from any gap have a trap without end. They stand apart at the right edge, behind a line.

    Parameters
    ----------
    results : StudyResults
        The study, with a set of motions at least; methods without sets are left out.
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    matplotlib Figure
    """
    methods = _chosen(results, None)
    traps = results.traps()
    if traps.empty:
        raise ValueError(f"results must hold sets of motions, but {', '.join(methods)} has none.")
    (panel,) = make_axes(ax, 1, (8.0, 5.0))
    words, handles = [], []
    for method in [name for name in methods if name in set(traps["method"])]:
        look, rows = method_style(method, methods), traps[traps["method"] == method]
        width = 1000 * rows["trap"].clip(GAPS[0]).to_numpy()
        nudged = width.clip(max=ENDLESS) * 1.06 ** _jitter(len(width))  # equal sets have equal traps
        panel.plot(nudged, rows["score"], look.marker, color=look.color, markersize=_size(look, 6), alpha=0.75,
                   markeredgecolor="white", markeredgewidth=0.5)  # fmt: skip
        handles.append(marker_handle(look.color, look.marker, look.label, markersize=_size(look, 7)))
        words.append(f"{look.label}: {_trap_words(width)}, mean score {rows['score'].mean():.1f}")
    panel.set(
        xscale="log",
        ylabel="score [reward]",
        xlabel="trap: gap to the riser below which no motion of the set climbs [mm]",
    )
    panel.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    panel.xaxis.set_major_formatter("{x:g}")
    panel.xaxis.set_minor_locator(NullLocator())
    if np.isinf(traps["trap"]).any():
        _draw_endless(panel)
    panel.set_axisbelow(True)
    panel.grid(color=GRID)
    panel.spines[["top", "right"]].set_visible(False)
    _shared_legend(panel, handles, ncols=min(len(handles), 4))
    return _done([panel], results, f"Score against the width of the trap. {'; '.join(words)}.")


def _draw_endless(ax: Axes) -> None:
    """Set the place of sets that never climb apart from the scale, at its right edge."""
    ax.axvline(ENDLESS / 2**0.5, color=INK, linestyle=":", linewidth=1.2)
    ax.set_xlim(min(ax.get_xlim()[0], ENDLESS / 6), 1.25 * ENDLESS)  # some of the scale can always be seen
    ticks = [tick for tick in ax.get_xticks() if tick <= 1000 * GAPS[-1]]
    ax.xaxis.set_major_locator(FixedLocator([*ticks, ENDLESS]))
    ax.xaxis.set_major_formatter(lambda x, _: f"{x:g}" if x < ENDLESS else NO_WAY_UP)


def _trap_words(width: np.ndarray) -> str:
    median, endless = np.median(width), int(np.isinf(width).sum())
    words = [f"median trap {median:.0f} mm"] if np.isfinite(median) else []
    if endless:
        words.append(f"with {endless} of {len(width)} sets {' '.join(NO_WAY_UP.split())}")
    return ", ".join(words)


# What all of them use


_OPEN: dict[str, Any] = {"markerfacecolor": "none", "markeredgecolor": INK, "markeredgewidth": 1, "markersize": 6}


def _chosen(results: StudyResults, methods: str | Sequence[str] | None) -> list[str]:
    """Return the methods to draw, each once."""
    study = expect("results", results, StudyResults).methods
    if methods is None:
        return study
    given = [methods] if isinstance(methods, str) else list(expect("methods", methods, Iterable))
    if not given:
        raise ValueError(f"methods must name at least one of {', '.join(map(repr, study))}, but it is empty.")
    return list(dict.fromkeys(one_of("a method", name, study) for name in given))


def _best_returns(results: StudyResults, method: str) -> np.ndarray:
    """Return what each seed's set allows, as far as there was a search."""
    runs = results.runs[results.runs["method"] == method]
    return pd.to_numeric(runs["best_return"]).dropna().to_numpy(dtype=float)


def _seeds(curves: pd.DataFrame) -> str:
    count = len(curves.columns)
    return f"{count} seed{'s'[: count != 1]}"


def _line(look: MethodStyle, points: int, phase: float = 0.0) -> dict[str, Any]:
    """Return how a curve is drawn: with some markers, at other places than those of other curves."""
    every = max(1, points // 7)
    return {
        "color": look.color,
        "linestyle": look.line,
        "linewidth": 1.7,
        "marker": look.marker,
        "markersize": _size(look, 6),
        "markeredgecolor": "white",
        "markeredgewidth": 0.6,
        "markevery": (int(phase * every), every),
    }


def _size(look: MethodStyle, points: float) -> float:
    """Return the size of a marker: a star needs more to look as large as others."""
    return 1.4 * points if look.marker == "*" else points


def _jitter(count: int) -> np.ndarray:
    """Return ``count`` places from -0.5 to 0.5 that look random, and are the same each time: steps of the golden ratio."""
    return (np.arange(count) * (5**0.5 - 1) / 2 + 0.5) % 1 - 0.5


def _draw_estimate(ax: Axes, row: int, estimate: Estimate, look: MethodStyle) -> None:
    if not np.isnan(estimate.low):
        ax.plot([estimate.low, estimate.high], [row, row], color=look.color, linewidth=3.5, alpha=0.7, zorder=4)
    ax.plot(estimate.value, row, look.marker, color=look.color, markersize=_size(look, 9), markeredgecolor=INK,
            markeredgewidth=0.8, zorder=5)  # fmt: skip


def _with_interval(estimates: Sequence[Estimate]) -> str:
    return ", with 95 % interval" if any(not np.isnan(estimate.low) for estimate in estimates) else ""


def _rows(ax: Axes, names: Sequence[str], xlabel: str) -> None:
    """Make axes of rows, from top to bottom."""
    ax.set_yticks(range(len(names)), names)
    ax.set(ylim=(len(names) - 0.45, -0.55), xlabel=xlabel)
    ax.set_axisbelow(True)
    ax.grid(axis="x", color=GRID)
    for between in range(1, len(names)):
        ax.axhline(between - 0.5, color=GRID, linewidth=0.8, zorder=0)
    ax.spines[["top", "right", "left"]].set_visible(False)
    ax.tick_params(axis="y", length=0)


def _tidy(ax: Axes) -> None:
    ax.xaxis.set_major_formatter("{x:,.0f}")
    ax.yaxis.set_major_locator(MaxNLocator(8, steps=[1, 2, 5, 10]))
    ax.set_axisbelow(True)
    ax.grid(axis="y", color=GRID)
    ax.spines[["top", "right"]].set_visible(False)


def _columns(count: int) -> int:
    """Return how many panels stand in a row, so that the last row is not much shorter than the others."""
    return math.ceil(count / math.ceil(count / PANELS_IN_A_ROW))


def _shared_legend(ax: Axes, handles: list[Any], ncols: int) -> None:
    """Draw one legend below all panels, its words a little off those handles that fill their place."""
    for handle in handles:
        handle.set_label(f" {handle.get_label()}")
    figure_legend(ax, handles, "lower center", ncols)


def _small_multiples(axes: Any, count: int, height: float) -> list[Axes]:
    columns, rows = _columns(count), math.ceil(count / _columns(count))
    return make_axes(axes, count, (max(3.0 * columns + 0.4, 6.0), height * rows + 1.1), columns)


def _share_limits(panels: Sequence[Axes]) -> None:
    """Give all panels the limits that hold 0 and what each of them shows."""
    x, y = (np.array([getattr(panel, f"get_{name}lim")() for panel in panels]) for name in "xy")
    for panel in panels:
        panel.set(xlim=(0, x.max()), ylim=(min(0.0, y.min()), y.max()))


def _label_outside(panels: Sequence[Axes], xlabel: str, ylabel: str, own: bool) -> None:
    """Name the axes: in a grid of our own only of those at its left and its lower edge."""
    columns = _columns(len(panels))
    for place, panel in enumerate(panels):
        if not own or place + columns >= len(panels):
            panel.set_xlabel(xlabel)
        else:
            panel.tick_params(labelbottom=False)
        if not own or place % columns == 0:
            panel.set_ylabel(ylabel)
        else:
            panel.tick_params(labelleft=False)


def _done(panels: Sequence[Axes], results: StudyResults, alt: str) -> Figure:
    """Return the figure with its alternative text, marked if the study is a quick one."""
    if not results.quick:
        return finish(panels[0], alt)
    figure = panels[0].figure
    title = figure.get_suptitle()
    if QUICK_BANNER not in title:
        look: dict[str, Any] = {} if title else {"fontsize": 10, "fontweight": "bold", "color": PATH}
        figure.suptitle(f"{title}\n{QUICK_BANNER}".strip(), **look)
    return finish(panels[0], f"{QUICK_BANNER}. {alt}")
