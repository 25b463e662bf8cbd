"""Lesson 06, how to place a few points well: the pictures of robust growing neural gas, and the outliers that it is tried on.

Everything is drawn in the network's plane: motions standardised over all samples, then centred and divided by one standard deviation
of their class, so that a distance means the same in all directions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from scipy.spatial.distance import cdist

from stairlab.clustering import KMeans, RGNGStep, RobustGrowingNeuralGas
from stairlab.drawing import COLORS, FAINT, GRID, INK, PATH, figure_legend, finish, make_axes, marker_handle
from stairlab.plots import LINES, class_style

TWO_STEPS = 4
""" Number of the class of jumps that gain two steps, whose look the samples have """
TELLING = (1, 4, 20)
""" Passes of each size that an animation of the growth shows """
PARTS = {
    "nodes": "the nodes",
    "names": "which node is near",
    "errors": "what is left",
    "outliers": "outliers, by themselves",
}
""" What the parts of a description length say """


def mean_distance(X: np.ndarray, nodes: np.ndarray) -> float:
    r"""Mean distance of a sample to its nearest node.

    .. math:: D = \frac{1}{N} \sum_{j=1}^{N} \min_i \lVert x_j - w_i \rVert

    Parameters
    ----------
    X : ndarray of shape (n_samples, n_features)
        Samples [standard deviations].
    nodes : ndarray of shape (n_nodes, n_features)
        Nodes, or the centres of K-Means [standard deviations].

    Returns
    -------
    float
        The distance [standard deviations].
    """
    return float(cdist(X, nodes).min(axis=1).mean())


def some_outliers(count: int, distance: float, seed: int = 0) -> np.ndarray:
    """Return points in random directions from the origin, all at one distance from it.

    Parameters
    ----------
    count : int
        Number of points.
    distance : float
        Their distance [standard deviations].
    seed : int
        Seed of the directions, which are the same for every distance.

    Returns
    -------
    ndarray of shape (count, 2)
    """
    angle = np.random.default_rng(seed).uniform(0, 2 * np.pi, size=count)
    return distance * np.column_stack([np.cos(angle), np.sin(angle)])


def four_blobs(seed: int = 0) -> np.ndarray:
    """Return 120 samples in four blobs that everybody sees, in a unit of their own, shape (120, 2)."""
    centers = 5.0 * np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
    X = np.repeat(centers, 30, axis=0) + 0.5 * np.random.default_rng(seed).normal(size=(120, 2))
    return (X - X.mean(axis=0)) / np.sqrt(X.var(axis=0).mean())


# Networks


def draw_network(
    X: np.ndarray,
    nodes: np.ndarray,
    edges: Any = (),
    *,
    outliers: np.ndarray | None = None,
    errors: np.ndarray | None = None,
    title: str = "",
    ax: Axes | None = None,
) -> Figure:
    """Draw samples, and the network among them: nodes with their numbers, the oldest is 0, and edges.

    Parameters
    ----------
    X : ndarray of shape (n_samples, 2)
        Samples [standard deviations].
    nodes : ndarray of shape (n_nodes, 2)
        Nodes [standard deviations].
    edges : array-like of shape (n_edges, 2)
        Pairs of node numbers.
    outliers : ndarray of shape (n_outliers, 2), optional
        Samples that are drawn as crosses.
    errors : ndarray of shape (n_nodes,), optional
        Errors of the nodes, written beside them [standard deviations].
    title : str
        What stands above.
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    matplotlib Figure
    """
    (ax,) = make_axes(ax, 1, (5.4, 4.2))
    _draw_samples(ax, X, outliers)
    for i, j in np.asarray(edges, dtype=int).reshape(-1, 2):
        ax.plot(*nodes[[i, j]].T, color=INK, linewidth=1.8, zorder=3)
    _draw_nodes(ax, nodes)
    if errors is not None:
        _write_errors(ax, nodes, errors, edges)
    ax.set_title(title, fontsize=10, loc="left")
    return finish(ax, f"{title or 'A network'}: {_describe(X, nodes, edges, outliers)}")


def draw_regions(X: np.ndarray, nodes: np.ndarray, ax: Axes | None = None) -> Figure:
    """Draw which node wins where: the plane and the samples have the colour of the nearest node.

    Parameters
    ----------
    X : ndarray of shape (n_samples, 2)
        Samples [standard deviations].
    nodes : ndarray of shape (n_nodes, 2)
        Nodes, at most ten [standard deviations].
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    matplotlib Figure
    """
    (ax,) = make_axes(ax, 1, (5.4, 4.2))
    low, high = X.min(axis=0) - 0.4, X.max(axis=0) + 0.4
    x, y = np.meshgrid(np.linspace(low[0], high[0], 300), np.linspace(low[1], high[1], 300))
    winners = cdist(np.column_stack([x.ravel(), y.ravel()]), nodes).argmin(axis=1).reshape(x.shape)
    colors = [class_style(i + 1).color for i in range(len(nodes))]
    ax.contourf(x, y, winners, levels=np.arange(len(nodes) + 1) - 0.5, colors=colors, alpha=0.22)
    labels = cdist(X, nodes).argmin(axis=1)
    for i in range(len(nodes)):
        color, marker = class_style(i + 1)
        ax.scatter(X[labels == i, 0], X[labels == i, 1], s=16, color=color, marker=marker, linewidths=0, zorder=2)
    _draw_nodes(ax, nodes)
    _plane(ax)
    counts = ", ".join(f"node {i} wins {count}" for i, count in enumerate(np.bincount(labels, minlength=len(nodes))))
    ax.set_title(counts, fontsize=10, loc="left")
    return finish(
        ax,
        f"The plane divided among {len(nodes)} nodes: each point has the colour of the nearest. Of the samples {counts}.",
    )


def draw_paths(X: np.ndarray, paths: Mapping[str, np.ndarray], ax: Axes | None = None) -> Figure:
    """Draw the way of a node, sample by sample, in several versions.

    Parameters
    ----------
    X : ndarray of shape (n_samples, 2)
        Samples [standard deviations].
    paths : mapping of str to ndarray of shape (n_steps, 2)
        Positions of the node by the version's name, from its start [standard deviations].
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    matplotlib Figure
    """
    (ax,) = make_axes(ax, 1, (6.2, 4.2))
    _draw_samples(ax, X, None)
    words = []
    for place, (name, path) in enumerate(paths.items()):
        color = (PATH, COLORS[1], INK)[place % 3]
        ax.plot(*path.T, color=color, linestyle=LINES[place % 2], linewidth=1.3, label=name, zorder=4 + place)
        ax.plot(*path[-1], "os^"[place % 3], color=color, markersize=9, markeredgecolor="white", zorder=7)
        reach = np.linalg.norm(path - path.mean(axis=0), axis=1).max()
        words.append(f"{name}: from {_at(path[0])} to {_at(path[-1])}, at most {reach:.1f} from the middle of its way")
    ax.plot(*next(iter(paths.values()))[0], "o", color="white", markeredgecolor=INK, markersize=9, zorder=8)
    ax.legend(frameon=False, fontsize=9, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return finish(ax, f"The way of a node among {len(X)} samples, sample by sample. {'; '.join(words)}.")


def draw_ages(X: np.ndarray, nodes: np.ndarray, ages: np.ndarray, title: str = "", limit: int = 100) -> Figure:
    """Draw a network's edges with their ages: the older, the fainter.

    Parameters
    ----------
    X : ndarray of shape (n_samples, 2)
        Samples [standard deviations].
    nodes : ndarray of shape (n_nodes, 2)
        Nodes [standard deviations].
    ages : ndarray of shape (n_nodes, n_nodes), int
        Age of the edge between two nodes, -1 where there is none; symmetric.
    title : str
        What stands above.
    limit : int
        The age at which edges are removed.

    Returns
    -------
    matplotlib Figure
    """
    (ax,) = make_axes(None, 1, (5.4, 4.2))
    _draw_samples(ax, X, None)
    pairs = np.argwhere(np.triu(ages >= 0, k=1))
    for i, j in pairs.tolist():
        youth = 1 - min(ages[i, j] / limit, 1)
        ax.plot(*nodes[[i, j]].T, color=INK, linewidth=0.8 + 2.7 * youth, alpha=0.35 + 0.65 * youth, zorder=3)
        x, y = nodes[[i, j]].mean(axis=0)
        ax.text(x, y, f"{ages[i, j]}", fontsize=9, ha="center", va="center", zorder=4,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 1})  # fmt: skip
    _draw_nodes(ax, nodes)
    ax.set_title(title, fontsize=10, loc="left")
    listed = ", ".join(f"{i}-{j}: {ages[i, j]}" for i, j in pairs.tolist()) or "none"
    return finish(ax, f"{title or 'A network'}: {len(nodes)} nodes, edges with their ages {listed}.")


def _draw_samples(ax: Axes, X: np.ndarray, outliers: np.ndarray | None) -> None:
    color, marker = class_style(TWO_STEPS)
    ax.scatter(X[:, 0], X[:, 1], s=14, color=color, marker=marker, alpha=0.5, linewidths=0, zorder=2)
    if outliers is not None:
        ax.scatter(outliers[:, 0], outliers[:, 1], s=36, color=PATH, marker="x", linewidths=1.5, zorder=2)
    _plane(ax)


def _plane(ax: Axes) -> None:
    ax.set(aspect="equal", xlabel="magnitude [sd]", ylabel="angle [sd]")
    ax.spines[["top", "right"]].set_visible(False)


def _draw_nodes(ax: Axes, nodes: np.ndarray, new: int | None = None) -> None:
    """Draw nodes with their numbers; the new one is yellow."""
    for i, (x, y) in enumerate(nodes.tolist()):
        fill = "#fff3a0" if i == new else "white"
        ax.plot(x, y, "o", markersize=15, color=fill, markeredgecolor=INK, markeredgewidth=1.5, zorder=5)
        ax.text(x, y, f"{i}", ha="center", va="center_baseline", fontsize=9, fontweight="bold", zorder=6)


def _write_errors(ax: Axes, nodes: np.ndarray, errors: np.ndarray, edges: Any) -> None:
    """Write each node's error beside it, on the side where it has no edges."""
    away, beside = np.zeros_like(nodes), {}
    for i, j in np.asarray(edges, dtype=int).reshape(-1, 2):
        way = (nodes[j] - nodes[i]) / np.linalg.norm(nodes[j] - nodes[i])
        away[i], away[j] = away[i] - way, away[j] + way
        beside[int(i)] = beside[int(j)] = np.array([way[1], -way[0]])
    for i in np.flatnonzero(np.linalg.norm(away, axis=1) < 0.1):  # halfway between two neighbours, or alone
        away[i] = beside.get(int(i), (1.0, 0.0))
    ax.margins(x=0.16)
    for node, error, (x, y) in zip(nodes, errors, away, strict=True):
        place = 13 * np.array([x, y]) / max(np.hypot(x, y), 1e-9)
        ax.annotate(f"error {error:.1f}", node, place, textcoords="offset points", fontsize=9, zorder=6,
                    ha="right" if x < 0 else "left", va="top" if y < 0 else "bottom",
                    bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 1})  # fmt: skip


