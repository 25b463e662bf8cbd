"""What all figures share: their palette, the figure that a notebook shows with its words, axes, legends, and files."""

from __future__ import annotations

import base64
import html
import io
import math
import os
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from PIL import Image

from stairlab._files import write_bytes

DPI = 150
""" Resolution of pictures in files [dots per inch] """
SHOWN_DPI = 90
""" Size of pictures in notebooks: so many pixels of CSS are an inch """
PALETTE = 128
""" Colours of a small picture """
TIGHT: dict[str, Any] = {"bbox_inches": "tight", "pad_inches": 0.08}
""" Cut pictures to what is drawn: nothing is clipped, and there is no empty rim """
INK = "#222222"
FAINT = "#8a8a8a"
GRID = "#e5e5e5"
STAIRS = "#d9d4cc"
CUBE = "#40c8c0"
PATH = "#c0392b"
OFF_MAP = "#c4c4c4"
COLORS = (
    "#56B4E9",
    "#0072B2",
    "#009E73",
    "#E69F00",
    "#D55E00",
    "#CC79A7",
    "#332288",
    "#999933",
    "#882255",
    "#000000",
)
""" Colours of classes 1 to 10, after Okabe and Ito, and Tol: told apart with any colour vision """
BELOW = 4.4
""" Distance of a legend below its axes, with room for ticks and label [font sizes] """


class Picture(Figure):
    """A figure that a notebook shows once, with its alternative text (and as a plain picture after ``%matplotlib inline`` too)."""

    def _repr_html_(self) -> str:
        return img(small_png(self), alt_text(self))


def new_figure(
    alt: str, panels: int = 1, size: tuple[float, float] = (6.4, 3.6), columns: int = 3
) -> tuple[Figure, Any]:
    """Return an empty figure that a notebook shows with its alternative text, and its axes.

    Parameters
    ----------
    alt : str
        What the figure will show, in words, for those who cannot see it.
    panels : int
        Number of axes.
    size : tuple of float
        Width and height [inches].
    columns : int
        Panels in a row, at most.

    Returns
    -------
    figure : matplotlib Figure
        Make it the last expression of the cell.
    axes : matplotlib Axes or list of them
        One for each panel; without a list if there is one.

    Raises
    ------
    ValueError
        If ``alt`` says nothing, or there are no panels.
    """
    if not isinstance(alt, str) or not alt.strip():
        raise ValueError(f"alt must say in words what the figure shows, not {alt!r}.")
    if panels < 1 or columns < 1:
        raise ValueError(f"panels and columns must be at least 1, not {panels} and {columns}.")
    axes = make_axes(None, panels, size, min(panels, columns))
    for ax in axes:
        ax.spines[["top", "right"]].set_visible(False)
        ax.set_prop_cycle(color=COLORS[1:])
    return finish(axes[0], alt), axes if panels > 1 else axes[0]


def png(figure: Figure, dpi: int = DPI) -> bytes:
    """Return a figure as a PNG file's bytes; equal figures give equal bytes."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=dpi, metadata={"Software": None}, **TIGHT)
    return buffer.getvalue()


def small_png(figure: Figure, dpi: int = DPI, *, cut: bool = True) -> bytes:
    """Return a figure as the bytes of a PNG file with a palette, a third as large; uncut where several must have one size."""
    picture = Image.open(io.BytesIO(png(figure, dpi) if cut else quick_png(figure, dpi))).convert("RGB")
    buffer = io.BytesIO()
    picture.quantize(PALETTE, dither=Image.Dither.NONE).save(buffer, format="PNG")
    return buffer.getvalue()


def quick_png(figure: Figure, dpi: int = DPI) -> bytes:
    """Return a figure as a PNG file's bytes, laid out for good, uncut, hardly compressed: in half the time, for sliders."""
    engine = figure.get_layout_engine()
    if engine is not None:  # matplotlib would draw it twice
        engine.execute(figure)
        figure.set_layout_engine(None)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=dpi, pil_kwargs={"compress_level": 1})
    return buffer.getvalue()


