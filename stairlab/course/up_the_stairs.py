"""Lesson 08, up the stairs: pictures of episodes and of the gap before a riser, and the game played by hand."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator, PercentFormatter

from stairlab.course.explore import DPI, Live, explore
from stairlab.course.game import (
    READINGS,
    Game,
    from_gap,
    gap_of,
    play,
    repeat,
    replay_plan,
    step_of,
    widest_after,
)
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
from stairlab.fidelity import CLOSE, Rollouts, TreadMeasures
from stairlab.physics import CUBE_EDGE, Staircase
from stairlab.planning import DEAD_BAND, Plan
from stairlab.plots import draw_cube, draw_cube_from_above, draw_stairs, draw_stairs_from_above, pose
from stairlab.prototypes import Prototypes
from stairlab.tumbling import TumblingWorld, stair_world
from stairlab.world import CubeWorld, Jump, StairWorld, reach_of, yaw_of

if TYPE_CHECKING:
    import ipywidgets

FEWEST_SHOWN = 4
""" An episode's picture shows so many steps of the stairs at least """
GAME_COLORS = (COLORS[1], COLORS[3], COLORS[2], COLORS[5])
GAPS = np.geomspace(0.0005, 0.345, 70)
""" Gaps from which a motion's map is drawn; with 0.35 m, the centre of the cube is on the edge [m] """
LINEAR_FROM = 10
""" A motion's map that shows no narrower gaps than this has linear axes [mm] """
TABLE_GAPS = np.array([1, 2, 3, 4, 5, 7, 10, 14, 20, 28, 40, 56, 80, 110, 150, 200, 250, 300, 340]) / 1000
""" Gaps in the table of what each motion does [m] """
CLOSE_GAPS = np.geomspace(0.0005, 0.1, 26)
""" Gaps from which a set's ways out are tried [m] """
CLOSE_UP = 0.75
""" Half the width of a close-up [m] """
HEADROOM = 0.6
""" Height shown above the cube, at least [m] """
SHOWN_TURN = 0.5
""" A cube that is turned about the vertical by less is said to stand straight [deg] """
TURNED = 10
""" A cube that bumps into a riser turned about the vertical, by this much [deg] """
BUMPS = ("plane", "tumbling", f"tumbling, turned by {TURNED}°")
""" Worlds in which a cube bumps into a riser, and how it stands before it """
WORLD_STYLES = {"plane": (COLORS[1], "o"), "tumbling": (COLORS[2], "s")}
YAW_BINS = {"below 0.5°": (0.0, 0.5), "0.5 to 5°": (0.5, 5.0), "above 5°": (5.0, 46.0)}
""" How far a trapped cube is turned about the vertical, from and below [deg] """


# Equation 5 and its readings


def draw_reading(reading: str = "with dead band") -> Figure:
    """Draw the reward against the height gained, by one reading of equation 5; the others stay faint behind it."""
    figure, ax = new_figure(_words_of_reading(reading), size=(6.4, 3.4))
    dz = np.linspace(-1.0, 1.3, 921)
    for name, reward in READINGS.items():
        shown = name == reading
        values = np.array([reward(value, 0.3) for value in dz.tolist()])
        values[1:][np.abs(np.diff(values)) > 0.1] = np.nan  # no line where the reward jumps
        ax.plot(dz, values, color=PATH if shown else FAINT, linewidth=2.4 if shown else 0.8, zorder=3 if shown else 2)
    ax.axhline(0, color=GRID, zorder=1)
    ax.axvspan(-DEAD_BAND, DEAD_BAND, color=GRID, zorder=0)
    ax.set(xlabel="height gained Δz [m]", ylabel="reward r", ylim=(-3.6, 3.6), xticks=np.arange(-0.9, 1.3, 0.3))
    ax.set_title(f"equation 5, {reading}", fontsize=10, loc="left")
    return figure


def _words_of_reading(reading: str) -> str:
    reward = READINGS[reading]
    heights = (-0.6, -0.3, -0.001, 0.001, 0.3, 0.6)
    parts = ", ".join(f"{reward(dz, 0.3):.3g} for {dz:+g} m" for dz in heights)
    return f"Reward against height gained, equation 5 {reading}: {parts}. The other readings are faint lines."


# Episodes


def draw_episode(game: Game, jumps: int | None = None) -> Figure:
    """Draw an episode's first ``jumps`` jumps (all by default): the paths on the stairs, and below what each gained and earned."""
    count = len(game.actions) if jumps is None else jumps
    figure, (ax, ledger) = new_figure("Up The Stairs.", panels=2, size=(6.4, 6.0), columns=1)
    figure.set_layout_engine(None)
    ax.set_position((0.09, 0.33, 0.89, 0.62))
    ledger.set_position((0.09, 0.08, 0.89, 0.17))
    made = [game.path(number) for number in range(1, count + 1)]
    paths = [jump.trajectory for jump in made if jump.trajectory is not None]
    _stairs_of(ax, game, max((float(path.z.max()) for path in paths), default=0.0))
    for number, path in enumerate(paths, 1):
        last = number == count
        ax.plot(path.y, path.z, color=PATH if last else FAINT, linewidth=1.6 if last else 0.8, zorder=3)
    for state in game.states[:count]:
        draw_cube(ax, *pose(state), facecolor="white", edgecolor=FAINT, zorder=2)
    draw_cube(ax, *pose(game.states[count]))
    ax.set_title(_after(game, count), fontsize=10, loc="left")
    _ledger(ledger, game, count)
    if game.tumbles:
        ax.set_position((0.09, 0.42, 0.89, 0.53))
        ledger.set_position((0.09, 0.07, 0.89, 0.12))
        _from_above(figure.add_axes(_below(ax, 0.26, 0.12)), ax, game, made)
    setattr(figure, "stairlab_alt", _words_of_episode(game, count))  # noqa: B010
    return figure


