"""One small run of the pipeline, its pictures and its report, made once for all tests that look at them."""

from functools import cache
from typing import Any

from stairlab.pipeline import Run, run_pipeline
from stairlab.report import Picture, draw_figures, figures, render

ARGUMENTS: dict[str, Any] = {"n": 300, "seed": 0, "replays": 3, "progress": False}


@cache
def small_run() -> Run:
    return run_pipeline(**ARGUMENTS)


@cache
def pictures() -> dict[str, Picture]:
    return draw_figures(figures(small_run()))


@cache
def page() -> str:
    return render(small_run(), pictures())
