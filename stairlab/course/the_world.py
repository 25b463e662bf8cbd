"""Lesson 01, the world: closed forms for push, flight, slide and rebound, pictures beside them, and what a plane cannot do."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

from stairlab.drawing import FAINT, GRID, INK, PATH, figure_legend, legend_below, new_figure
from stairlab.physics import (
    CUBE_EDGE,
    CUBE_MASS,
    FLUSH_RISER_FRICTION,
    FRICTION,
    GRAVITY,
    PUSH_STEPS,
    REBOUND_SPEED,
    TIME_STEP,
    Staircase,
    Trajectory,
)
from stairlab.plots import class_style, cube_corners, draw_cube, draw_stairs, plot_jump_views, pose, pose_at
from stairlab.tumbling import stair_world
from stairlab.world import CubeWorld, Jump, StairWorld, yaw_of

PUSH_TIME = PUSH_STEPS * TIME_STEP
""" Time that the force acts [s] """
HALF = CUBE_EDGE / 2
FIELD = (0.1, 0.25, 0.4, 0.54, 0.7, 0.94, 1.1, 1.34)
""" Start positions of the trajectory explorer: on the ground and on two treads, the last of each 10 mm before a riser [m] """
SEEN_HEIGHT = 1.75
""" The trajectory explorer shows heights up to here, so that pictures keep their size [m] """
RECORDED_GAPS = {0.0001: 0.033, 0.001: 0.173, 0.002: 0.447, 0.005: 0.546, 0.02: 0.578, 0.1: 0.702}
""" Share of the authors' 10,000 recorded jumps, of those that end below the top step, with a smaller gap [m] to the riser ahead """
VIEWED = ((-0.1, 2.45), (-0.16, 1.75), (0.5, -0.5))
""" What the explorer of both worlds shows of y, z and x [m]; x points down """
SHOWN_TURN = 0.5
""" A cube that is turned about the vertical by less is said to stand straight [deg] """
WORLD_WORDS = {"tumbling": "In three dimensions", "plane": "In the plane"}
OUTCOMES = {-1: "off the map", 0: "0 steps", 1: "1 step", 2: "2 steps", 3: "3 steps", 4: "4 steps"}
SMALLEST_GAP = 1e-5
""" Gaps are drawn on a logarithmic axis from here: smaller ones are flush [m] """


# Closed forms: what Newton's laws say without a simulation


