"""Lesson 07, action prototypes: its figures, and how motions are replayed, with and without noise."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.spatial import ConvexHull, Delaunay

from stairlab.drawing import FAINT, GRID, INK, OFF_MAP, PATH, Picture, finish, legend_below, new_figure
from stairlab.effects import OFF_THE_MAP, EffectClasses
from stairlab.plots import class_style, draw_cube, draw_stairs, plot_prototype_trajectories, pose
from stairlab.prototypes import Prototypes
from stairlab.sampling import noisy_motions, replay_motions
from stairlab.world import CubeWorld, Jump, StairWorld

WORDS = 62
""" Width of a prototype's name and share [points] """
PLACES = tuple((x, y) for y in (0.0, 11.0, -11.0, 17.0, -17.0) for x in (9.0, -9.0, 0.0) if x or abs(y) > 11)
""" Where they are tried, from the prototype [points] """
MANY = 6
""" More motions than this are drawn small """
STEEPEST = 3.5
""" Height up to which the stairs are drawn, so that the highest jumps are seen [m] """
EFFECT_LIMITS = ((-0.3, 2.1), (-0.15, 1.4))
""" What is seen of the effect plane: dy and dz [m] """
FEW_TICKS = {
    "motion": ((200, 600, 1000), (0, 45, 90)),
    "effect": ((0, 1, 2), (0, 0.6, 1.2)),
    "stairs": ((0, 1, 2), (0, 1, 2, 3)),
}
""" Ticks of the three linked panels """
SYMBOLS = ("*", "s", "P", "h")
""" Symbols of motions that are pointed out """
TRIES = 20
""" Noisy replays of a motion that are drawn """


def replay(world: StairWorld, motions: np.ndarray, classes: EffectClasses) -> tuple[np.ndarray, np.ndarray]:
    """Perform motions from the start pose, and sort what they do.

    Parameters
    ----------
    world : StairWorld
        Where to perform them.
    motions : array-like of shape (n, 2)
        Magnitude [N] and angle [deg].
    classes : EffectClasses
        The classes that effects are sorted into, by the nearest mean effect.

    Returns
    -------
    effects : ndarray of shape (n, n_features)
        In the clustered dimensions [m].
    reached : ndarray of shape (n,), int
        The class of each effect, from 1; 0 off the map.
    """
    outcome = replay_motions(world, motions)
    return outcome.effect(*classes.features), classes.reached(outcome)


def prototype_names(prototypes: Prototypes) -> list[str]:
    """Return a name for each prototype of a set with classes: its class and a letter, such as "C4b"."""
    numbers = [] if prototypes.classes is None else prototypes.classes.tolist()
    return [f"C{number}{chr(97 + numbers[:i].count(number))}" for i, number in enumerate(numbers)]


def called(reached: int) -> str:
    """Return what a class is called in words; 0 is off the map."""
    return f"C{reached}" if reached else "off the map"


# The two planes


def draw_motions(ax: Axes, classes: EffectClasses, number: int | None = None) -> None:
    """Draw the samples faintly in the motion plane, those of class ``number`` clearly."""
    for each in (OFF_THE_MAP, *classes.numbers):
        color, marker = class_style(each) if each else (OFF_MAP, "o")
        shown = each == number
        x, y = classes.samples.motions[classes.labels == each].T
        size, alpha = (4.0, 0.9) if shown else (1.8 if each else 1.2, 0.3)
        ax.plot(x, y, marker, color=color, markersize=size, markeredgewidth=0, alpha=alpha, zorder=2 if shown else 1)
    ax.set(xlabel="magnitude [N]", ylabel="angle [°]", xlim=(20, 1030), ylim=(-2, 92), yticks=range(0, 91, 15))
    ax.spines[["top", "right"]].set_visible(False)


def draw_effects(ax: Axes, classes: EffectClasses, number: int | None = None) -> None:
    """Draw the effects of the samples on the map faintly, those of class ``number`` clearly, and the mean effects as crosses."""
    effects = classes.samples.effect("dy", "dz")
    for each in classes.numbers:
        color, marker = class_style(each)
        x, y = effects[classes.labels == each].T
        size, alpha = (5.0, 0.8) if each == number else (3.0, 0.25)
        ax.plot(x, y, marker, color=color, markersize=size, markeredgewidth=0, alpha=alpha, zorder=1)
        ax.plot(*effects[classes.labels == each].mean(axis=0), "+", color=INK, markersize=9, zorder=3)
    ax.set(xlabel="Δy [m]", ylabel="Δz [m]", xlim=EFFECT_LIMITS[0], ylim=EFFECT_LIMITS[1])
    ax.spines[["top", "right"]].set_visible(False)


