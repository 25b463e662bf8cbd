"""The one-file HTML report: shows and explains a whole run, and works offline.

Every number in it comes from the run. The words are in ``templates/report.html.jinja``.
"""

from __future__ import annotations

import base64
import math
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jinja2
import numpy as np
import pandas as pd
from markupsafe import Markup
from matplotlib.figure import Figure
from matplotlib.markers import MarkerStyle
from tqdm import tqdm

from stairlab import drawing, plots
from stairlab._files import write_bytes, write_whole
from stairlab.effects import EffectClasses
from stairlab.physics import CUBE_EDGE, CUBE_MASS, PUSH_STEPS, TIME_STEP
from stairlab.prototypes import LARGEST_CV, MAX_COUNT, NEIGHBOURS
from stairlab.tumbling import TumblingWorld

if TYPE_CHECKING:
    from stairlab.pipeline import Run

REPORT = "report.html"
NEAR_TIE = 0.01
""" Scores that differ by less are called close """
SET_FILES = ("effect", "fixed", "uniform", "random")
""" The sets of prototypes that get a file of their own """
PRESET_WORDS = {
    "paper-figures": "what gives the paper's figures",
    "paper-text": "what the paper's text says",
    "released-code": "what the authors' released code does",
}
CRITERIA = {"silhouette": "silhouette, highest", "davies-bouldin": "Davies-Bouldin, lowest"}
SCALINGS = {"none": "metres", "max-abs": "divided by the largest absolute value"}
WORDS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")


@dataclass(frozen=True)
class Picture:
    """A figure as it goes into the report and into a file."""

    png: bytes
    alt: str

    @property
    def src(self) -> str:
        """The picture as a data URL."""
        return "data:image/png;base64," + base64.b64encode(self.png).decode()


def figures(run: Run) -> dict[str, Callable[[], Figure]]:
    """Return how to draw each figure of a run, by the name of its file."""
    shown = [run.prototypes[name] for name in ("effect", "fixed", "random", "uniform")]  # the order of figure 3
    return {
        "figure_1_world": lambda: plots.plot_world(run.example, run.world.staircase),
        "figure_2_effect_classes": lambda: plots.plot_effect_classes(run.classes),
        "figure_3_prototypes": lambda: plots.plot_prototypes(shown, run.classes),
        "figure_5_trajectories": lambda: plots.plot_prototype_trajectories(run.world, shown[0], run.classes),
        "figure_6_effect_distributions": lambda: plots.plot_effect_distributions(run.samples),
        "figure_7_features": lambda: plots.plot_feature_comparison(run.classes, run.classes_x),
        "scores": lambda: plots.plot_score_curve(run.presets),
        "prototype_counts": lambda: plots.plot_prototype_counts(run.counts),
        "reliability": lambda: plots.plot_reliability(run.summary()),
    }


def tables(run: Run) -> dict[str, pd.DataFrame]:
    """Return the tables of a run that are not samples or prototypes, by the name of their file."""
    return {
        "effect_classes": run.classes.to_frame().reset_index(),
        "prototype_counts": run.counts.reset_index(),
        "reliability": run.summary(),
        "scores": run.scores(),
        "merges": run.merges,
    }


