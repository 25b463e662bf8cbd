"""Figures and helpers of lesson 05: equations 2 and 3, what they make of six classes, and what breaks them."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from stairlab.drawing import COLORS, FAINT, GRID, INK, PATH, new_figure
from stairlab.effects import EffectClasses
from stairlab.plots import class_style
from stairlab.prototypes import LARGEST_CV, MAX_COUNT, prototype_counts
from stairlab.sampling import noisy_motions, replay_motions
from stairlab.world import World

PUBLISHED_MEANS = (0.092, 0.290, 0.875, 1.594, 2.313, 2.902)
""" Mean effects of the six classes of the published jumps, Δy + Δz, given to the millimetre [m] """
PUBLISHED_STDS = (0.062, 0.023, 0.114, 0.104, 0.102, 0.096)
""" Their standard deviations of Δy [m]; those of Δz are far below a millimetre """
STAGES = ("mean", "spread", "cv", "weight", "ratio", "count")
""" The steps from effects to counts """
STAGE_LABELS = {
    "mean": "mean $\\mu_k$ [m]",
    "spread": "spread $\\sigma_k$ [m]",
    "cv": "$\\mathrm{cv}_k = \\sigma_k / \\mu_k$ [no unit]",
    "weight": "weight $(1 - \\mathrm{cv}_k)\\,\\sigma_k$ [m]",
    "ratio": "weight / smallest weight [no unit]",
    "count": "$\\xi_k$ [count]",
}


def stages_of(
    mean: Sequence[float] | np.ndarray, spread: Sequence[float] | np.ndarray, cap: int = MAX_COUNT
) -> dict[str, np.ndarray]:
    r"""Return every step of equations 2 and 3, by its name in ``STAGES``.

    .. math:: \xi_k = \left\lfloor \frac{(1 - cv_k) \, std_k}{\min_k (1 - cv_k) \, std_k} \right\rfloor, \quad
              cv_k = \frac{\sigma_k}{\mu_k}

    Parameters
    ----------
    mean, spread : array-like of shape (n_classes,)
        Mean effect and standard deviation of each class, summed over the dimensions [m]; means other than 0, spreads above 0.
    cap : int
        Largest count.

    Returns
    -------
    dict of str to ndarray of shape (n_classes,)
    """
    mu, sigma = np.asarray(mean, float), np.asarray(spread, float)
    cv = np.minimum(sigma / mu, LARGEST_CV)
    weight = (1 - cv) * sigma
    ratio = weight / weight.min()
    count = np.minimum(np.floor(ratio), cap).astype(int)
    return dict(zip(STAGES, (mu, sigma, cv, weight, ratio, count), strict=True))


def counts_if(classes: EffectClasses, number: int, mean: float = 1.0, spread: float = 1.0) -> pd.DataFrame:
    """Return ``prototype_counts`` as they would be if one class had another mean effect and another spread.

    Parameters
    ----------
    classes : EffectClasses
        The classes.
    number : int
        The class that is changed, from 1.
    mean, spread : float
        Factors for its mean effect and its standard deviation.

    Returns
    -------
    pandas.DataFrame
        As ``prototype_counts`` returns it; its warnings are left to the caller, who knows what was changed.
    """
    means, stds = classes.means.copy(), classes.stds.copy()
    means[number - 1] *= mean
    stds[number - 1] *= spread
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return prototype_counts(dataclasses.replace(classes, means=means, stds=stds))


def resampled_stages(classes: EffectClasses, repeats: int = 300, seed: int = 0) -> dict[str, np.ndarray]:
    """Return the steps of equations 2 and 3 for classes whose samples are drawn again, with replacement (the bootstrap).

    Parameters
    ----------
    classes : EffectClasses
        The classes; who belongs to which stays as it is.
    repeats : int
        How often everything is drawn again.
    seed : int
        For the draws.

    Returns
    -------
    dict of str to ndarray of shape (repeats, n_classes)
    """
    rng = np.random.default_rng(seed)
    effects = classes.samples.effect(*classes.features)
    members = [effects[classes.labels == number] for number in classes.numbers]
    rows = []
    for _ in range(repeats):
        drawn = [each[rng.integers(len(each), size=len(each))] for each in members]
        rows.append(stages_of([d.mean(0).sum() for d in drawn], [d.std(0, ddof=1).sum() for d in drawn]))
    return {stage: np.array([row[stage] for row in rows]) for stage in STAGES}


def kept_under_noise(
    world: World, classes: EffectClasses, motions: int = 40, replays: int = 5, seed: int = 0
) -> np.ndarray:
    """Replay motions of each class under noise, and return the share of replays that stay in their class, shape (n_classes,).

    Parameters
    ----------
    world : World
        Where to replay; noise is as large as it says (for the stairs 2 % of the magnitude and 1 degree).
    classes : EffectClasses
        The classes; a replay belongs to the class with the nearest mean effect, or to none off the map.
    motions : int
        Motions of each class that are replayed, at most.
    replays : int
        Noisy replays of each.
    seed : int
        For choice and noise.
    """
    rng = np.random.default_rng(seed)
    shares = []
    for number in classes.numbers:
        own = classes.motions_of(number)
        chosen = np.repeat(own[rng.permutation(len(own))[:motions]], replays, axis=0)
        reached = classes.reached(replay_motions(world, noisy_motions(world, chosen, rng)))
        shares.append(float(np.mean(reached == number)))
    return np.array(shares)


def names_of(numbers: Sequence[int] | np.ndarray | range) -> list[str]:
    """Return the names of classes as tick labels show them."""
    return [f"$C_{{{number}}}$" for number in numbers]


def plot_effects_by_class(classes: EffectClasses, features: Sequence[str] = ("dy", "dz")) -> Figure:
    """Draw the effects of each class, a panel for each dimension, with mean and standard deviation beside them."""
    words = "; ".join(
        f"C{n}: " + ", ".join(f"{f} {m:.2f} ± {s:.3f} m" for f, m, s in zip(classes.features, mean, std, strict=True))
        for n, mean, std in zip(classes.numbers, classes.means, classes.stds, strict=True)
    )
    figure, axes = new_figure(
        f"Effects of each class, with mean and standard deviation. {words}.",
        panels=len(features),
        size=(10.0, 3.8),
        columns=2,
    )
    rng = np.random.default_rng(0)
    for ax, feature in zip(np.ravel(axes), features, strict=True):
        values = classes.samples.effect(feature)[:, 0]
        place = classes.features.index(feature)
        for n in classes.numbers:
            own = values[classes.labels == n]
            color, marker = class_style(n)
            jitter = n + rng.uniform(-0.28, 0.12, len(own))
            ax.scatter(jitter, own, s=9, color=color, marker=marker, linewidths=0, alpha=0.7)
            mean, std = classes.means[n - 1, place], classes.stds[n - 1, place]
            ax.errorbar(n + 0.27, mean, std, color=INK, marker="_", markersize=11, capsize=3, linewidth=1.6)
        ax.set_xticks(list(classes.numbers), names_of(classes.numbers))
        ax.set(xlabel="effect class", ylabel=f"effect Δ{feature[1:]} [m]")
    return figure


def plot_bars(
    values: Mapping[str, Sequence[float] | np.ndarray],
    label: str,
    *,
    numbers: Sequence[int] | None = None,
    stacked: bool = False,
    digits: int = 2,
    log: bool = False,
) -> Figure:
    """Draw one or more values of each class as bars.

    Parameters
    ----------
    values : mapping of str to sequence of float
        Name and values, one for each class. With one name, bars have their class's colour and marker.
    label : str
        What is drawn, with its unit.
    numbers : sequence of int, optional
        Numbers of the classes, from 1 by default.
    stacked : bool
        Draw several values on top of each other, not side by side.
    digits : int
        Decimal places of the numbers on the bars.
    log : bool
        A logarithmic scale.

    Returns
    -------
    matplotlib Figure
    """
    columns = {name: np.asarray(each, float) for name, each in values.items()}
    count = len(next(iter(columns.values())))
    shown = list(numbers or range(1, count + 1))
    words = "; ".join(
        f"{_in_words(name)}: {', '.join(f'{v:.{digits}f}' for v in each)}" for name, each in columns.items()
    )
    figure, ax = new_figure(f"Bars by effect class, {_in_words(label)}. {words}.", size=(7.2, 3.3))
    x = np.arange(count)
    if len(columns) == 1:
        _class_bars(ax, x, next(iter(columns.values())), shown, digits)
    elif stacked:
        _stacked_bars(ax, x, columns, digits)
    else:
        _bars_side_by_side(ax, x, columns, digits)
    ax.set_xticks(x, names_of(shown))
    ax.set(xlabel="effect class", ylabel=label)
    ax.axhline(0, color=INK, linewidth=0.8)
    if log:
        ax.set_yscale("log")
    else:
        ax.margins(y=0.16)
    if len(columns) > 1:
        ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=len(columns), frameon=False, fontsize=9)
    return figure


def _in_words(label: str) -> str:
    """Return a label without TeX, for alternative text."""
    for tex, word in {
        "\\mathrm{cv}": "cv",
        "\\mu": "μ",
        "\\sigma": "σ",
        "\\xi": "ξ",
        "\\,": " ",
        "$": "",
        "_": "",
    }.items():
        label = label.replace(tex, word)
    return label


def _class_bars(ax: Axes, x: np.ndarray, values: np.ndarray, numbers: Sequence[int], digits: int) -> None:
    styles = [class_style(number) for number in numbers]
    ax.bar(x, values, 0.6, color=[style.color for style in styles], edgecolor=INK, linewidth=0.7)
    for place, (value, style) in enumerate(zip(values.tolist(), styles, strict=True)):
        _annotate(ax, place, value, digits)
        ax.plot(place, value / 2, marker=style.marker, color="white", markeredgecolor=INK, markersize=8)


def _annotate(ax: Axes, x: float, value: float, digits: int) -> None:
    below = value < 0
    ax.annotate(
        f"{value:.{digits}f}",
        (x, value),
        (0, -3 if below else 3),
        textcoords="offset points",
        ha="center",
        va="top" if below else "bottom",
        fontsize=9,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6},
    )


def _stacked_bars(ax: Axes, x: np.ndarray, columns: dict[str, np.ndarray], digits: int) -> None:
    bottom = np.zeros(len(x))
    for place, (name, each) in enumerate(columns.items()):
        look = _FILLS[place % len(_FILLS)]
        ax.bar(x, each, 0.6, bottom=bottom, label=name, edgecolor=INK, linewidth=0.7, **look)
        bottom = bottom + each
    ax.set_ylim(min(0, 1.16 * bottom.min()), 1.16 * bottom.max())  # a part of height 0 would end the margin
    for place, value in enumerate(bottom.tolist()):
        _annotate(ax, place, value, digits)


def _bars_side_by_side(ax: Axes, x: np.ndarray, columns: dict[str, np.ndarray], digits: int) -> None:
    wide = 0.84 / len(columns)
    for place, (name, each) in enumerate(columns.items()):
        look = _FILLS[place % len(_FILLS)]
        at = x + (place - (len(columns) - 1) / 2) * wide
        ax.bar(at, each, 0.92 * wide, label=name, edgecolor=INK, linewidth=0.7, **look)
        for where, value in zip(at.tolist(), each.tolist(), strict=True):
            _annotate(ax, where, value, digits)


_FILLS: tuple[dict[str, Any], ...] = (
    {"color": COLORS[0]},
    {"color": COLORS[3], "hatch": "///"},
    {"color": "white", "hatch": ".."},
    {"color": FAINT},
)


def plot_stage(stages: Mapping[str, np.ndarray], stage: str) -> Figure:
    """Draw one step of equations 2 and 3: with a line at the smallest weight, and at whole numbers where ratios are cut."""
    values = stages[stage]
    place = STAGES.index(stage)
    digits = {"mean": 3, "spread": 3, "weight": 4, "count": 0}.get(stage, 2)
    figure = plot_bars({stage: values}, STAGE_LABELS[stage], digits=digits)
    ax = figure.axes[0]
    ax.set_title(f"{place + 1}. {stage}", fontsize=10, loc="left")
    if stage == "weight":
        ax.axhline(values.min(), color=PATH, linestyle="--", linewidth=1.2)
    if stage in ("ratio", "count"):
        for level in range(1, int(np.floor(values.max())) + 2):
            ax.axhline(level, color=PATH, linestyle="--", linewidth=0.9, zorder=0)
        ax.yaxis.set_major_locator(MaxNLocator(integer=True))
    return figure


def plot_mean_and_spread(
    mean: Sequence[float] | np.ndarray, spread: Sequence[float] | np.ndarray, show: str = "cv", ax: Axes | None = None
) -> Figure:
    """Draw classes in the plane of mean and spread, over lines of equal cv, or over the weight that equation 2 gives them.

    Parameters
    ----------
    mean, spread : sequence of float
        Mean effect and standard deviation of each class [m].
    show : {"cv", "weight"}
        What lies below the classes.
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    matplotlib Figure
    """
    mu, sigma = np.asarray(mean, float), np.asarray(spread, float)
    words = "; ".join(f"C{n}: mean {m:.2f}, spread {s:.3f}" for n, (m, s) in enumerate(zip(mu, sigma, strict=True), 1))
    figure, ax = new_figure(f"Classes in the plane of mean and spread, over lines of equal {show}. {words}.",
                            size=(7.2, 3.8))  # fmt: skip
    left, right, top = min(0.0, 1.15 * float(mu.min())), 1.12 * float(mu.max()), 1.35 * float(sigma.max())
    if show == "cv":
        _draw_cv_lines(ax, right, top)
    else:
        _draw_weights(ax, left, right, top)
    for n, (m, s) in enumerate(zip(mu.tolist(), sigma.tolist(), strict=True), 1):
        color, marker = class_style(n)
        ax.plot(m, s, marker, color=color, markersize=11, markeredgecolor=INK, zorder=5)
        ax.annotate(f"$C_{{{n}}}$", (m, s), (9, 5), textcoords="offset points", zorder=6)
    if left < 0:
        ax.axvline(0, color=INK, linewidth=0.8)
    ax.set(xlim=(left, right), ylim=(0, top), xlabel="mean $\\mu$ [m]", ylabel="spread $\\sigma$ [m]")
    return figure


def _draw_cv_lines(ax: Axes, right: float, top: float) -> None:
    for cv in (0.03, 0.05, 0.1, 0.2, 0.6):
        ax.plot([0, right], [0, cv * right], color=FAINT, linewidth=0.9, zorder=1)
        out = cv * right > top
        place, at = (top / cv, top) if out else (right, cv * right)
        shift = (0, 2) if out else (3, 0)
        ax.annotate(
            f"cv {cv:g}",
            (place, at),
            shift,
            textcoords="offset points",
            fontsize=8,
            color="#5f5f5f",
            ha="center" if out else "left",
            va="bottom" if out else "center",
            annotation_clip=False,
        )


def _draw_weights(ax: Axes, left: float, right: float, top: float) -> None:
    mu, sigma = np.meshgrid(np.linspace(left, right, 300), np.linspace(top / 300, top, 300))
    with np.errstate(divide="ignore", invalid="ignore"):
        weight = sigma - sigma**2 / mu
    weight = np.ma.masked_where(np.abs(mu) < 1e-9, np.clip(weight, -0.02, 1.5 * top))
    levels = np.linspace(0, top, 9) if left == 0 else np.linspace(0, 1.5 * top, 10)
    shades = ax.contourf(mu, sigma, weight, levels=levels, cmap="Blues", alpha=0.75, extend="max")
    ax.contour(mu, sigma, weight, levels=levels, colors="white", linewidths=0.6)
    ax.contourf(mu, sigma, weight, levels=[-1, 0], colors=["#f0c9c4"], hatches=["xx"])
    ax.plot([0, right], [0, right / 2], color=PATH, linestyle="--", linewidth=1.2, zorder=3)
    ax.figure.colorbar(shades, ax=ax, label="weight $(1 - \\mathrm{cv})\\,\\sigma$ [m]", format="%.2f")


def plot_sensitivity(classes: EffectClasses, number: int, factors: Sequence[float] | np.ndarray) -> Figure:
    """Draw how all counts change when the spread of one class is multiplied by each of ``factors``."""
    tables = [counts_if(classes, number, spread=float(factor)) for factor in factors]
    counts = np.array([table["xi"].to_numpy() for table in tables])
    figure, ax = new_figure(
        f"Counts of all classes against the spread of C{number}: each line is a staircase. Totals from {counts.sum(1).min()} to "
        f"{counts.sum(1).max()}.",
        size=(7.2, 3.8),
    )
    for n in classes.numbers:
        color, marker = class_style(n)
        shifted = counts[:, n - 1] + 0.06 * (n - (classes.n_classes + 1) / 2)  # lines that coincide stay visible
        look: dict[str, Any] = {"color": color, "marker": marker, "markevery": (2 * n, 14), "label": names_of([n])[0]}
        ax.plot(factors, shifted, linewidth=2 if n != number else 3, **look)
    ax.axvline(1, color=INK, linewidth=0.8)
    ax.set(xlabel=f"spread of $C_{{{number}}}$, times the measured one [no unit]", ylabel="prototypes $\\xi_k$ [count]")
    ax.yaxis.set_major_locator(MaxNLocator(integer=True))
    ax.grid(axis="y", color=GRID, zorder=0)
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=9)
    return figure


def plot_resampled_counts(counts: np.ndarray, measured: Sequence[int] | np.ndarray) -> Figure:
    """Draw how often each count came out for each class, as circles, with the measured counts ringed.

    Parameters
    ----------
    counts : ndarray of shape (repeats, n_classes), int
        Counts of each repeat.
    measured : sequence of int
        The counts of the samples themselves.

    Returns
    -------
    matplotlib Figure
    """
    values = np.arange(1, counts.max() + 1)
    shares = np.array([(counts == value).mean(axis=0) for value in values])
    words = "; ".join(
        f"C{k + 1}: " + ", ".join(f"{v} in {s:.0%}" for v, s in zip(values, shares[:, k], strict=True) if s >= 0.01)
        for k in range(counts.shape[1])
    )
    figure, ax = new_figure(f"How often each count came out, by class. {words}.".replace("%", " %"), size=(7.2, 3.8))
    for k in range(counts.shape[1]):
        ax.scatter(np.full(len(values), k), values, s=900 * shares[:, k], color=class_style(k + 1).color, zorder=2)
        for value, share in zip(values.tolist(), shares[:, k].tolist(), strict=True):
            if share >= 0.01:
                label = f"{share:.0%}".replace("%", " %")
                ax.annotate(label, (k, value), (21, 0), textcoords="offset points", va="center", fontsize=8)
        ax.plot(k, measured[k], "o", markersize=33, markerfacecolor="none", markeredgecolor=PATH, zorder=3)
    ax.set_xticks(range(counts.shape[1]), names_of(range(1, counts.shape[1] + 1)))
    ax.set(xlim=(-0.5, counts.shape[1] - 0.3), ylim=(0.4, values[-1] + 0.6), yticks=values)
    ax.set(xlabel="effect class", ylabel="count $\\xi_k$ [count]")
    return figure


def plot_ratios(ratios: Mapping[str, np.ndarray]) -> Figure:
    """Draw what is cut down to a count, the weight over the smallest weight, with its 95 % range where it was drawn repeatedly.

    Parameters
    ----------
    ratios : mapping of str to ndarray of shape (n_classes,) or (repeats, n_classes)
        Name and ratios.

    Returns
    -------
    matplotlib Figure
    """
    middles = {name: np.median(np.atleast_2d(each), axis=0) for name, each in ratios.items()}
    words = "; ".join(f"{name}: {', '.join(f'{v:.2f}' for v in middle)}" for name, middle in middles.items())
    figure, ax = new_figure(
        f"Weights over the smallest weight, by class, before they are cut. {words}.", size=(7.2, 3.6)
    )
    for place, (name, middle) in enumerate(middles.items()):
        low, high = np.quantile(np.atleast_2d(ratios[name]), [0.025, 0.975], axis=0)
        x = np.arange(len(middle)) + 0.16 * (place - (len(middles) - 1) / 2)
        color, marker = (COLORS[1], COLORS[4], COLORS[2])[place % 3], "osD"[place % 3]
        ax.errorbar(x, middle, [middle - low, high - middle], fmt=marker, color=color, capsize=3, label=name, zorder=3)
    top = max(float(np.quantile(np.atleast_2d(each), 0.975, axis=0).max()) for each in ratios.values())
    for level in range(1, int(top) + 2):
        ax.axhline(level, color=FAINT, linestyle="--", linewidth=0.9, zorder=0)
    ax.set_xticks(range(len(middle)), names_of(range(1, len(middle) + 1)))
    ax.set(ylim=(0.5, int(top) + 1.3), xlabel="effect class", ylabel="weight / smallest weight [no unit]")
    if len(ratios) > 1:
        ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=len(ratios), frameon=False, fontsize=9)
    return figure


def plot_against_cv(cv: np.ndarray, kept: np.ndarray) -> Figure:
    """Draw the share of noisy replays that stay in their class against the class's coefficient of variation."""
    words = "; ".join(
        f"C{n}: cv {c:.2f}, kept {100 * k:.0f} %" for n, (c, k) in enumerate(zip(cv, kept, strict=True), 1)
    )
    figure, ax = new_figure(f"Share of noisy replays that stay in their class, against cv. {words}.", size=(7.2, 3.6))
    for n, (c, k) in enumerate(zip(cv.tolist(), kept.tolist(), strict=True), 1):
        color, marker = class_style(n)
        ax.plot(c, 100 * k, marker, color=color, markersize=11, markeredgecolor=INK)
        ax.annotate(names_of([n])[0], (c, 100 * k), (9, 5), textcoords="offset points")
    ax.set(xscale="log", ylim=(40, 104), xlabel="coefficient of variation cv [no unit]")
    ax.set_ylabel("noisy replays that stay [%]")
    ticks = [0.03, 0.05, 0.1, 0.2, 0.5]
    ax.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    ax.set_xticks([], minor=True)
    return figure


