"""Figures and helpers of lesson 02: what random exploring finds, and how many jumps are enough."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from stairlab.course import budget
from stairlab.drawing import (
    COLORS,
    FAINT,
    GRID,
    INK,
    OFF_MAP,
    PATH,
    figure_legend,
    finish,
    make_axes,
    marker_handle,
    new_figure,
)
from stairlab.plots import UNITS, ClassStyle, class_style, draw_cube, draw_stairs, pose
from stairlab.sampling import Samples, sample_motions
from stairlab.world import FEATURES, Jump, StairWorld

OUTCOMES = ("off the map", "0 steps", "1 step", "2 steps", "3 steps", "4 steps")
""" What a jump from the start pose can come to, on four steps """
PUBLISHED_OUTCOMES = (1714, 6329, 769, 584, 455, 149)
""" The same of the 10,000 jumps that the authors published """
JUMPS = 2000
""" The paper's number of samples """
DY_BIN = 0.05
""" Width of a bin of the widget's histogram [m] """
SEEN = (1.75, 3.4)
""" Height and length of what a turn of the loop shows of the stairs [m] """
LEAST_GAP = 0.02
""" Between the effects of thousands of jumps, a wider hole is not chance [m] """


@lru_cache(maxsize=16)
def samples_of(seed: int) -> Samples:
    """Return 2,000 uniform jumps from the start pose, simulated once in a session for each seed; fewer with ``STAIRLAB_FAST``."""
    return sample_motions(StairWorld(), n=budget(JUMPS, 500), seed=seed, progress=False)


def outcomes_of(samples: Samples, rise: float = 0.3) -> np.ndarray:
    """Return the outcome of each jump, shape (n_samples,), int: steps gained, or -1 off the map (``rise`` in metres)."""
    steps = np.round(samples.effect("dz")[:, 0] / rise).astype(int)
    return np.where(samples.on_map, steps, -1)


def outcome_counts(samples: Samples) -> np.ndarray:
    """Return how many jumps came to each of ``OUTCOMES``, shape (6,), int."""
    return np.bincount(outcomes_of(samples) + 1, minlength=len(OUTCOMES))


def outcome_style(outcome: int) -> ClassStyle:
    """Return colour and marker of an outcome; later lessons give them to the classes of effects that climb as high."""
    return class_style(outcome + 2) if outcome >= 0 else ClassStyle(OFF_MAP, ".")


def holes_between(values: np.ndarray, least: float = LEAST_GAP) -> np.ndarray:
    """Return the holes of at least ``least`` [m] between sorted values: where each begins and ends, shape (n_holes, 2) [m]."""
    ordered = np.sort(values)
    wide = np.diff(ordered) >= least
    return np.column_stack([ordered[:-1][wide], ordered[1:][wide]])


def plot_state_change(jump: Jump) -> Figure:
    """Draw the eight features of the state before and after a jump, and the effect, their difference (equation 1)."""
    figure, ax = new_figure(
        f"Eight features before and after a jump with {jump.magnitude:.0f} N at {jump.angle:.0f}°. Effects: "
        + ", ".join(f"{name} {change:+.2f}" for name, change in zip(FEATURES, jump.effect, strict=True))
        + ".",
        size=(7.2, 3.6),
    )
    shown = np.clip([jump.start, jump.end], -1.2, 2.6)  # d_obs = 10 stands for "none"
    for row, (before, after) in enumerate(shown.T.tolist()):
        ax.plot([before, after], [row, row], color=FAINT, linewidth=2, zorder=1)
        ax.plot(before, row, "o", color="white", markeredgecolor=INK, markersize=8, zorder=3)
        ax.plot(after, row, "D", color=COLORS[4], markersize=6, zorder=2 if abs(after - before) > 0.02 else 4)
        ax.text(4.3, row, f"{jump.effect[row]:+.2f}", va="center", ha="right", color=PATH)
        if jump.end[row] != after:
            ax.text(after + 0.1, row, "10: none ahead", va="center", ha="left", fontsize=9, color="#5f5f5f")
    ax.text(4.3, -0.9, "effect", ha="right", va="center", color=PATH)
    units = ["m"] * 3 + ["no unit"] * 4 + ["m"]
    ax.set_yticks(range(8), [f"{name} [{unit}]" for name, unit in zip(FEATURES, units, strict=True)])
    ax.set(xlim=(-1.3, 4.4), ylim=(7.6, -1.3), xlabel="value of the feature [its unit]")
    ax.set_xticks([-1, 0, 1, 2])
    ax.grid(axis="x", color=GRID, zorder=0)
    handles = [
        marker_handle("white", "o", "s, before", markeredgecolor=INK, markeredgewidth=1),
        marker_handle(COLORS[4], "D", "s', after"),
    ]
    figure_legend(ax, handles, "upper center", ncols=2)
    return figure