def _below(ax: Axes, bottom: float, height: float) -> tuple[float, float, float, float]:
    """Return a place as wide as what is drawn of axes of equal scales."""
    ax.apply_aspect()
    box = ax.get_position()
    return box.x0, bottom, box.width, height


def _from_above(ax: Axes, side: Axes, game: Game, jumps: Sequence[Jump]) -> None:
    """Draw an episode's jumps from above, over as much of the stairs as its side view shows."""
    draw_stairs_from_above(ax, game.staircase, *side.get_xlim())
    for number, jump in enumerate(jumps, 1):
        last = number == len(jumps)
        if (path := jump.trajectory) is not None and path.x is not None:
            ax.plot(path.y, path.x, color=PATH if last else FAINT, linewidth=1.4 if last else 0.7, zorder=3)
    state = game.states[len(jumps)]
    draw_cube_from_above(ax, state[0], state[1], state[3:7], zorder=4)
    aside = max(0.5, 0.15 + max(abs(float(state[0])) for state in game.states))
    ax.set(xlabel="", ylim=(aside, -aside), aspect="auto", yticks=[-round(aside - 0.1, 1), 0, round(aside - 0.1, 1)])
    ax.tick_params(labelbottom=False, labelsize=8)


def _stairs_of(ax: Axes, game: Game, highest: float) -> None:
    """Draw the part of the stairs that an episode visits, and of the air, up to ``highest`` or somewhat more than usual [m]."""
    stairs = game.staircase
    shown = min(stairs.n_steps, max(FEWEST_SHOWN, int(game.steps.max()) + 1))
    right = stairs.first_riser + stairs.run * shown + 0.35
    farthest = max(float(state[1]) for state in game.states if state[1] < stairs.end)
    right = max(right, farthest + 0.3)
    usual = stairs.rise * shown + HEADROOM
    draw_stairs(ax, stairs, max(usual, min(highest + 0.15, usual + 1.5)), 0.0)
    ax.set(xlim=(-0.1, right), aspect="equal", anchor="W")


def _ledger(ax: Axes, game: Game, count: int) -> None:
    """Draw for each jump the steps gained (outline) and the reward (filled), from left to right."""
    gains, number = game.gains, np.arange(1, len(game.actions) + 1)
    rewards = np.array(game.rewards)
    ax.bar(number[:count], gains[:count], color="white", edgecolor=INK, linewidth=0.9, width=0.8)
    ax.bar(number[:count], rewards[:count], color=COLORS[1], width=0.5)
    ax.axhline(0, color=INK, linewidth=0.6)
    most, least = (max(1, int(gains.max())), min(0, int(gains.min()))) if len(gains) else (1, 0)
    ax.set(xlim=(0.3, max(len(gains), 8) + 0.7), ylim=(least - 0.15, most + 0.15), xlabel="jump")
    ax.set_ylabel("steps (outline)\nreward (filled)", fontsize=8)
    ax.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    ax.yaxis.set_major_locator(MaxNLocator(4, integer=True, min_n_ticks=1))


def _after(game: Game, count: int) -> str:
    where = f"step {game.steps[count]} of {game.staircase.n_steps}"
    value = sum(game.rewards[:count])
    if not count:
        return f"start: {where}, return 0"
    magnitude, angle = game.motions[game.actions[count - 1]]
    return f"jump {count}, {magnitude:.0f} N at {angle:.0f}°: {_gained(game, count)}; {where}, return {_number(value)}"


def _gained(game: Game, count: int) -> str:
    gained = int(game.gains[count - 1])
    if not game.on_map(count):
        return "off the stairs"
    return f"{gained:+d} step{'s' if abs(gained) != 1 else ''}" if gained else "no step"


def _number(value: float) -> str:
    """Return a return in whole steps where it is one, as a cube that leans spoils it by hundredths."""
    return f"{round(value)}" if abs(value - round(value)) < 0.005 else f"{value:.2f}"


def _words_of_episode(game: Game, count: int) -> str:
    gains = ", ".join(f"{gain:+d}" for gain in game.gains[:count].tolist())
    aside = f" It is {100 * game.states[count][0]:.0f} cm aside, seen from above." if game.tumbles else ""
    return (
        f"Side view of the stairs with the first {count} of {len(game.actions)} jumps, and a bar for each: "
        f"{_after(game, count)}. Steps gained: {gains or 'none yet'}.{aside}"
    )


def draw_gaps(games: Mapping[str, Game], trap: float = 0.0) -> Figure:
    """Draw the gap to the riser ahead after each jump of some episodes, and the trap below which no motion climbs [m]."""
    ends = "; ".join(
        f"{name}: from {1000 * game.gaps[0]:.0f} to {_millimetres(game.gaps[-1])} after {len(game.actions)} jumps"
        for name, game in games.items()
    )
    words = f"Gap before the next riser against the number of jumps. {ends}."
    figure, ax = new_figure(f"{words} The trap is {1000 * trap:.1f} mm wide.", size=(7.6, 3.6))
    for (name, game), color, marker in zip(
        games.items(), GAME_COLORS * len(games), "osD^vP" * len(games), strict=False
    ):
        gaps = np.where(np.isfinite(game.gaps), game.gaps, np.nan)
        ax.plot(1000 * gaps, color=color, marker=marker, markersize=4, linewidth=1, label=name)
        climbs = np.flatnonzero(game.gains > 0) + 1
        ax.plot(climbs, 1000 * gaps[climbs], "o", color="none", markeredgecolor=INK, markersize=8)
    ax.axhspan(0.01, 1000 * trap, color=GRID, zorder=0)
    if trap:
        ax.text(0.995, 0.93 * 1000 * trap, "trap", ha="right", va="top", transform=ax.get_yaxis_transform(), fontsize=9)
    ax.set(yscale="log", ylim=(0.1, 500), xlabel="jumps made", ylabel="gap to the riser ahead [mm]")
    ax.yaxis.set_major_formatter("{x:g}")
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    handles, _ = ax.get_legend_handles_labels()
    handles.append(Line2D([], [], linestyle="none", marker="o", color="none", markeredgecolor=INK, label="climbed"))
    figure.legend(handles=handles, loc="outside lower center", ncols=6, frameon=False, fontsize=9)
    return figure