def draw_counts_if(classes: EffectClasses, number: int = 3, mean: float = 1.0, spread: float = 1.0) -> Figure:
    """Draw one class with another mean and spread, and all counts: the widget of lesson 05.

    Parameters
    ----------
    classes : EffectClasses
        The classes as they were measured.
    number : int
        The class that is changed, from 1.
    mean, spread : float
        Factors for its mean effect and its standard deviation.

    Returns
    -------
    matplotlib Figure
    """
    before, after = prototype_counts(classes), counts_if(classes, number, mean, spread)
    words = "; ".join(f"C{n} {a} to {b}" for n, a, b in zip(before.index, before["xi"], after["xi"], strict=True))
    figure, (left, right) = new_figure(
        f"C{number} with {mean:g} times its mean and {spread:g} times its spread: cv {after['cv'][number]:.2f}. Counts: {words}.",
        panels=2,
        size=(10.0, 3.7),
        columns=2,
    )
    mu, sigma = classes.means.sum(axis=1), classes.stds.sum(axis=1)
    _draw_moved_class(left, mu, sigma, number, mean, spread)
    x = np.arange(len(after))
    styles = [class_style(n) for n in after.index]
    right.bar(x, after["xi"], 0.6, color=[style.color for style in styles], edgecolor=INK, linewidth=0.7)
    right.plot(x, before["xi"], "_", color="black", markersize=26, markeredgewidth=2)
    for place, (old, new) in enumerate(zip(before["xi"], after["xi"], strict=True)):
        color = INK if old == new else PATH
        right.annotate(f"{new}", (place, max(old, new) + 0.25), ha="center", color=color, fontsize=12)
    smallest = after["weight"].idxmin()
    right.set_title(f"{after['xi'].sum()} prototypes; the smallest weight is $C_{smallest}$'s", fontsize=10)
    right.set_xticks(x, names_of(after.index))
    right.set(
        ylim=(0, MAX_COUNT + 1.5), xlabel="effect class (black line: as measured)", ylabel="prototypes $\\xi_k$ [count]"
    )
    return figure