def save_run(run: Run, out_dir: str | PathLike[str], *, progress: bool = True) -> list[Path]:
    """Write tables (CSV), figures (PNG) and the report (HTML) of a run into a folder; each file appears whole or not at all.

    Parameters
    ----------
    run : Run
        As ``run_pipeline`` returns it.
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
    folder.mkdir(parents=True, exist_ok=True)
    written = [folder / "samples.csv"]
    run.samples.to_csv(written[0])
    for name, table in tables(run).items():
        written.append(folder / f"{name}.csv")
        write_whole(written[-1], partial(table.to_csv, index=False, lineterminator="\n"))
    for name in SET_FILES:
        written.append(folder / f"prototypes_{name}.csv")
        run.prototypes[name].to_csv(written[-1])
    pictures = draw_figures(figures(run), progress)
    written += save_pictures(pictures, folder)
    written.append(folder / REPORT)
    _write(run, pictures, written[-1])
    return written


def write_report(run: Run, path: str | PathLike[str], *, progress: bool = False) -> None:
    """Write the report of a run: one HTML file with everything in it. It appears whole or not at all.

    Parameters
    ----------
    run : Run
        As ``run_pipeline`` returns it.
    path : path-like
        The file.
    progress : bool
        Show a progress bar.
    """
    _write(run, draw_figures(figures(run), progress), path)


def _write(run: Run, pictures: dict[str, Picture], path: str | PathLike[str]) -> None:
    page = render(run, pictures)
    write_whole(path, lambda file: file.write(page))


def draw_figures(figures: dict[str, Callable[[], Figure]], progress: bool = False) -> dict[str, Picture]:
    """Draw the figures of a report."""
    bar = tqdm(figures.items(), desc="figures", disable=not progress, leave=False, delay=0.5)
    return {name: Picture(drawing.png(figure), drawing.alt_text(figure)) for name, draw in bar for figure in [draw()]}


def save_pictures(pictures: dict[str, Picture], folder: Path) -> list[Path]:
    """Write each picture into a file of its name."""
    written = []
    for name, picture in pictures.items():
        written.append(folder / f"{name}.png")
        write_bytes(written[-1], picture.png)
    return written


def render(run: Run, pictures: dict[str, Picture]) -> str:
    """Return the report of a run as HTML."""
    return render_page("report.html.jinja", pictures, **_context(run))


def render_page(template: str, pictures: dict[str, Picture], **context: Any) -> str:
    """Fill a template of a report."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("stairlab"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "number": "{:,}".format,
        "percent": percent,
        "metres": lambda value: f"{value + 0.0:.3f}".replace("-0.000", "0.000"),
        "fixed": fixed,
        "word": lambda value: WORDS[value] if value < len(WORDS) else f"{value:,}",
        "listed": listed,
    }
    return environment.get_template(template).render(context, pictures=pictures)


def fixed(value: float, digits: int = 3) -> str:
    """Return a number with a fixed number of digits after the point."""
    return f"{value:.{digits}f}"


def percent(share: float, digits: int = 0) -> str:
    """Return a share as a percentage; a dash for NaN."""
    return "–" if math.isnan(share) else f"{100 * share:.{digits}f}\u202f%"


def listed(items: Iterable[Any]) -> str:
    """Return items as a list in a sentence: "1, 2 and 3"."""
    *first, last = map(str, items)
    return f"{', '.join(first)} and {last}" if first else last


def _context(run: Run) -> dict[str, Any]:
    glosses = plots.class_glosses(run.classes)
    methods = dict(zip(run.reliability, run.summary().to_dict("records"), strict=True))
    return {
        "run": run,
        "tumbling": isinstance(run.world, TumblingWorld),
        "constants": {
            "mass": CUBE_MASS,
            "edge": CUBE_EDGE,
            "push": PUSH_STEPS * TIME_STEP,
            "cap": MAX_COUNT,
            "largest_cv": LARGEST_CV,
            "neighbours": NEIGHBOURS,
            "noise": run.world.noise_scale(np.array([100.0, 45.0])),
        },
        "on_map": int(run.samples.on_map.sum()),
        "outcomes": _outcomes(run),
        "glosses": glosses,
        "marks": {
            number: _mark(number) for number in range(1, max(run.classes.n_classes, run.classes_x.n_classes) + 1)
        },
        "classes": [
            {"number": n} | row for n, row in zip(glosses, run.classes.to_frame().to_dict("records"), strict=True)
        ],
        "flat": [n for n, gloss in glosses.items() if gloss.startswith("0 steps")],
        "choice": _choice(run.classes),
        "wide": _wide(run),
        "presets": [_preset_row(name, classes) for name, classes in run.presets.items()],
        "counts": [{"number": n} | row for n, row in zip(glosses, run.counts.to_dict("records"), strict=True)],
        "prototypes": run.reliability["effect"].table.to_dict("records"),
        "methods": methods,
        "best": max((row for row in methods.values() if row["under noise"] >= 0), key=lambda row: row["under noise"]),
        "merges": _merges(run),
        "classes_x": [
            {"number": n, "gloss": gloss} | row
            for (n, gloss), row in zip(
                plots.class_glosses(run.classes_x).items(), run.classes_x.to_frame().to_dict("records"), strict=True
            )
        ],
        "choice_x": _choice(run.classes_x),
        "settings": run.classes.settings,
        "scaling": SCALINGS[run.classes.settings["scaling"]],
        "command": f"stairlab run --n {run.n} --seed {run.seed}"
        + " --world tumbling" * isinstance(run.world, TumblingWorld),
        "files": sorted(f"{name}.csv" for name in ("samples", *tables(run), *(f"prototypes_{s}" for s in SET_FILES))),
    }


