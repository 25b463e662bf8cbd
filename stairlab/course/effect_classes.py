"""Lesson 03, effect classes: histogram bins and K-Means on the plane of effects, turn by turn, and centres that are moved by hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.colors import ListedColormap, to_rgb
from matplotlib.figure import Figure

from stairlab.clustering import HistogramBins, KMeans
from stairlab.course.explore import DPI, Exploration
from stairlab.course.player import Player
from stairlab.drawing import (
    COLORS,
    FAINT,
    GRID,
    INK,
    OFF_MAP,
    PATH,
    alt_text,
    finish,
    img,
    make_axes,
    new_figure,
    quick_png,
)
from stairlab.plots import class_style

if TYPE_CHECKING:
    import ipywidgets

SPREAD = 0.03
""" Marks in the plane of effects are moved up or down by at most this much, to be seen beside each other [m] """
PLANE = ((-0.25, 2.05), (-0.25, 1.45))
""" What is shown of the plane of effects: dy and dz [m] """
PALE = 0.82
""" How much white is in the colour of a region """
STARTS: dict[str, tuple[tuple[float, float], ...]] = {
    "in a row": tuple((y, 0.6) for y in (0.0, 0.36, 0.72, 1.08, 1.44, 1.8)),
    "in a heap": ((0.0, 0.0), (0.18, 0.0), (0.36, 0.0), (0.0, 0.18), (0.18, 0.18), (0.36, 0.18)),
    "up a ladder": tuple((0.3, z) for z in (0.0, 0.24, 0.48, 0.72, 0.96, 1.2)),
}
""" Six centres to start from, dy and dz [m] """
TURNS = 10
""" Turns of K-Means that the exploration offers, and one """


def effect_axes(ax: Axes) -> None:
    """Label axes as the plane of effects (dy, dz), both in metres and to one scale."""
    ax.set(xlim=PLANE[0], ylim=PLANE[1], aspect="equal", xlabel="distance gained dy [m]", ylabel="height gained dz [m]")
    ax.spines[["top", "right"]].set_visible(False)


def spread(effects: np.ndarray) -> np.ndarray:
    """Return where effects are drawn, shape (n, 2): dz moved by up to 3 cm, always alike, as most marks would hide each other."""
    moves = np.random.default_rng(0).uniform(-SPREAD, SPREAD, len(effects))
    return effects[:, :2] + np.column_stack([np.zeros(len(effects)), moves])


def draw_samples(ax: Axes, effects: np.ndarray, labels: np.ndarray | None = None, size: float = 11) -> None:
    """Draw samples in the plane of effects: grey, or each class (labels from 0) in its colour and marker."""
    shown = spread(effects)
    if labels is None:
        ax.scatter(shown[:, 0], shown[:, 1], s=size / 2, color=FAINT, alpha=0.6, linewidths=0, zorder=2)
        return
    for label in np.unique(labels):
        color, marker = class_style(int(label) + 1)
        ax.scatter(
            shown[labels == label, 0],
            shown[labels == label, 1],
            s=size,
            color=color,
            marker=marker,
            alpha=0.75,
            linewidths=0,
            zorder=2,
        )


def draw_regions(ax: Axes, centers: np.ndarray) -> None:
    """Shade where each centre is the nearest."""
    (left, right), (low, high) = PLANE
    width, height = 230, 170
    y = left + (np.arange(width) + 0.5) * (right - left) / width
    z = low + (np.arange(height) + 0.5) * (high - low) / height
    squared = (y[None, :, None] - centers[:, 0]) ** 2 + (z[:, None, None] - centers[:, 1]) ** 2
    colors = [1 - (1 - PALE) * (1 - np.array(to_rgb(class_style(c + 1).color))) for c in range(len(centers))]
    ax.imshow(
        squared.argmin(axis=2), cmap=ListedColormap(colors), vmin=-0.5, vmax=len(centers) - 0.5, zorder=0,
        extent=(left, right, low, high), origin="lower", interpolation="nearest", aspect="equal",
    )  # fmt: skip


def draw_centers(ax: Axes, centers: np.ndarray, chosen: int | None = None) -> None:
    """Draw centres, large and outlined, in the colour and marker of their class; ring the chosen one (from 0)."""
    for c, (y, z) in enumerate(centers.tolist()):
        color, marker = class_style(c + 1)
        ax.plot(y, z, marker, color="white", markersize=15, zorder=5)
        ax.plot(y, z, marker, color=color, markersize=11, markeredgecolor=INK, markeredgewidth=1.5, zorder=6)
        if c == chosen:
            ax.plot(
                y, z, "o", markersize=23, markerfacecolor="none", markeredgecolor=PATH, markeredgewidth=1.8, zorder=8
            )


def draw_effects(
    effects: np.ndarray,
    labels: np.ndarray | None = None,
    centers: np.ndarray | None = None,
    before: np.ndarray | None = None,
    *,
    regions: bool = False,
    chosen: int | None = None,
    title: str = "",
    ax: Axes | None = None,
) -> Figure:
    """Draw effects, and what K-Means makes of them.

    Parameters
    ----------
    effects : ndarray of shape (n_samples, 2)
        dy and dz of each sample [m].
    labels : ndarray of shape (n_samples,), int, optional
        Class of each sample, from 0; grey marks without.
    centers : ndarray of shape (n_classes, 2), optional
        The centres [m].
    before : ndarray of shape (n_classes, 2), optional
        Where the centres were: an arrow leads from there.
    regions : bool
        Whether to shade where each centre is the nearest.
    chosen : int, optional
        A centre to ring, from 0.
    title : str
        What stands above.
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    matplotlib Figure
    """
    (ax,) = make_axes(ax, 1, (6.8, 4.6))
    effect_axes(ax)
    if regions and centers is not None:
        draw_regions(ax, centers)
    draw_samples(ax, effects, labels)
    for start, end in zip(before if before is not None else [], centers if centers is not None else [], strict=False):
        if np.hypot(*(end - start)) > SPREAD:
            ax.plot(*start, "o", markersize=5, color="white", markeredgecolor=INK, zorder=4)
            ax.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": INK, "shrinkB": 7}, zorder=4)
    if centers is not None:
        draw_centers(ax, centers, chosen)
    ax.set_title(title, fontsize=10, loc="left")
    return finish(ax, _words(effects, labels, centers, title))


def _words(effects: np.ndarray, labels: np.ndarray | None, centers: np.ndarray | None, title: str) -> str:
    parts = [
        f"{title}." if title else "",
        f"{len(effects)} effects: the height gained, dz, against the distance gained, dy.",
    ]
    if labels is not None:
        sizes = np.bincount(labels, minlength=0 if centers is None else len(centers)).tolist()
        parts.append(f"Classes of {', '.join(map(str, sizes))} samples.")
    if centers is not None:
        places = ", ".join(f"({y:.2f}, {z:.2f})" for y, z in centers.tolist())
        parts.append(f"Centres at {places} m.")
    return " ".join(filter(None, parts))


def draw_distances(effects: np.ndarray, centers: np.ndarray, sample: int) -> Figure:
    """Draw the distances of one sample to all centres: what its assignment is decided by.

    Parameters
    ----------
    effects : ndarray of shape (n_samples, 2)
        dy and dz of each sample [m].
    centers : ndarray of shape (n_classes, 2)
        The centres [m].
    sample : int
        The sample, a row of ``effects``.

    Returns
    -------
    matplotlib Figure
    """
    place = effects[sample]
    distances = np.linalg.norm(centers - place, axis=1)
    words = ", ".join(f"{distance:.2f} m to centre {c + 1}" for c, distance in enumerate(distances.tolist()))
    alt = f"One effect at dy = {place[0]:.2f} m, dz = {place[1]:.2f} m, and its distances to the centres: {words}."
    figure, ax = new_figure(alt, size=(6.8, 4.6))
    effect_axes(ax)
    draw_samples(ax, effects)
    for c, (center, distance) in enumerate(zip(centers, distances, strict=True)):
        nearest = c == distances.argmin()
        color = class_style(c + 1).color
        ax.plot(
            *np.array([place, center]).T,
            color=color,
            linewidth=2.4 if nearest else 1.2,
            linestyle="-" if nearest else "--",
            zorder=3,
        )
        ax.annotate(
            f"{distance:.2f} m", (place + center) / 2, (7, 4), textcoords="offset points", zorder=7, fontsize=9,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 1, "alpha": 0.85},
        )  # fmt: skip
    draw_centers(ax, centers)
    ax.plot(*place, "o", markersize=8, color=INK, zorder=7)
    ax.set_title(f"nearest: centre {distances.argmin() + 1}", fontsize=10, loc="left")
    return figure


def draw_turn(
    effects: np.ndarray,
    turns: Sequence[tuple[np.ndarray, np.ndarray]],
    turn: int = 0,
    best: float | None = None,
    chosen: int | None = None,
) -> Figure:
    """Draw one turn of K-Means: the centres, what is nearest to each, the way they came, and the inertia so far.

    Parameters
    ----------
    effects : ndarray of shape (n_samples, 2)
        dy and dz of each sample [m].
    turns : sequence of (centers, labels)
        The centres of each turn, and the nearest one of each sample.
    turn : int
        The turn to draw, from 0.
    best : float, optional
        An inertia to compare with [m²], as a dashed line.
    chosen : int, optional
        A centre to ring, from 0.

    Returns
    -------
    matplotlib Figure
    """
    centers, labels = turns[turn]
    inertias = [inertia(effects, *each) for each in turns]
    title = f"turn {turn}: J = {inertias[turn]:.2f} m²"
    fallen = ", ".join(f"{value:.2f}" for value in inertias[: turn + 1])
    alt = f"The plane of effects, and the inertia J, turn by turn {fallen} m²."
    figure, (plane, curve) = new_figure(alt, panels=2, size=(9.6, 3.9), columns=2)
    draw_effects(effects, labels, centers, regions=True, chosen=chosen, title=title, ax=plane)
    ways = np.array([each for each, _ in turns[: turn + 1]])
    for way in ways.transpose(1, 0, 2):
        plane.plot(*way.T, color=INK, linewidth=1.1, marker="o", markersize=2.5, zorder=4)
    curve.plot(range(len(turns)), inertias, color=GRID, linewidth=1.4, zorder=1)
    curve.plot(range(turn + 1), inertias[: turn + 1], "o-", color=INK, markersize=4, linewidth=1.4, zorder=2)
    curve.plot(turn, inertias[turn], "o", color=PATH, markersize=8, zorder=3)
    lowest, highest = min(*inertias, best or np.inf), max(inertias)
    if best is not None:
        curve.axhline(best, color=COLORS[1], linestyle="--", linewidth=1.2)
        curve.annotate(
            f"best known: {best:.1f}", (1, best), (-2, 4), xycoords=("axes fraction", "data"),
            textcoords="offset points", ha="right", fontsize=9, color=COLORS[1],
        )  # fmt: skip
    curve.set(yscale="log", ylim=(lowest / 1.5, highest * 1.6), xlim=(-0.5, max(len(turns) - 0.5, 4)), xlabel="turn")
    curve.set_ylabel("inertia J [m²] (logarithmic)")
    _plain_ticks(curve.yaxis, *curve.get_ylim())
    curve.xaxis.get_major_locator().set_params(integer=True)
    figure.set_layout_engine(None)  # places by hand: half the time to draw, for the exploration
    figure.subplots_adjust(left=0.07, right=0.985, bottom=0.14, top=0.93, wspace=0.2)
    return figure


def inertia(effects: np.ndarray, centers: np.ndarray, labels: np.ndarray) -> float:
    """Return the sum of squared distances of the samples to the centres of their classes [m²]."""
    return float(((effects - centers[labels]) ** 2).sum())


def draw_bins(values: np.ndarray, n_bins: int = 10, name: str = "dz") -> Figure:
    """Draw the histogram of one effect dimension, each bin that holds samples in the look of its class.

    Parameters
    ----------
    values : ndarray of shape (n_samples,)
        One effect dimension [m].
    n_bins : int
        Number of bins, the empty ones counted.
    name : str
        What the dimension is called.

    Returns
    -------
    matplotlib Figure
    """
    bins = HistogramBins(n_bins).fit(values)
    counts = np.bincount(bins.labels_).tolist()
    title = f"{n_bins} bins, {bins.n_clusters_} of them hold samples: {bins.n_clusters_} classes"
    words = ", ".join(f"{count} from {low:.2f} m" for count, (low, _) in zip(counts, bins.edges_, strict=True))
    figure, ax = new_figure(f"Histogram of {name}. {title}: {words}.", size=(7.2, 3.4))
    for number, (count, (low, high)) in enumerate(zip(counts, bins.edges_.tolist(), strict=True), 1):
        color, marker = class_style(number)
        ax.bar((low + high) / 2, count, high - low, color=color, edgecolor="white", linewidth=0.5, bottom=0, zorder=2)
        ax.plot((low + high) / 2, 1.6, marker, color="white", markeredgecolor=INK, markersize=7, zorder=4)
        ax.annotate(f"{count}", ((low + high) / 2, count), (0, 3), textcoords="offset points", ha="center", fontsize=9)
    margin = 0.03 * np.ptp(values)
    for edge in bins.bin_edges_:
        ax.axvline(edge, color=INK, linewidth=0.8, linestyle=":", zorder=3)
    ax.set(
        xlim=(values.min() - margin, values.max() + margin),
        yscale="log",
        ylim=(0.8, 5000),
        xlabel=f"{name} [m]",
        ylabel="samples (logarithmic)",
    )
    ax.yaxis.set_major_formatter("{x:.0f}")
    ax.set_title(title, fontsize=10, loc="left")
    figure.set_layout_engine(None)  # places by hand: half the time to draw, for animations
    figure.subplots_adjust(left=0.1, right=0.985, bottom=0.16, top=0.92)
    return figure


def draw_inertias(inertias: Mapping[str, Sequence[float]], size: tuple[float, float] = (7.2, 3.2)) -> Figure:
    """Draw where many starts of K-Means ended: a row for each way to start, a disc for each end, as large as it is frequent.

    Parameters
    ----------
    inertias : mapping of str to sequence of float
        Inertias at the end [m²], by the way to start.
    size : tuple of float
        Width and height [inches].

    Returns
    -------
    matplotlib Figure
    """
    ends = {name: _gathered(values) for name, values in inertias.items()}
    words = "; ".join(
        f"{name}: " + ", ".join(f"{count} at {end:.1f}" for end, count in each) for name, each in ends.items()
    )
    figure, ax = new_figure(f"Inertia in m² at the end, and how many starts ended there. {words}.", size=size)
    for row, each in enumerate(ends.values()):
        values, counts = np.array(each).T
        area = 900 * counts / counts.sum()
        ax.scatter(values, np.full(len(values), row), s=area, color=COLORS[1], alpha=0.6, edgecolors=INK, zorder=2)
        for value, count, size_ in zip(values, counts, area, strict=True):
            above = 3 + np.sqrt(size_) / 2
            ax.annotate(
                f"{count:.0f}", (value, row), (0, above), textcoords="offset points", ha="center", fontsize=9, zorder=3,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6},
            )  # fmt: skip
    ax.axvline(min(each[0][0] for each in ends.values()), color=PATH, linewidth=1.2, linestyle="--", zorder=1)
    ax.set_yticks(range(len(ends)), list(ends))
    ax.set(xscale="log", ylim=(len(ends) - 0.4, -0.6), xlabel="inertia J at the end [m²] (logarithmic)")
    _plain_ticks(ax.xaxis, *ax.get_xlim())
    ax.grid(axis="x", color=GRID, zorder=0)
    return figure


def _plain_ticks(axis: Axis, low: float, high: float) -> None:
    """Name 1, 2, 5, 10, 20 ... on a logarithmic axis, and nothing else."""
    ticks = [base * 10**power for power in range(4) for base in (1, 2, 5) if low <= base * 10**power <= high]
    axis.set_ticks(ticks, [f"{tick}" for tick in ticks])
    axis.set_minor_formatter("")


def _gathered(values: Sequence[float]) -> list[tuple[float, int]]:
    """Return mean and number of the values, those within 6 % of each other together; rising."""
    groups: list[list[float]] = []
    for value in sorted(values):
        if groups and value <= 1.06 * groups[-1][0]:
            groups[-1].append(value)
        else:
            groups.append([value])
    return [(float(np.mean(group)), len(group)) for group in groups]


def draw_far_samples(effects: np.ndarray, centers: np.ndarray, title: str = "") -> Figure:
    """Draw how probably each sample is drawn as the next centre by k-means++: in proportion to its squared distance to the nearest.

    Parameters
    ----------
    effects : ndarray of shape (n_samples, 2)
        dy and dz of each sample [m].
    centers : ndarray of shape (n_chosen, 2)
        The centres drawn so far [m], the last one the latest.
    title : str
        What stands above.

    Returns
    -------
    matplotlib Figure
    """
    squared = ((effects[:, None] - centers) ** 2).sum(axis=2).min(axis=1)
    share = squared / squared.sum()
    alt = (
        f"{title}. {len(centers)} centre{'s' * (len(centers) > 1)} drawn, the last at "
        f"dy = {centers[-1, 0]:.2f} m, dz = {centers[-1, 1]:.2f} m. "
        f"The likeliest sample for the next has a probability of {100 * share.max():.2f} %, the {int((share < 1e-4).sum())} "
        "samples nearest to a centre have together less than "
        f"{max(0.1, np.ceil(1000 * share[share < 1e-4].sum()) / 10):.1f} %."
    )
    figure, ax = new_figure(alt.removeprefix(". "), size=(6.8, 4.4))
    effect_axes(ax)
    y, z = spread(effects).T
    ax.scatter(y, z, s=2, color=OFF_MAP, zorder=1)
    drawn = ax.scatter(y, z, s=1 + 12000 * share, c=100 * share, cmap="cividis_r", vmin=0, vmax=0.6, zorder=2)
    draw_centers(ax, centers, chosen=len(centers) - 1)
    figure.colorbar(drawn, ax=ax, label="probability to be next [%]", shrink=0.8, extend="max")
    ax.set_title(title, fontsize=10, loc="left")
    return figure


def draw_agreement(table: np.ndarray, rows: Sequence[str], columns: Sequence[str], labels: tuple[str, str]) -> Figure:
    """Draw how two ways to sort the same samples agree: a table of counts, shaded by their share of the row.

    Parameters
    ----------
    table : ndarray of shape (n_rows, n_columns), int
        Samples in each pair of classes.
    rows, columns : sequence of str
        Names of the classes.
    labels : (str, str)
        What rows and columns stand for.

    Returns
    -------
    matplotlib Figure
    """
    words = "; ".join(
        f"{row}: " + ", ".join(f"{count} {column}" for count, column in zip(counts, columns, strict=True) if count)
        for row, counts in zip(rows, table.tolist(), strict=True)
    )
    size = (2.6 + 0.85 * len(columns), 1.2 + 0.42 * len(rows))
    figure, ax = new_figure(f"Table of samples by {labels[0]} and {labels[1]}. {words}.", size=size)
    shares = table / np.maximum(table.sum(axis=1, keepdims=True), 1)
    ax.imshow(shares, cmap="Blues", vmin=0, vmax=1.15, aspect="auto")
    for (row, column), count in np.ndenumerate(table):
        color = "white" if shares[row, column] > 0.5 else INK if count else "#a0a0a0"
        ax.text(column, row, f"{count}", ha="center", va="center", color=color)
    ax.set_xticks(range(len(columns)), columns)
    ax.set_yticks(range(len(rows)), rows)
    ax.set(ylabel=labels[0], xlabel=labels[1])
    ax.tick_params(length=0)
    ax.spines[:].set_visible(False)
    return figure


# The widget: centres moved by hand


def turns_from(effects: np.ndarray, centers: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Run K-Means from given centres until nothing changes.

    Parameters
    ----------
    effects : ndarray of shape (n_samples, 2)
        dy and dz of each sample [m].
    centers : ndarray of shape (n_classes, 2)
        First centres [m].

    Returns
    -------
    list of (centers, labels)
        The first as given; a class may be empty there.
    """
    model = KMeans(len(centers), init=centers, tol=0, record_history=True).fit(effects)
    steps = model.history_
    return [
        (step.centers, step.labels)
        for i, step in enumerate(steps)
        if not i or (step.centers != steps[i - 1].centers).any()
    ]


