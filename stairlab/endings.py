"""How the trained agents end, and why: on the top, off the map, or stuck before a riser, where a set may have no way up.

The tables are those of ``StudyResults``: episodes and motions, each row with its "method" and "seed". Episodes of the plane have no
columns "x" and "yaw"; there these are 0.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from tqdm import tqdm

from stairlab.fidelity import CLOSE
from stairlab.physics import CUBE_EDGE, Staircase
from stairlab.planning import jumps_to_climb, trap_width
from stairlab.world import MAP_HALF_WIDTH, CubeWorld, StairWorld, reach_of

ENDS = ("top", "off", "stuck", "other")
""" How a greedy episode ends: on the top; off the map; stuck where its last jumps change nothing; or else (time's up) """
STUCK_JUMPS = 5
STUCK_SHIFT = 0.001
""" So many last jumps that all move the cube by less than this are called stuck, in the plane [m] """
STUCK_STEPS = 10
""" A cube that has stayed on its step for so many last jumps is called stuck where it tumbles """
RUN = ["method", "seed"]
STEEP = 85.0
""" A motion above this angle climbs from where others are trapped; the grid has it in its corners [deg] """
EPISODE = [*RUN, "episode"]
MOTION = ["magnitude", "angle"]


def ends(episodes: pd.DataFrame, tumbles: bool) -> pd.DataFrame:
    """Say how the greedy episode of each trained agent ends.

    Parameters
    ----------
    episodes : pandas.DataFrame
        A row for each jump.
    tumbles : bool
        Whether the cube tumbles, or moves in the plane: "stuck" differs (see ``STUCK_JUMPS``, ``STUCK_STEPS``).

    Returns
    -------
    pandas.DataFrame
        A row for each episode: "method", "seed", "episode", "step" of the stairs on which it ends, the distance "to riser" ahead of
        the cube's foremost corner [m], and "end", one of ``ENDS``.
    """
    found = [
        {**dict(zip(EPISODE, key, strict=True)), **_end(rows, tumbles)}
        for key, rows in _complete(episodes).groupby(EPISODE, sort=False)
    ]
    return pd.DataFrame(found, columns=[*EPISODE, "step", "to riser", "end"])


def _complete(episodes: pd.DataFrame) -> pd.DataFrame:
    """Put 0 where episodes of the plane lack an "episode", "x" or "yaw"."""
    lacking = {name: episodes[name].fillna(0) if name in episodes else 0 for name in ("episode", "x", "yaw")}
    return episodes.assign(**lacking)


def _end(episode: pd.DataFrame, tumbles: bool) -> dict[str, Any]:
    staircase = Staircase.fifteen()
    last = episode.iloc[-1]
    world = StairWorld(staircase)
    if last["steps"] == staircase.n_steps:
        end = "top"
    elif not world.on_map(last[["x", "y", "z"]].to_numpy(dtype=float)):
        end = "off"
    else:
        end = "stuck" if _is_stuck(episode, tumbles) else "other"
    return {"step": int(last["steps"]), "to riser": float(gaps(episode.iloc[-1:])[0]), "end": end}


def _is_stuck(episode: pd.DataFrame, tumbles: bool) -> bool:
    """Whether the last jumps of an episode change nothing: no place in the plane, no step where the cube tumbles."""
    if not tumbles:
        moved = np.abs(np.diff(episode[["y", "z"]].to_numpy()[-STUCK_JUMPS - 1 :], axis=0)).sum(axis=1)
        return len(moved) == STUCK_JUMPS and bool((moved < STUCK_SHIFT).all())
    steps = episode["steps"].to_numpy()[-STUCK_STEPS - 1 :]
    return len(steps) == STUCK_STEPS + 1 and len(set(steps)) == 1


def gaps(episodes: pd.DataFrame) -> np.ndarray:
    """Return the gap between the foremost corner and the riser ahead after each jump, shape (n_jumps,); infinite on the top [m].

    The cube is taken to rest on a face, see ``reach_of``.
    """
    episodes, staircase = _complete(episodes), Staircase.fifteen()
    steps = episodes["steps"].to_numpy(dtype=int)
    ahead = np.where(steps < staircase.n_steps, staircase.first_riser + staircase.run * steps, np.inf)
    return ahead - episodes["y"].to_numpy(dtype=float) - reach_of(episodes["yaw"].to_numpy(dtype=float))


def trapped(episodes: pd.DataFrame) -> pd.DataFrame:
    """Count how often greedy agents lie in the trap before a riser, and how they get out.

    Parameters
    ----------
    episodes : pandas.DataFrame
        A row for each jump.

    Returns
    -------
    pandas.DataFrame
        A row for each method: the number of "jumps" that start from where another one ended; the share of them that start "in the
        trap", within 3 cm of the riser; of these, the share after which the cube is "free", on the map and 3 cm or more off a riser,
        and that "climbs"; the share that starts "turned" by more than 5 degrees; and the share of all that "climbs anywhere".
    """
    table = _complete(episodes).assign(gap=gaps(episodes))
    before = table.groupby(EPISODE, sort=False)[["gap", "steps", "yaw"]].shift()
    follows = before["gap"].notna()
    table, before = table[follows], before[follows]
    caught, climbs = before["gap"] < CLOSE, table["steps"] > before["steps"]
    free = (table["gap"] >= CLOSE) & (table["y"] > 0) & (table["x"].abs() < MAP_HALF_WIDTH)
    shares = pd.DataFrame(
        {
            "method": table["method"],
            "jumps": 1.0,
            "in the trap": caught.astype(float),
            "free": free.where(caught).astype(float),
            "climbs": climbs.where(caught).astype(float),
            "turned": (before["yaw"].abs() > 5).astype(float),
            "climbs anywhere": climbs.astype(float),
        }
    )
    grouped = shares.groupby("method", sort=False)
    return grouped.mean().assign(jumps=grouped["jumps"].sum().astype(int)).reset_index()


def accounts(episodes: pd.DataFrame) -> pd.DataFrame:
    """Say what greedy episodes earn and lose: why a set that climbs fast may score less than one that climbs step by step.

    Parameters
    ----------
    episodes : pandas.DataFrame
        A row for each jump.

    Returns
    -------
    pandas.DataFrame
        A row for each method, with means over episodes: "jumps"; those that "climb", each of which earns 1; the "steps a climb",
        which earn no more if they are two or three; what falls have "lost", in steps; and the "return".
    """
    table = _complete(episodes)
    before = table.groupby(EPISODE, sort=False)["steps"].shift(fill_value=0)
    gained = table["steps"] - before
    table = table.assign(climb=gained > 0, gained=gained.clip(lower=0), lost=table["reward"].clip(upper=0))
    sums = table.groupby(EPISODE, sort=False)[["climb", "gained", "lost", "reward"]].sum()
    means = sums.assign(jumps=table.groupby(EPISODE, sort=False).size()).groupby("method", sort=False).mean()
    means["steps a climb"] = means["gained"] / means["climb"]
    return means.rename(columns={"reward": "return"})[
        ["jumps", "climb", "steps a climb", "lost", "return"]
    ].reset_index()


def thrown_off(episodes: pd.DataFrame, tumbles: bool) -> pd.DataFrame:
    """Say how greedy agents leave the map.

    Parameters
    ----------
    episodes : pandas.DataFrame
        A row for each jump.
    tumbles : bool
        Whether the cube tumbles, or moves in the plane.

    Returns
    -------
    pandas.DataFrame
        A row for each method: the share of jumps with a "steep" motion, above ``STEEP``; the number of "episodes", the share that
        ends "off" the map, and of these the shares whose last motion is steep ("steep last"), and that end "behind" the start or
        "aside" of the stairs (else: beyond). Shares of motions are NaN where these are not known.
    """
    table = _complete(episodes).merge(ends(episodes, tumbles)[[*EPISODE, "end"]], on=EPISODE)
    table["steep"] = (table["angle"] > STEEP).where(table["angle"].notna()).astype(float)
    last = table.groupby(EPISODE, sort=False).tail(1)
    off = last["end"] == "off"
    shares = pd.DataFrame(
        {
            "method": last["method"],
            "off": off.astype(float),
            "steep last": last["steep"].where(off),
            "behind": (last["y"] < 0).astype(float).where(off),
            "aside": (last["x"].abs() > MAP_HALF_WIDTH).astype(float).where(off),
        }
    ).groupby("method", sort=False)
    counts = {"steep": table.groupby("method", sort=False)["steep"].mean(), "episodes": shares.size()}
    return pd.concat([pd.DataFrame(counts), shares.mean()], axis=1).reset_index()


def ways_out(
    episodes: pd.DataFrame,
    motions: pd.DataFrame,
    world: CubeWorld | None = None,
    max_simulated: int = 700,
    progress: bool = False,
) -> pd.DataFrame:
    """Ask whether a set has a way up from where its trained agent got stuck, in the first of its episodes that is kept.

    In the plane the agent's jumps are made again, so that the cube stands exactly where it did; in the tumbling world the cube is
    put there, on a face. The motions of the set are searched from there (see ``jumps_to_climb``).

    Parameters
    ----------
    episodes, motions : pandas.DataFrame
        A row for each jump; a row for each motion of a set.
    world : StairWorld or TumblingWorld, optional
        The world with fifteen steps; the plane by default.
    max_simulated : int
        Jumps that each search may simulate.
    progress : bool
        Show a progress bar.

    Returns
    -------
    pandas.DataFrame
        A row for each stuck run with a set of motions: "method", "seed", and the "jumps" until it could be higher: infinite if
        never, NaN if the search was not over.
    """
    world = world or StairWorld(Staircase.fifteen())
    first = _complete(episodes).query("episode == 0")
    jumps, sets = dict(iter(first.groupby(RUN))), dict(iter(motions.groupby(RUN)))
    stuck = (
        ends(episodes, not isinstance(world, StairWorld)).query("episode == 0 and end == 'stuck'").set_index(RUN).index
    )
    rows = []
    for run in tqdm([run for run in stuck if run in sets], desc="ways out", disable=not progress, leave=False):
        _put_where_it_ended(world, jumps[run])
        rows.append((*run, jumps_to_climb(world, sets[run][MOTION].to_numpy(), max_simulated)))
    return pd.DataFrame(rows, columns=[*RUN, "jumps"]).astype({"jumps": float})


def _put_where_it_ended(world: CubeWorld, episode: pd.DataFrame) -> None:
    """Put a world into the state after an episode's last jump."""
    if isinstance(world, StairWorld):  # exactly, at the precision of the environment's actions
        world.reset()
        for motion in episode[MOTION].to_numpy().astype(np.float32).astype(float):
            world.perform(motion)
        return
    last = episode.iloc[-1]
    z = world.staircase.rise * last["steps"] + CUBE_EDGE / 2
    world.reset(world.state_at(last["y"], z, x=last["x"], yaw=np.radians(last["yaw"])))


def traps(motions: pd.DataFrame, world: CubeWorld | None = None) -> pd.DataFrame:
    """Measure for each set the trap that a riser is: the gap below which none of its motions climbs (see ``trap_width``).

    Parameters
    ----------
    motions : pandas.DataFrame
        A row for each motion of a set.
    world : StairWorld or TumblingWorld, optional
        The world with fifteen steps; the plane by default.

    Returns
    -------
    pandas.DataFrame
        A row for each run with a set of motions: "method", "seed", the "trap" [m], and the "steepest" angle of the set [deg].
    """
    world = world or StairWorld(Staircase.fifteen())
    width_of: dict[bytes, float] = {}  # uniform sets are the same for every seed
    rows = []
    for run, one in motions.groupby(RUN, sort=False):
        motion_set = one[MOTION].to_numpy(dtype=float)
        key = motion_set.tobytes()
        if key not in width_of:
            width_of[key] = trap_width(world, motion_set)
        rows.append((*run, width_of[key], motion_set[:, 1].max()))
    return pd.DataFrame(rows, columns=[*RUN, "trap", "steepest"]).astype({"trap": float, "steepest": float})