def plot_motions(sets: Mapping[str, np.ndarray] | np.ndarray, size: float = 14, ax: Axes | None = None) -> Figure:
    """Draw motions in motion space.

    Parameters
    ----------
    sets : ndarray of shape (n, 2), or a mapping of names to such arrays
        Magnitude [N] and angle [deg] of each motion; named sets are drawn over each other, with different marks.
    size : float
        Size of the marks [points²]; later sets have hollow, larger ones.
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    matplotlib Figure
    """
    named = dict(sets) if isinstance(sets, Mapping) else {"": np.asarray(sets)}
    words = "; ".join(f"{name or 'motions'}: {len(motions)}" for name, motions in named.items())
    (panel,) = make_axes(ax, 1, (6.4, 3.8))
    panel.spines[["top", "right"]].set_visible(False)
    looks = (("o", COLORS[1], COLORS[1], 1.0), ("s", "none", PATH, 6.0), ("D", "none", INK, 10.0))
    for place, (name, motions) in enumerate(named.items()):
        marker, face, edge, larger = looks[place % len(looks)]
        look: dict[str, Any] = {"marker": marker, "facecolor": face, "edgecolor": edge, "label": name}
        line = 0.0 if face != "none" else 1.1
        panel.scatter(motions[:, 0], motions[:, 1], s=size * larger, linewidths=line, **look)
    _motion_axes(panel)
    if len(named) > 1:
        panel.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=len(named), frameon=False, fontsize=9)
    return finish(panel, f"Scatter plot of motions, angle against magnitude. {words}.")


def _motion_axes(ax: Axes) -> None:
    labels = [f"{name} [{unit}]" for name, unit in UNITS.items()]
    ax.set(xlim=(20, 1030), ylim=(-3, 93), yticks=range(0, 91, 15), xlabel=labels[0], ylabel=labels[1])


def plot_sampling_step(jumps: Sequence[Jump], step: int) -> Figure:
    """Draw one turn of Algorithm 1's loop: the motion drawn, with those before it, and the jump that it brings about.

    Parameters
    ----------
    jumps : sequence of Jump
        The jumps of all turns, made with ``trajectory=True``.
    step : int
        Which turn to draw, from 0.

    Returns
    -------
    matplotlib Figure
    """
    jump = jumps[step]
    words = (
        f"Turn i = {step} of the loop: {jump.magnitude:.0f} N at {jump.angle:.0f}°, effect Δy = {jump.dy:+.2f} m, "
        f"Δz = {round(jump.dz, 2) + 0.0:+.2f} m{'' if jump.on_map else ', off the map'}. {step + 1} stored."
    )
    figure, (left, right) = new_figure(words, panels=2, size=(10.5, 3.3), columns=2)
    left.get_gridspec().set_width_ratios([1, 1.7])
    motions = np.array([[one.magnitude, one.angle] for one in jumps[: step + 1]])
    left.scatter(*motions[:-1].T, s=40, color=FAINT)
    left.scatter(*motions[-1:].T, s=110, color=COLORS[4], marker="D", zorder=3)
    _motion_axes(left)
    left.set_title(f"i = {step}: {step + 1} in Ω", fontsize=10, loc="left")
    draw_stairs(right, StairWorld().staircase, *SEEN)
    right.set_xlim(-0.1, SEEN[1] + 0.2)
    if jump.trajectory is not None:
        right.plot(jump.trajectory.y, jump.trajectory.z, color=PATH, zorder=3)
    draw_cube(right, *pose(jump.start), facecolor="white")
    draw_cube(right, *pose(jump.end))
    effect = f"$e_{step}$: Δy = {jump.dy:+.2f} m, Δz = {round(jump.dz, 2) + 0.0:+.2f} m"
    right.set_title(effect + ("" if jump.on_map else " (off the map)"), fontsize=10, loc="left")
    return figure