def _millimetres(gap: float) -> str:
    return f"{1000 * gap:.1f} mm" if math.isfinite(gap) else "the top"


# The gap before a riser


def draw_ways_out(**sets: Prototypes) -> Figure:
    """Draw for each set the widest gap that one of its motions leaves, against the gap before; and from where one climbs."""
    gaps = CLOSE_GAPS
    figure, axes = new_figure("Ways out.", panels=len(sets), size=(3.1 * len(sets), 3.2), columns=len(sets))
    words = []
    for ax, (name, motions) in zip(np.ravel(axes), sets.items(), strict=True):
        after = np.array([widest_after(motions, gap) for gap in gaps.tolist()])
        bump, up = float(after[0]), np.isinf(after)
        ax.plot(1000 * gaps[~up], 1000 * after[~up], "o", color=COLORS[1], markersize=4, label="no motion climbs")
        ax.plot(1000 * gaps[up], np.full(up.sum(), 450.0), "^", color=COLORS[2], markersize=5, label="a motion climbs")
        ax.plot([0.5, 450], [0.5, 450], color=FAINT, linewidth=0.8)
        caught = bool((after[gaps <= bump] <= 1.01 * bump).all())
        if caught:
            ax.add_patch(Rectangle((0.01, 0.01), 1000 * bump, 1000 * bump, facecolor=GRID, zorder=0))
        ax.set(xscale="log", yscale="log", xlim=(0.4, 130), ylim=(0.4, 800), title=name, xlabel="gap before [mm]")
        for axis in (ax.xaxis, ax.yaxis):
            axis.set_major_formatter("{x:g}")
        found = "nothing leads out of the gaps up to that" if caught else "some motion leads on from there"
        words.append(f"{name}: from 0.5 mm the widest is {1000 * bump:.1f} mm, and {found}")
    first = np.ravel(axes)[0]
    first.set_ylabel("widest gap after [mm]")
    figure.legend(
        handles=first.get_legend_handles_labels()[0], loc="outside lower center", ncols=2, frameon=False, fontsize=9
    )
    setattr(figure, "stairlab_alt", f"The widest gap after a jump against the gap before it. {'; '.join(words)}.")  # noqa: B010
    return figure


def draw_push(gap: int = 10, angle: int = 85, magnitude: int = 500, world: str = "plane") -> Figure:
    """Draw a push off close to a riser: its straight line, and what becomes of the cube.

    Parameters
    ----------
    gap : int
        Between the cube's front face and the riser [mm].
    angle : int
        Of the push [deg].
    magnitude : int
        Of the push [N].
    world : {"plane", "tumbling"}
        Which one; where it tumbles, the cube rocks in the fixed way.

    Returns
    -------
    matplotlib Figure
    """
    where = stair_world(world)
    stairs, jump = where.staircase, _jump_before_riser(where, gap, angle, magnitude)
    (ax,) = make_axes(None, 1, (5.6, 4.6))
    ax.figure.figure.set_layout_engine(None)
    ax.set_position((0.13, 0.12, 0.83, 0.78))
    _draw_jump_before_riser(ax, stairs, jump)
    front = float(jump.start[1]) + CUBE_EDGE / 2
    reach, said = gap / 1000 * math.tan(math.radians(angle)), _what_becomes(jump, stairs)
    top = min(reach, 0.8)
    ax.plot([front, front + top / math.tan(math.radians(angle))], [0, top], "--", color=INK, linewidth=1.2, zorder=5)
    if reach == top:
        marker = "o" if reach > stairs.rise else "X"
        ax.plot([stairs.first_riser], [reach], marker=marker, color=INK, markersize=7, zorder=6)
    ax.set_title(f"g tan α = {reach:.3f} m, h = {stairs.rise} m\n{world}: {said}", fontsize=9, loc="left")
    return finish(
        ax,
        f"Close-up of a riser of {stairs.rise} m. {world}: the cube stands {gap} mm before it and is pushed with {magnitude} N at "
        f"{angle}°. The straight line of its lower front corner meets the riser at {reach:.3f} m: {said}.",
    )


def draw_bump(world: str = "plane", angle: int = 75, gap: int = 5, magnitude: int = 500) -> Figure:
    """Draw a push off close to a riser from the side and from above, in one of the two worlds.

    Parameters
    ----------
    world : {"plane", "tumbling", "tumbling, turned by 10°"}
        The world, and how the cube stands. Where it tumbles, it rocks in the fixed way.
    angle : int
        Of the push [deg].
    gap : int
        Between the cube's foremost corner and the riser [mm].
    magnitude : int
        Of the push [N].

    Returns
    -------
    matplotlib Figure
    """
    where: CubeWorld = StairWorld() if world == BUMPS[0] else TumblingWorld()
    stairs = where.staircase
    jump = _jump_before_riser(where, gap, angle, magnitude, TURNED if world == BUMPS[2] else 0.0)
    figure, (side, above) = new_figure(
        f"Close-up of a riser, from the side and from above. {world}: the cube stands {gap} mm before it and is pushed with "
        f"{magnitude} N at {angle}°: {_what_becomes(jump, stairs)}.",
        panels=2,
        size=(5.6, 5.8),
        columns=1,
    )
    figure.set_layout_engine(None)
    side.set_position((0.13, 0.5, 0.84, 0.45))
    _draw_jump_before_riser(side, stairs, jump)
    side.set(xlim=(-0.06, 1.22), ylim=(-0.06, 0.62), xlabel="", xticks=[])
    above.set_position(_below(side, 0.07, 0.42))
    draw_stairs_from_above(above, stairs, *side.get_xlim())
    above.set(ylim=(0.14, -0.5), yticks=(-0.4, -0.2, 0), anchor="N")
    if jump.trajectory is not None and jump.trajectory.x is not None:
        above.plot(jump.trajectory.y, jump.trajectory.x, color=PATH, linewidth=1.4, zorder=3)
    for state, look in ((jump.start, {}), (jump.end, {"facecolor": "white", "alpha": 0.85})):
        draw_cube_from_above(above, state[0], state[1], state[3:7], **look)
    side.set_title(f"{world}: {_what_becomes(jump, stairs)}", fontsize=9, loc="left")
    return figure