def _outcomes(run: Run) -> list[tuple[str, int]]:
    """Count the jumps by what became of them: off the map, or the number of steps gained."""
    steps = np.round(run.samples.on_the_map().effect("dz")[:, 0] / run.world.staircase.rise).astype(int)
    counts = sorted(Counter(steps.tolist()).items())
    off = len(run.samples) - len(steps)
    return [("off the map", off), *((f"{step} step{'s'[: step != 1]}", count) for step, count in counts)]


def _choice(classes: EffectClasses) -> dict[str, Any]:
    """Say what was searched for k, what was found, and whether it lies at an edge of the range."""
    low, high = classes.settings["k_range"]
    k = classes.n_classes
    return {
        "k": k,
        "low": low,
        "high": high,
        "edge": "largest" if k == high else "smallest" if k == low else "",
        "score": _score_of(classes, k),
    }


def _score_of(classes: EffectClasses, k: int) -> float:
    return float(classes.scores.set_index("k")["score"].loc[k])


def _wide(run: Run) -> dict[str, Any] | None:
    """Say what the paper's own range would have given, and which k come close to the chosen one there."""
    wide = run.presets.get("paper-text")
    if wide is None:
        return None
    scores = wide.scores.set_index("k")["score"]
    here = _score_of(run.classes, run.classes.n_classes)
    close = [k for k, score in scores.items() if k != run.classes.n_classes and abs(score - here) < NEAR_TIE]
    return _choice(wide) | {"close": close, "margin": NEAR_TIE}


def _preset_row(name: str, classes: EffectClasses) -> dict[str, Any]:
    scores = classes.scores.sort_values(
        "score", ascending=classes.settings["criterion"] == "davies-bouldin", kind="stable"
    )
    second = scores.iloc[1].to_dict() if len(scores) > 1 else None
    return _choice(classes) | {
        "name": name,
        "words": PRESET_WORDS.get(name, ""),
        "criterion": CRITERIA[classes.settings["criterion"]],
        "scaling": SCALINGS[classes.settings["scaling"]],
        "second": second,
    }


def _merges(run: Run) -> dict[str, Any]:
    return {
        "here": [[int(name[1:]) for name in group.split("+")] for group in run.together.split(", ")],
        "resamples": len(run.merges),
        "fewer": int((run.merges["with x"] < run.merges["without x"]).sum()),
        "numbers": {column: sorted(Counter(run.merges[column].tolist()).items()) for column in ("without x", "with x")},
        "rows": run.merges.value_counts(["without x", "with x", "together"]).reset_index().to_dict("records"),
    }


def _mark(number: int) -> Markup:
    """Return the marker of a class as a small inline SVG, the same as in the figures."""
    style = plots.class_style(number)
    marker = MarkerStyle(style.marker)
    outline = marker.get_path().transformed(marker.get_transform())
    polygons = [np.asarray(polygon) * (1, -1) for polygon in outline.to_polygons()]
    reach = max(float(np.abs(polygon).max()) for polygon in polygons)
    points = " ".join(
        "M" + "L".join(f"{x / reach:.2f} {y / reach:.2f}" for x, y in polygon) + "Z" for polygon in polygons
    )
    return Markup(
        '<svg class="mark" viewBox="-1.1 -1.1 2.2 2.2" aria-hidden="true"><path fill="{}" d="{}"/></svg>'
    ).format(style.color, points)
