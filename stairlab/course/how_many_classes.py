"""Lesson 04, how many classes: silhouettes and Davies-Bouldin ratios to be seen, and what scaling and an added feature do to them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from scipy.spatial.distance import cdist

from stairlab.clustering import KMeans, silhouette_samples, silhouette_scores
from stairlab.course.effect_classes import draw_effects, draw_samples, effect_axes, spread
from stairlab.drawing import COLORS, GRID, INK, PATH, finish, make_axes, marker_handle, new_figure
from stairlab.effects import EffectClasses
from stairlab.plots import class_style
from stairlab.sampling import Samples

KS = range(2, 11)
""" The numbers of classes that are tried: 2 to psi = 10 """
FIGURES = (3, 6)
""" The range that gives the paper's figures """
LEVELS = ("ground", "1 step", "2 steps", "3 steps", "4 steps")
LINES = ("-", "--", ":", "-.")
BETTER = {"silhouette": "mean silhouette (higher is better)", "davies-bouldin": "Davies-Bouldin (lower is better)"}


def labels_by_k(effects: np.ndarray, ks: Sequence[int] = KS, n_init: int = 10) -> dict[int, np.ndarray]:
    """Run K-Means for each k.

    Parameters
    ----------
    effects : ndarray of shape (n_samples, n_features)
        The effects, in metres or scaled.
    ks : sequence of int
        Numbers of classes.
    n_init : int
        Starts for each k.

    Returns
    -------
    dict of int to ndarray of shape (n_samples,)
        The class of each sample, from 0, ordered by the length of the classes' means.
    """
    return {k: _ordered(effects, KMeans(k, n_init=n_init, random_state=0).fit(effects).labels_) for k in ks}


def _ordered(effects: np.ndarray, labels: np.ndarray) -> np.ndarray:
    lengths = [np.linalg.norm(effects[labels == c].mean(axis=0)) for c in range(labels.max() + 1)]
    return np.argsort(np.argsort(lengths))[labels]


def best_k(scores: Sequence[float] | np.ndarray, ks: Sequence[int] = KS, low: int = 2, high: int = 10) -> int:
    """Return the first k from ``low`` to ``high`` with the highest score."""
    within = [(k, score) for k, score in zip(ks, scores, strict=True) if low <= k <= high]
    return max(within, key=lambda pair: pair[1])[0]


# Silhouettes