def plot_explored(samples: Samples) -> Figure:
    """Draw motions in motion space, by outcome: off the map, or so many steps up."""
    counts = outcome_counts(samples)
    words = ", ".join(f"{name} {count}" for name, count in zip(OUTCOMES, counts, strict=True))
    figure, ax = new_figure(
        f"Scatter plot of {len(samples)} motions, angle against magnitude, by outcome: {words}.", size=(7.6, 4.4)
    )
    _scatter_outcomes(ax, samples, *samples.motions.T)
    _motion_axes(ax)
    _outcome_legend(ax, counts)
    return figure


def plot_ends(samples: Samples) -> Figure:
    """Draw where the cubes come to rest, on the stairs, by outcome; jumps off the map are left out."""
    kept = samples.on_the_map()
    places = kept.starts[:, 1:3] + kept.effects[:, 1:3]
    counts = outcome_counts(samples)
    words = ", ".join(f"{name} {count}" for name, count in zip(OUTCOMES[1:], counts[1:], strict=True))
    figure, ax = new_figure(f"The stairs from the side, a mark where each of {len(kept)} cubes came to rest: {words}.",
                            size=(7.6, 4.4))  # fmt: skip
    draw_stairs(ax, StairWorld().staircase, 1.55, 2.2)
    jitter = np.random.default_rng(0).uniform(0, 0.09, len(kept))  # else all marks of a tread lie on a line
    _scatter_outcomes(ax, kept, places[:, 0], places[:, 1] + jitter)
    draw_cube(ax, *pose(kept.starts[0]), facecolor="none")
    _outcome_legend(ax, counts, first=1)
    return figure


def plot_effect_plane(samples: Samples) -> Figure:
    """Draw the effects of the jumps that stayed on the map: the height gained against the distance gained, by outcome."""
    kept = samples.on_the_map()
    dy, dz = kept.effect("dy", "dz").T
    figure, ax = new_figure(
        f"Scatter plot of {len(kept)} effects, height gained against distance gained: five level rows at 0 to 1.2 m.",
        size=(7.6, 3.8),
    )
    _scatter_outcomes(ax, kept, dy, dz)
    ax.set(xlabel="effect Δy [m]", ylabel="effect Δz [m]", yticks=[0, 0.3, 0.6, 0.9, 1.2])
    ax.grid(axis="y", color=GRID, zorder=0)
    _outcome_legend(ax, outcome_counts(samples), first=1)
    return figure


def _scatter_outcomes(ax: Axes, samples: Samples, x: np.ndarray, y: np.ndarray) -> None:
    outcomes = outcomes_of(samples)
    for outcome in range(-1, 5):
        color, marker = outcome_style(outcome)
        chosen = outcomes == outcome
        ax.scatter(x[chosen], y[chosen], s=5 if outcome < 0 else 15, color=color, marker=marker, linewidths=0, zorder=5)


def _outcome_legend(ax: Axes, counts: np.ndarray, first: int = 0) -> None:
    handles = [
        marker_handle(*outcome_style(place - 1), f"{OUTCOMES[place]} ({counts[place]})")
        for place in range(first, len(OUTCOMES))
    ]
    figure_legend(ax, handles, "lower center", ncols=6 - first)


def plot_all_effects(samples: Samples) -> Figure:
    """Draw a small histogram of each of the eight effect dimensions, of the jumps that stayed on the map."""
    kept = samples.on_the_map()
    spans = {name: np.ptp(kept.effect(name)) for name in kept.effect_names}
    still = [name for name, span in spans.items() if span < 1e-12]
    figure, axes = new_figure(
        f"Histograms of eight effect dimensions of {len(kept)} jumps. Always 0: {', '.join(still) or 'none'}. The others spread over "
        + ", ".join(f"{name} {span:.2f}" for name, span in spans.items() if name not in still)
        + ".",
        panels=8,
        size=(10.0, 4.6),
        columns=4,
    )
    for place, (ax, name) in enumerate(zip(axes, kept.effect_names, strict=True)):
        values = kept.effect(name)[:, 0]
        span = max(np.ptp(values), 0.2)
        middle = (values.min() + values.max()) / 2
        edges = np.linspace(middle - 0.55 * span, middle + 0.55 * span, 60)
        ax.hist(values, edges, color=FAINT if name in still else COLORS[1])
        ax.set(yscale="log", ylim=(0.7, 3000))
        ax.set_title(f"{name}{': always 0' if name in still else ''}", fontsize=10, loc="left")
        ax.yaxis.set_major_formatter("{x:.0f}")
        ax.minorticks_off()
        ax.set_xlabel("[no unit]" if name[1] == "q" else "[m]")
        if place % 4 == 0:
            ax.set_ylabel("jumps (log.)")
    return figure


