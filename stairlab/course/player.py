"""Pictures made beforehand, under a slider: what reacts where no kernel runs, and how animations are played."""

from __future__ import annotations

import base64
import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.figure import Figure

from stairlab.drawing import alt_text, shown_width, small_png

DPI = 110
""" Resolution of a picture, under a slider or live [dots per inch] """
_numbers = itertools.count(1)


@dataclass(frozen=True)
class Control:
    """What a slider chooses from.

    Attributes
    ----------
    label : str
        What it is called, with its unit.
    values : sequence of str
        The values as they are shown.
    start : int
        The place of the value that is shown first.
    """

    label: str
    values: Sequence[str]
    start: int = 0


class Player:
    """Pictures under one or more sliders; with one slider, they can be played, paused and stepped through. No kernel needed.

    Parameters
    ----------
    figures : iterable of matplotlib Figure
        A figure for each combination of the controls' values, the last control's varying fastest. Each has its alternative text.
    controls : sequence of Control
        The sliders.
    seconds : float
        How long each picture is shown when played [s].

    Raises
    ------
    ValueError
        If the number of figures does not fit the controls, or one lacks its alternative text.
    """

    def __init__(self, figures: Iterable[Figure], controls: Sequence[Control], seconds: float = 0.8) -> None:
        self.controls = list(controls)
        self.seconds = seconds
        self.pictures = [(small_png(figure, DPI, cut=False), alt_text(figure)) for figure in figures]
        wanted = math.prod(len(control.values) for control in self.controls)
        if len(self.pictures) != wanted or not wanted:
            raise ValueError(
                f"figures must be one for each combination of the controls' values, {wanted} in all, not {len(self.pictures)}."
            )

    def __len__(self) -> int:
        return len(self.pictures)

    def __repr__(self) -> str:
        return f"Player of {len(self)} pictures: {', '.join(control.label for control in self.controls)}"

    def _repr_html_(self) -> str:
        start = 0
        for control in self.controls:
            start = start * len(control.values) + control.start
        width = max(shown_width(data, DPI) for data, _ in self.pictures)
        return _TEMPLATE.render(
            id=f"stairlab-player-{next(_numbers)}",
            controls=self.controls,
            start=start,
            width=width,
            milliseconds=round(1000 * self.seconds),
            pictures=[
                {"src": f"data:image/png;base64,{base64.b64encode(data).decode()}", "alt": alt}
                for data, alt in self.pictures
            ],
        )


def animate(draw: Callable[..., Figure], steps: Iterable[Any], label: str = "step", seconds: float = 0.8) -> Player:
    """Draw ``draw(step)`` for each step, to be played, paused and stepped through.

    Parameters
    ----------
    draw : callable
        Takes a step and returns a figure with its alternative text.
    steps : iterable
        What ``draw`` is called with, one after the other. A step that is a number is shown as it is, others are counted from 0.
    label : str
        What a step is called.
    seconds : float
        How long each picture is shown [s].

    Returns
    -------
    Player
    """
    steps = list(steps)
    names = [shown(step) if isinstance(step, (int, float, str)) else str(i) for i, step in enumerate(steps)]
    return Player((draw(step) for step in steps), [Control(label, names)], seconds)


def shown(value: Any) -> str:
    """Return a control's value as it is shown."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return value if isinstance(value, str) else f"{value:.4g}"


_TEMPLATE = Environment(
    loader=PackageLoader("stairlab"), undefined=StrictUndefined, autoescape=True, trim_blocks=True, lstrip_blocks=True
).get_template("player.html.jinja")
