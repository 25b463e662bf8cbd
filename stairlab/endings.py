"""How the trained agents end, and why: on the top, or stuck before a riser, where a set of motions may have no way up.

The tables are those of ``StudyResults``: episodes and motions, each row with its "method" and "seed".
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from tqdm import tqdm

from stairlab.physics import CUBE_EDGE, Staircase
from stairlab.planning import jumps_to_climb, trap_width
from stairlab.world import StairWorld

ENDS = ("top", "stuck", "other")
""" How a greedy episode ends: on the top; stuck where its last jumps change nothing; or else (time's up, or off the map) """
STUCK_JUMPS = 5
STUCK_SHIFT = 0.001
""" So many last jumps that all move the cube by less than this are called stuck [m] """
RUN = ["method", "seed"]
MOTION = ["magnitude", "angle"]


def ends(episodes: pd.DataFrame) -> pd.DataFrame:
    """Say how the greedy episode of each trained agent ends.

    Parameters
    ----------
    episodes : pandas.DataFrame
        A row for each jump.

    Returns
    -------
    pandas.DataFrame
        A row for each run: "method", "seed", "step" of the stairs on which it ends, the distance "to riser" ahead of the cube's
        front [m], and "end", one of ``ENDS``.
    """
    found = [{**dict(zip(RUN, run, strict=True)), **_end(one)} for run, one in episodes.groupby(RUN, sort=False)]
    return pd.DataFrame(found, columns=[*RUN, "step", "to riser", "end"])


def _end(episode: pd.DataFrame) -> dict[str, Any]:
    staircase = Staircase.fifteen()
    last, places = episode.iloc[-1], episode[["y", "z"]].to_numpy()
    moved = np.abs(np.diff(places[-STUCK_JUMPS - 1 :], axis=0)).sum(axis=1)
    still = len(moved) == STUCK_JUMPS and (moved < STUCK_SHIFT).all()
    end = "top" if last["steps"] == staircase.n_steps else "stuck" if still else "other"
    gap = staircase.next_riser(last["y"]) - last["y"] - CUBE_EDGE / 2
    return {"step": int(last["steps"]), "to riser": gap, "end": end}


def ways_out(
    episodes: pd.DataFrame,
    motions: pd.DataFrame,
    restitution: float | None = None,
    max_simulated: int = 700,
    progress: bool = False,
) -> pd.DataFrame:
    """Ask whether a set has a way up from where its trained agent got stuck.

    The agent's jumps are made again, so that the cube stands exactly where it did, and the motions of the set are searched from
    there (see ``jumps_to_climb``).

    Parameters
    ----------
    episodes, motions : pandas.DataFrame
        A row for each jump; a row for each motion of a set.
    restitution : float, optional
        Of the risers, see ``Staircase``.
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
    staircase = Staircase.fifteen(restitution)
    jumps, sets = dict(iter(episodes.groupby(RUN))), dict(iter(motions.groupby(RUN)))
    stuck = ends(episodes).query("end == 'stuck'").set_index(RUN).index
    rows = []
    for run in tqdm([run for run in stuck if run in sets], desc="ways out", disable=not progress, leave=False):
        world = _replayed(staircase, jumps[run][MOTION].to_numpy())
        rows.append((*run, jumps_to_climb(world, sets[run][MOTION].to_numpy(), max_simulated)))
    return pd.DataFrame(rows, columns=[*RUN, "jumps"]).astype({"jumps": float})


def _replayed(staircase: Staircase, motions: np.ndarray) -> StairWorld:
    """Return the world after some jumps from the start, at the precision of the environment's actions."""
    world = StairWorld(staircase)
    for motion in motions.astype(np.float32).astype(float):
        world.perform(motion)
    return world


def traps(motions: pd.DataFrame, restitution: float | None = None) -> pd.DataFrame:
    """Measure for each set the trap that a riser is: the gap below which none of its motions climbs (see ``trap_width``).

    Parameters
    ----------
    motions : pandas.DataFrame
        A row for each motion of a set.
    restitution : float, optional
        Of the risers, see ``Staircase``.

    Returns
    -------
    pandas.DataFrame
        A row for each run with a set of motions: "method", "seed", the "trap" [m], and the "steepest" angle of the set [deg].
    """
    staircase = Staircase.fifteen(restitution)
    width_of: dict[bytes, float] = {}  # uniform sets are the same for every seed
    rows = []
    for run, one in motions.groupby(RUN, sort=False):
        motion_set = one[MOTION].to_numpy(dtype=float)
        key = motion_set.tobytes()
        if key not in width_of:
            width_of[key] = trap_width(staircase, motion_set)
        rows.append((*run, width_of[key], motion_set[:, 1].max()))
    return pd.DataFrame(rows, columns=[*RUN, "trap", "steepest"]).astype({"trap": float, "steepest": float})