def draw_neighbours(effects: np.ndarray, labels: np.ndarray, sample: int, shown: int = 30) -> Figure:
    """Draw what the silhouette of one sample is made of: its mean distance to its own class, a, and to the next one, b.

    Parameters
    ----------
    effects : ndarray of shape (n_samples, 2)
        dy and dz of each sample [m].
    labels : ndarray of shape (n_samples,), int
        Class of each sample, from 0.
    sample : int
        The sample, a row of ``effects``.
    shown : int
        Lines drawn to either class, at most.

    Returns
    -------
    matplotlib Figure
    """
    distances = np.linalg.norm(effects - effects[sample], axis=1)
    own = int(labels[sample])
    others = labels != own
    means = np.array([distances[labels == c].mean() for c in range(labels.max() + 1)])
    means[own] = distances[~others].sum() / max((~others).sum() - 1, 1)
    nearest = min((c for c in range(len(means)) if c != own), key=lambda c: means[c])
    a, b = means[own], means[nearest]
    s = (b - a) / max(a, b)
    words = ", ".join(f"{mean:.2f} m to C{c + 1}" for c, mean in enumerate(means.tolist()))
    title = f"a = {a:.3f} m, b = {b:.3f} m, s = {s:.2f}"
    alt = f"A sample of class C{own + 1} and its mean distances: {words}. {title}."
    figure, (plane, bars) = new_figure(alt, panels=2, size=(9.6, 3.9), columns=2)
    effect_axes(plane)
    draw_samples(plane, effects, labels)
    places = spread(effects)
    for c, style in ((own, "-"), (nearest, "--")):
        members = np.flatnonzero((labels == c) & (np.arange(len(labels)) != sample))
        for member in members[:: max(1, len(members) // shown)]:
            color = class_style(c + 1).color
            plane.plot(*places[[sample, member]].T, color=color, linestyle=style, linewidth=0.8, zorder=3)
    plane.plot(*places[sample], "o", color=INK, markersize=8, zorder=5)
    for c, mean in enumerate(means.tolist()):
        bars.barh(c, mean, color=class_style(c + 1).color, edgecolor=INK, linewidth=0.7)
        note = "  a: its own class" if c == own else "  b: the next class" if c == nearest else ""
        bars.text(mean, c, note, va="center", fontsize=9)
    bars.set_yticks(range(len(means)), [f"$C_{{{c + 1}}}$" for c in range(len(means))])
    bars.set(xlabel="mean distance [m]", xlim=(0, max(means.max() * 1.05, b * 2.2)), title=title)
    bars.title.set_fontsize(10)
    bars.invert_yaxis()
    return figure


def draw_silhouettes(effects: np.ndarray, labels: np.ndarray, title: str = "", ax: Axes | None = None) -> Figure:
    """Draw the silhouette of every sample, sorted within its class, and their mean.

    Parameters
    ----------
    effects : ndarray of shape (n_samples, n_features)
        The effects, as they were clustered.
    labels : ndarray of shape (n_samples,), int
        Class of each sample, from 0.
    title : str
        What stands above.
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    matplotlib Figure
    """
    silhouettes = silhouette_samples(effects, labels)
    (ax,) = make_axes(ax, 1, (6.8, 4.2))
    top, words, names = 0, [], {}
    for c in range(labels.max() + 1):
        members = np.sort(silhouettes[labels == c])
        color = class_style(c + 1).color
        ax.fill_betweenx(np.arange(top, top + len(members)), 0, members, color=color, linewidth=0, step="mid")
        names[top + len(members) / 2] = f"$C_{{{c + 1}}}$"
        words.append(f"C{c + 1}: {len(members)} samples, mean {members.mean():.2f}, lowest {members[0]:.2f}")
        top += len(members) + 25
    mean = silhouettes.mean()
    ax.axvline(mean, color=PATH, linestyle="--", linewidth=1.4)
    ax.annotate(
        f"mean {mean:.3f}", (mean, top), (-4, 2), textcoords="offset points", color=PATH, fontsize=9, ha="right"
    )
    ax.set(
        xlim=(min(0, silhouettes.min()), 1.02), ylim=(0, 1.04 * top), xlabel="silhouette s", ylabel="samples, by class"
    )
    ax.set_yticks(list(names), list(names.values()))
    ax.tick_params(axis="y", length=0)
    ax.set_title(title, fontsize=10, loc="left")
    ax.spines[["top", "right"]].set_visible(False)
    return finish(ax, f"Silhouettes by class{', ' * bool(title)}{title}, mean {mean:.3f}. {'; '.join(words)}.")


def draw_silhouette_map(effects: np.ndarray, labels: np.ndarray, title: str = "") -> Figure:
    """Draw the silhouette of each sample where the sample is, in the plane of effects.

    Parameters
    ----------
    effects : ndarray of shape (n_samples, 2)
        dy and dz of each sample [m].
    labels : ndarray of shape (n_samples,), int
        Class of each sample, from 0.
    title : str
        What stands above.

    Returns
    -------
    matplotlib Figure
    """
    silhouettes = silhouette_samples(effects, labels)
    worst = effects[silhouettes.argmin()]
    alt = (
        f"Silhouettes in the plane of effects, from {silhouettes.min():.2f} to {silhouettes.max():.2f}; the lowest at "
        f"dy = {worst[0]:.2f} m, dz = {worst[1]:.2f} m; {int((silhouettes < 0.5).sum())} of {len(labels)} are below 0.5."
    )
    figure, ax = new_figure(alt, size=(6.8, 4.4))
    effect_axes(ax)
    order = np.argsort(-silhouettes)  # low ones on top
    y, z = spread(effects)[order].T
    drawn = ax.scatter(y, z, c=silhouettes[order], cmap="cividis", vmin=0, vmax=1, s=14, linewidths=0)
    figure.colorbar(
        drawn, ax=ax, label="silhouette s", shrink=0.8, extend="min" if silhouettes.min() < 0 else "neither"
    )
    ax.set_title(title, fontsize=10, loc="left")
    return figure


def draw_votes(effects: np.ndarray, labels: Mapping[int, np.ndarray], base: int = 2) -> Figure:
    """Draw what each height gives to the mean silhouette, and what it takes, compared with the classes for k = ``base``.

    Parameters
    ----------
    effects : ndarray of shape (n_samples, 2)
        dy and dz of each sample [m].
    labels : mapping of int to ndarray of shape (n_samples,)
        Class of each sample, from 0, by k.
    base : int
        The k that the others are compared with.

    Returns
    -------
    matplotlib Figure
    """
    levels = height_levels(effects)
    silhouettes = {k: silhouette_samples(effects, each) for k, each in labels.items()}
    ks = [k for k in labels if k != base]
    gains = np.array(
        [[(silhouettes[k] - silhouettes[base])[levels == level].sum() / len(levels) for level in range(5)] for k in ks]
    )
    words = "; ".join(
        f"k = {k}: " + ", ".join(f"{name} {gain:+.3f}" for name, gain in zip(LEVELS, row, strict=True))
        for k, row in zip(ks, gains.tolist(), strict=True)
    )
    figure, ax = new_figure(
        f"What each height adds to the mean silhouette, against k = {base}: {words}.", size=(7.6, 4)
    )
    hatches = ("", "//", "..", "\\\\", "xx")
    for sign in (1, -1):
        bottom = np.zeros(len(ks))
        for level, hatch in enumerate(hatches):
            part = np.where(sign * gains[:, level] > 0, gains[:, level], 0.0)
            look: dict[str, Any] = {"color": COLORS[level], "hatch": hatch, "edgecolor": "white", "linewidth": 0.5}
            ax.bar(ks, part, 0.7, bottom=bottom, label=LEVELS[level] if sign > 0 else None, **look)
            bottom = bottom + part
    ax.plot(ks, gains.sum(axis=1), "D", color="white", markeredgecolor=INK, markersize=7, label="together")
    ax.axhline(0, color=INK, linewidth=0.8)
    ax.set(xlabel="number of classes k", ylabel=f"mean silhouette, against k = {base}", xticks=ks)
    ax.legend(frameon=False, fontsize=9, loc="center left", bbox_to_anchor=(1, 0.5))
    return figure


def height_levels(effects: np.ndarray, rise: float = 0.3) -> np.ndarray:
    """Return how many steps each sample gained, from its dz in the last column; shape (n_samples,)."""
    return np.round(effects[:, -1] / rise).astype(int)


# Curves and tables


def draw_scores(
    curves: Mapping[str, Sequence[float] | np.ndarray],
    ylabel: str = BETTER["silhouette"],
    rings: Mapping[int, str] | None = None,
    *,
    ks: Sequence[int] = KS,
    ax: Axes | None = None,
) -> Figure:
    """Draw scores by k.

    Parameters
    ----------
    curves : mapping of str to sequence of float
        The scores of all ``ks``, by name; an empty name has no entry in the legend.
    ylabel : str
        What the score is.
    rings : mapping of int to str, optional
        Values of k to ring on the first curve, with a word for each.
    ks : sequence of int
        The numbers of classes.
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    matplotlib Figure
    """
    (ax,) = make_axes(ax, 1, (6.8, 3.5))
    for i, (name, scores) in enumerate(curves.items()):
        look: dict[str, Any] = {"color": (INK, COLORS[1], COLORS[4], COLORS[2])[i % 4], "linestyle": LINES[i % 4]}
        ax.plot(list(ks), list(scores), marker="osD^"[i % 4], markersize=5, linewidth=1.4, label=name or None, **look)
    first = dict(zip(ks, next(iter(curves.values())), strict=True))
    for k, word in (rings or {}).items():
        ax.plot(k, first[k], "o", markersize=16, markerfacecolor="none", markeredgecolor=PATH, markeredgewidth=1.6)
        ax.annotate(word, (k, first[k]), (12, 4), textcoords="offset points", fontsize=9, color=PATH)
    ax.set(xlabel="number of classes k", ylabel=ylabel, xticks=list(ks))
    ax.margins(y=0.15)
    ax.grid(axis="y", color=GRID)
    ax.set_axisbelow(True)
    ax.spines[["top", "right"]].set_visible(False)
    if any(curves):
        ax.legend(frameon=False, fontsize=9)
    words = "; ".join(
        f"{name} " + ", ".join(f"{k}: {score:.3f}" for k, score in zip(ks, scores, strict=True))
        for name, scores in curves.items()
    )
    ringed = "".join(f" Ringed: k = {k}{f', {word}' if word else ''}." for k, word in (rings or {}).items())
    return finish(ax, f"{ylabel} by number of classes: {words.strip()}.{ringed}")


def draw_grid(
    values: np.ndarray,
    rows: Sequence[str],
    columns: Sequence[str],
    labels: tuple[str, str],
    form: str = "{:.0f}",
    ringed: Sequence[tuple[int, int]] = (),
    title: str = "",
) -> Figure:
    """Draw a table of numbers, the darker the larger.

    Parameters
    ----------
    values : ndarray of shape (n_rows, n_columns)
        The numbers; nothing stands where one is nan.
    rows, columns : sequence of str
        Their names.
    labels : (str, str)
        What rows and columns stand for.
    form : str
        How a number is written.
    ringed : sequence of (row, column)
        Places to frame.
    title : str
        What stands above.

    Returns
    -------
    matplotlib Figure
    """
    values = np.asarray(values, dtype=float)
    words = "; ".join(
        f"{row}: " + ", ".join(f"{column} {form.format(v)}" for column, v in zip(columns, vs, strict=True) if v == v)
        for row, vs in zip(rows, values.tolist(), strict=True)
    )
    alt = f"{title or 'Numbers'}, in a table: {labels[0]} against {labels[1]}. {words}."
    figure, ax = new_figure(alt, size=(2.8 + 0.72 * len(columns), 1.3 + 0.44 * len(rows)))
    low, high = np.nanmin(values), np.nanmax(values)
    ax.imshow(values, cmap="Blues", vmin=low, vmax=high + 0.15 * (high - low) + 1e-9, aspect="auto")
    for (row, column), value in np.ndenumerate(values):
        if value == value:
            dark = value > low + 0.6 * (high - low)
            ax.text(column, row, form.format(value), ha="center", va="center", color="white" if dark else INK)
    for row, column in ringed:
        frame = Rectangle((column - 0.46, row - 0.44), 0.92, 0.88, fill=False, edgecolor=PATH, linewidth=2)
        ax.add_patch(frame)
    ax.set_xticks(range(len(columns)), columns)
    ax.set_yticks(range(len(rows)), rows)
    ax.set(ylabel=labels[0], xlabel=labels[1])
    ax.tick_params(length=0)
    ax.spines[:].set_visible(False)
    ax.set_title(title, fontsize=10, loc="left")
    return figure


# Davies-Bouldin


def draw_pair(effects: np.ndarray, labels: np.ndarray, i: int, j: int) -> Figure:
    """Draw what the Davies-Bouldin ratio of two classes is made of: how wide they are, and how far apart.

    Parameters
    ----------
    effects : ndarray of shape (n_samples, 2)
        dy and dz of each sample [m].
    labels : ndarray of shape (n_samples,), int
        Class of each sample, from 0.
    i, j : int
        The two classes, from 0.

    Returns
    -------
    matplotlib Figure
    """
    centers, widths = _centers_and_widths(effects, labels)
    apart = float(np.linalg.norm(centers[i] - centers[j]))
    ratio = (widths[i] + widths[j]) / apart
    title = f"$C_{{{i + 1}}}$ and $C_{{{j + 1}}}$: ({widths[i]:.3f} + {widths[j]:.3f}) / {apart:.3f} = {ratio:.2f}"
    alt = (
        f"Classes C{i + 1} and C{j + 1}: mean distances to the centre {widths[i]:.3f} m and {widths[j]:.3f} m, "
        f"centres {apart:.3f} m apart, ratio {ratio:.2f}."
    )
    figure, ax = new_figure(alt, size=(6.8, 4.6))
    draw_effects(effects, labels, ax=ax)
    ax.plot(*centers[[i, j]].T, color=INK, linewidth=1.6, zorder=5)
    for c in (i, j):
        style = class_style(c + 1)
        ax.add_patch(Circle(tuple(centers[c]), widths[c], facecolor=style.color, alpha=0.35, edgecolor=INK, zorder=4))
        ax.plot(*centers[c], style.marker, color=style.color, markeredgecolor=INK, markersize=8, zorder=6)
    ax.set_title(title, fontsize=10, loc="left")
    return figure


def _centers_and_widths(effects: np.ndarray, labels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    members = [effects[labels == c] for c in range(labels.max() + 1)]
    centers = np.array([each.mean(axis=0) for each in members])
    widths = [np.linalg.norm(each - center, axis=1).mean() for each, center in zip(members, centers, strict=True)]
    return centers, np.array(widths)


# Scaling, and a feature that is random


def draw_stretched(effects: np.ndarray, factor: float = 1.0, k: int = 6) -> Figure:
    """Draw the classes that K-Means finds when dz counts ``factor`` times as much, and the mean silhouettes by k.

    Parameters
    ----------
    effects : ndarray of shape (n_samples, 2)
        dy and dz of each sample [m].
    factor : float
        What dz is multiplied by before the clustering.
    k : int
        Number of classes that are shown.

    Returns
    -------
    matplotlib Figure
    """
    stretched = effects * [1, factor]
    labels = labels_by_k(stretched, n_init=5)
    scores = silhouette_scores(stretched, list(labels.values()))
    best = best_k(scores, KS, *FIGURES)
    figure, (plane, curve) = new_figure(f"dz counts {factor:g} times.", panels=2, size=(9.6, 3.9), columns=2)
    draw_effects(effects, labels[k], title=f"dz counts {factor:g} times: six classes", ax=plane)
    draw_scores({"": scores}, rings={best: ""}, ax=curve)
    curve.set(ylim=(0.7, 1))
    curve.set_title(f"best of {FIGURES[0]} to {FIGURES[1]}: {best}", fontsize=10, loc="left")
    return figure


def draw_drift(effects: np.ndarray, labels: np.ndarray, title: str = "", ax: Axes | None = None) -> Figure:
    """Draw samples from above: the sideways drift dx against the distance gained dy, in the look of their classes.

    Parameters
    ----------
    effects : ndarray of shape (n_samples, 3)
        dx, dy and dz of each sample [m].
    labels : ndarray of shape (n_samples,), int
        Class of each sample, from 0.
    title : str
        What stands above.
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    matplotlib Figure
    """
    (ax,) = make_axes(ax, 1, (6.8, 3.4))
    for label in np.unique(labels):
        color, marker = class_style(int(label) + 1)
        dx, dy, _ = effects[labels == label].T
        ax.scatter(dy, dx, s=12, color=color, marker=marker, alpha=0.75, linewidths=0, label=f"$C_{{{label + 1}}}$")
    ax.set(xlabel="distance gained dy [m]", ylabel="sideways drift dx [m]", xlim=(-0.1, 2), ylim=(-0.32, 0.32))
    ax.legend(frameon=False, fontsize=9, ncols=6, loc="upper left", handletextpad=0.1, columnspacing=0.8)
    ax.spines[["top", "right"]].set_visible(False)
    ax.set_title(title, fontsize=10, loc="left")
    spreads = ", ".join(f"C{c + 1} {effects[labels == c, 0].std():.3f} m" for c in np.unique(labels))
    start = f"{title}. " if title else ""
    return finish(ax, f"{start}Sideways drift dx against dy. Standard deviation of dx by class: {spreads}.")


def draw_a_and_b(spaces: Mapping[str, np.ndarray], labels: np.ndarray) -> Figure:
    """Draw the two distances that silhouettes are made of, the mean over each class, in several spaces.

    Parameters
    ----------
    spaces : mapping of str to ndarray of shape (n_samples, n_features)
        The effects, in one or more choices of features or units.
    labels : ndarray of shape (n_samples,), int
        Class of each sample, from 0.

    Returns
    -------
    matplotlib Figure
    """
    classes = range(labels.max() + 1)
    names = [f"$C_{{{c + 1}}}$" for c in classes]
    found = {name: _a_and_b(effects, labels) for name, effects in spaces.items()}
    words = "; ".join(
        f"{name}: " + ", ".join(f"C{c + 1} {a:.3f} and {b:.3f} m" for c, (a, b) in enumerate(zip(*each, strict=True)))
        for name, each in found.items()
    )
    figure, panels = new_figure(
        f"Mean a and b by class, on {' and '.join(spaces)}. {words}.", panels=2, size=(9, 3.1), columns=2
    )
    width = 0.8 / len(spaces)
    for place, (name, each) in enumerate(found.items()):
        for panel, means in zip(panels, each, strict=True):
            x = np.arange(len(means)) + width * (place - (len(spaces) - 1) / 2)
            look: dict[str, Any] = {"color": COLORS[(1, 4, 2)[place % 3]], "hatch": ("", "//", "..")[place % 3]}
            panel.bar(x, means, width * 0.95, edgecolor="white", linewidth=0.5, label=name, **look)
    for panel, ylabel in zip(panels, ("a: own class, mean [m]", "b: next class, mean [m]"), strict=True):
        panel.set(ylabel=ylabel, ylim=(0, 1.25 * max(bar.get_height() for bar in panel.patches)))
        panel.set_xticks(classes, names)
        panel.legend(frameon=False, fontsize=9, ncols=2, loc="upper left")
    return figure


def _a_and_b(effects: np.ndarray, labels: np.ndarray) -> tuple[list[float], list[float]]:
    """Return for each class the mean of its samples' a and of their b."""
    distances = cdist(effects, effects)
    sizes = np.bincount(labels)
    own = np.eye(len(sizes), dtype=bool)[labels]
    sums = np.column_stack([distances[:, labels == c].sum(axis=1) for c in range(len(sizes))])
    a = sums[own] / np.maximum(sizes[labels] - 1, 1)
    b = np.where(own, np.inf, sums / sizes).min(axis=1)
    return [float(a[labels == c].mean()) for c in range(len(sizes))], [
        float(b[labels == c].mean()) for c in range(len(sizes))
    ]


# The widget


class ClassChoices:
    """All the choices that lead to effect classes, to be explored: what was clustered before is remembered.

    Parameters
    ----------
    samples : Samples
        Jumps on the stairs, with x drift.
    """

    FEATURES = ("dy, dz", "dx, dy, dz")
    CRITERIA = tuple(BETTER)
    SCALINGS = ("none", "max-abs")

    def __init__(self, samples: Samples) -> None:
        self.samples = samples
        self._found: dict[tuple[Any, ...], EffectClasses] = {}

    def classes(self, low: int, high: int, criterion: str, scaling: str, features: str) -> EffectClasses:
        """Return the effect classes that Algorithm 2 finds with these choices, k from ``low`` to ``high``."""
        key = low, high, criterion, scaling, features
        if key not in self._found:
            self._found[key] = EffectClasses.from_samples(
                self.samples, features.split(", "), criterion=criterion, k_range=(low, high), scaling=scaling
            )
        return self._found[key]

    def scores(self, criterion: str, scaling: str = "none", features: str = "dy, dz") -> np.ndarray:
        """Return the score of each k from 2 to 10, shape (9,)."""
        return self.classes(KS[0], KS[-1], criterion, scaling, features).scores["score"].to_numpy()

    def chosen(self, low: int, high: int, criterion: str, scaling: str = "none", features: str = "dy, dz") -> int:
        """Return the k from ``low`` to ``high`` that Algorithm 2 chooses with these choices."""
        scores = self.scores(criterion, scaling, features) * (1 if criterion == "silhouette" else -1)
        return best_k(scores, KS, low, high)

    def draw(
        self, k: int = 6, criterion: str = "silhouette", scaling: str = "none", features: str = "dy, dz"
    ) -> Figure:
        """Draw the classes for one k, and the score of every k.

        Parameters
        ----------
        k : int
            Number of classes, 2 to 10.
        criterion : {"silhouette", "davies-bouldin"}
            The score.
        scaling : {"none", "max-abs"}
            Whether each dimension is divided by its largest absolute value.
        features : {"dy, dz", "dx, dy, dz"}
            What is clustered.

        Returns
        -------
        matplotlib Figure
        """
        shown = self.classes(k, k, criterion, scaling, features)
        scores = self.scores(criterion, scaling, features)
        ranges = ((KS[0], KS[-1]), (3, KS[-1]), FIGURES)
        picks = {f"{low} to {high}": self.chosen(low, high, criterion, scaling, features) for low, high in ranges}
        words = ", ".join(f"of {where} it picks {pick}" for where, pick in picks.items())
        figure, (plane, curve) = new_figure(
            f"{features}, scaling {scaling}, {criterion}: {words}.", panels=2, size=(9.6, 3.9), columns=2
        )
        effects = self.samples.on_the_map().effect("dy", "dz")
        draw_effects(effects, shown.labels[self.samples.on_map] - 1, title=f"{k} classes on ({features})", ax=plane)
        draw_scores({"": scores}, BETTER[criterion], ax=curve)
        curve.plot(k, scores[k - KS[0]], "o", color=PATH, markersize=8, zorder=4)
        handles = [marker_handle(PATH, "o", "this k")]
        rings = zip(picks.items(), (23, 18, 13), (COLORS[1], COLORS[5], COLORS[2]), strict=True)
        for (where, pick), size, color in rings:
            ring: dict[str, Any] = {"markerfacecolor": "none", "markeredgewidth": 1.6, "markeredgecolor": color}
            curve.plot(pick, scores[pick - KS[0]], "o", markersize=size, **ring)
            handles.append(marker_handle(color, "o", f"best of {where}", **ring | {"markersize": size / 2}))
        place: dict[str, Any] = {"loc": "upper center", "ncols": 4, "bbox_to_anchor": (0.47, 1.15)}
        curve.legend(handles=handles, frameon=False, fontsize=8.5, handletextpad=0, columnspacing=0.9, **place)
        figure.set_layout_engine(None)  # places by hand: half the time to draw
        figure.subplots_adjust(left=0.07, right=0.985, bottom=0.14, top=0.89, wspace=0.22)
        return figure