def _jump_before_riser(world: CubeWorld, gap: float, angle: float, magnitude: float, turned: float = 0.0) -> Jump:
    """Jump with the foremost corner ``gap`` [mm] before the first riser, turned about the vertical [deg]."""
    y = world.staircase.first_riser - gap / 1000 - float(reach_of(turned))
    world.reset(world.state_at(y, CUBE_EDGE / 2, yaw=math.radians(turned)))
    return world.jump(magnitude, angle, trajectory=True)


def _what_becomes(jump: Jump, stairs: Staircase) -> str:
    gained, after = step_of(jump.end, stairs), gap_of(jump.end, stairs)
    if gained:
        return f"+{gained} step{'s' if gained != 1 else ''}"
    turned = abs(yaw_of(*jump.end[3:7]))
    words = f", turned by {turned:.0f}°" if turned >= SHOWN_TURN else ""
    return f"no step, rests {1000 * after:.3g} mm before it{words}"


def _draw_jump_before_riser(ax: Axes, stairs: Staircase, jump: Jump) -> None:
    draw_stairs(ax, stairs, 1.0, 0.0)
    ax.set(xlim=(min(0.12, float(jump.end[1]) - 0.1), 1.32), ylim=(-0.06, 0.86))
    if jump.trajectory is not None:
        ax.plot(jump.trajectory.y, jump.trajectory.z, color=PATH, linewidth=1.4, zorder=3)
    draw_cube(ax, *pose(jump.start))
    draw_cube(ax, *pose(jump.end), facecolor="white", alpha=0.85)


# The trap in both worlds


def after_bumps(rollouts: Rollouts, staircase: Staircase | None = None) -> pd.DataFrame:
    """Say what becomes of the cubes that lie in the trap, within 3 cm of a riser, by one more jump of some rollouts.

    Parameters
    ----------
    rollouts : Rollouts
        See ``roll_out``. Their first jumps, from the start pose, do not count.
    staircase : Staircase, optional
        Fifteen steps by default.

    Returns
    -------
    pandas.DataFrame
        A row for each jump from the trap: the "yaw" of the cube before it [deg], whether it "climbs", and whether the cube is
        "free" after it: on the map, and not within 3 cm of the riser ahead (see ``TreadMeasures``).
    """
    measured = TreadMeasures.of(rollouts, staircase)
    table = pd.DataFrame({"yaw": measured.yaws, "climbs": measured.climbed, "free": measured.freed})
    return table[measured.gaps < CLOSE]


def draw_trap_in_worlds(staircase: Staircase | None = None, **rollouts: Rollouts) -> Figure:
    """Draw how often a trapped cube is free after one more jump, by its turn, and how often a moderate jump climbs, by gap.

    Parameters
    ----------
    staircase : Staircase, optional
        Fifteen steps by default.
    **rollouts : Rollouts
        Of the worlds "plane" and "tumbling".

    Returns
    -------
    matplotlib Figure
    """
    figure, (left, right) = new_figure("The trap in both worlds.", panels=2, size=(9.0, 3.4), columns=2)
    words = []
    for name, rolled in rollouts.items():
        color, marker = WORLD_STYLES[name]
        trapped, by_gap = after_bumps(rolled, staircase), TreadMeasures.of(rolled, staircase).climb_by_gap()
        rows = [trapped[(trapped["yaw"] >= low) & (trapped["yaw"] < high)] for low, high in YAW_BINS.values()]
        _draw_shares(left, name, [len(row) for row in rows], [row["free"].sum() for row in rows], color, marker)
        _draw_shares(right, name, by_gap["n"].tolist(), (by_gap["n"] * by_gap["climb"]).tolist(), color, marker)
        shares = ", ".join(
            f"{row['free'].mean():.0%} {bin}" for bin, row in zip(YAW_BINS, rows, strict=True) if len(row)
        )
        climbs = ", ".join(f"{share:.0%} at {gap}" for gap, share in by_gap["climb"].items() if share == share)
        words.append(f"{name}: free after one more jump {shares} of turn; a moderate jump climbs {climbs}")
        right.set_xticks(range(len(by_gap)), [gap.replace(" to ", "–").removesuffix(" cm") for gap in by_gap.index])
    left.set_xticks(range(len(YAW_BINS)), list(YAW_BINS))
    left.set(xlabel="turn of the trapped cube about the vertical", ylabel="free after one more jump")
    right.set(xlabel="gap before the jump [cm]", ylabel="moderate jump climbs")
    for ax in (left, right):
        ax.set(ylim=(-0.04, 1.04), xlim=(-0.5, len(ax.get_xticks()) - 0.5))
        ax.yaxis.set_major_formatter(PercentFormatter(1.0))
    left.legend(frameon=False, loc="upper left")
    setattr(figure, "stairlab_alt", f"{'. '.join(words)}.")  # noqa: B010
    return figure