def _at(point: np.ndarray) -> str:
    return f"({point[0]:.1f}, {point[1]:.1f})"


def _describe(X: np.ndarray, nodes: np.ndarray, edges: Any, outliers: np.ndarray | None) -> str:
    joined = ", ".join(f"{i}-{j}" for i, j in np.asarray(edges, dtype=int).reshape(-1, 2).tolist())
    return (
        f"{len(nodes)} node{'s' if len(nodes) != 1 else ''} at {', '.join(_at(node) for node in nodes)} among {len(X)} samples"
        + (f" and {len(outliers)} outliers" if outliers is not None and len(outliers) else "")
        + (f"; edges {joined}." if joined else ".")
    )


# Growth


def telling_steps(history: Sequence[RGNGStep], passes: Sequence[int] = TELLING) -> list[int]:
    """Return the places of a history that an animation shows: the start, every insertion, and some passes after each."""
    chosen, made = [], 0
    for place, step in enumerate(history):
        made = made + 1 if step.event == "pass" else 0
        if step.event != "pass" or made in passes:
            chosen.append(place)
    return chosen


def draw_growth(
    X: np.ndarray, history: Sequence[RGNGStep], step: int = 0, outliers: np.ndarray | None = None
) -> Figure:
    """Draw one moment of a recorded growth, and how far samples are from their nearest node in all of it.

    Parameters
    ----------
    X : ndarray of shape (n_samples, 2)
        The samples without outliers [standard deviations].
    history : sequence of RGNGStep
        As ``RobustGrowingNeuralGas(record_history=True)`` keeps it.
    step : int
        Which moment: 0 is the start; beyond the end of the history it is the last.
    outliers : ndarray of shape (n_outliers, 2), optional
        Samples that are drawn as crosses; they do not count in the distance.

    Returns
    -------
    matplotlib Figure
    """
    step = min(step, len(history) - 1)
    now = history[step]
    left, right = make_axes(None, 2, (9.6, 4.2), columns=2)
    _draw_samples(left, X, outliers)
    for i, j in now.edges.tolist():
        left.plot(*now.nodes[[i, j]].T, color=INK, linewidth=1.8, zorder=3)
    _draw_nodes(left, now.nodes, new=len(now.nodes) - 1 if now.event == "insertion" else None)
    distances = [mean_distance(X, one.nodes) for one in history]
    sizes = [len(one.nodes) for one in history]
    right.plot(distances, color=FAINT, linewidth=1.2)
    right.plot(distances[: step + 1], color=INK, linewidth=1.8)
    right.plot(step, distances[step], "o", color=PATH, markersize=9)
    for place, one in enumerate(history):
        if one.event != "pass":
            right.axvline(place, color=GRID, zorder=0)
            right.text(place + 1, 1.0, f"{sizes[place]}", transform=right.get_xaxis_transform(), va="top", fontsize=9)
    right.set(
        ylim=(0, 1.1 * max(distances)), xlabel="event: start, pass or insertion", ylabel="mean distance to a node [sd]"
    )
    right.spines[["top", "right"]].set_visible(False)
    title = _moment(history, step)
    left.set_title(title, fontsize=10, loc="left")
    right.set_title("number of nodes along the top", fontsize=10, loc="left")
    return finish(
        left,
        f"{title}: {_describe(X, now.nodes, now.edges, outliers)} Samples are {distances[step]:.2f} standard deviations from their "
        f"nearest node on average; over the whole growth this falls from {distances[0]:.2f} to {distances[-1]:.2f}.",
    )


