"""Files that appear whole or not at all, and tables read with the line and column at fault."""

from __future__ import annotations

import csv
import io
import os
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple, TextIO

import numpy as np


def write_bytes(path: str | os.PathLike[str], data: bytes) -> None:
    """Write a file so that it appears whole or not at all: into a temporary file beside it, then renamed."""
    path = Path(path)
    temporary = ""
    try:
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        with open(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())  # on the disk before it has its name, whatever happens then
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except BaseException as error:
        if temporary:
            Path(temporary).unlink(missing_ok=True)
        if isinstance(error, OSError) and error.errno:
            raise OSError(error.errno, error.strerror, os.fspath(path)) from None
        raise


def write_whole(path: str | os.PathLike[str], write: Callable[[TextIO], object]) -> None:
    """Write a text file with ``write(file)`` so that it appears whole or not at all."""
    text = io.StringIO(newline="")
    write(text)
    write_bytes(path, text.getvalue().encode())


class Table(NamedTuple):
    """A CSV file: its column names, its rows, and its comments, each with the number of its line."""

    name: str
    header_line: int
    header: list[str]
    rows: list[tuple[int, list[str]]]
    comments: list[tuple[int, str]]

    def numbers(
        self,
        columns: Sequence[str],
        flags: Sequence[str] = (),
        limits: Mapping[str, tuple[float, float]] | None = None,
    ) -> np.ndarray:
        """Return named columns of finite numbers (and of True or False), shape (n_rows, n_columns).

        Raises
        ------
        ValueError
            If a column is missing, or a cell is not what it should be or outside its limits, with the line and column at fault.
        """
        if missing := [column for column in columns if column not in self.header]:
            raise ValueError(
                f"{self.name}, line {self.header_line}: the column{'s'[: len(missing) > 1]} {', '.join(missing)} must be there; "
                f"found {', '.join(self.header)}."
            )
        values = np.empty((len(self.rows), len(columns)))
        for row, (line, cells) in enumerate(self.rows):
            for place, column in enumerate(columns):
                text = cells[self.header.index(column)]
                values[row, place] = self._cell(line, column, text, column in flags, (limits or {}).get(column))
        return values

    def _cell(self, line: int, column: str, text: str, flag: bool, limits: tuple[float, float] | None) -> float:
        try:
            value = float({"true": 1, "false": 0}[text.strip().lower()]) if flag else float(text)
        except (KeyError, ValueError):
            value = np.nan
        low, high = limits or (-np.inf, np.inf)
        if not np.isfinite(value) or not low <= value <= high:
            expected = (
                "True or False" if flag else f"a number from {low:g} to {high:g}" if limits else "a finite number"
            )
            raise ValueError(f"{self.name}, line {line}, column {column}: expected {expected}, found {text!r}.")
        return value


def read_table(path: str | os.PathLike[str]) -> Table:
    """Read a CSV file with a line of column names; lines that begin with # are comments.

    Raises
    ------
    ValueError
        If it is not such a file; the message names the file and the line.
    OSError
        If it cannot be read.
    """
    name = os.fspath(path)
    try:
        text = Path(path).read_bytes().decode("utf-8-sig")  # a byte order mark is no part of a name
        reader = csv.reader(io.StringIO(text, newline=""))
        lines = [(reader.line_num, cells) for cells in reader if cells and not cells[0].startswith("#")]
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{name} is not a CSV file: {error}.") from None
    comments = [(number, line) for number, line in enumerate(text.splitlines(), 1) if line.startswith("#")]
    if len(lines) < 2:
        lacks = "has no row" if lines else "is empty"
        raise ValueError(f"{name} must hold a line of column names and at least one row, but it {lacks}.")
    (header_line, header), *rows = lines
    for line, cells in rows:
        if len(cells) != len(header):
            raise ValueError(
                f"{name}, line {line}: expected {len(header)} cells, found {len(cells)}. Is the file cut off?"
            )
    return Table(name, header_line, header, rows, comments)