def pushed(magnitude: float | np.ndarray, angle: float | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    r"""Return the velocity that a push alone gives the cube, forward and up.

    .. math:: v = F \tau / m \, (\cos \alpha, \sin \alpha)

    Parameters
    ----------
    magnitude, angle : float or ndarray of shape (n,)
        Force F [N] and its direction above the +y axis [deg].

    Returns
    -------
    v_y, v_z : ndarray of the same shape
        Velocity [m/s]; gravity, which takes its share of v_z, is not in it.
    """
    speed = np.asarray(magnitude) * PUSH_TIME / CUBE_MASS
    return speed * np.cos(np.radians(angle)), speed * np.sin(np.radians(angle))


def time_of_fall(v_z: float | np.ndarray, height: float | np.ndarray = 0.0) -> np.ndarray:
    r"""Return when a cube that was pushed up with v_z comes down to a height above its start.

    .. math:: t = \frac{v_z + \sqrt{v_z^2 - g v_z \tau - 2 g h}}{g}, \quad\text{from}\quad v_z (t - \tau / 2) - g t^2 / 2 = h

    Parameters
    ----------
    v_z : float or ndarray
        Velocity by the push alone, upwards [m/s].
    height : float or ndarray
        Height h above the start [m].

    Returns
    -------
    ndarray
        Time since the push began [s]; NaN where the cube never gets there.
    """
    v_z = np.asarray(v_z, dtype=float)
    root = v_z**2 - GRAVITY * v_z * PUSH_TIME - 2 * GRAVITY * np.asarray(height)
    return (v_z + np.sqrt(np.where(root >= 0, root, np.nan))) / GRAVITY


def level_jump(magnitude: float | np.ndarray, angle: float | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return how far a jump goes on level ground: the flight, and the slide after landing, where friction has taken its share.

    Parameters
    ----------
    magnitude, angle : float or ndarray of shape (n,)
        The motion [N], [deg]; its upward part must exceed the weight, or the cube does not take off.

    Returns
    -------
    flight, slide : ndarray of the same shape
        Way in the air, and over the ground [m].
    """
    v_y, v_z = pushed(magnitude, angle)
    lands = time_of_fall(v_z)
    left = np.maximum(
        v_y - FRICTION * (GRAVITY * lands - v_z), 0
    )  # landing takes as much speed off as it stops downwards
    return v_y * (lands - PUSH_TIME / 2), left**2 / (2 * FRICTION * GRAVITY)


def gap_by_formula(magnitude: float | np.ndarray, angle: float | np.ndarray, ahead: float = 0.3) -> np.ndarray:
    r"""Return the gap that a cube leaves to a riser that it flies into with its whole face.

    The riser stops it, and its friction takes off up to 0.475 times as much vertical speed; then the cube falls, and drifts back at
    10 mm/s, for as long as the fall takes.

    Parameters
    ----------
    magnitude, angle : float or ndarray of shape (n,)
        The motion [N], [deg].
    ahead : float
        Way to the riser at the start [m]; 0.3 from the start pose.

    Returns
    -------
    ndarray of the same shape
        Gap [m]; NaN for a cube that has landed before.
    """
    v_y, v_z = pushed(magnitude, angle)
    hits = ahead / v_y + PUSH_TIME / 2
    height = ahead / v_y * v_z - GRAVITY * hits**2 / 2
    up = v_z - GRAVITY * hits
    up = np.sign(up) * np.maximum(np.abs(up) - FLUSH_RISER_FRICTION * v_y, 0)
    falls = (up + np.sqrt(up**2 + 2 * GRAVITY * np.where(height > 0, height, np.nan))) / GRAVITY
    return REBOUND_SPEED * falls + REBOUND_SPEED**2 / (2 * FRICTION * GRAVITY)


def gap_to_climb(magnitude: float | np.ndarray, angle: float | np.ndarray, rise: float = Staircase.rise) -> np.ndarray:
    r"""Return the smallest gap to a riser from which a motion's path passes the edge.

    .. math:: g_{min} = v_y \, \frac{v_z - \sqrt{v_z^2 - 2 g h}}{g} \;\approx\; \frac{h}{\tan \alpha} \text{ for a fast push}

    Parameters
    ----------
    magnitude, angle : float or ndarray of shape (n,)
        The motion [N], [deg].
    rise : float
        Height of the step h [m].

    Returns
    -------
    ndarray of the same shape
        Gap [m]; infinite where the cube does not get as high as the step.
    """
    v_y, v_z = pushed(magnitude, angle)
    v_z = v_z - GRAVITY * PUSH_TIME
    root = v_z**2 - 2 * GRAVITY * rise
    passes = (v_z - np.sqrt(np.where(root >= 0, root, np.nan))) / GRAVITY
    return np.where(root >= 0, v_y * passes, np.inf)


# The simulation


def jump_from(world: CubeWorld, y: float, magnitude: float, angle: float) -> Jump:
    """Put the cube upright on the ground or tread at ``y`` [m], and jump with ``magnitude`` [N] at ``angle`` [deg], path recorded."""
    world.reset(world.state_at(y, world.staircase.height_at(y) + HALF))
    return world.jump(magnitude, angle, trajectory=True)


def riser_gap(jump: Jump, staircase: Staircase | None = None) -> float:
    """Gap between the foremost point of the cube and the riser ahead after a jump, infinite where there is none [m]."""
    front = float(cube_corners(*pose(jump.end))[:, 0].max())
    return (staircase or Staircase()).next_riser(float(jump.end[1])) - front


def outcome_words(jump: Jump) -> str:
    """Say what a jump did: "2 steps", "1 step down", "off the map"."""
    steps = round(jump.dz / Staircase.rise)
    if not jump.on_map:
        return OUTCOMES[-1]
    return OUTCOMES[steps] if steps >= 0 else f"{-steps} step{'s' if steps < -1 else ''} down"


def gap_words(jump: Jump) -> str:
    """Say how far before the next riser a jump has ended, such as ", 1.8 mm before the riser"; nothing where there is none."""
    gap = max(1000 * riser_gap(jump), 0)
    return f", {gap:.{1 if gap < 10 else 0}f} mm before the riser" if jump.on_map and math.isfinite(gap) else ""


def turn_words(jump: Jump) -> str:
    """Say how a jump has turned the cube about the vertical, such as ", turned by 12°"; nothing where it has not."""
    turned = abs(yaw_of(*jump.end[3:7]))
    return f", turned by {turned:.0f}°" if jump.on_map and turned >= SHOWN_TURN else ""


def front_edge(path: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """Return the path of the middle of the cube's lower front edge, which from the side is a corner: y and z [m]."""
    flat = path.quaternions is None
    turns = Rotation.from_euler("x", path.rotation[:, None]) if flat else Rotation.from_quat(path.quaternions)
    _, y, z = turns.apply((0, HALF, -HALF)).T
    return path.y + y, path.z + z


def path_of(jump: Jump) -> Trajectory:
    """Return the path of a jump.

    Raises
    ------
    ValueError
        If it was not recorded.
    """
    if jump.trajectory is None:
        raise ValueError("jump must have its path: make it with world.jump(..., trajectory=True).")
    return jump.trajectory


def phases(jump: Jump) -> list[tuple[str, float, float]]:
    """Return the phases of a jump from the start pose over the stairs: push, flight, contact, rest.

    The flight ends where the path leaves the parabola of the closed form by 0.5 mm.

    Parameters
    ----------
    jump : Jump
        With its path.

    Returns
    -------
    list of (str, float, float)
        Name, begin and end of each phase [s]; rest lasts until the published rule ends the jump.
    """
    path = path_of(jump)
    off = np.hypot(*flight_error(jump)) > 5e-4
    lands = float(path.time[np.argmax(off)]) if off.any() else float(path.time[-1])
    still = _stands_still(path)
    return [
        ("push", 0.0, PUSH_TIME),
        ("flight", PUSH_TIME, lands),
        ("contact", lands, max(still, lands)),
        ("rest", max(still, lands), jump.duration),
    ]


def _stands_still(path: Trajectory) -> float:
    """Return when the cube has come within 0.1 mm of where it ends [s]."""
    away = np.hypot(path.y - path.y[-1], path.z - path.z[-1]) > 1e-4
    return float(path.time[np.flatnonzero(away)[-1]]) if away.any() else 0.0


def flight_error(jump: Jump) -> tuple[np.ndarray, np.ndarray]:
    """Return the path of a jump less the closed form of its flight.

    In the simulation a force shows in the position one step later than it acts: its push counts from half a step later than in the
    closed form. With that, the two are equal up to rounding, from the end of the push to the first contact.

    Parameters
    ----------
    jump : Jump
        With its path.

    Returns
    -------
    d_y, d_z : ndarray of shape (n,)
        Differences at each millisecond [m]; 0 during the push.
    """
    path = path_of(jump)
    v_y, v_z = pushed(jump.magnitude, jump.angle)
    since = path.time - (PUSH_TIME + TIME_STEP) / 2
    d_y = path.y - path.y[0] - v_y * since
    d_z = path.z - path.z[0] - (v_z * since - GRAVITY * path.time**2 / 2)
    in_push = path.time < PUSH_TIME - TIME_STEP / 2
    return np.where(in_push, 0.0, d_y), np.where(in_push, 0.0, d_z)


def _fixed(figure: Figure, ax: Axes, left: float, bottom: float, right: float, top: float) -> None:
    """Place the axes once and for all, in parts of the figure: laying out each picture anew would cost a slider half its time."""
    figure.set_layout_engine("none")
    ax.set_position((left, bottom, right - left, top - bottom))


# Pictures: one jump


def draw_moment(jump: Jump, milliseconds: int = 0, staircase: Staircase | None = None) -> Figure:
    """Draw a jump as it is after some milliseconds: the cube, its path so far, and the force while it acts.

    Parameters
    ----------
    jump : Jump
        With its path.
    milliseconds : int
        Time since the push began; after the end of the path, the end is drawn.
    staircase : Staircase, optional
        The stairs; four steps by default.

    Returns
    -------
    matplotlib Figure
    """
    stairs, path = staircase or Staircase(), path_of(jump)
    i = min(milliseconds, len(path.time) - 1)
    y, z, rotation = pose_at(path, i)
    figure, ax = new_figure(
        f"The cube {path.time[i]:.3f} s after the push began, at y = {y:.2f} m, z = {z:.2f} m.", size=(5.4, 3.8)
    )
    draw_stairs(ax, stairs, max(stairs.top + 0.3, float(path.z.max()) + 0.15), float(path.y.max()))
    ax.plot(path.y[: i + 1], path.z[: i + 1], color=PATH, linewidth=1.5, zorder=3)
    draw_cube(ax, y, z, rotation)
    if path.time[i] < PUSH_TIME:
        angle = math.radians(jump.angle)
        reach = 0.1 + 0.25 * jump.magnitude / 1000
        head = (y + reach * math.cos(angle), z + reach * math.sin(angle))
        ax.annotate("", head, (y, z), arrowprops={"arrowstyle": "-|>", "color": INK, "linewidth": 1.8}, zorder=6)
    ax.set_title(f"t = {1000 * path.time[i]:.0f} ms", fontsize=10, loc="left")
    return figure


def draw_phases(jump: Jump) -> Figure:
    """Draw the height of the cube against time, with push, flight, contact and rest shaded.

    Parameters
    ----------
    jump : Jump
        From the start pose, with its path.

    Returns
    -------
    matplotlib Figure
    """
    path, parts = path_of(jump), phases(jump)
    words = "; ".join(f"{name} until {end:.2f} s" for name, _, end in parts)
    figure, ax = new_figure(f"Height of the cube's centre against time. Phases: {words}.", size=(6.4, 3.2))
    shades = dict(zip(("push", "flight", "contact", "rest"), ("#e8a08a", "#dcebf7", "#f6e3b4", "#e6efe4"), strict=True))
    low, high = -0.02, 1.15 * float(path.z.max())
    for name, begin, end in parts:
        ax.axvspan(begin, end, color=shades[name], linewidth=0)
        if name != "push":
            ax.text((begin + end) / 2, high * 0.96, name, ha="center", va="top", fontsize=9)
    ax.annotate(
        "push", (0.005, 0.07), (0.06, 0.22 * high), fontsize=9, arrowprops={"arrowstyle": "-", "color": INK, "lw": 0.8}
    )
    time, z = np.append(path.time, jump.duration), np.append(path.z, path.z[-1])
    ax.plot(time, z, color=PATH)
    ax.set(xlim=(0, jump.duration), ylim=(low, high), xlabel="time [s]", ylabel="z of the centre [m]")
    return figure


# Pictures: flight, and what the formula says of the stairs


def draw_fan(magnitude: float, angles: Sequence[float], highlight: float | None = None) -> Figure:
    """Draw the parabolas of pushes in several directions, on level ground; the highest point of each is marked.

    Parameters
    ----------
    magnitude : float
        Force [N].
    angles : sequence of float
        Directions [deg].
    highlight : float, optional
        One of them, drawn bold.

    Returns
    -------
    matplotlib Figure
    """
    far = [float(level_jump(magnitude, angle)[0]) for angle in angles]
    words = ", ".join(f"{angle:g}° {reach:.2f} m" for angle, reach in zip(angles, far, strict=True))
    figure, ax = new_figure(f"Parabolas of pushes with {magnitude:g} N. Range by angle: {words}.", size=(6.8, 3.4))
    for angle in angles:
        v_y, v_z = pushed(magnitude, angle)
        time = np.linspace(PUSH_TIME / 2, float(time_of_fall(v_z)), 80)
        z = v_z * (time - PUSH_TIME / 2) - GRAVITY * time**2 / 2
        bold = angle == highlight
        ax.plot(v_y * (time - PUSH_TIME / 2), z, color=PATH if bold else FAINT, linewidth=2 if bold else 1)
        top = int(np.argmax(z))
        at = (float(v_y * (time[top] - PUSH_TIME / 2)), float(z[top]))
        ax.annotate(f"{angle:g}°", at, (0, 3), textcoords="offset points", ha="center", fontsize=8)
    ax.axhline(0, color=INK, linewidth=0.8)
    ax.set(xlabel="y from the start [m]", ylabel="height above the start [m]", aspect="equal")
    ax.margins(y=0.08)
    return figure


def draw_formula_against_simulation(motions: np.ndarray, formula: np.ndarray, simulated: np.ndarray) -> Figure:
    """Draw in motion space what formula and simulation say of each motion, side by side; where they differ is ringed.

    Parameters
    ----------
    motions : ndarray of shape (n, 2)
        Magnitude [N] and angle [deg].
    formula, simulated : ndarray of shape (n,), int
        Steps gained by each; -1 off the map.

    Returns
    -------
    matplotlib Figure
    """
    differ = formula != simulated
    figure, panels = new_figure(
        f"Two panels in motion space, {len(motions)} motions by the number of steps gained: by formula and by simulation. They agree "
        f"for {1 - differ.mean():.1%}; the {differ.sum()} others are ringed and lie at the borders of the regions.",
        panels=2,
        size=(9.6, 4.2),
    )
    handles: list[object] = []
    for panel, title, values in zip(
        panels, ("by formula", "by simulation"), (np.asarray(formula), np.asarray(simulated)), strict=True
    ):
        handles = [
            panel.scatter(
                *motions[values == outcome].T, s=14, linewidths=0, label=words, zorder=2, **_outcome_style(outcome)
            )
            for outcome, words in OUTCOMES.items()
        ]
        ring = panel.scatter(
            *motions[differ].T, s=70, facecolors="none", edgecolors=INK, linewidths=0.9, zorder=3, label="they differ"
        )
        panel.set(xlim=(20, 1030), ylim=(-2, 92), yticks=range(0, 91, 15), xlabel="magnitude [N]", ylabel="angle [°]")
        panel.set_title(title, fontsize=10)
    figure_legend(panels[0], [*handles, ring], "lower center", ncols=7)
    return figure


def _outcome_style(outcome: int) -> dict[str, str]:
    if outcome < 0:
        return {"color": "#b0b0b0", "marker": "."}
    style = class_style(outcome + 1)
    return {"color": style.color, "marker": style.marker}


# Pictures: landing and sliding


def draw_level_jumps(magnitude: float = 200, angles: Sequence[float] = tuple(range(5, 90, 5))) -> Figure:
    """Draw how far jumps go on level ground by angle: flight and slide by the closed form, stacked, and the simulation as dots.

    Parameters
    ----------
    magnitude : float
        Force [N].
    angles : sequence of float
        Directions simulated [deg].

    Returns
    -------
    matplotlib Figure
    """
    plain = StairWorld(Staircase(first_riser=100.0))
    simulated = []
    for angle in angles:
        plain.reset()
        simulated.append(plain.jump(magnitude, angle).dy)
    fine = np.linspace(min(angles), max(angles), 200)
    flight, slide = level_jump(magnitude, fine)
    off = np.abs(np.sum(level_jump(magnitude, np.array(angles, dtype=float)), axis=0) - simulated)
    figure, ax = new_figure(
        f"Distance of jumps with {magnitude:g} N on level ground against angle: the flight alone is longest at 45°, the slide adds to "
        f"it below 45°. Simulated jumps lie on the sum, at most {1000 * np.nanmax(off):.1f} mm off.",
        size=(6.4, 3.4),
    )
    ax.fill_between(fine, flight, color="#dcebf7", label="flight, closed form")
    ax.fill_between(fine, flight, flight + slide, color="#f6e3b4", label="slide, closed form")
    ax.plot(angles, simulated, "o", color=PATH, markersize=4, label="simulated")
    ax.axvline(45, color=FAINT, linewidth=0.8, linestyle=":")
    ax.set(xlabel="angle [°]", ylabel="distance [m]", xlim=(0, 90), xticks=range(0, 91, 15))
    legend_below(ax, ncols=3)
    return figure


# Pictures: the riser


def draw_at_riser(jump: Jump, milliseconds: int = 0, riser: float = Staircase.first_riser) -> Figure:
    """Draw the cube near the first riser, some milliseconds after the push began, with the gap to the riser.

    Parameters
    ----------
    jump : Jump
        With its path.
    milliseconds : int
        Time; after the end of the path, the end is drawn.
    riser : float
        y of the riser [m].

    Returns
    -------
    matplotlib Figure
    """
    path = path_of(jump)
    i = min(milliseconds, len(path.time) - 1)
    y, z, rotation = float(path.y[i]), float(path.z[i]), float(path.rotation[i])
    gap = 1000 * (riser - float(cube_corners(y, z, rotation)[:, 0].max()))
    words = f"t = {1000 * path.time[i]:.0f} ms, gap {gap:.1f} mm" if gap > -1 else f"t = {1000 * path.time[i]:.0f} ms"
    figure, ax = new_figure(f"The cube before the riser: {words}, height of its centre {z:.2f} m.", size=(4.8, 3.4))
    draw_stairs(ax, Staircase(n_steps=1), 0.45, 0.9)
    ax.plot(path.y[: i + 1], path.z[: i + 1], color=PATH, linewidth=1.5, zorder=3)
    draw_cube(ax, y, z, rotation)
    ax.set(xlim=(riser - 0.4, riser + 0.2), ylim=(-0.05, 0.42))
    ax.set_title(words, fontsize=10, loc="left")
    return figure


def draw_gaps(gaps: Mapping[str, np.ndarray], recorded: Mapping[float, float] | None = None) -> Figure:
    """Draw how gaps to the riser ahead are distributed: for each set, the share of jumps that leave less than a gap.

    Parameters
    ----------
    gaps : mapping of str to ndarray of shape (n,)
        Gaps [m], by the name of the set; flush cubes, below 0.01 mm, are drawn at the left rim.
    recorded : mapping of float to float, optional
        Known shares of jumps with less than a gap [m], drawn as crosses.

    Returns
    -------
    matplotlib Figure
    """
    shares = {name: float((values < 0.0025).mean()) for name, values in gaps.items()}
    words = "; ".join(f"{name}: {share:.0%} below 2.5 mm" for name, share in shares.items())
    figure, ax = new_figure(f"Share of jumps that leave less than a gap to the riser. {words}.", size=(6.4, 3.6))
    for i, (name, values) in enumerate(gaps.items()):
        color, _ = class_style((2, 5, 4, 6)[i % 4])
        line = ("-", "--", "-.", ":")[i % 4]
        ordered = np.sort(np.maximum(values, SMALLEST_GAP))
        share = np.arange(1, len(ordered) + 1) / len(ordered)
        ax.plot(np.append(ordered, 0.5), np.append(share, 1.0), line, color=color, drawstyle="steps-post", label=name)
    if recorded:
        ax.plot(list(recorded), list(recorded.values()), "X", color=INK, markersize=8, label="recorded in Gazebo")
    ax.set(xscale="log", xlim=(SMALLEST_GAP, 0.35), ylim=(0, 1.02), xlabel="gap to the riser [mm]")
    ax.set_ylabel("share of jumps with a smaller gap")
    ticks = (1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
    ax.set_xticks(ticks, ["flush", "0.1", "1", "10", "100"])
    ax.grid(color=GRID)
    ax.legend(frameon=False, fontsize=9, loc="upper left")
    return figure


# Pictures: the trap


def draw_trap_geometry(gap: float = 0.06, angle: float = 75.0, rise: float = Staircase.rise) -> Figure:
    """Draw why tan(angle) > rise / gap: the cube before a riser, the line of a fast push from its lower front corner, the edge.

    Parameters
    ----------
    gap : float
        Gap between the cube's front and the riser [m].
    angle : float
        Direction of the push [deg].
    rise : float
        Height of the step [m].

    Returns
    -------
    matplotlib Figure
    """
    height = gap * math.tan(math.radians(angle))
    passes = height > rise
    figure, ax = new_figure(
        f"A cube {1000 * gap:.0f} mm before a riser {rise:g} m high. The line of the push, at {angle:g}°, comes to the riser at a "
        f"height of {height:.2f} m: it {'passes' if passes else 'does not pass'} the edge.",
        size=(4.6, 4.0),
    )
    riser = Staircase.first_riser
    front = riser - gap
    draw_stairs(ax, Staircase(n_steps=1, rise=rise), rise + 0.15, 0.9)
    draw_cube(ax, front - HALF, HALF, 0)
    long = min(height, rise + 0.12)
    ax.plot([front, front + long / math.tan(math.radians(angle))], [0, long], color=PATH, linewidth=2, zorder=5)
    if not passes:
        ax.plot(riser, height, "x", color=PATH, markersize=9, markeredgewidth=2, zorder=6)
    arrow = {"arrowstyle": "<->", "color": INK, "linewidth": 0.9, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", (riser, -0.02), (front, -0.02), arrowprops=arrow, zorder=7)
    ax.text(front + gap / 2, -0.03, "g", ha="center", va="top", style="italic", zorder=7)
    ax.annotate("", (riser + 0.03, rise), (riser + 0.03, 0), arrowprops=arrow, zorder=7)
    ax.text(riser + 0.04, rise / 2, "h", va="center", style="italic", zorder=7)
    ax.text(front + 0.012, 0.012, "α", zorder=7, fontsize=9)
    ax.set(xlim=(riser - 0.3, riser + 0.2), ylim=(-0.07, rise + 0.14))
    ax.set_title(
        f"{1000 * gap:.0f} mm · tan {angle:g}° = {height:.2f} m {'>' if passes else '<'} h", fontsize=10, loc="left"
    )
    return figure


def draw_trap(gap: float = 20.0, angle: float = 80.0, magnitude: float = 500.0, world: str = "plane") -> Figure:
    """Draw a jump from close before the first riser: the rule's line, the simulated path of the lower front edge, and the end.

    Parameters
    ----------
    gap : float
        Gap between the cube's front and the riser [mm].
    angle : float
        Direction of the push [deg].
    magnitude : float
        Force [N].
    world : {"plane", "tumbling"}
        Which one; where it tumbles, the cube rocks in the fixed way.

    Returns
    -------
    matplotlib Figure
    """
    where = stair_world(world)
    front = where.staircase.first_riser - gap / 1000
    jump = jump_from(where, front - HALF, magnitude, angle)
    steep = math.tan(math.radians(angle))
    says = "out" if steep > Staircase.rise / (gap / 1000) else "trapped"
    does = f"{outcome_words(jump)}{gap_words(jump)}{turn_words(jump)}"
    figure, ax = new_figure(
        f"{WORLD_WORDS[world]}: a jump with {magnitude:g} N at {angle:g}° from {gap:g} mm before the riser. tan α > h/g says: {says}. "
        f"Simulated: {does}.",
        size=(5.8, 3.6),
    )
    _fixed(figure, ax, 0.12, 0.22, 0.98, 0.87)
    draw_stairs(ax, where.staircase, 1.0, 2.0)
    line = [front, front + 0.42 / steep], [0, 0.42]
    ax.plot(*line, "--", color=INK, linewidth=1.2, zorder=6, label="line of the push")
    edge = front_edge(path_of(jump))
    ax.plot(*edge, color=PATH, linewidth=1.5, zorder=5, label="lower front edge, its middle")
    draw_cube(ax, *pose(jump.start), facecolor="none", linestyle=":", linewidth=1.2)
    draw_cube(ax, *pose(jump.end))
    ax.set(xlim=(0, 1.15), ylim=(-0.04, 0.56), xticks=(0, 0.2, 0.4, 0.6, 0.8, 1.0), yticks=(0, 0.15, 0.3, 0.45))
    ax.set_title(f"{world}; tan α > h/g says: {says}\nsimulated: {does}", fontsize=10, loc="left")
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2), frameon=False, fontsize=9, ncols=2)
    return figure


def climbs_from(magnitude: float, angles: Sequence[float], gaps: Sequence[float]) -> np.ndarray:
    """Simulate jumps from close before the first riser, for each angle and gap.

    Parameters
    ----------
    magnitude : float
        Force [N].
    angles : sequence of float
        Directions [deg].
    gaps : sequence of float
        Gaps [m].

    Returns
    -------
    ndarray of shape (n_angles, n_gaps), bool
        Whether the cube comes to rest higher than before.
    """
    world = StairWorld()
    riser = world.staircase.first_riser
    climbs = np.zeros((len(angles), len(gaps)), dtype=bool)
    for i, angle in enumerate(angles):
        for j, gap in enumerate(gaps):
            world.reset(world.state_at(riser - HALF - gap, HALF))
            climbs[i, j] = world.jump(magnitude, angle).dz > Staircase.rise / 2
    return climbs


def draw_trap_map(magnitude: float, angles: Sequence[float], gaps: Sequence[float], climbs: np.ndarray) -> Figure:
    """Draw from which gap which angle climbs: the simulation as marks, the rule h / tan(angle) and the closed form as lines.

    Parameters
    ----------
    magnitude : float
        Force [N].
    angles, gaps : sequence of float
        Directions [deg] and gaps [m] that were simulated.
    climbs : ndarray of shape (n_angles, n_gaps), bool
        Whether the cube climbed.

    Returns
    -------
    matplotlib Figure
    """
    angle, gap = np.meshgrid(angles, 1000 * np.asarray(gaps), indexing="ij")
    rule = np.tan(np.radians(angle)) > 1000 * Staircase.rise / gap
    figure, ax = new_figure(
        f"Gap to the riser against angle, {climbs.size} jumps with {magnitude:g} N: {climbs.sum()} climb. The rule tan α > h/g is "
        f"right for {(rule == climbs).mean():.0%}; the others lie along its curve, or at large gaps and steep angles.",
        size=(6.4, 4.0),
    )
    ax.plot(angle[~climbs], gap[~climbs], "x", color=FAINT, markersize=5, label="stays below")
    ax.plot(angle[climbs], gap[climbs], "o", color=class_style(3).color, markersize=6, label="climbs")
    fine = np.linspace(min(angles), max(angles), 300)
    ax.plot(fine, 1000 * Staircase.rise / np.tan(np.radians(fine)), color=INK, label="h / tan α")
    ax.plot(fine, 1000 * gap_to_climb(magnitude, fine), "--", color=PATH, label="with gravity")
    ax.set(yscale="log", xlabel="angle [°]", ylabel="gap [mm]", ylim=(0.8 * gap.min(), 1.25 * gap.max()))
    _plain_ticks(ax, (1, 2, 5, 10, 20, 50, 100, 200))
    legend_below(ax, ncols=4)
    return figure


def _plain_ticks(ax: Axes, ticks: Sequence[float]) -> None:
    low, high = ax.get_ylim()
    shown = [tick for tick in ticks if low <= tick <= high]
    ax.set_yticks(shown, [f"{tick:g}" for tick in shown])
    ax.minorticks_off()


def draw_two_jumps(gap: float = 2.0, first: float = 89.0, second: float = 89.0, magnitude: float = 1000.0) -> Figure:
    """Draw two jumps in a row from close before a riser: height of the lower face, and gap to the first riser, against time.

    Parameters
    ----------
    gap : float
        Gap at the start [mm].
    first, second : float
        Directions of the two pushes [deg].
    magnitude : float
        Force of both [N].

    Returns
    -------
    matplotlib Figure
    """
    world = StairWorld()
    riser = world.staircase.first_riser
    one = jump_from(world, riser - HALF - gap / 1000, magnitude, first)
    two = world.jump(magnitude, second, trajectory=True)
    between = 1000 * (riser - HALF - float(one.end[1]))
    figure, panels = new_figure(
        f"Two jumps with {magnitude:g} N, at {first:g}° and {second:g}°, from {gap:g} mm before the riser. After the first the gap is "
        f"{between:.1f} mm, at the same height; the second gains {max(round(two.dz / 0.3), 0)} step.",
        panels=2,
        size=(8.6, 3.2),
        columns=2,
    )
    begins, names = 0.0, ("first jump", "second jump")
    for jump, name, number in zip((one, two), names, (2, 5), strict=True):
        path, color = path_of(jump), class_style(number).color
        panels[0].plot(
            begins + path.time, path.z - HALF, color=color, label=name, linestyle="-" if jump is one else "--"
        )
        panels[1].plot(
            begins + path.time,
            1000 * (riser - HALF - path.y),
            color=color,
            label=name,
            linestyle="-" if jump is one else "--",
        )
        begins += float(path.time[-1])
    panels[0].axhline(Staircase.rise, color=INK, linewidth=0.8)
    panels[0].text(begins / 4, Staircase.rise, "height of the step", ha="center", va="bottom", fontsize=8)
    panels[0].set(xlabel="time [s]", ylabel="height of the lower face [m]")
    panels[1].axhline(0, color=INK, linewidth=0.8)
    panels[1].text(0.9, -0.5, "the riser", ha="center", va="top", fontsize=8)
    panels[1].set(xlabel="time [s]", ylabel="gap to the first riser [mm]", xlim=(-0.1, 2.6), ylim=(-12, 26))
    panels[1].legend(frameon=False, fontsize=9)
    return figure


# The lesson's widget


def draw_field(magnitude: float = 450, angle: float = 65, start: float = 0.25, world: str = "plane") -> Figure:
    """Draw one motion from a field of start positions: the path from ``start`` bold, the others faint, and where each cube ends.

    Parameters
    ----------
    magnitude, angle : float
        The motion [N], [deg].
    start : float
        y of the cube that is shown with its path and effect [m]; it stands upright on the ground or tread there.
    world : {"plane", "tumbling"}
        Which one; where it tumbles, the cube rocks in the fixed way.

    Returns
    -------
    matplotlib Figure
    """
    where = stair_world(world)
    stairs = where.staircase
    jump = jump_from(where, start, magnitude, angle)
    others = [jump_from(where, y, magnitude, angle) for y in FIELD if y != start]
    climb = sum(one.on_map and one.dz > stairs.rise / 2 for one in (jump, *others))
    what = f"{outcome_words(jump)}{gap_words(jump)}{turn_words(jump)}"
    effect = f"Δy = {jump.dy:+.2f} m, Δz = {round(jump.dz, 2) + 0.0:+.2f} m"  # + 0.0: no "-0.00"
    figure, ax = new_figure(
        f"{WORLD_WORDS[world]}: a push with {magnitude:g} N at {angle:g}° from y = {start:g} m: {what}; {effect}. "
        f"From {climb} of {len(others) + 1} start positions the cube climbs.",
        size=(6.6, 4.5),
    )
    _fixed(figure, ax, 0.09, 0.11, 0.98, 0.9)
    draw_stairs(ax, stairs, SEEN_HEIGHT, stairs.end + 0.15)
    ax.set(xticks=np.arange(0, 2.6, 0.5), yticks=(0, 0.3, 0.6, 0.9, 1.2, 1.5))
    for one in others:
        path = path_of(one)
        ax.plot(path.y[::4], path.z[::4], color=FAINT, linewidth=0.8, alpha=0.7, zorder=2)
        draw_cube(ax, *pose(one.end), facecolor="none", edgecolor=FAINT, zorder=3)
    ax.plot([one.start[1] for one in others], [one.start[2] for one in others], ".", color=FAINT, zorder=3)
    path = path_of(jump)
    ax.plot(path.y, path.z, color=PATH, linewidth=2, zorder=5)
    if path.z.max() > SEEN_HEIGHT:
        words = f"flies up to z = {path.z.max():.1f} m"
        box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.9, "pad": 2}
        ax.text(2.55, SEEN_HEIGHT - 0.05, words, color=PATH, ha="right", va="top", fontsize=9, bbox=box, zorder=7)
    draw_cube(ax, *pose(jump.start), facecolor="none", linestyle=":", linewidth=1.3, zorder=6)
    draw_cube(ax, *pose(jump.end), zorder=6)
    ax.set_title(f"{world}: {what}\n{effect}", fontsize=10, loc="left")
    return figure


# The plane and three dimensions


def draw_in_either_world(world: str = "tumbling", magnitude: float = 500, draw: int = 0, angle: float = 70) -> Figure:
    """Draw a jump from the start pose in one of the two worlds, from the side and from above.

    Parameters
    ----------
    world : {"tumbling", "plane"}
        Which one.
    magnitude, angle : float
        The motion [N], [deg].
    draw : int
        Seed of the generator that the rocking of the cube is drawn from; the plane draws nothing.

    Returns
    -------
    matplotlib Figure
    """
    jump = stair_world(world).jump(magnitude, angle, np.random.default_rng(draw), trajectory=True)
    figure, (side, above) = new_figure(f"{WORLD_WORDS[world]}, draw {draw}.", panels=2, size=(5.6, 7.1))
    figure.set_layout_engine("none")
    side.set_position((0.12, 0.452, 0.86, 0.508))
    above.set_position((0.12, 0.068, 0.86, 0.266))
    plot_jump_views(jump, axes=(side, above))
    (y, z, x) = VIEWED
    side.set(xlim=y, ylim=z)
    above.set(xlim=y, ylim=x)
    path = path_of(jump)
    if path.z.max() > z[1]:
        box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.9, "pad": 2}
        words = f"flies up to z = {path.z.max():.1f} m"
        side.text(y[1] - 0.05, z[1] - 0.05, words, color=PATH, ha="right", va="top", fontsize=9, bbox=box, zorder=7)
    side.set_title(
        f"{WORLD_WORDS[world]}: {outcome_words(jump)}, {magnitude:g} N at {angle:g}°", fontsize=10, loc="left"
    )
    return figure