def _moment(history: Sequence[RGNGStep], step: int) -> str:
    now = history[step]
    if now.event != "pass":
        return (
            "2 nodes, the start"
            if now.event == "start"
            else f"{len(now.nodes)} nodes, node {len(now.nodes) - 1} is new"
        )
    made = next(back for back in range(1, step + 1) if history[step - back].event != "pass")
    return f"{len(now.nodes)} nodes, after pass {made}"


# The description length


def draw_tug_of_war(parts: Mapping[int, Mapping[str, float]]) -> Figure:
    """Draw what more nodes cost and what they save, in bits against the smallest network.

    Parameters
    ----------
    parts : mapping of int to mapping of str to float
        For each number of nodes the bits of "nodes", "names", "errors" and "outliers".

    Returns
    -------
    matplotlib Figure
    """
    (ax,) = make_axes(None, 1, (6.8, 4.0))
    sizes = sorted(parts)
    change = {name: np.array([parts[m][name] - parts[sizes[0]][name] for m in sizes]) for name in PARTS}
    up, down = np.zeros(len(sizes)), np.zeros(len(sizes))
    for (name, bits), color, hatch in zip(
        change.items(), (COLORS[1], COLORS[0], COLORS[3], FAINT), ("", "....", "////", "xxxx"), strict=True
    ):
        if not bits.any():
            continue
        ax.bar(sizes, bits, 0.6, np.where(bits > 0, up, down), color=color, hatch=hatch, edgecolor=INK, linewidth=0.6,
               label=PARTS[name])  # fmt: skip
        up, down = up + np.maximum(bits, 0), down + np.minimum(bits, 0)
    total = np.sum(list(change.values()), axis=0)
    ax.plot(sizes, total, "o-", color=PATH, markeredgecolor="white", markersize=8, linewidth=2, label="sum", zorder=4)
    best = sizes[int(total.argmin())]
    ax.plot(
        best,
        total.min(),
        "o",
        markersize=17,
        markerfacecolor="none",
        markeredgecolor=PATH,
        markeredgewidth=1.6,
        zorder=4,
    )
    ax.axhline(0, color=INK, linewidth=0.8)
    ax.set(xlabel="nodes [count]", ylabel=f"bits more than with {sizes[0]} nodes")
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.spines[["top", "right"]].set_visible(False)
    ax.legend(frameon=False, fontsize=9, loc="center left", bbox_to_anchor=(1.0, 0.5))
    listed = ", ".join(f"{m}: {bits:+.0f}" for m, bits in zip(sizes, total, strict=True))
    return finish(
        ax,
        f"Bars of bits by number of nodes, against {sizes[0]} nodes: nodes and names cost more, what is left to say of the samples "
        f"costs less. Sum: {listed}. The smallest, at {best} nodes, is ringed.",
    )


