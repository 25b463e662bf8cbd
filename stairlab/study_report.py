"""What a study leaves beside its runs: tables, figures, and a one-file HTML report that says what was found and how sure it is."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from stairlab import study_plots
from stairlab._files import write_whole
from stairlab.claims import paper_claims
from stairlab.report import REPORT, draw_figures, render_page, save_pictures
from stairlab.results import CONFIDENCE, ENDS, FEWEST_SEEDS, RESAMPLES, StudyResults

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
    return {"summary": results.summary(), "claims": paper_claims(results)}


def save_study(results: StudyResults, out_dir: str | PathLike[str], *, progress: bool = True) -> list[Path]:
    """Write tables, figures and report of a study into a folder; each file appears whole or not at all. See ``StudyResults.save``."""
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
    page = render_page("study.html.jinja", pictures, **_context(results, found))
    write_whole(written[-1], lambda file: file.write(page))
    return written


def _context(results: StudyResults, found: dict[str, pd.DataFrame]) -> dict[str, Any]:
    settings = results.description["settings"]
    return {
        "results": results,
        "settings": settings,
        "label": {method: study_plots.method_style(method, results.methods).label for method in results.methods},
        "rows": [_present(row) for row in found["summary"].to_dict("records")],
        "claims": found["claims"].to_numpy().tolist(),
        "ends": _ends(results),
        "command": results.command(),
        "description": results.description,
        "confidence": CONFIDENCE,
        "resamples": RESAMPLES,
        "fewest": FEWEST_SEEDS,
        "learning_starts": settings["dqn"].get("learning_starts", study_plots.LEARNING_STARTS),
    }


def _present(row: dict[str, Any]) -> dict[str, Any]:
    """Put None for NaN, which the template can ask for."""
    return {name: None if value != value else value for name, value in row.items()}


def _ends(results: StudyResults) -> list[dict[str, Any]]:
    """Count for each method how the trained agents' greedy episodes end, and how many stuck ones had a motion that climbs."""
    ways, traps = results.ways_out(), results.traps()
    has_motions = set(results.motions["method"])
    return [
        {"method": method, "runs": len(rows)}
        | {end: int((rows["end"] == end).sum()) for end in ENDS}
        | {"trap": 1000 * traps[traps["method"] == method]["trap"].median() if method in has_motions else None}
        | {"way_out": int((ways[ways["method"] == method]["climb"] > 0).sum()) if method in has_motions else None}
        for method, rows in results.ends().groupby("method", sort=False)
    ]
