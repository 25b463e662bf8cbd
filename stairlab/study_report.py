"""What a study leaves beside its runs: tables, figures, and a one-file HTML report that says what was found and how sure it is."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from stairlab import study_plots
from stairlab._files import write_whole
from stairlab.claims import paper_claims
from stairlab.endings import ENDS
from stairlab.estimates import FEWEST_SEEDS, RESAMPLES
from stairlab.report import REPORT, draw_figures, render_page, save_pictures
from stairlab.results import StudyResults

FIGURE_4A = ("effect", "uniform", "random")


def figures(results: StudyResults) -> dict[str, Callable[[], Figure]]:
    """Return how to draw each figure of a study, by the name of its file."""
    there = set(results.methods)
    compared = [method for method in FIGURE_4A if method in there]
    drawn: dict[str, Callable[[], Figure]] = {}
    if len(compared) > 1:
        drawn["figure_4a_learning_curves"] = lambda: study_plots.plot_learning_curves(results, compared)
    if {"sac", "effect"} <= there:
        drawn["figure_4b_learning_curves"] = lambda: study_plots.plot_learning_curves(results, ["sac", "effect"])
    drawn["learning_certainty"] = lambda: study_plots.plot_learning_certainty(results)
    drawn["scores"] = lambda: study_plots.plot_study_scores(results)
    if "effect" in there and len(there) > 1:
        drawn["improvement"] = lambda: study_plots.plot_improvement(results)
    if len(results.motions):
        drawn["traps"] = lambda: study_plots.plot_traps(results)
    drawn["last_episodes"] = lambda: study_plots.plot_last_episodes(results)
    return drawn


def tables(results: StudyResults) -> dict[str, pd.DataFrame]:
    """Return the tables that a study is read by, by the name of their file."""
    return {"summary": results.summary(), "claims": paper_claims(results).assign(quick=results.quick)}


def save_study(results: StudyResults, out_dir: str | PathLike[str], *, progress: bool = True) -> list[Path]:
    """Write tables (CSV), figures (PNG) and a report (HTML) of a study into a folder; each file appears whole or not at all.

    Parameters
    ----------
    results : StudyResults
        The study.
    out_dir : path-like
        The folder; it is made where it does not exist.
    progress : bool
        Show a progress bar.

    Returns
    -------
    list of Path
        The files written.
    """
    folder = Path(out_dir)
    written = results.save_tables(folder / "tables")
    found = tables(results)
    for name, table in found.items():
        written.append(folder / "tables" / f"{name}.csv")
        write_whole(written[-1], partial(table.to_csv, index=False, lineterminator="\n"))
    pictures = draw_figures(figures(results), progress)
    (folder / "figures").mkdir(exist_ok=True)
    written += save_pictures(pictures, folder / "figures")
    written.append(folder / REPORT)
    page = render_page("study.html.jinja", pictures, **_context(results, found, progress))
    write_whole(written[-1], lambda file: file.write(page))
    return written


def _context(results: StudyResults, found: dict[str, pd.DataFrame], progress: bool) -> dict[str, Any]:
    settings = results.description["settings"]
    return {
        "results": results,
        "settings": settings,
        "label": {method: study_plots.method_style(method, results.methods).label for method in results.methods},
        "rows": [_present(row) for row in found["summary"].to_dict("records")],
        "claims": [_present(row) for row in found["claims"].to_dict("records")],
        "trapped": results.trapped().to_dict("records"),
        "accounts": [_present(row) for row in results.accounts().to_dict("records")],
        "ends": _ends(results, progress),
        "command": results.command(),
        "hours": results.hours,
        "description": results.description,
        "departures": _departures(settings),
        "search": results.runs[["simulated", "exhausted"]]
        .astype(float)
        .groupby(results.runs["method"])
        .mean()
        .to_dict("index"),
        "resamples": RESAMPLES,
        "fewest": FEWEST_SEEDS,
        "learning_starts": settings["dqn"].get("learning_starts", study_plots.LEARNING_STARTS),
    }


def _departures(settings: dict[str, Any]) -> list[str]:
    """Name what differs from the paper's study."""
    named = {
        "it is in the plane, where a cube neither turns nor rolls": settings["world"] == "plane",
        f"the cube rocks {settings['rocking']:g} times as much": settings["rocking"] != 1,
        f"the friction is {settings['friction']:g}": settings["friction"] != 1,
        "DQN has other settings than the published ones": settings["dqn"],
        "SAC has other settings than the published ones": settings["sac"],
        f"the risers have a restitution of {settings['restitution']}": settings["restitution"] is not None,
    }
    return [words for words, there in named.items() if there]


def _present(row: dict[str, Any]) -> dict[str, Any]:
    """Put None for NaN, which the template can ask for."""
    return {name: None if value != value else value for name, value in row.items()}


def _ends(results: StudyResults, progress: bool) -> list[dict[str, Any]]:
    """Say for each method how the trained agents' greedy episodes end, where they are stuck, and whether the set had a way out."""
    ends, traps, ways = results.ends(), results.traps(), results.ways_out(progress=progress)
    rows = []
    for method, mine in ends.groupby("method", sort=False):
        jumps, sets = ways[ways["method"] == method]["jumps"], traps[traps["method"] == method]
        row: dict[str, Any] = {"method": method, "episodes": len(mine)}
        row |= {end: int((mine["end"] == end).sum()) for end in ENDS}
        row["stuck at"] = 1000 * mine.loc[mine["end"] == "stuck", "to riser"].clip(lower=0).median()
        row |= {"way out": int(np.isfinite(jumps).sum()), "none": int(np.isinf(jumps).sum())}
        row |= {"trap": 1000 * sets["trap"].median(), "steepest": sets["steepest"].median()}
        rows.append(_present(row))
    return rows