def draw_choices(lengths: Mapping[str, Sequence[Mapping[int, float]]]) -> Figure:
    """Draw description lengths by size for many seeds, each above its own smallest one, and how often each size is kept.

    Parameters
    ----------
    lengths : mapping of str to sequence of mappings of int to float
        For each data set the ``mdl_`` of networks grown with several seeds [bits].

    Returns
    -------
    matplotlib Figure
    """
    panels = make_axes(None, len(lengths), (4.6 * len(lengths), 3.6), columns=len(lengths))
    words = []
    for panel, (name, seeds) in zip(panels, lengths.items(), strict=True):
        kept = [min(one, key=lambda m: one[m]) for one in seeds]
        for one in seeds:
            sizes = sorted(one)
            panel.plot(sizes, [one[m] - min(one.values()) for m in sizes], color=COLORS[1], alpha=0.35, linewidth=1)
        counts = {m: kept.count(m) for m in sorted(set(kept))}
        for m, count in counts.items():
            panel.plot(m, 0, "o", color=PATH, markersize=4 + 9 * count / len(seeds), zorder=4, clip_on=False)
            panel.annotate(f"{count}", (m, 0), (0, -11), textcoords="offset points", ha="center", va="top", fontsize=9,
                           annotation_clip=False)  # fmt: skip
        top = max(max(one.values()) - min(one.values()) for one in seeds)
        panel.set(xlabel="nodes [count]", ylabel="bits above the shortest", ylim=(-0.14 * top, 1.05 * top))
        panel.yaxis.set_major_locator(MaxNLocator(5, prune=None))
        panel.set_yticks([tick for tick in panel.get_yticks() if 0 <= tick <= top])
        panel.xaxis.set_major_locator(MaxNLocator(integer=True))
        panel.spines[["top", "right"]].set_visible(False)
        panel.set_title(f"{name}: kept by how many of {len(seeds)} seeds", fontsize=10, loc="left")
        listed = ", ".join(f"{m} nodes {count} times" for m, count in counts.items())
        words.append(f"{name}: kept are {listed}; lengths differ by up to {top:.0f} bits")
    return finish(panels[0], f"Description lengths by number of nodes, a line for each seed. {'. '.join(words)}.")