def img(data: bytes, alt: str, dpi: int = DPI) -> str:
    """Return the HTML element of a PNG picture with its alternative text, sharp on fine screens."""
    return (
        f'<img alt="{html.escape(alt)}" width="{shown_width(data, dpi)}" style="max-width:100%;height:auto" '
        f'src="data:image/png;base64,{base64.b64encode(data).decode()}">'
    )


def shown_width(data: bytes, dpi: int = DPI) -> int:
    """Return how wide a PNG picture is shown [CSS pixels]."""
    return int.from_bytes(data[16:20], "big") * SHOWN_DPI // dpi


def save_figure(figure: Figure, path: str | os.PathLike[str], dpi: int = DPI) -> None:
    """Write a figure to a file, in the format that its name ends in (.png, .svg, .pdf); it appears whole or not at all.

    Raises
    ------
    ValueError
        If matplotlib knows no such format.
    """
    buffer = io.BytesIO()
    figure.savefig(buffer, format=Path(path).suffix[1:] or "png", dpi=dpi, **TIGHT)
    write_bytes(path, buffer.getvalue())


def alt_text(figure: Figure) -> str:
    """Return what a figure of this package shows, in words, for those who cannot see it.

    Raises
    ------
    ValueError
        If it has no such text, as a figure of another origin.
    """
    text = getattr(figure, "stairlab_alt", "")
    if not text:
        raise ValueError(
            "figure must be one that a function of stairlab has drawn, or new_figure has made; this one has no alternative text."
        )
    return text


def expect(name: str, value: Any, kind: Any) -> Any:
    """Return ``value`` if it is of the type ``kind``, or of one of several."""
    if not isinstance(value, kind):
        wanted = " or ".join(one.__name__ for one in (kind if isinstance(kind, tuple) else (kind,)))
        raise TypeError(f"{name} must be {wanted}, not {type(value).__name__}.")
    return value


def make_axes(given: Any, count: int, size: tuple[float, float], columns: int = 1) -> list[Axes]:
    """Return ``count`` axes: those given, or those of a new figure; unused places of its grid stay empty."""
    if given is not None:
        panels = [given] if isinstance(given, Axes) else list(np.ravel(given))
        if len(panels) != count or not all(isinstance(panel, Axes) for panel in panels):
            raise ValueError(f"axes must be {count} matplotlib Axes, one for each panel, not {given!r}.")
        return panels
    figure = Picture(figsize=size, layout="constrained")
    grid = figure.subplots(math.ceil(count / columns), columns, squeeze=False).ravel()
    for unused in grid[count:]:
        unused.remove()
    return list(grid[:count])


def marker_handle(color: str, marker: str, words: str, **style: Any) -> Line2D:
    """Return a marker as a legend shows it."""
    drawn = {"markersize": 7, "markeredgewidth": 0} | style
    return Line2D([], [], linestyle="none", color=color, marker=marker, label=words, **drawn)


def legend_below(ax: Axes, **style: Any) -> None:
    """Draw the legend of one panel below its axes."""
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, 0), borderaxespad=BELOW, frameon=False, fontsize=9, **style)


def figure_legend(ax: Axes, handles: list[Any], where: str, ncols: int) -> None:
    """Draw one legend for the whole figure: outside the panels where the figure's layout makes room for it."""
    makes_room = isinstance(ax.figure.figure.get_layout_engine(), ConstrainedLayoutEngine)
    place: dict[str, Any] = {"loc": f"outside {where}" if makes_room else where}
    ax.figure.legend(handles=handles, ncols=ncols, frameon=False, fontsize=9, handletextpad=0.2, **place)


def finish(ax: Axes, alt: str) -> Figure:
    """Return the figure that ``ax`` is part of, with its alternative text."""
    figure: FigureBase = ax.figure
    while not isinstance(figure, Figure):  # a SubFigure
        figure = figure.figure
    before = getattr(figure, "stairlab_alt", "")
    setattr(figure, "stairlab_alt", f"{before} {alt}".strip())  # noqa: B010
    return figure