def mark(ax: Axes, place: Sequence[float] | np.ndarray, number: int, size: float = 11) -> None:
    """Draw one motion or effect large, with colour and marker of its class; grey and round for 0, off the map."""
    color, marker = class_style(number) if number else (OFF_MAP, "o")
    look: dict[str, Any] = {"markeredgecolor": INK, "markeredgewidth": 1.3, "clip_on": False, "zorder": 6}
    ax.plot(*place, marker, color=color, markersize=size, **look)


def draw_path(ax: Axes, jump: Jump, world: CubeWorld, reached: int) -> None:
    """Draw a jump on the stairs; the cube at its end has the colour of the class that was reached, grey off the map."""
    draw_stairs(ax, world.staircase, STEEPEST, 2.6)
    if jump.trajectory is not None:
        ax.plot(jump.trajectory.y, jump.trajectory.z, color=PATH, linewidth=1.6, zorder=3)
    draw_cube(ax, *pose(jump.start))
    draw_cube(ax, *pose(jump.end), facecolor=class_style(reached).color if reached else OFF_MAP, clip_on=True)


def plot_motions(
    classes: EffectClasses, number: int | None, marks: Mapping[str, np.ndarray], title: str = ""
) -> Figure:
    """Draw one class in the motion plane, and some motions on top.

    Parameters
    ----------
    classes : EffectClasses
        The classes.
    number : int or None
        The class that is shown clearly.
    marks : mapping of str to array-like of shape (n, 2)
        Motions to point out: magnitude [N] and angle [deg], under the words of the legend.
    title : str
        What stands above.
    """
    where = "; ".join(f"{words} at {_listed(np.reshape(motions, (-1, 2)))}" for words, motions in marks.items())
    figure, ax = new_figure(
        f"The motion plane{f' with the motions of C{number} shown clearly' if number else ''}. {where}.",
        size=(6.4, 4.4),
    )
    draw_motions(ax, classes, number)
    for symbol, (words, motions) in zip(SYMBOLS, marks.items(), strict=False):
        x, y = np.reshape(motions, (-1, 2)).T
        look: dict[str, Any] = {"color": INK, "markersize": 13, "zorder": 5, "clip_on": False}
        if len(x) > MANY:
            look |= {"markersize": 4, "marker": "o", "color": FAINT}
        elif symbol == "s":  # open, so that what lies under it is seen
            look |= {"markerfacecolor": "none", "markeredgewidth": 2, "marker": symbol}
        else:
            look |= {"markeredgecolor": "white", "marker": symbol}
        ax.plot(x, y, linestyle="none", label=words, **look)
    ax.set_title(title, fontsize=10)
    legend_below(ax, ncols=2)
    return figure


def _listed(motions: np.ndarray) -> str:
    if len(motions) > MANY:
        return f"{len(motions)} places"
    return ", ".join(f"{magnitude:.0f} N and {angle:.0f}°" for magnitude, angle in motions)


# One motion in three pictures: the widget, and the walk between two motions


def linked_view(
    world: CubeWorld | Mapping[str, CubeWorld], classes: EffectClasses, sets: Mapping[str, Prototypes]
) -> Callable[..., Figure]:
    """Return a function that draws one prototype of a set three times: in the motion plane, among effects, on the stairs.

    Parameters
    ----------
    world : CubeWorld or mapping of str to CubeWorld
        Where it is performed; several worlds by what they are called, to choose from.
    classes : EffectClasses
        The classes.
    sets : mapping of str to Prototypes
        Sets with the same classes in the same order, by what they are called.

    Returns
    -------
    callable
        ``draw(prototype="C1a", which="...", where="...")``; the first of each is shown if none is named.

    Raises
    ------
    ValueError
        If the sets do not stand for the same classes.
    """
    worlds = world if isinstance(world, Mapping) else {"": world}
    here = next(iter(worlds))
    names = {which: prototype_names(prototypes) for which, prototypes in sets.items()}
    first, *others = names
    if not names[first] or any(names[other] != names[first] for other in others):
        raise ValueError(
            "sets must have prototypes of the same classes in the same order, so that they can be compared."
        )

    def draw(prototype: str = names[first][0], which: str = first, where: str = here) -> Figure:
        place = names[which].index(prototype)
        prototypes = sets[which]
        assert prototypes.classes is not None
        number = int(prototypes.classes[place])
        name = prototype if where == here else f"{prototype} in {where}"
        motions, others = prototypes.motions[place], prototypes.of_class(number)
        return three_views(worlds[where], classes, motions, number, others, name)

    return draw