# Against K-Means


def draw_rivals(X: np.ndarray, count: int = 6, distance: float = 10.0, max_nodes: int = 4, seed: int = 0) -> Figure:
    """Fit robust growing neural gas and K-Means, with as many centres as it keeps nodes, to samples with outliers, and draw both.

    Parameters
    ----------
    X : ndarray of shape (n_samples, 2)
        Samples [standard deviations].
    count : int
        Number of outliers.
    distance : float
        Their distance from the origin [standard deviations].
    max_nodes : int
        Largest number of nodes.
    seed : int
        Seed of everything.

    Returns
    -------
    matplotlib Figure
    """
    outliers = some_outliers(count, distance, seed)
    panels = make_axes(None, 2, (9.6, 4.2), columns=2)
    words = []
    for panel, (name, nodes) in zip(panels, rivals(np.vstack([X, outliers]), max_nodes, seed).items(), strict=True):
        _draw_samples(panel, X, outliers)
        panel.plot(*nodes.T, "o", markersize=8, color="white", markeredgecolor=INK, markeredgewidth=1.8, zorder=5)
        apart = mean_distance(X, nodes)
        panel.set_title(f"{name}: mean distance {apart:.2f} sd", fontsize=10, loc="left")
        words.append(
            f"{name} has nodes at {', '.join(_at(node) for node in nodes)}, mean distance of a sample {apart:.2f}"
        )
    node = marker_handle("white", "o", "node or centre", markeredgecolor=INK, markeredgewidth=1.8)
    figure_legend(
        panels[0], [_sample_handle(), marker_handle(PATH, "x", "outlier", markeredgewidth=1.5), node], "lower center", 3
    )
    return finish(
        panels[0], f"{len(X)} samples and {count} outliers at {distance:g} standard deviations. {'; '.join(words)}."
    )


def rivals(X: np.ndarray, max_nodes: int, seed: int = 0) -> dict[str, np.ndarray]:
    """Return the nodes that robust growing neural gas keeps, and as many centres of K-Means, shapes (n_nodes, n_features)."""
    nodes = RobustGrowingNeuralGas(max_nodes, random_state=seed).fit(X).nodes_
    return {"K-Means": KMeans(len(nodes), random_state=seed).fit(X).cluster_centers_, "RGNG": nodes}


def _sample_handle() -> Any:
    color, marker = class_style(TWO_STEPS)
    return marker_handle(color, marker, "sample", markersize=5)
