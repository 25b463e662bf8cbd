"""The figures of the paper, and the few that the course adds: each function takes results and returns a matplotlib ``Figure``.

Three conventions hold for all of them.

- **Figures do not go through pyplot.** They are made as ``matplotlib.figure.Figure``, so nothing piles up and no backend is
  chosen. In a notebook a figure is shown once, where it is the last expression of a cell. To draw into axes of one's own, give
  ``ax`` (or ``axes`` where there are several panels); with pyplot's axes, end the cell's last line with ``;``, since pyplot shows its
  figures itself.
- **Class k looks the same everywhere**: one colour and one marker for each class number (``class_style``).
- **Every figure says in words what it shows**: ``alt_text(figure)``. In a notebook the text goes with the picture.
"""

from __future__ import annotations

import copy
import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon, Rectangle
from matplotlib.ticker import MaxNLocator, PercentFormatter
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from stairlab._validation import finite_number
from stairlab.drawing import (
    COLORS,
    CUBE,
    FAINT,
    GRID,
    INK,
    OFF_MAP,
    PATH,
    STAIRS,
    Picture,
    expect,
    figure_legend,
    finish,
    legend_below,
    make_axes,
    marker_handle,
)
from stairlab.effects import OFF_THE_MAP, EffectClasses
from stairlab.fidelity import CLOSE, GAP_BINS, Fidelity, TreadFidelity, TreadMeasures
from stairlab.physics import CUBE_EDGE, NO_RISER, Staircase, Trajectory
from stairlab.prototypes import Prototypes
from stairlab.sampling import Samples
from stairlab.tumbling import HALF_WIDTH
from stairlab.world import FEATURES, CubeWorld, Jump, yaw_of

MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "p")
""" Markers of classes 1 to 10: told apart without colours """
LINES = ("-", "--", "-.", ":", (0, (6, 1, 1, 1, 1, 1)))
BIN = 0.02
""" Width of a bin in the distributions of effects [m] """
SEEN_AHEAD = 2.5
""" Where the last tread is longer, this much of it is drawn [m] """
CORNERS = CUBE_EDGE / 2 * np.array(list(itertools.product((-1, 1), repeat=3)))
""" The cube's eight corners, seen from its centre, before it turns; x, y, z [m] """
SIDE, ABOVE = (1, 2), (1, 0)
""" The axes that are seen from the side, y and z, and from above, y and x """
LONGEST_VIEW = 3.0
""" Of stairs longer than this, a jump's two views show what is around the jump [m] """
SEEN_ASIDE = 0.3
""" A view from above shows at least this much to both sides of a jump [m] """
UNITS = {"magnitude": "N", "angle": "°"}
SET_NAMES = {
    "effect": "effect classes, ξ for each",
    "fixed": "effect classes, up to {} for each",
    "random": "random",
    "uniform": "uniform grid",
}
""" What a set of prototypes is called in a figure, by its method """
WORLD_STYLES = {"tumbling": (COLORS[4], "--", "s"), "plane": (COLORS[1], ":", "^")}
""" Colour, line and marker of a world, beside what was recorded, which is black, with a full line and dots """
FEWEST = 10
""" A probability is drawn where at least so many jumps speak of it """
SHOWN_SHARE = 0.05
""" A height is named in a class's gloss where at least this share of the class gained it """


class ClassStyle(NamedTuple):
    """How a class is drawn, in every figure."""

    color: str
    marker: str


def class_style(number: int) -> ClassStyle:
    """Return colour and marker of class ``number`` (from 1); beyond ten classes, colours meet other markers."""
    turn, place = divmod(number - 1, len(COLORS))
    return ClassStyle(COLORS[place], MARKERS[(place + 3 * turn) % len(MARKERS)])


def class_glosses(classes: EffectClasses, rise: float = Staircase.rise) -> dict[int, str]:
    """Say in words what each class of jumps does, such as "1 step" or "0 steps, 0.29 m".

    Parameters
    ----------
    classes : EffectClasses
        The classes.
    rise : float
        Height of a step [m].

    Returns
    -------
    dict of int to str
        By class number: the heights that at least 5 % of the class gained, and the mean dy [m] where that does not tell two
        classes apart. Empty words where the samples are not of the stairs.
    """
    samples = expect("classes", classes, EffectClasses).samples
    if samples.feature_names != FEATURES:
        return dict.fromkeys(classes.numbers, "")
    dy, dz = samples.effect("dy", "dz").T
    heights = {n: _heights(np.round(dz[classes.labels == n] / rise).astype(int)) for n in classes.numbers}
    return {
        n: words if list(heights.values()).count(words) == 1 else f"{words}, {dy[classes.labels == n].mean():.2f} m"
        for n, words in heights.items()
    }


def _heights(steps: np.ndarray) -> str:
    levels, counts = np.unique(steps, return_counts=True)
    levels = levels[counts >= SHOWN_SHARE * len(steps)].tolist()
    if levels == [1]:
        return "1 step"
    together = len(levels) > 2 and levels[-1] - levels[0] == len(levels) - 1
    return (f"{levels[0]} to {levels[-1]}" if together else " or ".join(map(str, levels))) + " steps"


def class_names(classes: EffectClasses) -> dict[int, str]:
    """Return the name of each class as legends show it: "$C_3$: 1 step"."""
    return {n: f"$C_{{{n}}}$" + (f": {gloss}" if gloss else "") for n, gloss in class_glosses(classes).items()}


# Figure 1: the world


def plot_world(world_or_jump: CubeWorld | Jump, staircase: Staircase | None = None, ax: Axes | None = None) -> Figure:
    """Draw the stairs and the cube from the side: where a world has it now, or a jump from start to end (figure 1).

    ``plot_jump_views`` shows a jump from above, too.

    Parameters
    ----------
    world_or_jump : CubeWorld or Jump
        In the plane or in three dimensions. For the path, make the jump with ``trajectory=True``; without one only start and end are
        drawn.
    staircase : Staircase, optional
        The stairs that a jump was made on; four steps by default. A world knows its own.
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    matplotlib Figure
    """
    shown = expect("world_or_jump", world_or_jump, (CubeWorld, Jump))
    stairs = shown.staircase if isinstance(shown, CubeWorld) else staircase or Staircase()
    (ax,) = make_axes(ax, 1, (7.6, 5.0))
    states = [shown.state] if isinstance(shown, CubeWorld) else [shown.start, shown.end]
    top = max(stairs.top + 0.35, *(float(state[2]) + 0.2 for state in states))
    if isinstance(shown, Jump) and shown.trajectory is not None:
        top = max(top, float(shown.trajectory.z.max()) + 0.15)
    draw_stairs(ax, stairs, top, max(float(state[1]) for state in states))
    if isinstance(shown, CubeWorld):
        draw_cube(ax, *pose(states[0]))
        _draw_d_obs(ax, states[0])
        return finish(ax, f"Side view of {stairs.n_steps} steps and the cube at {_place(states[0])}.")
    _draw_jump(ax, shown)
    motion, effect = _motion_words(shown), _effect_words(shown)
    ax.set_title(f"motion: {motion}        effect: {effect}", fontsize=10, loc="left")
    return finish(
        ax,
        f"Side view of {stairs.n_steps} steps. The cube starts at {_place(states[0])}, is pushed with {motion}, and comes to rest at "
        f"{_place(states[1])}: {effect}.",
    )


