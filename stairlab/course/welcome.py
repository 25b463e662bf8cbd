"""Lesson 00, welcome: play a jump, the course as a map, and the whole method as a few pictures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch, Rectangle

from stairlab._validation import one_of
from stairlab.drawing import CUBE, FAINT, GRID, INK, OFF_MAP, PATH, STAIRS, figure_legend, marker_handle, new_figure
from stairlab.effects import EffectClasses
from stairlab.physics import CUBE_EDGE, Staircase
from stairlab.plots import SEEN_AHEAD, class_names, class_style, cube_corners, draw_cube, draw_stairs, pose
from stairlab.prototypes import Prototypes
from stairlab.sampling import Samples, noisy_motions
from stairlab.tumbling import TumblingWorld
from stairlab.world import CubeWorld, Jump, StairWorld

SEEN_HEIGHT = 1.75
""" "Play a jump" shows heights up to here, so that pictures keep their size [m] """
SEEN_WAY = 2.6
""" ... and this far [m] """
PLAY_WORLDS: dict[str, type[CubeWorld]] = {"plane": StairWorld, "three dimensions": TumblingWorld}
""" Where "Play a jump" can be played """
MOST_JUMPS = 30
""" A climb is given up after so many jumps """


class Stage(NamedTuple):
    """A part of the course: what the robot does, and the lessons about it."""

    name: str
    lessons: tuple[tuple[str, str], ...]
    hands_on: str


STAGES = (
    Stage(
        "it jumps",
        (("01_the_world", "What happens in a jump?"), ("02_sampling", "What does random exploring find?")),
        "effects",
    ),
    Stage(
        "it sorts",
        (("03_effect_classes", "Which effects are “the same”?"), ("04_how_many_classes", "Why six?")),
        "classes",
    ),
    Stage(
        "it keeps a few",
        (
            ("05_how_many_prototypes", "Which actions deserve more variants?"),
            ("06_growing_neural_gas", "How to place a few points well?"),
            ("07_action_prototypes", "Are our prototypes any good?"),
        ),
        "prototypes",
    ),
    Stage(
        "it climbs",
        (
            ("08_up_the_stairs", "What does it take to climb?"),
            ("09_learning_to_climb", "How does trial and error become a policy?"),
        ),
        "results",
    ),
    Stage("you judge", (("10_does_it_hold_up", "Do you believe the paper?"),), ""),
)
""" The course, in the order of the method """


# The lesson's widget


def draw_play(magnitude: float = 450, angle: float = 65, world: str = "plane") -> Figure:
    """Draw a jump from the start pose from the side: its path, where it ends, and its effect as two arrows.

    Parameters
    ----------
    magnitude, angle : float
        The motion [N], [deg].
    world : {"plane", "three dimensions"}
        Where. In three dimensions the cube rocks each time in the same way, so that equal motions give equal pictures.

    Returns
    -------
    matplotlib Figure
    """
    here = PLAY_WORLDS[one_of("world", world, PLAY_WORLDS)]()
    stairs = here.staircase
    jump = here.jump(magnitude, angle, trajectory=True)
    said, effect = what_it_did(jump), f"Δy = {_rounded(jump.dy)} m, Δz = {_rounded(jump.dz)} m"
    aside = _rounded(float(jump.effect[0]))
    effect += "" if aside == "0.00" else f", and aside Δx = {aside} m"
    where = "" if world == "plane" else f" in {world}"
    figure, ax = new_figure(
        f"A jump with {magnitude:g} N at {angle:g}°{where}: {said}. Its effect is {effect}.",
        size=(6.6, 4.5),
    )
    figure.set_layout_engine("none")  # laying out each picture anew would cost a slider half its time
    ax.set_position((0.09, 0.11, 0.89, 0.82))
    draw_stairs(ax, stairs, SEEN_HEIGHT, SEEN_WAY - 0.25)
    ax.set(xticks=np.arange(0, SEEN_WAY, 0.5), yticks=(0, 0.3, 0.6, 0.9, 1.2, 1.5))
    path = jump.trajectory
    if path is not None:
        ax.plot(path.y, path.z, color=PATH, linewidth=1.5, zorder=5)
        if path.z.max() > SEEN_HEIGHT:
            words = f"flies up to z = {path.z.max():.1f} m"
            ax.text(SEEN_WAY - 0.05, SEEN_HEIGHT - 0.05, words, color=PATH, ha="right", va="top", fontsize=9)
    draw_cube(ax, *pose(jump.start), facecolor="none", linestyle=":", linewidth=1.3, zorder=6)
    draw_cube(ax, *pose(jump.end), zorder=6)
    if jump.on_map:
        _draw_effect(ax, jump)
    ax.set_title(f"{said}        effect: {effect}", fontsize=10, loc="left")
    return figure


def _rounded(length: float) -> str:
    """Return a length to the centimetre, with its sign, and without that of a zero."""
    rounded = round(length, 2) + 0.0
    return f"{rounded:+.2f}" if rounded else "0.00"


def _draw_effect(ax: Axes, jump: Jump) -> None:
    y, z, _ = pose(jump.start)
    far, high, _ = pose(jump.end)
    arrow = {"arrowstyle": "-|>", "color": INK, "linewidth": 1.4, "shrinkA": 0, "shrinkB": 0}
    if abs(far - y) > 0.03:
        ax.annotate("", (far, z - 0.11), (y, z - 0.11), arrowprops=arrow, zorder=7)
        ax.text((y + far) / 2, z - 0.13, "Δy", ha="center", va="top", fontsize=9, zorder=7)
    if abs(high - z) > 0.03:
        ax.annotate("", (far, high), (far, z - 0.11), arrowprops=arrow, zorder=7)
        ax.text(far + 0.02, (z + high) / 2, "Δz", va="center", fontsize=9, zorder=7)


def what_it_did(jump: Jump) -> str:
    """Say what a jump did: "2 steps up", "no step", "off the map"."""
    steps = round(jump.dz / Staircase.rise)
    if not jump.on_map:
        return "off the map"
    return (
        "no step" if steps == 0 else f"{abs(steps)} step{'s' if abs(steps) > 1 else ''} {'up' if steps > 0 else 'down'}"
    )


# The method in pictures


def draw_first_jumps(samples: Samples, count: int) -> Figure:
    """Draw the first random jumps: where the cubes ended, and which motions these were.

    Parameters
    ----------
    samples : Samples
        Jumps from the start pose.
    count : int
        How many to draw.

    Returns
    -------
    matplotlib Figure
    """
    some = samples[:count]
    ends = some.starts + some.effects
    figure, (left, right) = new_figure(
        f"Where the cube ended after the first {len(some)} random jumps, {int((~some.on_map).sum())} of them off the map; and their "
        "motions, spread over the whole plane of force and angle.",
        panels=2,
        size=(9.0, 3.5),
    )
    draw_stairs(left, Staircase(), 1.55, 2.35)
    for state in ends[some.on_map]:
        draw_cube(left, *pose(state), facecolor=PATH, alpha=0.25, linewidth=0.5)
    draw_cube(left, *pose(some.starts[0]), facecolor="none", linestyle=":")
    left.set_title("where the cube ended", fontsize=10)
    right.plot(*some.motions[some.on_map].T, ".", color=PATH, markersize=5)
    right.plot(*some.motions[~some.on_map].T, "x", color=FAINT, markersize=4)
    right.set(xlim=(20, 1030), ylim=(-2, 92), yticks=range(0, 91, 15), xlabel="magnitude [N]", ylabel="angle [°]")
    off = ", × off the map" if (~some.on_map).any() else ""
    right.set_title(f"the motions: {count} jump{'s' if count > 1 else ''}{off}", fontsize=10)
    return figure


def draw_effects(samples: Samples, classes: EffectClasses | None = None) -> Figure:
    """Draw the effects (dy, dz) of the jumps that ended on the map, by class if there are classes.

    Parameters
    ----------
    samples : Samples
        Jumps.
    classes : EffectClasses, optional
        Classes of these samples.

    Returns
    -------
    matplotlib Figure
    """
    effects = samples.effect("dy", "dz")
    levels, counts = np.unique(np.round(effects[samples.on_map, 1] / Staircase.rise).astype(int), return_counts=True)
    words = ", ".join(f"{count} at {0.3 * level:.1f} m" for level, count in zip(levels, counts, strict=True))
    found = f" in {classes.n_classes} classes" if classes else ""
    figure, ax = new_figure(
        f"Effects of {samples.on_map.sum()} jumps{found}, height gained against way gained: {words}.", size=(7.2, 3.8)
    )
    if classes is None:
        ax.plot(*effects[samples.on_map].T, "o", color=INK, markersize=5, alpha=0.4, markeredgewidth=0)
    else:
        for number in classes.numbers:
            style = class_style(number)
            of_class = effects[classes.labels == number]
            ax.plot(*of_class.T, style.marker, color=style.color, markersize=6, alpha=0.7, markeredgewidth=0)
        handles = [marker_handle(*class_style(n), name) for n, name in class_names(classes).items()]
        figure_legend(ax, handles, "right upper", 1)
    ax.set(xlabel="effect Δy [m]", ylabel="effect Δz [m]", yticks=(0, 0.3, 0.6, 0.9, 1.2))
    ax.grid(axis="y", color=GRID)
    return figure


def draw_noise(motion: Sequence[float], n: int = 20, seed: int = 0) -> Figure:
    """Draw the same motion again and again with a little noise on force and angle: whether it does what it did without.

    Parameters
    ----------
    motion : sequence of two floats
        Magnitude [N] and angle [deg].
    n : int
        How often.
    seed : int
        For the noise: 2 % of the force, and 1 degree.

    Returns
    -------
    matplotlib Figure
    """
    world = StairWorld()
    exact = world.jump(float(motion[0]), float(motion[1]), trajectory=True)
    rng = np.random.default_rng(seed)
    jumps = []
    for magnitude, angle in noisy_motions(world, np.tile(motion, (n, 1)), rng).tolist():
        world.reset()
        jumps.append(world.jump(magnitude, angle, trajectory=True))
    same = sum(jump.on_map and round(jump.dz / Staircase.rise) == round(exact.dz / Staircase.rise) for jump in jumps)
    figure, ax = new_figure(
        f"The motion {motion[0]:.0f} N at {motion[1]:.0f}° does this: {what_it_did(exact)}. Of {n} replays with noise, {same} gain as "
        "much height.",
        size=(6.4, 4.0),
    )
    paths = [path for jump in [*jumps, exact] if (path := jump.trajectory) is not None]
    draw_stairs(ax, world.staircase, max(1.5, *(float(path.z.max()) + 0.1 for path in paths)), 2.4)
    for path in paths:
        bold = path is paths[-1]
        ax.plot(path.y, path.z, color=PATH if bold else FAINT, linewidth=2 if bold else 0.8, zorder=5 if bold else 3)
    for jump in jumps:
        draw_cube(ax, *pose(jump.end), facecolor="none", edgecolor=FAINT)
    draw_cube(ax, *pose(exact.end))
    ax.set(xlim=(-0.1, 2.6))
    words = f"{motion[0]:.0f} N at {motion[1]:.0f}°: {what_it_did(exact)}, with noise {same} of {n} times"
    ax.set_title(words, fontsize=10, loc="left")
    return figure


# Climbing


def climb(motions: Prototypes | np.ndarray, careful: bool = False) -> list[Jump]:
    """Climb fifteen steps greedily, in the plane: try each motion where the cube is, and take the one that lifts it highest.

    Parameters
    ----------
    motions : Prototypes or ndarray of shape (n_motions, 2)
        Magnitude [N] and angle [deg].
    careful : bool
        Take the one that lifts the cube least, but does, and of several the one that leaves the largest gap to the next riser.

    Returns
    -------
    list of Jump
        With their paths; the last one rests on the top, or no motion lifts the cube any more.
    """
    world = StairWorld(Staircase.fifteen())
    stairs = world.staircase
    choices = motions.motions if isinstance(motions, Prototypes) else np.asarray(motions, dtype=float)
    taken: list[Jump] = []
    while len(taken) < MOST_JUMPS and world.state[2] < stairs.top:
        here, tried = world.state, []
        for motion in choices.tolist():
            world.reset(here)
            tried.append(world.jump(*motion))
        up = [jump for jump in tried if jump.on_map and jump.dz > stairs.rise / 2]
        if not up:
            return taken
        steps = [round(jump.dz / stairs.rise) for jump in up]
        gaps = [stairs.next_riser(float(jump.end[1])) - float(jump.end[1]) for jump in up]
        best = max(range(len(up)), key=lambda i: (-steps[i] if careful else steps[i], gaps[i]))
        world.reset(here)
        taken.append(world.jump(up[best].magnitude, up[best].angle, trajectory=True))
    return taken


def draw_climb(jumps: Sequence[Jump], count: int | None = None) -> Figure:
    """Draw the first jumps of a climb over fifteen steps.

    Parameters
    ----------
    jumps : sequence of Jump
        One after the other, with their paths.
    count : int, optional
        How many to draw; all by default.

    Returns
    -------
    matplotlib Figure
    """
    stairs = Staircase.fifteen()
    shown = list(jumps)[:count]
    state = shown[-1].end if shown else StairWorld(stairs).start
    step = round((float(state[2]) - CUBE_EDGE / 2) / stairs.rise)
    gap = stairs.next_riser(float(state[1])) - float(cube_corners(*pose(state))[:, 0].max())
    left = f", {1000 * max(gap, 0.0):.0f} mm before the next riser" if math.isfinite(gap) else ", the top"
    words = f"after {len(shown)} jump{'s' if len(shown) != 1 else ''}: step {step} of {stairs.n_steps}{left}"
    figure, ax = new_figure(f"Fifteen steps, {words}.", size=(7.4, 4.6))
    highest = max((float(path.z.max()) for jump in jumps if (path := jump.trajectory) is not None), default=0.0)
    draw_stairs(ax, stairs, max(stairs.top + 0.5, highest + 0.2), float(stairs.risers[-1]) + SEEN_AHEAD - 0.25)
    for i, jump in enumerate(shown):
        if jump.trajectory is not None:
            last = i == len(shown) - 1
            ax.plot(jump.trajectory.y, jump.trajectory.z, color=PATH if last else FAINT, linewidth=1.5, zorder=3)
    draw_cube(ax, *pose(state))
    ax.set_title(words, fontsize=10, loc="left")
    return figure


# The course


def draw_map(here: str = "") -> Figure:
    """Draw the course as a staircase: a step for each part, with its lessons, and what each part hands on to the next.

    Parameters
    ----------
    here : str
        Name of a lesson that is marked, such as "01_the_world".

    Returns
    -------
    matplotlib Figure
    """
    parts = "; ".join(
        f"{stage.name}: lesson{'s' if len(stage.lessons) > 1 else ''} "
        + ", ".join(f"{int(name[:2])} {name[3:].replace('_', ' ')}" for name, _ in stage.lessons)
        for stage in STAGES
    )
    figure, ax = new_figure(f"The course as a staircase of five steps. {parts}.", size=(9.6, 4.8))
    ax.axis("off")
    for i, stage in enumerate(STAGES):
        height = 1.6 + 0.75 * i
        ax.add_patch(Rectangle((2 * i, 0), 2, height, facecolor=STAIRS, edgecolor=INK, linewidth=0.8))
        ax.text(2 * i + 1, height - 0.22, stage.name, ha="center", va="center", fontsize=11, fontweight="bold")
        for j, (name, _) in enumerate(stage.lessons):
            marked = name == here
            words = f"{int(name[:2])}  {name[3:].replace('_', ' ')}"
            face = CUBE if marked else "white"
            ax.add_patch(
                FancyBboxPatch(
                    (2 * i + 0.1, height - 0.83 - 0.42 * j),
                    1.8,
                    0.26,
                    boxstyle="round,pad=0.04",
                    facecolor=face,
                    edgecolor=FAINT,
                )
            )
            ax.text(2 * i + 1, height - 0.7 - 0.42 * j, words, ha="center", va="center", fontsize=8)
        if stage.hands_on:
            arrow = {"arrowstyle": "-|>", "color": PATH, "linewidth": 1.6, "connectionstyle": "arc3,rad=-0.45"}
            ax.annotate("", (2 * i + 2.5, height + 0.8), (2 * i + 1.3, height + 0.05), arrowprops=arrow)
            ax.text(2 * i + 1.25, height + 0.62, stage.hands_on, ha="right", fontsize=9, color=PATH)
    ax.add_patch(Rectangle((-0.75, 0), 0.4, 0.4, facecolor=CUBE, edgecolor=INK))
    arrow = {"arrowstyle": "-|>", "color": INK, "linewidth": 1.6, "connectionstyle": "arc3,rad=-0.3"}
    ax.annotate("", (0.4, 1.65), (-0.55, 0.45), arrowprops=arrow)
    ax.set(xlim=(-0.9, 10.1), ylim=(-0.05, 5.6))
    return figure


def draw_cycle() -> Figure:
    """Draw how every lesson goes: a question, your prediction, the code, a picture, what it means, and again.

    Returns
    -------
    matplotlib Figure
    """
    stations = ("a question", "your prediction", "code", "a picture", "what it means")
    figure, ax = new_figure(
        f"A circle of five stations: {', '.join(stations)}, and on to the next question.", size=(5.6, 3.4)
    )
    ax.axis("off")
    ax.set(xlim=(-2.1, 2.1), ylim=(-1.35, 1.35))
    turns = math.pi / 2 - 2 * math.pi * np.arange(len(stations)) / len(stations)
    places = np.column_stack([1.45 * np.cos(turns), np.sin(turns)])
    for i, ((x, y), words) in enumerate(zip(places.tolist(), stations, strict=True)):
        mine = words == "your prediction"
        box = {"boxstyle": "round,pad=0.5", "facecolor": CUBE if mine else "white", "edgecolor": INK}
        ax.text(x, y, words, ha="center", va="center", fontsize=10, bbox=box, zorder=3)
        to_x, to_y = places[(i + 1) % len(places)].tolist()
        begin, end = ((x + share * (to_x - x), y + share * (to_y - y)) for share in (0.36, 0.64))
        arrow = {"arrowstyle": "-|>", "color": FAINT, "linewidth": 1.8, "shrinkA": 0, "shrinkB": 0}
        ax.annotate("", end, begin, arrowprops=arrow, zorder=2)
    return figure


def outcome_shares(samples: Samples) -> Mapping[str, float]:
    """Return the share of jumps with each outcome, by its name: "no step", "1 step", ..., "off the map"."""
    steps = np.round(samples.effect("dz").ravel() / Staircase.rise).astype(int)
    names = {0: "no step", 1: "1 step"} | {k: f"{k} steps" for k in range(2, Staircase().n_steps + 1)}
    shares = {name: float((samples.on_map & (steps == k)).mean()) for k, name in names.items()}
    return shares | {"off the map": float((~samples.on_map).mean())}


def draw_outcomes(samples: Samples) -> Figure:
    """Draw how many of the jumps had which outcome.

    Parameters
    ----------
    samples : Samples
        Jumps from the start pose.

    Returns
    -------
    matplotlib Figure
    """
    shares = outcome_shares(samples)
    words = ", ".join(f"{name} {share:.0%}" for name, share in shares.items())
    figure, ax = new_figure(f"Share of {len(samples)} random jumps with each outcome: {words}.", size=(6.0, 2.8))
    colors = [OFF_MAP if name == "off the map" else class_style(2).color for name in shares]
    bars = ax.barh(list(shares), [100 * share for share in shares.values()], color=colors)
    ax.bar_label(bars, fmt="%.0f %%", padding=3, fontsize=9)
    ax.invert_yaxis()
    ax.set(xlabel="share of the jumps [%]", xlim=(0, 100))
    return figure