def plot_bins(values: np.ndarray, width: float, name: str = "Δy") -> Figure:
    """Draw the histogram of an effect with bins of a given width, and say how many hold something.

    Parameters
    ----------
    values : ndarray of shape (n,)
        The effects [m].
    width : float
        Width of a bin [m].
    name : str
        What the effect is called.

    Returns
    -------
    matplotlib Figure
    """
    edges = width * np.arange(math.floor(-0.2 / width) - 1, math.ceil(2.0 / width) + 2) - width / 2
    heights, _ = np.histogram(values, edges)
    used = int((heights > 0).sum())
    figure, ax = new_figure(
        f"Histogram of {name} of {len(values)} jumps in bins of {1000 * width:.0f} mm: {used} bins hold jumps, the fullest "
        f"{heights.max()}.",
        size=(7.2, 3.2),
    )
    ax.stairs(heights, edges, fill=True, baseline=0.1, color=INK if name == "Δy" else COLORS[1])
    ax.set(yscale="log", ylim=(0.6, 3000), xlim=(-0.2, 2.0))
    ax.set(xlabel=f"effect {name} [m]", ylabel="jumps in a bin (logarithmic)")
    ax.yaxis.set_major_formatter("{x:.0f}")
    ax.minorticks_off()
    ax.set_title(f"bins of {1000 * width:.0f} mm: {used} of them hold jumps", fontsize=10, loc="left")
    return figure


def plot_running_share(hits: Mapping[str, np.ndarray], share: float) -> Figure:
    r"""Draw how the share of hits settles as jumps come in, and the band :math:`p \pm 2 \sqrt{p (1 - p) / N}` about ``share``.

    Parameters
    ----------
    hits : mapping of str to ndarray of shape (n,), bool
        For each robot, whether each jump was a hit, in order.
    share : float
        The share p that the band is drawn about.

    Returns
    -------
    matplotlib Figure
    """
    ends = {name: float(np.mean(flags)) for name, flags in hits.items()}
    figure, ax = new_figure(
        "Share of hits against the number of jumps made, a line for each robot, in a band that narrows like a funnel. Last shares: "
        + ", ".join(f"{name} {100 * end:.1f} %" for name, end in ends.items())
        + ".",
        size=(7.2, 3.8),
    )
    n = np.arange(1, max(len(flags) for flags in hits.values()) + 1)
    margin = 2 * np.sqrt(share * (1 - share) / n)
    ax.fill_between(n, share - margin, share + margin, color=GRID, label="p ± 2 standard errors")
    for place, (name, flags) in enumerate(hits.items()):
        so_far = np.arange(1, len(flags) + 1)
        style = ("-", "--", "-.", ":")[place % 4]
        ax.plot(
            so_far, np.cumsum(flags) / so_far, style, color=COLORS[(1, 4, 2, 5)[place % 4]], linewidth=1.4, label=name
        )
    ax.axhline(share, color=INK, linewidth=0.8)
    ax.set(xscale="log", xlim=(5, len(n)), ylim=(0, min(1.0, 3 * share)), xlabel="jumps made N [count]")
    ax.set_ylabel("share of hits so far [%]")
    ax.yaxis.set_major_formatter(PercentFormatter(1, symbol="", decimals=0))
    ax.xaxis.set_major_formatter("{x:.0f}")
    ax.legend(frameon=False, fontsize=9, ncols=3, loc="upper right")
    return figure


