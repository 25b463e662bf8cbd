"""Sliders on a function that draws: ipywidgets in a notebook, a ``Player`` of pictures made beforehand everywhere else."""

from __future__ import annotations

import html
import inspect
import itertools
import os
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from stairlab.course.player import DPI, Control, Player, shown
from stairlab.drawing import alt_text, img, quick_png

if TYPE_CHECKING:
    import ipywidgets

WITHOUT_KERNEL = "STAIRLAB_BOOK"
""" Where this environment variable is set, explorations show also what reacts without a kernel """
MOST_PICTURES = 30
""" Pictures made beforehand for one exploration, at most """
FEW = 5
""" Up to so many named choices are buttons, more a slider, which follows the keyboard as a list in a notebook does not """


def explore(
    draw: Callable[..., Figure], labels: Mapping[str, str] | None = None, /, **controls: Sequence[Any] | np.ndarray
) -> Exploration:
    """Put controls on ``draw``: each keyword gives the values of one of its arguments.

    Parameters
    ----------
    draw : callable
        Returns a figure, with its alternative text, and has a default for each argument that is controlled: the value at the start.
    labels : mapping of str to str, optional
        What controls are called, with unit; their argument's name by default.
    **controls : sequence
        The values of an argument: numbers and many words become a slider, few words buttons, ``(False, True)`` a box to tick.

    Returns
    -------
    Exploration

    Raises
    ------
    ValueError
        If ``draw`` lacks such an argument or its default, the default is not among the values, or there is no control.

    Examples
    --------
    >>> explore(draw_jump, magnitude=range(50, 1001, 25), angle=range(1, 90))  # doctest: +SKIP
    """
    return Exploration(draw, labels or {}, controls)


class Live:
    """What is live where a kernel runs, and a ``Player`` of pictures made beforehand where none does."""

    def widget(self) -> ipywidgets.Widget:
        """Return the live widget."""
        raise NotImplementedError

    def player(self) -> Player:
        """Return what needs no kernel."""
        raise NotImplementedError

    def _repr_mimebundle_(self, **_: Any) -> dict[str, Any]:
        try:
            bundle = self.widget()._repr_mimebundle_()
        except ImportError:
            return {"text/plain": repr(self), "text/html": self.player()._repr_html_()}
        if os.environ.get(WITHOUT_KERNEL):
            bundle["text/html"] = self.player()._repr_html_()
        return bundle


class Exploration(Live):
    """A function that draws, and controls on its arguments. Made by ``explore``.

    Attributes
    ----------
    draw : callable
        The function.
    choices : dict of str to list
        The values of each argument.
    start : dict of str to object
        The values at the start.
    """

    def __init__(
        self, draw: Callable[..., Figure], labels: Mapping[str, str], controls: Mapping[str, Sequence[Any] | np.ndarray]
    ) -> None:
        self.draw = draw
        self.choices = {name: _plain(values) for name, values in controls.items()}
        self.labels = {name: labels.get(name, name.replace("_", " ")) for name in self.choices}
        self.start = {name: _default(draw, name, values) for name, values in self.choices.items()}
        if not self.choices:
            raise ValueError("explore needs a control: explore(draw, angle=range(1, 90)).")

    def __repr__(self) -> str:
        return f"Exploration of {', '.join(self.choices)}"

    def player(self, most: int = MOST_PICTURES) -> Player:
        """Return a player that needs no kernel, of at most ``most`` pictures: each slider has some of its values."""
        chosen = _thinned(self.choices, self.start, most)
        figures = (
            self.draw(**dict(zip(chosen, values, strict=True))) for values in itertools.product(*chosen.values())
        )
        controls = [
            Control(self.labels[name], [shown(value) for value in values], values.index(self.start[name]))
            for name, values in chosen.items()
        ]
        return Player(figures, controls)

    def widget(self) -> ipywidgets.Widget:
        """Return the live widget, which calls ``draw`` with each new value.

        Raises
        ------
        ImportError
            If ipywidgets is not installed.
        """
        import ipywidgets

        picture = ipywidgets.HTML()
        controls = {
            name: _control(ipywidgets, self.labels[name], self.choices[name], self.start[name]) for name in self.choices
        }

        def redraw(_: Any = None) -> None:
            try:
                figure = self.draw(**{name: control.value for name, control in controls.items()})
            except Exception as error:  # a callback's exception would be lost in a log
                picture.value = f"<pre>{html.escape(f'{type(error).__name__}: {error}')}</pre>"
                raise
            picture.value = img(quick_png(figure, DPI), alt_text(figure), DPI)

        for control in controls.values():
            control.observe(redraw, "value")
        redraw()
        return ipywidgets.VBox([*controls.values(), picture])


def _plain(values: Sequence[Any] | np.ndarray) -> list[Any]:
    """Return values as a list of Python's own numbers."""
    return values.tolist() if isinstance(values, np.ndarray) else list(values)


def _default(draw: Callable[..., Figure], name: str, values: list[Any]) -> Any:
    parameter = inspect.signature(draw).parameters.get(name)
    if parameter is None or parameter.default is inspect.Parameter.empty:
        raise ValueError(f"draw must have an argument {name} with a default, to start from.")
    if parameter.default not in values:
        raise ValueError(f"{name} starts at its default {parameter.default!r}, which is not among its values {values}.")
    return parameter.default


def _thinned(choices: dict[str, list[Any]], start: dict[str, Any], most: int) -> dict[str, list[Any]]:
    """Leave out values, evenly, of the control that has most, until there are at most ``most`` combinations; the start stays."""
    counts = {name: len(values) for name, values in choices.items()}
    while np.prod(list(counts.values())) > most:
        counts[max(counts, key=lambda name: counts[name])] -= 1
    chosen = {}
    for name, values in choices.items():
        at = values.index(start[name])
        places = np.round(np.linspace(0, len(values) - 1, counts[name])).astype(int)
        places[np.abs(places - at).argmin()] = at
        chosen[name] = [values[place] for place in sorted(set(places.tolist()))]
    return chosen


def _control(ipywidgets: Any, label: str, values: list[Any], start: Any) -> ipywidgets.Widget:
    style = {"description_width": "initial"}
    if all(isinstance(value, bool) for value in values):
        return ipywidgets.Checkbox(value=start, description=label, style=style, indent=False)
    options = [(shown(value), value) for value in values]
    if isinstance(values[0], str) and len(values) <= FEW:
        return ipywidgets.ToggleButtons(options=options, value=start, description=label, style=style)
    layout = ipywidgets.Layout(width="32em", max_width="95%")
    return ipywidgets.SelectionSlider(
        options=options, value=start, description=label, style=style, layout=layout, continuous_update=False
    )