class MovableCenters(Exploration):
    """Centres to be placed by hand, from which K-Means then runs. Made by ``move_centers``.

    Where no kernel runs, three starts and the turns of K-Means can be chosen.

    Attributes
    ----------
    effects : ndarray of shape (n_samples, 2)
        dy and dz of each sample [m].
    best : float
        The smallest inertia of ten starts [m²].
    """

    def __init__(self, effects: np.ndarray) -> None:
        self.effects = effects
        self.best = float(KMeans(6, random_state=0).fit(effects).inertia_)
        self._runs = {name: turns_from(effects, np.array(centers)) for name, centers in STARTS.items()}

        def draw(start: str = "in a heap", turns: int = 0) -> Figure:
            return self.picture(self._runs[start], turns)

        labels = {"start": "centres at first", "turns": "turns of K-Means"}
        super().__init__(draw, labels, {"start": list(STARTS), "turns": range(TURNS)})

    def picture(self, run: list[tuple[np.ndarray, np.ndarray]], turns: int, chosen: int | None = None) -> Figure:
        """Draw a run after so many turns, or at its end if that comes before; ring a centre."""
        return draw_turn(self.effects, run, min(turns, len(run) - 1), self.best, chosen)

    def player(self, most: int = 21) -> Player:
        """Return a player that needs no kernel: seven moments of each run, of which none has more than ten."""
        return super().player(most)

    def widget(self) -> ipywidgets.Widget:
        """Return the live widget: a start, the chosen centre and its place, and the turns of K-Means.

        Raises
        ------
        ImportError
            If ipywidgets is not installed.
        """
        import ipywidgets

        wide: dict[str, Any] = {
            "style": {"description_width": "11em"},
            "layout": ipywidgets.Layout(width="32em", max_width="95%"),
            "continuous_update": False,
        }
        begin = self.start["start"]
        start = ipywidgets.ToggleButtons(
            options=list(STARTS), value=begin, description="all centres", style={"button_width": "8em"}
        )
        chosen = ipywidgets.IntSlider(1, 1, 6, description="chosen centre", **wide)
        dy = ipywidgets.FloatSlider(0.0, min=-0.2, max=2.0, step=0.02, description="its dy [m]", **wide)
        dz = ipywidgets.FloatSlider(0.0, min=-0.2, max=1.4, step=0.02, description="its dz [m]", **wide)
        turns = ipywidgets.IntSlider(0, 0, TURNS - 1, description="turns of K-Means", **wide)
        picture = ipywidgets.HTML()
        state: dict[str, Any] = {"centers": np.array(STARTS[begin]), "run": self._runs[begin], "quiet": False}

        def redraw() -> None:
            figure = self.picture(state["run"], turns.value, chosen.value - 1)
            picture.value = img(quick_png(figure, DPI), alt_text(figure), DPI)

        def show_place() -> None:
            state["quiet"] = True
            dy.value, dz.value = state["centers"][chosen.value - 1]
            state["quiet"] = False

        def place_all(_: Any) -> None:
            state["centers"], state["run"] = np.array(STARTS[start.value]), self._runs[start.value]
            show_place()
            back_to_start()

        def move(_: Any) -> None:
            if not state["quiet"]:
                state["centers"][chosen.value - 1] = dy.value, dz.value
                state["run"] = turns_from(self.effects, state["centers"].copy())
                back_to_start()

        def back_to_start() -> None:
            if turns.value:
                turns.value = 0  # redraws
            else:
                redraw()

        def choose(_: Any) -> None:
            show_place()
            redraw()

        start.observe(place_all, "value")
        chosen.observe(choose, "value")
        dy.observe(move, "value")
        dz.observe(move, "value")
        turns.observe(lambda _: redraw(), "value")
        redraw()
        return ipywidgets.VBox([chosen, dy, dz, turns, start, picture])


def move_centers(effects: np.ndarray) -> MovableCenters:
    """Offer six centres to be placed by hand, and K-Means to run from there.

    Parameters
    ----------
    effects : ndarray of shape (n_samples, 2)
        dy and dz of each sample [m].

    Returns
    -------
    MovableCenters
        Shown by a notebook as sliders and a picture.
    """
    return MovableCenters(effects)