def _motion_words(jump: Jump) -> str:
    return f"{jump.magnitude:.0f} N at {jump.angle:.0f}°"


def _effect_words(jump: Jump) -> str:
    """Say what a jump did, such as "Δy = +1.10 m, Δz = +0.60 m"; with Δx where it shows."""
    words = f"Δy = {_signed(jump.dy)} m, Δz = {_signed(jump.dz)} m"
    aside = _signed(float(jump.effect[0]))
    return words if aside == "0.00" else f"Δx = {aside} m, {words}"


def _signed(value: float) -> str:
    """Return a number with two decimals and its sign; none where it is 0.00."""
    return f"{value:+.2f}" if abs(value) >= 0.005 else "0.00"


def _place(state: np.ndarray) -> str:
    return f"y = {state[1]:.2f} m, z = {state[2]:.2f} m"


def pose(state: np.ndarray) -> tuple[float, float, float | np.ndarray]:
    """Return how a state is seen from the side: y, z [m], and rotation about the x-axis [rad], or a quaternion if that is not all."""
    y, z = float(state[1]), float(state[2])
    return y, z, np.array(state[3:7]) if state[4] or state[5] else 2 * math.atan2(state[3], state[6])


def pose_at(path: Trajectory, i: int) -> tuple[float, float, float | np.ndarray]:
    """Return how entry ``i`` of a path is seen from the side, as ``pose`` has it."""
    y, z = float(path.y[i]), float(path.z[i])
    return y, z, float(path.rotation[i]) if path.quaternions is None else path.quaternions[i]


def draw_stairs(ax: Axes, stairs: Staircase, top: float, right: float) -> None:
    """Draw the stairs from the side, up to the height ``top``, at least as far as y = ``right`` [m]."""
    seen = min(stairs.end, float(stairs.risers[-1]) + SEEN_AHEAD)
    begin, end, low = -0.1, max(seen, right) + 0.25, -0.16
    outline = [(begin, low), (begin, 0.0), (stairs.first_riser, 0.0)]
    for left, far, height in stairs.treads.tolist():
        outline += [(left, height), (far, height)]
    outline += [(stairs.end, 0.0), (max(end, stairs.end), 0.0), (max(end, stairs.end), low)]
    ax.add_patch(Polygon(outline, facecolor=STAIRS, edgecolor=INK, linewidth=0.8, zorder=1))
    ax.set(xlim=(begin, end), ylim=(low, top), aspect="equal", xlabel="y [m]", ylabel="z [m]")
    ax.spines[["top", "right"]].set_visible(False)


def cube_corners(y: float, z: float, rotation: float | np.ndarray) -> np.ndarray:
    """Corners of the cube with its centre at ``y``, ``z`` [m], as it is seen from the side.

    Parameters
    ----------
    y, z : float
        Centre [m].
    rotation : float or ndarray of shape (4,)
        Rotation about the x-axis [rad], or a quaternion x, y, z, w.

    Returns
    -------
    ndarray of shape (n, 2)
        Four corners in the plane, up to six of a cube that is turned otherwise: its outline, counterclockwise.
    """
    if np.ndim(rotation) == 1:
        return np.array([y, z]) + cube_outline(np.asarray(rotation), SIDE)
    turned = rotation + math.pi / 4 + math.pi / 2 * np.arange(4)
    reach = CUBE_EDGE / math.sqrt(2)
    return np.column_stack([y + reach * np.cos(turned), z + reach * np.sin(turned)])


def cube_outline(quaternion: np.ndarray, axes: tuple[int, int] = SIDE) -> np.ndarray:
    """Return the outline of a turned cube about its centre: the convex hull of its eight corners, seen along the third axis.

    Parameters
    ----------
    quaternion : ndarray of shape (4,)
        Rotation x, y, z, w.
    axes : tuple of two int
        The axes that are seen, 0 to 2 for x to z: ``SIDE`` or ``ABOVE``.

    Returns
    -------
    ndarray of shape (n, 2)
        Four to six corners, counterclockwise [m].
    """
    corners = Rotation.from_quat(quaternion).apply(CORNERS)[:, axes]
    return corners[ConvexHull(corners).vertices]


def draw_cube(ax: Axes, y: float, z: float, rotation: float | np.ndarray, **style: Any) -> Polygon:
    """Draw the cube with its centre at ``y``, ``z`` [m], seen from the side; its rotation is an angle [rad] or a quaternion."""
    return _draw_outline(ax, cube_corners(y, z, rotation), style)


def _draw_outline(ax: Axes, corners: np.ndarray, style: Mapping[str, Any]) -> Polygon:
    look: dict[str, Any] = {"facecolor": CUBE, "edgecolor": INK, "linewidth": 1.0, "zorder": 4, **style}
    cube = Polygon(corners, **look)
    ax.add_patch(cube)
    return cube


def _draw_jump(ax: Axes, jump: Jump) -> None:
    if jump.trajectory is not None:
        path = jump.trajectory
        ax.plot(path.y, path.z, color=PATH, linewidth=1.5, zorder=3, label="path of the centre")
        for i in _moments(path.y, path.z, 6):
            draw_cube(ax, *pose_at(path, i), facecolor="none", edgecolor=FAINT, zorder=2)
    apart = abs(jump.end[1] - jump.start[1]) > 0.5 or abs(jump.end[2] - jump.start[2]) > CUBE_EDGE
    for state in (jump.start, jump.end):
        draw_cube(ax, *pose(state))
    for state in (jump.start, jump.end)[: 2 if apart else 1]:  # words that would lie on each other
        _draw_d_obs(ax, state)
    _draw_push(ax, jump)
    for words, state, side in (("start", jump.start, -1), ("end", jump.end, -1 if apart else 1)):
        where: dict[str, Any] = {"ha": "right" if side < 0 else "left", "va": "center", "fontsize": 9, "zorder": 7}
        ax.annotate(words, (state[1], state[2]), (14 * side, 0), textcoords="offset points", **where)


def _draw_push(ax: Axes, jump: Jump) -> None:
    y, z, _ = pose(jump.start)
    length, angle = 0.1 + 0.25 * jump.magnitude / 1000, math.radians(jump.angle)
    head = (y + length * math.cos(angle), z + length * math.sin(angle))
    ax.annotate("", head, (y, z), arrowprops={"arrowstyle": "-|>", "color": INK, "linewidth": 1.8}, zorder=6)


def _moments(y: np.ndarray, z: np.ndarray, count: int) -> list[int]:
    """Return rows at equal distances along a path, its ends left out."""
    walked = np.append(0.0, np.hypot(np.diff(y), np.diff(z)).cumsum())
    return np.searchsorted(walked, walked[-1] * np.arange(1, count + 1) / (count + 1)).tolist()