def _draw_moved_class(ax: Axes, mu: np.ndarray, sigma: np.ndarray, number: int, mean: float, spread: float) -> None:
    for n, (m, s) in enumerate(zip(mu.tolist(), sigma.tolist(), strict=True), 1):
        color, marker = class_style(n)
        if n == number:
            ax.plot([m, mean * m], [s, spread * s], color=PATH, linewidth=1.2, zorder=2)
            ax.plot(m, s, marker, color="white", markeredgecolor=color, markersize=9, zorder=3)
            m, s = mean * m, spread * s
            ax.plot(m, s, "o", color="none", markeredgecolor=PATH, markersize=19, zorder=3)
        ax.plot(m, s, marker, color=color, markersize=10, markeredgecolor=INK, zorder=4)
        ax.annotate(names_of([n])[0], (m, s), (8, 5), textcoords="offset points")
    right, top = max(3.3, 1.1 * mean * mu[number - 1]), max(0.25, 1.15 * spread * sigma[number - 1])
    for cv, style in ((1.0, "-"), (0.5, "--")):
        ax.plot([0, right], [0, cv * right], style, color=FAINT, linewidth=1, label=f"cv = {cv:g}", zorder=1)
    ax.set(xlim=(0, right), ylim=(0, top), xlabel="mean $\\mu$ [m]", ylabel="spread $\\sigma$ [m]")
    ax.legend(frameon=False, fontsize=9, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