def three_views(
    world: CubeWorld,
    classes: EffectClasses,
    motion: np.ndarray,
    number: int,
    others: Sequence[np.ndarray] | np.ndarray = (),
    name: str = "the motion",
) -> Figure:
    """Draw a motion in the motion plane, its effect among the effects, and its jump on the stairs.

    Parameters
    ----------
    world : CubeWorld
        Where it is performed, from the start pose and without a generator; its state afterwards is what it was before.
    classes : EffectClasses
        The classes.
    motion : array-like of shape (2,)
        Magnitude [N] and angle [deg].
    number : int
        The class that the motion stands for; it is shown clearly.
    others : array-like of shape (n, 2)
        Other motions that stand for it, drawn small.
    name : str
        What the motion is called.
    """
    own = copy.copy(world)
    own.reset()
    jump = own.jump(*np.asarray(motion, dtype=float).tolist(), trajectory=True)
    effect = np.array([jump.dy, jump.dz])
    named = np.array([[jump.effect[classes.samples.effect_names.index(feature)] for feature in classes.features]])
    reached = int(classes.nearest_mean(named)[0]) if jump.on_map else OFF_THE_MAP
    verdict = f"stands for C{number}, ends {'in ' if reached else ''}{called(reached)}"
    figure = Picture(figsize=(9.2, 5.3))
    axes = figure.subplot_mosaic([["motion", "stairs"], ["effect", "stairs"]], width_ratios=[1, 1.15])
    figure.subplots_adjust(left=0.07, right=0.98, bottom=0.1, top=0.94, hspace=0.42, wspace=0.2)
    draw_motions(axes["motion"], classes, number)
    for other in others:
        mark(axes["motion"], other, number, size=6)
    mark(axes["motion"], (jump.magnitude, jump.angle), number, size=12)
    draw_effects(axes["effect"], classes, number)
    seen = np.clip(effect, *np.transpose(EFFECT_LIMITS))
    mark(axes["effect"], seen, reached, size=12)
    draw_path(axes["stairs"], jump, world, reached)
    shown = f"Δy = {round(jump.dy, 2) + 0.0:+.2f} m, Δz = {round(jump.dz, 2) + 0.0:+.2f} m"
    for panel, (x, y) in FEW_TICKS.items():  # ticks are what takes time, and this follows a slider
        axes[panel].set(xticks=x, yticks=y)
    axes["motion"].set_title(f"{name}: {jump.magnitude:.0f} N at {jump.angle:.0f}°", fontsize=10)
    axes["effect"].set_title(f"{shown}{'' if reached else ', off the map'}", fontsize=10)
    axes["stairs"].set_title(f"{name} {verdict} {'✓' if reached == number else '✗'}", fontsize=10)
    return finish(
        axes["motion"],
        f"{name}, {jump.magnitude:.0f} N at {jump.angle:.0f}°, {verdict}. In the motion plane it is over the motions of C{number}; in "
        f"the effect plane is its effect, {shown}; on the stairs its path.",
    )


def walk(
    world: StairWorld, classes: EffectClasses, first: np.ndarray, second: np.ndarray, number: int
) -> Callable[[float], Figure]:
    """Return a function that draws the motion at a share of the way from one motion of a class to another.

    Parameters
    ----------
    first, second : array-like of shape (2,)
        Magnitude [N] and angle [deg].
    number : int
        The class of both.

    Returns
    -------
    callable
        ``draw(share)``, with a share from 0 to 1.
    """
    ends = np.array([first, second], dtype=float)

    def draw(share: float) -> Figure:
        figure = three_views(
            world, classes, (1 - share) * ends[0] + share * ends[1], number, ends, f"{share:.0%} of the way"
        )
        figure.axes[0].plot(*ends.T, ":", color=INK, linewidth=1.2, zorder=3)
        return figure

    return draw