def _draw_shares(ax: Axes, name: str, counts: Sequence[int], hits: Sequence[float], color: str, marker: str) -> None:
    """Draw shares where there are counts, with their standard errors (of one more of each kind, so that none is 0)."""
    n, k = np.array(counts, dtype=float), np.array(hits, dtype=float)
    there = n > 0
    n, k = n[there], k[there]
    rate = (k + 1) / (n + 2)
    places = np.arange(len(counts))[there] + (0.08 if name == "tumbling" else -0.08)
    errors = np.sqrt(rate * (1 - rate) / n)
    ax.errorbar(places, k / n, errors, color=color, marker=marker, linestyle="none", capsize=3, label=name)


def draw_gap_map(motion: Sequence[float] = (300.0, 70.0), jumps: int = 0, narrowest: float = 0.3) -> Figure:
    """Draw what a motion does to the gap, and the path of ``jumps`` jumps with it from the start (a cobweb).

    Parameters
    ----------
    motion : sequence of two floats
        Magnitude [N] and angle [deg].
    jumps : int
        Jumps of the cobweb; it ends earlier where the episode is over.
    narrowest : float
        The narrowest gap shown [mm]; from 10 mm on, the axes are linear.

    Returns
    -------
    matplotlib Figure
    """
    (ax,) = make_axes(None, 1, (4.9, 4.6))
    ax.spines[["top", "right"]].set_visible(False)
    near = narrowest < LINEAR_FROM
    before = GAPS if near else np.linspace(narrowest / 1000, GAPS[-1], len(GAPS))
    ends = [from_gap(np.array(motion), gap) for gap in before.tolist()]
    gained, after = np.array([steps for steps, _ in ends]), 1000 * np.array([gap for _, gap in ends])
    for steps in sorted(set(gained.tolist())):
        here = gained == steps
        color, words = _gain_color(steps), f"{steps:+d}" if steps else "0"
        ax.plot(1000 * before[here], after[here], _gain_marker(steps), color=color, markersize=5, label=words, zorder=2)
    limits = (narrowest, 600 if near else 360)
    ax.plot(limits, limits, color=FAINT, linewidth=0.8, zorder=1)
    game = _orbit(motion, jumps)
    gaps = 1000 * game.gaps[np.isfinite(game.gaps)]
    if jumps and len(gaps) > 1:
        corners = np.repeat(gaps, 2)
        ax.plot(corners[:-1], np.append(limits[0], corners[2:]), color=PATH, linewidth=1.1, zorder=3)
        ax.plot(gaps[-1], gaps[-1], "*", color=PATH, markersize=12, zorder=4)
    scale = "log" if near else "linear"
    ax.set(xscale=scale, yscale=scale, xlim=limits, ylim=limits, aspect="equal")
    ax.set(xlabel="gap before the jump [mm]", ylabel="gap after the jump [mm]")
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_formatter("{x:g}")
    ax.legend(title="steps gained", frameon=False, fontsize=8, title_fontsize=8, loc="upper left", handletextpad=0.1)
    made = len(game.actions)
    so_far = f": after {made} jump{'s' * (made > 1)} on step {game.steps[-1]}" if jumps else ""
    ax.set_title(f"{motion[0]:.0f} N at {motion[1]:.0f}°{so_far}", fontsize=10, loc="left")
    orbit = ", ".join(f"{gap:.3g}" for gap in gaps[: made + 1]) if jumps else ""
    return finish(
        ax,
        f"The gap after a jump with {motion[0]:.0f} N at {motion[1]:.0f}° against the gap before it, by steps gained"
        f"{f'; from the start the gaps are {orbit} mm, and the cube is on step {game.steps[-1]}' if jumps else ''}.",
    )


def _orbit(motion: Sequence[float], jumps: int) -> Game:
    """Return an episode of so many jumps at most, with one motion again and again."""
    motions = np.array([motion])
    return play(motions, lambda seen: 0, max_jumps=jumps) if jumps else Game(motions)


def _gain_color(steps: int) -> str:
    return COLORS[5] if steps < 0 else FAINT if steps == 0 else COLORS[(2, 3, 4, 6)[min(steps, 4) - 1]]


def _gain_marker(steps: int) -> str:
    return "X" if steps < 0 else "osD^v"[min(steps, 4)]


def draw_action_table(motions: Prototypes | np.ndarray, trap: float = 0.0) -> Figure:
    """Draw how many steps each motion of a set gains from each gap, and the set's trap [m]."""
    values = motions.motions if isinstance(motions, Prototypes) else np.asarray(motions, dtype=float)
    table = [[from_gap(motion, gap) for gap in TABLE_GAPS.tolist()] for motion in values]
    figure, ax = new_figure(_words_of_table(values, table, trap), size=(7.6, 0.9 + 0.24 * len(values)))
    for row, motion_row in enumerate(table):
        for column, (steps, after) in enumerate(motion_row):
            off = math.isinf(after)
            face = OFF_MAP if off else _gain_color(steps) if steps else "#f4f4f4"
            ax.add_patch(Rectangle((column - 0.5, row - 0.5), 1, 1, facecolor=face, edgecolor="white", linewidth=1))
            dark = not off and steps and sum(to_rgb(face)) < 1.4
            words = "off" if off else f"{steps}"
            ax.text(column, row, words, ha="center", va="center", fontsize=8, color="white" if dark else INK)
    inside = int((trap >= TABLE_GAPS).sum())
    if trap:
        ax.axvline(inside - 0.5, color=PATH, linewidth=2)
        ax.text(inside - 0.6, -0.62, "trap", color=PATH, ha="right", va="bottom", fontsize=9)
    ax.set_xticks(range(len(TABLE_GAPS)), [f"{1000 * gap:.0f}" for gap in TABLE_GAPS], fontsize=8)
    labels = [f"{i}:  {m:.0f} N, {a:.0f}°" for i, (m, a) in enumerate(values.tolist())]
    ax.set_yticks(range(len(values)), labels, fontsize=8)
    ax.set(xlim=(-0.5, len(TABLE_GAPS) - 0.5), ylim=(len(values) - 0.5, -0.5), xlabel="gap to the riser ahead [mm]")
    ax.tick_params(length=0)
    ax.spines[:].set_visible(False)
    return figure