def plot_shares(counts: Mapping[str, Sequence[int] | np.ndarray]) -> Figure:
    """Draw the share of each outcome with two standard errors to both sides, for several sets of jumps side by side.

    Parameters
    ----------
    counts : mapping of str to sequence of 6 int
        The number of jumps that came to each of ``OUTCOMES``, for each set.

    Returns
    -------
    matplotlib Figure
    """
    words = []
    for name, each in counts.items():
        percent = 100 * np.asarray(each) / np.sum(each)
        words.append(f"{name}: " + ", ".join(f"{o} {p:.1f} %" for o, p in zip(OUTCOMES, percent, strict=True)))
    figure, ax = new_figure(f"Shares of outcomes with error bars. {'; '.join(words)}.", size=(7.6, 3.8))
    x, wide = np.arange(len(OUTCOMES)), 0.8 / len(counts)
    for place, (name, each) in enumerate(counts.items()):
        total = np.sum(each)
        share = np.asarray(each) / total
        _bars_with_errors(ax, x + (place - (len(counts) - 1) / 2) * wide, share, total, wide, place, name)
    ax.set_xticks(x, OUTCOMES)
    ax.set(xlabel="outcome of a jump", ylabel="share of jumps [%]")
    ax.yaxis.set_major_formatter(PercentFormatter(1, symbol=""))
    ax.legend(frameon=False, fontsize=9)
    return figure


def _bars_with_errors(
    ax: Axes, x: np.ndarray, share: np.ndarray, total: int, width: float, place: int, name: str
) -> None:
    color, hatch = ((COLORS[1], ""), ("#d9d9d9", "///"), (COLORS[3], ".."), ("white", "xx"))[place % 4]
    error = 2 * np.sqrt(share * (1 - share) / total)
    ax.bar(x, share, 0.92 * width, color=color, hatch=hatch, edgecolor=INK, linewidth=0.7, label=name)
    ax.errorbar(x, share, np.minimum(error, share), fmt="none", ecolor=PATH, elinewidth=1.6, capsize=3, zorder=4)


def draw_sample_size(n: int = 100, seed: int = 0) -> Figure:
    """Draw what ``n`` jumps of a seed say of the effects, over what 2,000 jumps of it say: the widget of lesson 02.

    Parameters
    ----------
    n : int
        Number of jumps, 2,000 at most: the first of those that the seed gives.
    seed : int
        Seed of the jumps.

    Returns
    -------
    matplotlib Figure
    """
    every = samples_of(seed)
    some = every[:n]
    n = len(some)
    counts, all_counts = outcome_counts(some), outcome_counts(every)
    words = ", ".join(f"{name} {count}" for name, count in zip(OUTCOMES, counts, strict=True))
    figure, (left, right) = new_figure(
        f"The first {n} jumps of seed {seed}. Left, the histogram of Δy; right, shares of outcomes with error bars: {words}.",
        panels=2,
        size=(10.0, 3.7),
        columns=2,
    )
    edges = np.arange(-2, 40) * DY_BIN
    looks: list[dict[str, Any]] = [{"color": COLORS[0], "fill": True}, {"color": INK, "linewidth": 1.2}]
    for each, look in zip((some, every), looks, strict=True):
        on_map = each.effect("dy")[each.on_map, 0]
        left.stairs(np.histogram(on_map, edges)[0] / len(each), edges, label=f"{len(each)} jumps", **look)
    left.set(xlim=(-0.1, 2.0), ylim=(0, 0.7), xlabel="effect Δy [m]", ylabel=f"share in a bin of {DY_BIN:g} m [%]")
    left.legend(frameon=False, fontsize=9)
    x = np.arange(len(OUTCOMES))
    _bars_with_errors(right, x, counts / n, n, 0.8, 0, f"{n} jumps, ± 2 standard errors")
    right.plot(x, all_counts / len(every), "_", color="black", markersize=22, markeredgewidth=2, zorder=5)
    for place, count in enumerate(counts):
        right.annotate(f"{count}", (place, 1.03), ha="center", color=PATH if count == 0 else INK)
    right.set_xticks(x, [name.replace(" steps", "").replace(" step", "").replace("the ", "") for name in OUTCOMES])
    right.set(ylim=(0, 1.1), yticks=np.arange(0, 1.1, 0.2), xlabel="steps gained [count]", ylabel="share of jumps [%]")
    right.set_title("jumps of each outcome", fontsize=10)
    for panel in (left, right):
        panel.yaxis.set_major_formatter(PercentFormatter(1, symbol="", decimals=0))
    return figure