def plot_paths(world: StairWorld, prototypes: Prototypes, classes: EffectClasses, number: int) -> Figure:
    """Draw the paths of one class's prototypes on the stairs, on axes that are the same for every class."""
    figure, ax = new_figure(f"The prototypes of C{number}, performed from the start pose.", size=(5.4, 6.6))
    plot_prototype_trajectories(world, prototypes, classes, numbers=[number], axes=[ax])
    ax.set_ylim(-0.16, STEEPEST + 0.9)
    ax.legend(loc="upper left", frameon=False, fontsize=9, handlelength=2.8)
    return figure


# Promises


def plot_promises(prototypes: Prototypes, effects: np.ndarray, reached: np.ndarray, classes: EffectClasses) -> Figure:
    """Draw what each prototype of a set promises and does: an arrow from its class's mean effect to its own effect.

    Parameters
    ----------
    prototypes : Prototypes
        A set with classes.
    effects : ndarray of shape (n_prototypes, 2)
        What each does: dy and dz [m].
    reached : ndarray of shape (n_prototypes,), int
        The class of each effect, 0 off the map.
    classes : EffectClasses
        The classes.
    """
    assert prototypes.classes is not None
    names = prototype_names(prototypes)
    broken = [
        f"{n} ends {'in ' if r else ''}{called(r)}"
        for n, c, r in zip(names, prototypes.classes, reached, strict=True)
        if r != c
    ]
    figure, ax = new_figure(
        f"The effect plane with an arrow from each class's mean effect to the effects of its prototypes. "
        f"{len(broken)} of {len(names)} end elsewhere: {'; '.join(broken) or 'none'}.",
        size=(7.6, 4.6),
    )
    draw_effects(ax, classes)
    said: dict[tuple[float, ...], str] = {}
    for name, number, effect, end in zip(names, prototypes.classes, effects, reached, strict=True):
        seen = np.clip(effect, *np.transpose(EFFECT_LIMITS))
        mark(ax, seen, end, size=9)
        if end != number:
            look = {"arrowstyle": "-|>", "color": INK, "linewidth": 1.0, "shrinkA": 4, "shrinkB": 6}
            ax.annotate("", seen, classes.means[number - 1], arrowprops={**look, "connectionstyle": "arc3,rad=.15"})
            place = tuple(np.round(seen, 2).tolist())
            said[place] = f"{said[place]}, {name}" if place in said else name
    for place, words in said.items():
        ax.annotate(
            words,
            place,
            (0, 9 if place[0] < EFFECT_LIMITS[0][1] else -17),
            textcoords="offset points",
            ha="center",
            fontsize=9,
            zorder=7,
        )
    return figure


def plot_kept(prototypes: Prototypes, shares: np.ndarray, classes: EffectClasses, title: str) -> Figure:
    """Draw a set in the motion plane, each prototype with the share of its replays that end in its own class.

    Parameters
    ----------
    prototypes : Prototypes
        A set with classes.
    shares : ndarray of shape (n_prototypes,)
        From 0 to 1.
    classes : EffectClasses
        The classes.
    title : str
        What stands above.
    """
    assert prototypes.classes is not None
    names = prototype_names(prototypes)
    told = ", ".join(f"{name} {share:.0%}" for name, share in zip(names, shares, strict=True))
    figure, ax = new_figure(f"Prototypes in the motion plane. {title}: {told}.", size=(7.0, 4.6))
    draw_motions(ax, classes)
    for motion, number in zip(prototypes.motions, prototypes.classes, strict=True):
        mark(ax, motion, int(number))
    for name, motion, share, (dx, dy) in zip(
        names, prototypes.motions, shares, _free_places(prototypes.motions), strict=True
    ):
        bad = share < 0.5
        look: dict[str, Any] = {"fontweight": "bold", "color": PATH} if bad else {"color": INK}
        side = {"ha": "left" if dx > 0 else "right" if dx < 0 else "center", "va": "center", "fontsize": 9}
        words = f"{name} {share:.0%}"
        ax.annotate(words, motion, (dx, dy), textcoords="offset points", zorder=7, **side, **look)
    ax.set_title(title, fontsize=10)
    return figure