def _draw_d_obs(ax: Axes, state: np.ndarray) -> None:
    y, z, distance = float(state[1]), float(state[2]), float(state[7])
    left, right = ax.get_xlim()
    if distance >= NO_RISER or distance < max(1.5 * CUBE_EDGE, 0.06 * (right - left)):
        return  # none, or too short for the words
    height = z - 0.9 * CUBE_EDGE  # a dimension line inside the ground
    arrow = {"arrowstyle": "<->", "color": INK, "linewidth": 0.8, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", (y + distance, height), (y, height), arrowprops=arrow)
    words = f"$d_\\mathrm{{obs}}$ = {distance:.2f} m"
    ax.text(y + distance / 2, height - 0.01, words, ha="center", va="top", fontsize=9, zorder=7)


def plot_jump_views(
    jump: Jump, staircase: Staircase | None = None, time: float | None = None, axes: Sequence[Axes] | None = None
) -> Figure:
    """Draw a jump from the side and, below, from above: its path, the cube on its way, and where it ends.

    In the view from above the robot looks to the right, so that +x, its right hand, points down. Axes depend on the whole jump and
    not on ``time``, so that the pictures of a film fit together.

    Parameters
    ----------
    jump : Jump
        In three dimensions or in the plane, with its path: made with ``trajectory=True``.
    staircase : Staircase, optional
        The stairs that it was made on; four steps by default.
    time : float, optional
        Draw it as it is so long after the push began [s]; by default the whole jump.
    axes : sequence of two matplotlib Axes, optional
        Where to draw, side and top; a new figure by default.

    Returns
    -------
    matplotlib Figure

    Raises
    ------
    ValueError
        If the jump has no path, or ``time`` is negative.
    """
    path, stairs = expect("jump", jump, Jump).trajectory, staircase or Staircase()
    if path is None:
        raise ValueError("jump must have its path: make it with world.jump(..., trajectory=True).")
    last = len(path.time) - 1
    now = last if time is None else min(int(np.searchsorted(path.time, finite_number("time", time, low=0))), last)
    x = np.full(len(path.time), jump.start[0]) if path.x is None else path.x
    side, above = _view_axes(axes, stairs, path, x)
    done = time is None
    draw_cube(side, *pose(jump.start), facecolor="none", linestyle=":", zorder=4)
    draw_cube_from_above(above, x[0], jump.start[1], jump.start[3:7], facecolor="none", linestyle=":")
    if done:
        _draw_push(side, jump)
    for i in _moments(path.y, path.z, 9) if done else ():
        faint: dict[str, Any] = {"facecolor": "none", "edgecolor": FAINT, "zorder": 2}
        draw_cube(side, *pose_at(path, i), **faint)
        draw_cube_from_above(above, x[i], path.y[i], _quaternion_at(path, i), **faint)
    for ax, seen in ((side, path.z), (above, x)):
        ax.plot(path.y[: now + 1], seen[: now + 1], color=PATH, linewidth=1.5, zorder=3)
    draw_cube(side, *pose_at(path, now), zorder=5)
    draw_cube_from_above(above, x[now], path.y[now], _quaternion_at(path, now), zorder=5)
    aside, turned = 100 * float(x[now] - x[0]), abs(yaw_of(*_quaternion_at(path, now)))
    motion, effect = _motion_words(jump), _effect_words(jump)
    title = f"motion: {motion}        effect: {effect}" if done else f"t = {1000 * path.time[now]:.0f} ms"
    side.set_title(title, fontsize=10, loc="left")
    where = f"{abs(aside):.0f} cm aside, turned by {turned:.0f}°"
    above.set_title(f"from above: {where}", fontsize=10, loc="left")
    when = f"comes to rest: {effect}" if done else f"is shown {path.time[now]:.3f} s after the push began"
    return finish(
        side,
        f"A jump on {stairs.n_steps} steps, from the side and from above. The cube is pushed with {motion} and {when}. It is {where} "
        "about the vertical.",
    )


def _view_axes(axes: Sequence[Axes] | None, stairs: Staircase, path: Trajectory, x: np.ndarray) -> list[Axes]:
    """Return axes for the views from the side and from above, with the stairs: one scale, and y shared."""
    right, top = float(path.y.max()), max(stairs.top + 0.35, float(path.z.max()) + 0.15)
    window = (-0.1, max(stairs.end, right) + 0.25, -0.16, top)
    if window[1] - window[0] > LONGEST_VIEW:  # long stairs: what is around the jump
        window = (float(path.y.min()) - 0.6, right + 0.6, float(path.z.min()) - 0.45, float(path.z.max()) + 0.6)
    low, high = float(x.min()) - SEEN_ASIDE, float(x.max()) + SEEN_ASIDE
    if axes is None:
        heights = (window[3] - window[2], high - low)
        metre = min(6.8 / (window[1] - window[0]), 5.0 / sum(heights))
        size = (max(5.0, metre * (window[1] - window[0]) + 0.8), metre * sum(heights) + 1.5)
        figure = Picture(figsize=size, layout="constrained")
        axes = figure.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": heights}).tolist()
    side, above = make_axes(axes, 2, (1, 1))
    draw_stairs(side, stairs, top, right)
    draw_stairs_from_above(above, stairs, *side.get_xlim())
    side.set(xlim=window[:2], ylim=window[2:])
    side.tick_params(labelbottom=True)
    above.set(xlim=window[:2], ylim=(high, low))
    return [side, above]


def _quaternion_at(path: Trajectory, i: int) -> np.ndarray:
    """Return the quaternion of entry ``i`` of a path, shape (4,)."""
    if path.quaternions is not None:
        return path.quaternions[i]
    return np.array([math.sin(path.rotation[i] / 2), 0.0, 0.0, math.cos(path.rotation[i] / 2)])


def draw_stairs_from_above(ax: Axes, stairs: Staircase, left: float, right: float) -> None:
    """Draw the stairs from above, between y = ``left`` and ``right`` [m]: the higher, the lighter; x points down."""
    levels = [(left, stairs.first_riser, 0.0), *stairs.treads.tolist(), (stairs.end, max(right, stairs.end), 0.0)]
    for begin, end, height in levels:
        shade = str(0.72 + 0.24 * height / stairs.top)
        extent: dict[str, Any] = {"facecolor": shade, "edgecolor": INK, "linewidth": 0.6, "zorder": 1}
        ax.add_patch(Rectangle((begin, -HALF_WIDTH), end - begin, 2 * HALF_WIDTH, **extent))
    ax.set(xlim=(left, right), ylim=(SEEN_ASIDE, -SEEN_ASIDE), aspect="equal", xlabel="y [m]", ylabel="x [m]")
    ax.spines[["top", "right"]].set_visible(False)


def draw_cube_from_above(ax: Axes, x: float, y: float, quaternion: np.ndarray, **style: Any) -> Polygon:
    """Draw the cube with its centre at ``x``, ``y`` [m], turned by a quaternion, seen from above; y to the right."""
    return _draw_outline(ax, np.array([y, x]) + cube_outline(quaternion, ABOVE), style)


# Figures 2 and 7: effect classes in motion space


def plot_effect_classes(classes: EffectClasses, ax: Axes | None = None) -> Figure:
    """Draw the samples in motion space, by effect class (figure 2).

    The classes were found in effect space; that they form coherent regions here shows how closely the two spaces are related.

    Parameters
    ----------
    classes : EffectClasses
        Classes of samples with two motion parameters.
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    matplotlib Figure
    """
    (panel,) = make_axes(ax, 1, (7.6, 5.0))
    _scatter(panel, expect("classes", classes, EffectClasses))
    _class_legend(panel, classes)
    return finish(panel, _describe_classes(classes))


def plot_feature_comparison(
    classes_yz: EffectClasses, classes_xyz: EffectClasses, axes: Sequence[Axes] | None = None
) -> Figure:
    """Draw the effect classes of two sets of features side by side (figure 7, Appendix C).

    Parameters
    ----------
    classes_yz, classes_xyz : EffectClasses
        Classes on (dy, dz) and on (dx, dy, dz), or on any two sets of features. Each has numbers of its own.
    axes : sequence of two matplotlib Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    matplotlib Figure
    """
    pair = {"classes_yz": classes_yz, "classes_xyz": classes_xyz}
    panels = make_axes(axes, 2, (10.0, 5.2), columns=2)
    for panel, letter, (name, classes) in zip(panels, "ab", pair.items(), strict=True):
        _scatter(panel, expect(name, classes, EffectClasses))
        features = ", ".join(feature.removeprefix("d") for feature in classes.features)
        panel.set_title(f"({letter}) clustered on ({features}): {classes.n_classes} classes", fontsize=10)
        _class_legend(panel, classes, below=True)
    return finish(panels[0], f"Two panels. (a) {_describe_classes(classes_yz)} (b) {_describe_classes(classes_xyz)}")


def _scatter(ax: Axes, classes: EffectClasses, size: float = 13, alpha: float = 0.85) -> None:
    samples = classes.samples
    _motion_axes(ax, samples.motion_names)
    x, y = samples.motions[classes.labels == OFF_THE_MAP].T
    ax.scatter(x, y, s=2.5, color=OFF_MAP, alpha=min(1.0, 2 * alpha), linewidths=0, zorder=1)
    for number in sorted(classes.numbers, key=lambda n: -classes.sizes[n - 1]):
        color, marker = class_style(number)
        x, y = classes.motions_of(number).T
        ax.scatter(x, y, s=size, color=color, marker=marker, alpha=alpha, linewidths=0, zorder=2)


def _motion_axes(ax: Axes, names: Sequence[str]) -> None:
    if len(names) != 2:
        raise ValueError(
            f"A motion space is drawn with two motion parameters, not with {len(names)}: {', '.join(names)}."
        )
    labels = [f"{name} [{UNITS[name]}]" if name in UNITS else name for name in names]
    ax.set(xlabel=labels[0], ylabel=labels[1])
    if tuple(names) == tuple(UNITS):
        ax.set(xlim=(20, 1030), ylim=(-2, 92), yticks=range(0, 91, 15))
    ax.spines[["top", "right"]].set_visible(False)


def _class_legend(ax: Axes, classes: EffectClasses, below: bool = False) -> None:
    handles = _class_handles(classes, off_map=True)
    if below:
        legend_below(ax, handles=handles, handletextpad=0.2, ncols=2)
    else:
        beside: dict[str, Any] = {"loc": "center left", "bbox_to_anchor": (1.01, 0.5)}
        ax.legend(handles=handles, frameon=False, fontsize=9, handletextpad=0.2, **beside)


def _class_handles(classes: EffectClasses, off_map: bool = False) -> list[Line2D]:
    handles = [
        marker_handle(*class_style(n), f"{name} ({classes.sizes[n - 1]})") for n, name in class_names(classes).items()
    ]
    missing = int((classes.labels == OFF_THE_MAP).sum())
    return [*handles, marker_handle(OFF_MAP, ".", f"off the map ({missing})")] if off_map and missing else handles


def _describe_classes(classes: EffectClasses) -> str:
    samples = classes.samples
    parts = [
        f"C{n}{f' ({gloss})' if gloss else ''}: {classes.sizes[n - 1]}" for n, gloss in class_glosses(classes).items()
    ]
    regions = []
    for n in classes.numbers:
        middle = np.median(classes.motions_of(n), axis=0)
        regions.append(
            f"C{n} about "
            + " and ".join(f"{v:.0f} {UNITS.get(m, m)}" for v, m in zip(middle, samples.motion_names, strict=True))
        )
    return (
        f"Scatter plot of {len(samples)} motions, {samples.motion_names[1]} against {samples.motion_names[0]}, by effect class on "
        f"({', '.join(classes.features)}); samples in each class: {'; '.join(parts)}; "
        f"{int((classes.labels == OFF_THE_MAP).sum())} off the map. Median motions: {'; '.join(regions)}."
    )


# Figures 3 and 5: prototypes


def plot_prototypes(
    sets: Prototypes | Sequence[Prototypes] | Mapping[str, Prototypes],
    classes: EffectClasses,
    axes: Axes | Sequence[Axes] | None = None,
) -> Figure:
    """Draw sets of prototypes in motion space, each over the faint samples (figure 3).

    A prototype has its class's colour and marker, large and outlined; those of a set without classes are white hexagons.

    Parameters
    ----------
    sets : Prototypes, or a sequence or mapping of them
        The sets; the keys of a mapping are used as titles.
    classes : EffectClasses
        The classes that colour the samples.
    axes : matplotlib Axes or a sequence of them, optional
        One for each set; a new figure by default.

    Returns
    -------
    matplotlib Figure
    """
    named = _named_sets(sets)
    expect("classes", classes, EffectClasses)
    columns = 1 if len(named) == 1 else 2
    rows = math.ceil(len(named) / columns)
    panels = make_axes(axes, len(named), (5.0 * columns, 3.6 * rows + 0.7), columns=columns)
    for i, (panel, (title, prototypes)) in enumerate(zip(panels, named.items(), strict=True)):
        _scatter(panel, classes, size=7, alpha=0.28)
        _draw_prototypes(panel, prototypes)
        letter = f"({'abcdefghijklmnopqrstuvwxyz'[i % 26]}) " if len(named) > 1 else ""
        panel.set_title(f"{letter}{title}: {len(prototypes)} prototypes", fontsize=10)
    handles = _class_handles(classes)
    if any(prototypes.classes is None for prototypes in named.values()):
        handles.append(
            marker_handle(
                "white", "h", "prototype without a class", markeredgecolor=INK, markeredgewidth=1.1, markersize=9
            )
        )
    figure_legend(panels[0], handles, "lower center", ncols=4)
    words = "; ".join(f"{title}, {_describe_set(prototypes)}" for title, prototypes in named.items())
    return finish(panels[0], f"Sets of prototypes in motion space, over the faint samples: {words}.")


def _named_sets(sets: Any) -> dict[str, Prototypes]:
    if isinstance(sets, Prototypes):
        sets = [sets]
    if not isinstance(sets, Mapping):
        sets = {f"{i}": one for i, one in enumerate(expect("sets", sets, Iterable))}
        named = {_set_name(expect("sets", one, Prototypes)): one for one in sets.values()}
        sets = (
            named if len(named) == len(sets) else {f"{one.method} {i}": one for i, one in enumerate(sets.values(), 1)}
        )
    if not sets:
        raise ValueError("sets must hold at least one set of prototypes, but it is empty.")
    return {str(title): expect("sets", one, Prototypes) for title, one in sets.items()}


def _set_name(prototypes: Prototypes) -> str:
    name = SET_NAMES.get(prototypes.method, prototypes.method)
    return name.format(max(prototypes.settings.get("xi", [len(prototypes)]))) if "{}" in name else name


def _draw_prototypes(ax: Axes, prototypes: Prototypes) -> None:
    labels = np.zeros(len(prototypes), int) if prototypes.classes is None else prototypes.classes
    for (x, y), number in zip(prototypes.motions.tolist(), labels.tolist(), strict=True):
        color, marker = class_style(number) if number else ("white", "h")
        ax.plot(x, y, marker, markersize=14, color="white", zorder=4, clip_on=False)
        ax.plot(
            x, y, marker, markersize=11, color=color, markeredgecolor=INK, markeredgewidth=1.3, zorder=5, clip_on=False
        )


def _describe_set(prototypes: Prototypes) -> str:
    if prototypes.classes is None:
        return f"{len(prototypes)} prototypes without a class"
    numbers, counts = np.unique(prototypes.classes, return_counts=True)
    return f"{len(prototypes)} prototypes ({', '.join(f'C{n}: {c}' for n, c in zip(numbers, counts, strict=True))})"


def plot_prototype_trajectories(
    world: CubeWorld,
    prototypes: Prototypes,
    classes: EffectClasses,
    numbers: Sequence[int] | None = None,
    axes: Sequence[Axes] | None = None,
) -> Figure:
    """Draw the paths of the prototypes of some classes, performed from the start pose (figure 5, Appendix A).

    Each cube at the end has the colour of the class that the jump reached (nearest mean effect), grey off the map: where it
    differs from the path's colour, the prototype did not do what its class stands for.

    Parameters
    ----------
    world : CubeWorld
        Where to perform them, without a generator: the tumbling world's cube rocks each time in the same way. Its state afterwards is
        what it was before.
    prototypes : Prototypes
        A set with classes.
    classes : EffectClasses
        Its classes.
    numbers : sequence of int, optional
        Classes to show, a panel for each; by default those that gain one and two steps, or where there are none, the last two.
    axes : sequence of matplotlib Axes, optional
        One for each class; a new figure by default.

    Returns
    -------
    matplotlib Figure
    """
    expect("world", world, CubeWorld)
    expect("classes", classes, EffectClasses)
    if expect("prototypes", prototypes, Prototypes).classes is None:
        raise ValueError(f"prototypes must have classes, but this set ({prototypes.method}) has none.")
    numbers = _climbing_classes(classes) if numbers is None else list(numbers)
    if not numbers or not set(numbers) <= set(classes.numbers):
        raise ValueError(f"numbers must be one or more classes from 1 to {classes.n_classes}, not {numbers}.")
    jumps = {number: _jumps_of(world, prototypes.of_class(number)) for number in numbers}
    top = max([world.staircase.top + 0.3, *(float(path.z.max()) + 0.12 for each in jumps.values() for _, path in each)])
    width, legend = 5.0, 0.2 * max(len(each) for each in jumps.values()) + 1.1
    height = (
        (width - 0.8) * (top + 0.16) / (min(world.staircase.end, float(world.staircase.risers[-1]) + SEEN_AHEAD) + 0.35)
    )
    shrink = min(1.0, 5.2 / height)
    size = ((width * shrink + 0.4) * len(numbers), height * shrink + legend)
    panels = make_axes(axes, len(numbers), size, columns=len(numbers))
    names, words = class_names(classes), []
    for i, (panel, number) in enumerate(zip(panels, numbers, strict=True)):
        draw_stairs(panel, world.staircase, top, 0.0)
        reached = [_draw_prototype_jump(panel, j, *made, number, classes) for j, made in enumerate(jumps[number])]
        panel.set_title(f"{f'({chr(97 + i)}) ' if len(numbers) > 1 else ''}{names[number]}", fontsize=10)
        if reached:
            legend_below(panel, handlelength=2.8)
        words.append(f"C{number}: {'; '.join(reached) or 'no prototype'}")
    return finish(panels[0], f"Side view of the stairs with the paths of prototypes. {'. '.join(words)}.")


def _climbing_classes(classes: EffectClasses) -> list[int]:
    glosses = class_glosses(classes)
    wanted = [n for steps in ("1 step", "2 steps") for n, gloss in glosses.items() if gloss.split(",")[0] == steps]
    return sorted(wanted or list(classes.numbers)[-2:])[:2]


def _jumps_of(world: CubeWorld, motions: np.ndarray) -> list[tuple[Jump, Trajectory]]:
    """Perform each motion from the start pose, in a copy of the world."""
    own, jumps = copy.copy(world), []
    for magnitude, angle in motions.tolist():
        own.reset()
        jump = own.jump(magnitude, angle, trajectory=True)
        assert jump.trajectory is not None
        jumps.append((jump, jump.trajectory))
    return jumps


def _draw_prototype_jump(
    ax: Axes, place: int, jump: Jump, path: Trajectory, number: int, classes: EffectClasses
) -> str:
    effect = [jump.effect[classes.samples.effect_names.index(name)] for name in classes.features]
    reached = int(classes.nearest_mean(np.array([effect]))[0]) if jump.on_map else OFF_THE_MAP
    words = f"ends in $C_{{{reached}}}$" if reached else "ends off the map"
    words += f", not $C_{{{number}}}$" if reached and reached != number else ""
    label = f"{jump.magnitude:.0f} N, {jump.angle:.0f}°: {words}"
    ax.plot(
        path.y,
        path.z,
        color=class_style(number).color,
        linestyle=LINES[place % len(LINES)],
        linewidth=1.8,
        label=label,
        zorder=3,
    )
    ends = class_style(reached).color if reached else OFF_MAP
    draw_cube(ax, *pose(jump.start))
    draw_cube(ax, *pose(jump.end), facecolor=ends, alpha=0.9, clip_on=True)
    return label.replace("$C_{", "C").replace("}$", "")


# Figure 6: continuous and discrete effects


def plot_effect_distributions(samples: Samples, axes: Sequence[Axes] | None = None) -> Figure:
    """Draw how dy and dz of the jumps that ended on the map are distributed: continuous against discrete (figure 6, Appendix B).

    Parameters
    ----------
    samples : Samples
        Jumps on the stairs.
    axes : sequence of two matplotlib Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    matplotlib Figure
    """
    dy, dz = expect("samples", samples, Samples).on_the_map().effect("dy", "dz").T
    panels = make_axes(axes, 2, (10.0, 3.9), columns=2)
    for panel, values, name, letter, kind in zip(panels, (dy, dz), "yz", "ab", ("continuous", "discrete"), strict=True):
        bins = np.arange(math.floor(values.min() / BIN) - 1, math.ceil(values.max() / BIN) + 2) * BIN - BIN / 2
        heights, edges = np.histogram(values, bins)
        panel.stairs(heights, edges, fill=True, baseline=0.1, color=INK if name == "y" else COLORS[1])
        panel.set(yscale="log", ylim=(0.6, 3 * heights.max()))
        panel.set(xlabel=f"effect Δ{name} [m]", ylabel=f"jumps in a bin of {BIN} m (logarithmic)")
        panel.yaxis.set_major_formatter("{x:.0f}")
        panel.set_title(f"({letter}) Δ{name}: {kind}", fontsize=10)
        panel.spines[["top", "right"]].set_visible(False)
    levels, counts = np.unique(np.round(dz, 1) + 0.0, return_counts=True)
    for level, count in zip(levels, counts, strict=True):
        panels[1].annotate(f"{count}", (level, count), (0, 3), textcoords="offset points", ha="center", fontsize=9)
    words = ", ".join(f"{count} at {level:.1f} m" for level, count in zip(levels, counts, strict=True))
    return finish(
        panels[0],
        f"Two histograms of {len(dy)} jumps. (a) The distance gained, Δy, is spread from {dy.min():.2f} to {dy.max():.2f} m. "
        f"(b) The height gained, Δz, gathers at separate levels: {words}.",
    )


# The choice of k, the counts, reliability


def plot_score_curve(
    classes: EffectClasses | Mapping[str, EffectClasses], axes: Axes | Sequence[Axes] | None = None
) -> Figure:
    """Draw the score of each k that was tried, with the chosen k ringed; a panel for each criterion.

    Parameters
    ----------
    classes : EffectClasses, or a mapping of names to them
        Classes found by K-Means; several, such as those of the presets, are drawn over each other.
    axes : matplotlib Axes or a sequence of them, optional
        One for each criterion (silhouette first); a new figure by default.

    Returns
    -------
    matplotlib Figure
    """
    curves = dict(classes) if isinstance(classes, Mapping) else {"": classes}
    for name, one in curves.items():
        if expect("classes", one, EffectClasses).scores.empty:
            raise ValueError(
                f"classes must come from K-Means; those on {', '.join(one.features)} {name} are histogram bins."
            )
    if not curves:
        raise ValueError("classes must hold at least one set of classes, but it is empty.")
    used = [
        c for c in ("silhouette", "davies-bouldin") if any(one.settings["criterion"] == c for one in curves.values())
    ]
    panels = dict(zip(used, make_axes(axes, len(used), (5.0 * len(used) + 1.0, 4.0), columns=len(used)), strict=True))
    words = []
    for place, (name, one) in enumerate(curves.items()):
        _draw_curve(panels[one.settings["criterion"]], place, name, one)
        listed = ", ".join(f"{k:.0f}: {score:.3f}" for k, score in one.scores.to_numpy())
        words.append(f"{name} {one.settings['criterion']} {listed}; chosen k = {one.n_classes}".strip())
    better = {
        "silhouette": "silhouette score (higher is better)",
        "davies-bouldin": "Davies-Bouldin index (lower is better)",
    }
    for criterion, panel in panels.items():
        panel.set(xlabel="number of classes k", ylabel=better[criterion])
        panel.xaxis.set_major_locator(MaxNLocator(integer=True))
        panel.margins(x=0.1, y=0.14)
        panel.grid(axis="y", color=GRID, zorder=0)
        panel.spines[["top", "right"]].set_visible(False)
        legend_below(panel)
    return finish(
        next(iter(panels.values())), f"Score by number of classes, the chosen one ringed. {'. '.join(words)}."
    )


def _draw_curve(ax: Axes, place: int, name: str, classes: EffectClasses) -> None:
    ks, scores = classes.scores["k"].to_numpy(), classes.scores["score"].to_numpy()
    label = f"{name}: k = {classes.n_classes} of {ks[0]} to {ks[-1]}".removeprefix(": ")
    look: dict[str, Any] = {
        "color": (INK, FAINT, COLORS[1])[place % 3],
        "linestyle": LINES[place % 3],
        "linewidth": 1.4,
    }
    ax.plot(ks, scores, marker="os^Dv"[place % 5], markersize=8 - 2 * (place % 2), label=label, **look)
    chosen = ks == classes.n_classes
    ring: dict[str, Any] = {"markersize": 16 + 3 * place, "markerfacecolor": "none", "markeredgecolor": PATH}
    ax.plot(ks[chosen], scores[chosen], "o", markeredgewidth=1.6, **ring)


def plot_prototype_counts(counts: pd.DataFrame, axes: Sequence[Axes] | None = None) -> Figure:
    """Draw what equations 2 and 3 make of each class: normalised mean, standard deviation and cv, and the count xi.

    Parameters
    ----------
    counts : pandas.DataFrame
        As ``prototype_counts`` returns it.
    axes : sequence of two matplotlib Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    matplotlib Figure
    """
    needed = ("mean", "std", "cv", "weight", "xi")
    if not isinstance(counts, pd.DataFrame) or not set(needed) <= set(counts.columns):
        raise TypeError(f"counts must be a table with the columns {', '.join(needed)}, as prototype_counts returns it.")
    left, right = make_axes(axes, 2, (10.0, 4.0), columns=2)
    x = np.arange(len(counts))
    shown = {"mean": "normalised mean $\\mu$", "std": "normalised spread $\\sigma$", "cv": "cv = $\\sigma/\\mu$"}
    fills = (("#bdbdbd", ""), ("#6b6b6b", ""), ("white", "////"))
    for i, ((column, label), (color, hatch)) in enumerate(zip(shown.items(), fills, strict=True)):
        left.bar(
            x + 0.27 * (i - 1),
            counts[column],
            0.25,
            color=color,
            hatch=hatch,
            edgecolor=INK,
            linewidth=0.7,
            label=label,
        )
    low = min(0.0, float(counts[["mean", "std"]].min().min()), max(float(counts["cv"].min()), -1.0))
    left.set(ylim=(1.1 * low, 1.25), ylabel="normalised value [no unit]")
    left.legend(frameon=False, fontsize=9, ncols=3, loc="upper center", columnspacing=1.0, handlelength=1.4)
    left.set_title("(a) what equation 2 is fed", fontsize=10)
    styles = [class_style(n) for n in counts.index]
    right.bar(x, counts["xi"], 0.6, color=[style.color for style in styles], edgecolor=INK, linewidth=0.7)
    for place, (xi, style) in enumerate(zip(counts["xi"], styles, strict=True)):
        right.annotate(f"{xi}", (place, xi), (0, 3), textcoords="offset points", ha="center")
        right.plot(place, xi / 2, marker=style.marker, color="white", markeredgecolor=INK, markersize=9)
    right.set(ylim=(0, 1.18 * counts["xi"].max()), ylabel=r"prototypes $\xi_k$ [count]")
    right.yaxis.set_major_locator(MaxNLocator(integer=True))
    right.set_title("(b) what comes out", fontsize=10)
    for panel in (left, right):
        panel.set_xticks(x, [f"$C_{{{n}}}$" for n in counts.index])
        panel.set_xlabel("effect class")
        panel.spines[["top", "right"]].set_visible(False)
        panel.axhline(0, color=INK, linewidth=0.8)
    rows = "; ".join(
        f"C{n}: mean {r['mean']:.3f}, spread {r['std']:.3f}, cv {r['cv']:.2f}, xi {r['xi']:.0f}"
        for n, r in counts.iterrows()
    )
    return finish(left, f"Two bar charts by effect class. {rows}.")


def plot_reliability(table: pd.DataFrame, ax: Axes | None = None) -> Figure:
    """Draw how reliable sets of prototypes are: exactly, and under noise.

    Parameters
    ----------
    table : pandas.DataFrame
        Columns "method", "exact" and "under noise", and where there is one "on map": shares from 0 to 1, as ``Run.summary``
        has them; NaN for a set without classes. Several rows of one method (several seeds) are drawn as small marks around their mean.
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    matplotlib Figure
    """
    if (
        not isinstance(table, pd.DataFrame)
        or not {"method", "exact", "under noise"} <= set(table.columns)
        or table.empty
    ):
        raise TypeError("table must have rows and the columns method, exact and under noise.")
    shown = {
        "on map": ("ends on the map", "|", FAINT),
        "exact": ("ends in its own class", "o", COLORS[1]),
        "under noise": ("ends in its own class, under noise", "D", COLORS[4]),
    }
    methods = list(dict.fromkeys(table["method"]))
    (ax,) = make_axes(ax, 1, (8.0, 1.5 + 0.42 * len(methods)))
    words = []
    for row, method in enumerate(methods):
        rows = table[table["method"] == method]
        means = {c: float(rows[c].mean()) for c in shown if c in rows}
        ax.plot([means["exact"], means["under noise"]], [row, row], color="#bbbbbb", linewidth=3, zorder=1)
        for column, mean in means.items():
            _, marker, color = shown[column]
            ax.plot(
                mean,
                row,
                marker,
                color=color,
                markersize=13 if marker == "|" else 8,
                markeredgewidth=2 if marker == "|" else 0.5,
                zorder=3,
            )
            if len(rows) > 1:
                ax.plot(rows[column], [row] * len(rows), marker, color=color, markersize=3, alpha=0.5, zorder=2)
        known = [f"{shown[c][0]} {100 * m:.0f} %" for c, m in means.items() if not math.isnan(m)]
        words.append(f"{method}: {', '.join(known)}")
        if math.isnan(means["exact"]):
            ax.text(0.01, row, "has no classes to end in", fontsize=9, color="#5f5f5f", va="center",
                    bbox={"facecolor": "white", "edgecolor": "none", "pad": 1})  # fmt: skip
    ax.set_yticks(range(len(methods)), methods)
    ax.set(
        ylim=(len(methods) - 0.5, -0.5),
        xlim=(0, 1.02),
        xlabel="share of a set's prototypes, or of its noisy replays [%]",
    )
    ax.xaxis.set_major_formatter(PercentFormatter(1, symbol=""))
    ax.grid(axis="x", color=GRID, zorder=0)
    ax.spines[["top", "right", "left"]].set_visible(False)
    ax.tick_params(axis="y", length=0)
    handles = [marker_handle(color, m, label, markersize=11 if m == "|" else 8, markeredgewidth=2 if m == "|" else 0.5)
               for column, (label, m, color) in shown.items() if column in table]  # fmt: skip
    figure_legend(ax, handles, "upper center", ncols=3)
    return finish(ax, f"Reliability of sets of prototypes. {'; '.join(words)}.")


# How faithful the world is


def plot_fidelity(fidelity: Fidelity | Mapping[str, Fidelity], axes: Sequence[Axes] | None = None) -> Figure:
    """Draw how replayed jumps agree with recorded ones: the outcomes as a table, and the two distributions of gaps to the next riser.

    Parameters
    ----------
    fidelity : Fidelity, or mapping of str to Fidelity
        As ``measure_fidelity`` returns it; or of several worlds by their names. Then there is a table for each, and the jumps that
        climb are drawn too: how far aside, how turned, and how far from the riser they end.
    axes : sequence of matplotlib Axes, optional
        Where to draw, two for one fidelity, four more than worlds for a mapping; a new figure by default.

    Returns
    -------
    matplotlib Figure
    """
    if isinstance(fidelity, Mapping) and fidelity:
        return _plot_worlds(fidelity, axes)
    one: Fidelity = expect("fidelity", fidelity, Fidelity)
    panels = make_axes(axes, 2, (10.0, 4.3), columns=2)
    alts = [_draw_outcomes(panels[0], "(a)", one)]
    alts += [_draw_all_gaps(panels[1], "(b)", one.gaps_recorded, {"replayed": one}, {"replayed": "tumbling"})]
    return finish(panels[0], " ".join(alts))


def _plot_worlds(fidelities: Mapping[str, Fidelity], axes: Sequence[Axes] | None) -> Figure:
    for one in fidelities.values():
        expect("each fidelity", one, Fidelity)
    some, count = next(iter(fidelities.values())), len(fidelities)
    panels = make_axes(axes, count + 4, (14.0, 4.1 * math.ceil((count + 4) / 3)), columns=3)
    names = [f"({letter})" for letter in "abcdefghijklmnopqrstuvwxyz"[: count + 4]]
    alts = [
        _draw_outcomes(ax, name, one, world)
        for ax, name, (world, one) in zip(panels, names, fidelities.items(), strict=False)
    ]
    rest, names = panels[count:], names[count:]
    alts += [_draw_all_gaps(rest[0], names[0], some.gaps_recorded, fidelities)]
    for ax, name, pair, words, unit, scale, limits in (
        (rest[1], names[1], "aside", "|dx|", "mm", 1000, (-5, 400)),
        (rest[2], names[2], "yaw", "yaw", "°", 1, (-0.5, 45)),
        (rest[3], names[3], "gap", "gap to the riser ahead", "mm", 1000, (-5, 400)),
    ):
        curves = {world: scale * getattr(one, pair).own for world, one in fidelities.items()}
        _draw_cumulative(ax, {"recorded": scale * getattr(some, pair).recorded} | curves)
        distances = {world: getattr(one, pair).ks for world, one in fidelities.items()}
        ax.set(xlim=limits, xlabel=f"{words} of jumps that climb [{unit}]")
        ax.set_title(f"{name} jumps that climb: {words}", fontsize=10)
        alts += [f"{name} Cumulative distributions of {words} where jumps that climb end, {_distances(distances)}."]
    return finish(panels[0], " ".join(alts))


def _draw_outcomes(ax: Axes, name: str, fidelity: Fidelity, world: str = "") -> str:
    _draw_confusion(ax, fidelity.confusion)
    share = f"{100 * fidelity.agreement:.2f} ± {100 * fidelity.agreement_se:.2f} % of {fidelity.n} jumps"
    ax.set_title(f"{name} {world}{': ' if world else ''}same outcome: {share}", fontsize=10)
    return f"{name} Table of recorded against replayed outcomes{f' ({world})' if world else ''}: {share} have the same."


def _draw_all_gaps(
    ax: Axes,
    name: str,
    recorded: np.ndarray,
    fidelities: Mapping[str, Fidelity],
    styles: Mapping[str, str] | None = None,
) -> str:
    curves = {"recorded": recorded} | {world: one.gaps_replayed for world, one in fidelities.items()}
    _draw_cumulative(ax, {world: np.maximum(1000 * gaps, 0.01) for world, gaps in curves.items()}, styles)
    ax.set(xscale="log", xlim=(0.009, 700), xlabel="gap to the next riser [mm]")
    ax.set_xticks([0.01, 0.1, 1, 10, 100], ["≤ 0.01", "0.1", "1", "10", "100"])
    distances = {world: one.gap_ks for world, one in fidelities.items()}
    only = f": Kolmogorov-Smirnov distance {next(iter(distances.values())):.3f}" if len(distances) == 1 else ""
    ax.set_title(f"{name} gaps{only or ' of all jumps'}", fontsize=10)
    return f"{name} Cumulative distributions of the gap to the next riser, {_distances(distances)}."


def _distances(distances: Mapping[str, float]) -> str:
    """Say how far curves are from the recorded one."""
    words = ", ".join(f"{name} {distance:.3f}" for name, distance in distances.items())
    return f"recorded and of worlds; Kolmogorov-Smirnov distances from the recorded one: {words}"


def _draw_cumulative(ax: Axes, curves: Mapping[str, np.ndarray], styles: Mapping[str, str] | None = None) -> None:
    """Draw the share of values up to each value; a name has the style of a world if there is one of that name, or ``styles`` says."""
    for place, (name, values) in enumerate(curves.items()):
        if not len(values):
            continue
        color, line, marker = _curve_style((styles or {}).get(name, name), place)
        drawn: dict[str, Any] = {"markersize": 5, "markevery": 0.12, "linewidth": 1.8}
        ax.ecdf(values, label=name, color=color, linestyle=line, marker=marker, **drawn)
    ax.set(ylim=(0, 1.02), ylabel="share at or below [%]")
    ax.yaxis.set_major_formatter(PercentFormatter(1, symbol=""))
    ax.grid(color=GRID)
    ax.spines[["top", "right"]].set_visible(False)
    if any(map(len, curves.values())):
        ax.legend(frameon=False, fontsize=9)


def _curve_style(name: str, place: int) -> tuple[str, Any, str]:
    if place == 0:
        return INK, "-", "o"
    return WORLD_STYLES.get(
        name, (COLORS[place % len(COLORS)], LINES[place % len(LINES)], MARKERS[place % len(MARKERS)])
    )


def plot_tread_fidelity(
    fidelity: TreadFidelity | Mapping[str, TreadFidelity], axes: Sequence[Axes] | None = None
) -> Figure:
    """Draw where cubes rest in rollouts, recorded and in worlds: gap, yaw, ``|x|``; and what the gap does to the next jump.

    Parameters
    ----------
    fidelity : TreadFidelity, or mapping of str to TreadFidelity
        As ``measure_tread_fidelity`` returns it; or of several worlds by their names.
    axes : sequence of four matplotlib Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    matplotlib Figure
    """
    given: Mapping[str, Any] = fidelity if isinstance(fidelity, Mapping) and fidelity else {"own": fidelity}
    fidelities: dict[str, TreadFidelity] = {name: expect("fidelity", one, TreadFidelity) for name, one in given.items()}
    panels = make_axes(axes, 4, (10.4, 7.6), columns=2)
    some = next(iter(fidelities.values()))
    alts = []
    for ax, name, pair, words, unit, scale, limits in (
        (panels[0], "(a)", "gap", "gap to the riser ahead", "cm", 100, (-0.5, 40)),
        (panels[1], "(b)", "yaw", "yaw", "°", 1, (-0.5, 45)),
        (panels[2], "(c)", "x", "|x|", "m", 1, (-0.03, 2.46)),
    ):
        curves = {"reference": scale * getattr(some, pair).recorded}
        _draw_cumulative(ax, curves | {world: scale * getattr(one, pair).own for world, one in fidelities.items()})
        distances = {world: getattr(one, pair).ks for world, one in fidelities.items()}
        ax.set(xlim=limits, xlabel=f"{words} of resting cubes [{unit}]")
        ax.set_title(f"{name} KS distance: " + ", ".join(f"{w} {d:.2f}" for w, d in distances.items()), fontsize=10)
        if pair == "gap":
            _draw_trap(ax)
        ax.legend(frameon=False, fontsize=9, loc="lower right")
        alts += [f"{name} Cumulative distributions of {words} of resting cubes, {_distances(distances)}."]
    measures = {"reference": some.reference} | {world: one.own for world, one in fidelities.items()}
    alts += [_draw_climbing(panels[3], measures)]
    return finish(panels[0], " ".join(alts))


def _draw_trap(ax: Axes) -> None:
    ax.axvspan(0, 100 * CLOSE, color=STAIRS, alpha=0.6, linewidth=0, zorder=0, label="within 3 cm: a trap")


def _draw_climbing(ax: Axes, measures: Mapping[str, TreadMeasures]) -> str:
    middles = 50 * (np.array(GAP_BINS[1:]) + GAP_BINS[:-1])
    tables = {name: measure.climb_by_gap() for name, measure in measures.items()}
    for place, (name, table) in enumerate(tables.items()):
        n, climb = table["n"].to_numpy(), table["climb"].to_numpy()
        seen = n >= FEWEST
        color, line, marker = _curve_style(name, place)
        errors = np.sqrt(climb * (1 - climb) / np.maximum(n, 1))[seen]
        shown = {"color": color, "linestyle": line, "marker": marker, "markersize": 6, "capsize": 3, "linewidth": 1.6}
        shift = 0.25 * (place - (len(tables) - 1) / 2)  # else markers of equal probabilities hide one another
        ax.errorbar(
            middles[seen] + shift,
            climb[seen],
            errors,
            label=f"{name}: {100 * measures[name].climb:.0f} % over all gaps",
            **shown,
        )
    _draw_trap(ax)
    ax.set(xlim=(-0.5, 40), ylim=(-0.03, 1.05), xlabel="gap to the riser ahead [cm]", ylabel="jumps that climb [%]")
    ax.yaxis.set_major_formatter(PercentFormatter(1, symbol=""))
    ax.set_title("(d) jumps of 350 to 650 N at 55 to 75° that climb", fontsize=10)
    ax.grid(color=GRID)
    ax.spines[["top", "right"]].set_visible(False)
    ax.legend(frameon=False, fontsize=9, loc="lower right")
    bins = ", ".join(tables["reference"].index)
    rows = [f"{name} {', '.join(f'{100 * p:.0f}' for p in table['climb'])} %" for name, table in tables.items()]
    over_all = ", ".join(f"{name} {100 * measure.climb:.0f} %" for name, measure in measures.items())
    return (
        f"(d) Probability that a jump of 350 to 650 N at 55 to 75 degrees climbs, for gaps of {bins}: "
        f"{'; '.join(rows).replace('nan', '-')}. Over all gaps: {over_all}."
    )


def _draw_confusion(ax: Axes, confusion: pd.DataFrame) -> None:
    counts = confusion.to_numpy()
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    ax.imshow(np.sqrt(shares), cmap="Blues", vmin=0, vmax=1.1, aspect="auto")
    for (row, column), count in np.ndenumerate(counts):
        color = "white" if shares[row, column] > 0.4 else INK if count else "#a0a0a0"
        ax.text(column, row, f"{count}", ha="center", va="center", color=color, fontsize=10)
    ax.set_xticks(
        range(len(counts)), [str(name).replace("off the map", "off map") for name in confusion.columns], fontsize=9
    )
    ax.set_yticks(range(len(counts)), list(confusion.index), fontsize=9)
    ax.set(xlabel="replayed outcome [jumps]", ylabel="recorded outcome [jumps]")
    ax.tick_params(length=0)
    ax.spines[:].set_visible(False)