def _words_of_table(motions: np.ndarray, table: list[list[tuple[int, float]]], trap: float) -> str:
    single = sum(any(steps == 1 for steps, _ in row) for row in table)
    free = [int(1000 * gap) for i, gap in enumerate(TABLE_GAPS) if any(row[i][0] > 0 for row in table)]
    return (
        f"Table of the steps that each of {len(motions)} motions gains from gaps of 1 to 340 mm. {single} motions gain exactly one "
        f"step from some gap; some motion climbs from {', '.join(map(str, free))} mm. The trap is {1000 * trap:.1f} mm wide."
    )


def draw_single_motions(
    magnitudes: Sequence[float] = range(240, 541, 30), angles: Sequence[float] = range(64, 89, 2), **sets: Prototypes
) -> Figure:
    """Draw what an episode returns in which one motion is performed again and again, and where the motions of some sets are.

    Parameters
    ----------
    magnitudes, angles : sequence of float
        The motions that are tried: magnitude [N], angle [deg].
    **sets : Prototypes
        Sets to mark, by name.

    Returns
    -------
    matplotlib Figure
    """
    values = np.array([[repeat((m, a)).value for m in magnitudes] for a in angles])
    best = values >= Staircase.fifteen().n_steps - 0.5
    others = f", the others {values[~best].min():.0f} to {values[~best].max():.0f}" if not best.all() else ""
    figure, ax = new_figure(
        f"Return of an episode of one motion, against its magnitude and angle, {values.size} motions: {best.sum()} return 15{others}.",
        size=(7.2, 4.2),
    )
    x, y = np.meshgrid(magnitudes, angles)
    drawn = ax.scatter(
        x, y, c=values, s=30 + 8 * values.clip(0), cmap="cividis_r", vmin=0, vmax=15, marker="s", linewidths=0
    )
    ax.scatter(x[best], y[best], s=190, facecolor="none", edgecolor=INK, marker="s", label="returns 15")
    for (name, one), marker, color in zip(sets.items(), "*Xo", (PATH, COLORS[1], COLORS[2]), strict=False):
        ax.plot(
            *one.motions.T, marker, color=color, markeredgecolor="white", markersize=13, label=name, linestyle="none"
        )
    space = 20, 1.5
    ax.set(xlim=(min(magnitudes) - space[0], max(magnitudes) + space[0]))
    ax.set(ylim=(min(angles) - space[1], max(angles) + space[1]), xlabel="magnitude [N]", ylabel="angle [°]")
    figure.colorbar(drawn, label="return", ticks=range(0, 16, 5))
    figure.legend(loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    return figure


# The game, played by hand


def draw_game(game: Game, rival: Game | None = None, chosen: int | None = None, preview: bool = False) -> Figure:
    """Draw a game as its player sees it: the stairs, a close-up of the cube, and the return, with a rival's at the same jump.

    Where the cube tumbles, the close-up is from above, too.

    Parameters
    ----------
    game : Game
        The episode so far.
    rival : Game, optional
        Another episode; its cube is shown as a dashed outline.
    chosen : int, optional
        A motion of the set: its push is an arrow.
    preview : bool
        Show where each motion of the set would lead.

    Returns
    -------
    matplotlib Figure
    """
    figure, (ax, near, curve) = new_figure("Up The Stairs.", panels=3, size=(9.0, 4.1), columns=3)
    figure.set_layout_engine(None)
    places = ((0.06, 0.12, 0.53, 0.8), (0.63, 0.45, 0.36, 0.53), (0.63, 0.12, 0.36, 0.25))
    for panel, place in zip((ax, near, curve), places, strict=True):
        panel.set_position(place)
    count, state = len(game.actions), game.states[-1]
    _overview(ax, game, rival)
    _near(near, game, chosen, preview)
    _returns(curve, game, rival)
    if game.tumbles:
        near.set_position((0.63, 0.54, 0.36, 0.44))
        curve.set_position((0.63, 0.12, 0.36, 0.16))
        _near_from_above(figure.add_axes(_below(near, 0.33, 0.18)), near, game)
    ax.set_title(_after(game, count), fontsize=9, loc="left")
    words = (
        f"{_after(game, count)}. Gap to the riser ahead: {_millimetres(gap_of(state, game.staircase))}{_turned(game)}."
    )
    if rival is not None:
        words += (
            f" The planner after as many jumps: step {_at(rival, count)[0]}, return {_number(_at(rival, count)[1])}."
        )
    if chosen is not None:
        magnitude, angle = game.motions[chosen]
        words += f" Chosen is motion {chosen}, {magnitude:.0f} N at {angle:.0f}°."
    setattr(figure, "stairlab_alt", f"Stairs from the side, a close-up of the cube, and the return. {words}")  # noqa: B010
    return figure


def _at(game: Game, jumps: int) -> tuple[int, float]:
    """Return step and return of an episode after so many jumps, or at its end."""
    jumps = min(jumps, len(game.actions))
    return int(game.steps[jumps]), float(sum(game.rewards[:jumps]))


def _overview(ax: Axes, game: Game, rival: Game | None) -> None:
    stairs = game.staircase
    draw_stairs(ax, stairs, stairs.top + HEADROOM, 0.0)
    ax.set(xlim=(-0.1, stairs.risers[-1] + 1.2), anchor="SW", yticks=range(5))
    places = np.array([state[1:3] for state in game.states])
    ax.plot(*places.T, color=FAINT, linewidth=0.8, marker=".", markersize=4, zorder=3)
    if rival is not None:
        there = rival.states[min(len(game.actions), len(rival.actions))]
        draw_cube(ax, *pose(there), facecolor="none", edgecolor=PATH, linestyle="--", linewidth=1.4, zorder=5)
        ax.text(0.02, 0.92, "dashed: the planner's cube", color=PATH, transform=ax.transAxes, fontsize=9)
    draw_cube(ax, *pose(game.states[-1]))


def _near(ax: Axes, game: Game, chosen: int | None, preview: bool) -> None:
    stairs, (y, z, rotation) = game.staircase, pose(game.states[-1])
    draw_stairs(ax, stairs, z + 1.4, 0.0)
    left, low = max(-0.1, y - CLOSE_UP), max(-0.12, z - 0.45)
    ax.set(xlim=(left, left + 2 * CLOSE_UP), ylim=(low, low + 1.16), xlabel="", ylabel="", xticks=[], yticks=[])
    if game.actions and (path := game.path(len(game.actions)).trajectory) is not None:
        ax.plot(path.y, path.z, color=PATH, linewidth=1.2, zorder=3)
    if preview and not game.over:
        _leads(ax, game)
    draw_cube(ax, y, z, rotation)
    if chosen is not None:
        magnitude, angle = game.motions[chosen]
        length, turn = 0.12 + 0.3 * magnitude / 1000, math.radians(angle)
        head = (y + length * math.cos(turn), z + length * math.sin(turn))
        ax.annotate("", head, (y, z), arrowprops={"arrowstyle": "-|>", "color": INK, "linewidth": 1.8}, zorder=6)


def _near_from_above(ax: Axes, side: Axes, game: Game) -> None:
    """Draw the close-up of the cube from above, over as much of the stairs as its side view shows, at the same scale."""
    x, y, *_ = state = game.states[-1]
    draw_stairs_from_above(ax, game.staircase, *side.get_xlim())
    path = game.path(len(game.actions)).trajectory if game.actions else None
    if path is not None and path.x is not None:
        ax.plot(path.y, path.x, color=PATH, linewidth=1.2, zorder=3)
    draw_cube_from_above(ax, x, y, state[3:7])
    half = CLOSE_UP * ax.bbox.height / ax.bbox.width
    ax.set(xlabel="", ylabel="", ylim=(x + half, x - half), aspect="auto", xticks=[], yticks=[])


def _turned(game: Game) -> str:
    """Say how the cube is turned about the vertical, such as ", turned by 12°"; nothing where it is not."""
    turned = abs(yaw_of(*game.states[-1][3:7]))
    return f", turned by {turned:.0f}°" if turned >= SHOWN_TURN else ""


def _leads(ax: Axes, game: Game) -> None:
    """Mark where each motion would lead, with its number; what lies outside the close-up is cut off."""
    numbers: dict[tuple[int, int], list[int]] = {}
    for action in range(len(game.motions)):
        if (jump := game.lead(action)) is not None:
            draw_cube(ax, *pose(jump.end), facecolor="none", edgecolor=FAINT, linewidth=0.7, zorder=3)
            place = round(jump.end[1] / CUBE_EDGE), step_of(jump.end, game.staircase)
            numbers.setdefault(place, []).append(action)
    for (column, step), actions in numbers.items():
        height = step * game.staircase.rise + 1.2 * CUBE_EDGE
        words = "\n".join(map(str, actions[::-1]))
        ax.text(column * CUBE_EDGE, height, words, ha="center", va="bottom", fontsize=7, zorder=7, clip_on=True)


def _returns(ax: Axes, game: Game, rival: Game | None) -> None:
    longest = len(game.actions)
    if rival is not None:
        longest = max(longest, len(rival.actions))
        ax.step(range(len(rival.rewards) + 1), np.append(0, np.cumsum(rival.rewards)), "--", color=PATH, where="post")
    earned = np.append(0, np.cumsum(game.rewards))
    ax.step(range(len(earned)), earned, color=COLORS[1], where="post", linewidth=2)
    ax.plot(len(game.rewards), game.value, "o", color=COLORS[1], markersize=5)
    top = game.staircase.n_steps
    ax.set(xlim=(0, max(longest, 15) + 1), ylim=(min(-1, game.value - 1), top + 1), yticks=(0, top))
    ax.set_xticks(range(0, max(longest, 15) + 1, 5))
    ax.set_xlabel("jumps", fontsize=8, labelpad=1)
    ax.set_ylabel("return", fontsize=8, labelpad=-4)
    ax.tick_params(labelsize=8)


class StairsGame(Live):
    """Up The Stairs to be played by hand against a search: a widget in a notebook, the search's game as pictures elsewhere.

    In the tumbling world the cube rocks before each push in the fixed way, as in the search.

    Parameters
    ----------
    sets : mapping of str to Prototypes or array-like
        The sets to choose from, by name.
    plans : mapping of str to mapping of str to Plan
        What the search found, by world and set; the worlds "plane" and "tumbling" are those to choose from.

    Raises
    ------
    ValueError
        If a set has no plan in a world.
    """

    def __init__(self, sets: Mapping[str, Prototypes | np.ndarray], plans: Mapping[str, Mapping[str, Plan]]) -> None:
        for world, found in plans.items():
            if missing := [name for name in sets if name not in found]:
                raise ValueError(
                    f"plans must have one for each set, but in the {world} world none for {', '.join(missing)}."
                )
        self.sets = dict(sets)
        self.worlds = {world: stair_world(world, Staircase.fifteen()) for world in plans}
        self.rivals = {
            (world, name): replay_plan(self.sets[name], plans[world][name], self.worlds[world])
            for world in plans
            for name in sets
        }
        self.start(next(iter(self.worlds)), next(iter(self.sets)))

    def __repr__(self) -> str:
        return f"Up The Stairs, played by hand with one of the sets {', '.join(self.sets)}"

    def start(self, world: str, name: str) -> None:
        """Begin a game in a world with a set."""
        self.world, self.name = world, name
        self.game = Game(self.sets[name], self.worlds[world])

    @property
    def rival(self) -> Game:
        """The planner's game in the present world with the present set."""
        return self.rivals[self.world, self.name]

    def options(self) -> list[tuple[str, int]]:
        """Return the motions of the present set as a list shows them, with their numbers."""
        motions = self.sets[self.name]
        classes = getattr(motions, "classes", None)
        return [
            (f"{i}: {m:.0f} N, {a:.0f}°" + (f", C{classes[i]}" if classes is not None else ""), i)
            for i, (m, a) in enumerate(self.game.motions.tolist())
        ]

    def words(self) -> str:
        """Say how the game stands."""
        game, rival = self.game, self.rival
        count = len(game.actions)
        step, value = _at(rival, count)
        said = f"{_after(game, count)[0].upper()}{_after(game, count)[1:]}. "
        if game.over:
            how = "You are on the top" if game.on_top else "That is the end of the episode"
            return f"{said}{how}, with a return of {_number(game.value)}; the planner ends with {_number(rival.value)}."
        return (
            f"{said}The gap ahead is {_millimetres(game.gaps[-1])}{_turned(game)}. The planner, after as many jumps: step {step}, "
            f"return {_number(value)}."
        )

    def leads(self) -> str:
        """Say how many steps each motion of the set would gain from here."""
        found: dict[str, list[str]] = {}
        for action in range(len(self.game.motions)):
            jump = self.game.lead(action)
            if jump is None:
                gained = "not over in time"
            elif not jump.on_map:
                gained = "off the map"
            else:
                steps = step_of(jump.end, self.game.staircase) - int(self.game.steps[-1])
                gained = f"{steps:+d}" if steps else "no step"
            found.setdefault(gained, []).append(str(action))
        return "From here: " + "; ".join(f"{', '.join(numbers)}: {gained}" for gained, numbers in found.items()) + "."

    def draw(self, chosen: int | None = None, preview: bool = False) -> Figure:
        """Draw the game as it stands."""
        return draw_game(self.game, self.rival, None if self.game.over else chosen, preview)

    def player(self) -> Player:
        """Return the planner's games with the present set, to be stepped through; no kernel needed."""
        rivals = {world: self.rivals[world, self.name] for world in self.worlds}
        longest = max(len(rival.actions) for rival in rivals.values())

        def planner(world: str = self.world, jump: int = 0) -> Figure:
            game = Game(self.sets[self.name], self.worlds[world])
            for action in rivals[world].actions[:jump]:
                game.jump(action)
            return draw_game(game)

        return explore(planner, {"jump": "jump of the planner"}, world=list(rivals), jump=range(longest + 1)).player()

    def widget(self) -> ipywidgets.Widget:
        """Return the live widget: a slider over the motions, and buttons to jump, undo and restart.

        Raises
        ------
        ImportError
            If ipywidgets is not installed.
        """
        import ipywidgets

        wide: dict[str, Any] = {"style": {"description_width": "initial"}}
        long = ipywidgets.Layout(width="38em", max_width="95%")
        # A slider, not a list: JupyterLab keeps the keys up and down, which a list needs, for moving between cells.
        motion = ipywidgets.SelectionSlider(
            options=self.options(), value=0, description="motion", layout=long, continuous_update=False, **wide
        )
        which = ipywidgets.ToggleButtons(options=list(self.sets), value=self.name, description="set", **wide)
        where = ipywidgets.ToggleButtons(options=list(self.worlds), value=self.world, description="world", **wide)
        preview = ipywidgets.Checkbox(value=False, description="show where each motion leads", indent=False)
        buttons = [
            ipywidgets.Button(description=words, button_style=style, layout=ipywidgets.Layout(width="8em"))
            for words, style in (("Jump", "primary"), ("Undo", ""), ("Restart", ""))
        ]
        said, picture = ipywidgets.HTML(), ipywidgets.HTML()
        busy = [False]

        def show(words: str = "") -> None:
            ahead = self.leads() if preview.value and not self.game.over else ""
            lines = "".join(
                f'<p style="margin:0;line-height:1.4">{html.escape(line)}</p>'
                for line in (words or self.words(), ahead)
            )
            said.value = f'<div aria-live="polite">{lines}</div>'
            buttons[0].disabled, buttons[1].disabled = self.game.over, not self.game.actions
            figure = self.draw(motion.value, preview.value)
            picture.value = img(quick_png(figure, DPI), alt_text(figure), DPI)

        def jump(_: Any) -> None:
            try:
                self.game.jump(motion.value)
            except (RuntimeError, ValueError) as error:
                show(str(error))
            else:
                show()

        def undo(_: Any) -> None:
            self.game.undo()
            show()

        def restart(_: Any) -> None:
            busy[0] = True  # a new list sets a new value, which would draw once more
            self.start(where.value, which.value)
            motion.options = self.options()
            motion.value = 0
            busy[0] = False
            show()

        def look(_: Any) -> None:
            if not busy[0]:
                show()

        for button, action in zip(buttons, (jump, undo, restart), strict=True):
            button.on_click(action)
        which.observe(restart, "value")
        where.observe(restart, "value")
        motion.observe(look, "value")
        preview.observe(look, "value")
        show()
        return ipywidgets.VBox([motion, ipywidgets.HBox([*buttons, preview]), where, which, said, picture])