def _free_places(motions: np.ndarray) -> list[tuple[float, float]]:
    """Return for each motion where its words have room, in points from it."""
    points = motions * [0.387, 2.71]  # about the points of a newton and of a degree in a figure of 7 by 4.6 inches
    taken = [np.array([*point - 7, *point + 7]) for point in points]
    chosen = []
    for point in points:
        boxes = {}
        for dx, dy in PLACES:
            left = point[0] + (dx if dx > 0 else dx - WORDS if dx < 0 else -WORDS / 2)
            boxes[dx, dy] = np.array([left, point[1] + dy - 6, left + WORDS, point[1] + dy + 6])
        overlaps = {
            place: sum(bool((box[:2] < other[2:]).all() and (other[:2] < box[2:]).all()) for other in taken)
            for place, box in boxes.items()
        }
        best = min(overlaps, key=lambda place: overlaps[place])
        taken.append(boxes[best])
        chosen.append(best)
    return chosen


def plot_confusion(promised: np.ndarray, reached: np.ndarray, n_classes: int) -> Figure:
    """Draw how many prototypes of each class reach each class, and the map's outside; those that keep their promise are framed.

    Parameters
    ----------
    promised, reached : ndarray of shape (n_prototypes,), int
        Class that each stands for, and class that it reaches (0 off the map).
    n_classes : int
        Number of classes.
    """
    table = np.zeros((n_classes, n_classes + 1), dtype=int)
    np.add.at(table, (np.asarray(promised) - 1, np.asarray(reached)), 1)
    kept = int(np.trace(table[:, 1:]))
    figure, ax = new_figure(
        f"Table of promised against reached classes; {kept} of {table.sum()} prototypes are on its diagonal, "
        f"{table[:, 0].sum()} end off the map.",
        size=(5.4, 4.0),
    )
    ax.imshow(table, cmap="Blues", vmin=0, vmax=max(4, table.max()), aspect="auto")
    for row, column in np.argwhere(table):
        color = "white" if table[row, column] > 2 else INK
        ax.text(column, row, table[row, column], ha="center", va="center", color=color)
    for row in range(n_classes):
        x, y = row + 1, row
        ax.plot(
            [x - 0.5, x + 0.5, x + 0.5, x - 0.5, x - 0.5],
            [y - 0.5, y - 0.5, y + 0.5, y + 0.5, y - 0.5],
            color=INK,
            linewidth=1,
        )
    names = [f"$C_{k}$" for k in range(1, n_classes + 1)]
    ax.set_xticks(range(n_classes + 1), ["off the map", *names])
    ax.set_yticks(range(n_classes), names)
    ax.set(xlabel="class reached", ylabel="class promised")
    return figure


def plot_reached(rows: Mapping[str, np.ndarray], n_classes: int) -> Figure:
    """Draw what the motions of several sets do: for each set a bar, divided by the class reached.

    Parameters
    ----------
    rows : mapping of str to ndarray of int
        By set: the class that each of its motions reaches, 0 off the map.
    n_classes : int
        Number of classes.
    """
    tables = {name: np.bincount(reached, minlength=n_classes + 1) for name, reached in rows.items()}
    told = "; ".join(
        f"{name}: {', '.join(f'{called(k)} {count}' for k, count in enumerate(table) if count)}"
        for name, table in tables.items()
    )
    figure, ax = new_figure(
        f"Bars divided by the class that motions reach. {told}.", size=(8.0, 1.0 + 0.45 * len(rows))
    )
    for row, table in enumerate(tables.values()):
        begin = 0.0
        for k in (*range(1, n_classes + 1), OFF_THE_MAP):
            width = table[k] / table.sum()
            color = class_style(k).color if k else OFF_MAP
            ax.barh(row, width, left=begin, color=color, edgecolor="white", height=0.75)
            if width > 0.03:
                words = f"$C_{k}$ {table[k]}" if width > 0.055 else table[k]
                words = words if k else f"off {table[k]}" if width > 0.07 else table[k]
                color = "white" if k in (2, 3, 5) else INK
                ax.text(begin + width / 2, row, words, ha="center", va="center", fontsize=8.5, color=color)
            begin += width
    ax.set_yticks(range(len(rows)), list(rows))
    ax.set(ylim=(len(rows) - 0.5, -0.5), xlim=(0, 1), xticks=[], xlabel="motions, by the class that they reach")
    ax.spines[["left", "bottom"]].set_visible(False)
    ax.tick_params(axis="y", length=0)
    return figure


# Noise


def plot_noise(
    world: StairWorld, classes: EffectClasses, motion: np.ndarray, number: int, name: str = "", seed: int = 0
) -> Figure:
    """Draw 20 noisy replays of a prototype: where they lie in the motion plane, and what they do.

    Parameters
    ----------
    world : StairWorld
        Where they are performed.
    classes : EffectClasses
        The classes.
    motion : array-like of shape (2,)
        Magnitude [N] and angle [deg].
    number : int
        The class that it stands for.
    name : str
        What it is called.
    seed : int
        For the noise.
    """
    tries = noisy_motions(world, np.tile(motion, (TRIES, 1)), np.random.default_rng(seed))
    effects, reached = replay(world, tries, classes)
    ends = ", ".join(f"{called(r)}: {int((reached == r).sum())}" for r in np.unique(reached).tolist())
    figure, (left, right) = new_figure(
        f"{len(tries)} noisy replays of {name or 'a prototype'} of C{number}, in the motion plane and in the effect plane. "
        f"They end: {ends}.",
        panels=2,
        size=(9.4, 3.9),
    )
    draw_motions(left, classes)
    draw_effects(right, classes, number)
    left.set(xlim=motion[0] + np.array([-110, 110]), ylim=motion[1] + np.array([-10, 10]), yticks=_ticks(motion[1]))
    for line in left.lines:
        line.set(markersize=5, alpha=0.55)
    seen = np.clip(effects, *np.transpose(EFFECT_LIMITS))
    for x, e, end in zip(tries, seen, reached.tolist(), strict=True):
        mark(left, x, end, size=7)
        mark(right, e, end, size=7)
    left.plot(*motion, "+", color=INK, markersize=26, markeredgewidth=2, zorder=7)
    left.set_title(f"{name} (+): {motion[0]:.0f} N at {motion[1]:.0f}°", fontsize=10)
    right.set_title(f"where {len(tries)} replays end: {ends}", fontsize=10)
    return figure


def _ticks(angle: float) -> list[int]:
    return list(range(5 * math.ceil((angle - 10) / 5), math.floor(angle + 10) + 1, 5))


def noise_sweep(
    world: StairWorld,
    classes: EffectClasses,
    sets: Mapping[str, Prototypes],
    scales: Sequence[float] = (0, 0.5, 1, 2, 4),
    replays: int = 10,
) -> pd.DataFrame:
    """Measure the share of replays that end in their own class, for noise of several sizes.

    Returns
    -------
    pandas.DataFrame
        A row for each set, a column for each scale: 1 is 2 % of the magnitude and 1 degree.
    """
    rows = {}
    for name, prototypes in sets.items():
        assert prototypes.classes is not None
        shares = []
        for scale in scales:
            each = replays if scale else 1
            tries = [
                noisy_motions(world, np.tile(motion, (each, 1)), np.random.default_rng(i), scale)
                for i, motion in enumerate(prototypes.motions)
            ]
            reached = replay(world, np.vstack(tries), classes)[1].reshape(len(prototypes), each)
            shares.append(float((reached == prototypes.classes[:, None]).mean()))
        rows[name] = shares
    return pd.DataFrame(rows, index=pd.Index(scales, name="noise")).T


def plot_noise_sweep(table: pd.DataFrame) -> Figure:
    """Draw the table of ``noise_sweep``: a line for each set."""
    told = "; ".join(
        f"{name} {', '.join(f'{share:.0%}' for share in row)}"
        for name, row in zip(table.index, table.to_numpy(), strict=True)
    )
    figure, ax = new_figure(
        f"Share of replays in their own class against the size of the noise: {told}.", size=(6.6, 3.8)
    )
    for place, (name, row) in enumerate(zip(table.index, table.to_numpy(), strict=True)):
        color, marker = class_style(place + 1)
        ax.plot(range(len(row)), row, "-", marker=marker, color=color, markersize=8, label=name)
    ax.set_xticks(range(table.shape[1]), [f"× {scale:g}" for scale in table.columns])
    ax.set(ylim=(0, 1.03), xlabel="noise, times 2 % and 1°", ylabel="share in own class")
    ax.grid(axis="y", color=GRID, zorder=0)
    legend_below(ax, ncols=4)
    return figure


# Why a mean may be bad


def strangers_in_hull(classes: EffectClasses, number: int) -> float:
    """Return the share of samples inside the convex hull of a class's motions that are not of the class, off the map included."""
    inside = Delaunay(classes.motions_of(number)).find_simplex(classes.samples.motions) >= 0
    return float((classes.labels[inside] != number).mean())


def plot_hulls(classes: EffectClasses) -> Figure:
    """Draw each class's motions, their convex hull, and their mean (a star)."""
    shares = {number: strangers_in_hull(classes, number) for number in classes.numbers}
    figure, axes = new_figure(
        "The convex hull of each class in the motion plane, with its mean. Strangers inside: "
        + ", ".join(f"C{number} {share:.0%}" for number, share in shares.items())
        + ".",
        panels=classes.n_classes,
        size=(9.4, 2.6 * math.ceil(classes.n_classes / 3)),
    )
    for ax, (number, share) in zip(np.ravel(axes), shares.items(), strict=True):
        draw_motions(ax, classes, number)
        motions = classes.motions_of(number)
        ax.fill(*motions[ConvexHull(motions).vertices].T, facecolor="none", edgecolor=INK, linewidth=1.2, zorder=4)
        ax.plot(*motions.mean(axis=0), "*", color=INK, markeredgecolor="white", markersize=13, zorder=5)
        ax.set_title(f"$C_{{{number}}}$: {share:.0%} strangers inside", fontsize=10)
        ax.label_outer()
    return figure


def flight_magnitude(angle: np.ndarray, distance: float, height: float) -> np.ndarray:
    """Return the force that makes the cube's centre come down ``distance`` away and ``height`` higher, if nothing is in its way.

    The ballistic flight of lesson 01, with a cube of 1 kg that is pushed for 0.01 s. It comes down there, and does not pass on
    its way up, where tan(angle) > 2 height / distance.

    Parameters
    ----------
    angle : ndarray of shape (n,)
        Angle above the y-axis [deg].
    distance, height : float
        Where it comes down, seen from where it starts [m].

    Returns
    -------
    ndarray of shape (n,)
        Force [N]; NaN at angles where no flight comes down there.
    """
    radians = np.radians(angle)
    room = distance * np.tan(radians) - height
    with np.errstate(invalid="ignore", divide="ignore"):
        speed = np.sqrt(9.81 * distance**2 / (2 * np.cos(radians) ** 2 * room))
    return np.where(np.tan(radians) > 2 * height / distance, speed / 0.01, np.nan)


def plot_values(classes: EffectClasses, number: int, values: np.ndarray, label: str, chosen: np.ndarray) -> Figure:
    """Draw the motions of a class coloured by a value each, and those that were chosen.

    Parameters
    ----------
    classes : EffectClasses
        The classes.
    number : int
        The class.
    values : ndarray of shape (size of the class,)
        A value for each of its motions.
    label : str
        What the value is.
    chosen : array-like of shape (n, 2)
        Motions to point out: magnitude [N] and angle [deg].
    """
    motions = classes.motions_of(number)
    figure, ax = new_figure(
        f"The motions of C{number} coloured by {label}, from {values.min():.2g} to {values.max():.2g}; chosen are "
        f"{_listed(np.reshape(chosen, (-1, 2)))}.",
        size=(6.8, 4.2),
    )
    draw_motions(ax, classes)
    points = ax.scatter(*motions.T, c=values, cmap="viridis", s=26, edgecolors=FAINT, linewidths=0.3, zorder=3)
    ax.figure.colorbar(points, ax=ax, label=label)
    for motion in np.reshape(chosen, (-1, 2)):
        mark(ax, motion, number, size=12)
    return figure


def plot_trade(table: pd.DataFrame) -> Figure:
    """Draw reliability under noise against how far a class's motions are from their nearest prototype.

    Parameters
    ----------
    table : pandas.DataFrame
        A row for each set, with the columns "under noise" (share) and "distance" (standard deviations).
    """
    told = "; ".join(f"{name}: {row['under noise']:.0%}, {row['distance']:.2f}" for name, row in table.iterrows())
    figure, ax = new_figure(
        f"Reliability under noise against distance to the nearest prototype. {told}.", size=(6.4, 3.8)
    )
    for place, (name, row) in enumerate(table.iterrows()):
        mark(ax, (row["distance"], row["under noise"]), place + 1)
        ax.annotate(str(name), (row["distance"], row["under noise"]), (9, -3), textcoords="offset points", fontsize=9)
    room = 0.35 * float(np.ptp(table["distance"])) + 0.02
    ax.set(
        xlim=(table["distance"].min() - 0.2 * room, table["distance"].max() + room),
        ylim=(0, 1.05),
        xlabel="distance of a motion to its class's nearest prototype [sd]",
        ylabel="share in own class,\nunder noise",
    )
    ax.grid(color=GRID, zorder=0)
    return figure
