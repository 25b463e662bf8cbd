"""How an answer is judged: try it on several inputs, compare, and name the usual mistakes; nothing that it does can break a check."""

from __future__ import annotations

import copy
import ctypes
import html
import inspect
import threading
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

TIME_LIMIT = 10.0
""" A function that takes longer for one input is stopped [s] """
RTOL, ATOL = 1e-6, 1e-9
""" Numbers that differ by less are the same """
LONGEST = 160
""" Inputs and results are shown with so many characters, at most """


@dataclass(frozen=True)
class Verdict:
    """What a check says of an answer.

    Attributes
    ----------
    right : bool
        Whether the answer is right; a verdict is as true as this.
    words : str
        One or two sentences for the reader.
    """

    right: bool
    words: str

    def __bool__(self) -> bool:
        return self.right

    def __repr__(self) -> str:
        return self.words

    def _repr_html_(self) -> str:
        color, mark = ("#009E73", "✓") if self.right else ("#D55E00", "✗")
        return (
            f'<div role="status" style="border-left:4px solid {color};padding:.2em .9em;max-width:48em">'
            f"<strong>{mark}</strong> {html.escape(self.words)}</div>"
        )


@dataclass(frozen=True)
class Mistake:
    """A usual mistake: what it is called, and a function that makes it.

    Attributes
    ----------
    words : str
        What the reader is told, such as "This is the variance; the standard deviation is its square root."
    function : callable
        The exercise's function with this mistake. An answer that gives what it gives, for every input, has made it.
    """

    words: str
    function: Callable[..., Any]


@dataclass(frozen=True)
class Attempt:
    """What came of calling a function: its value, or a sentence that says what went wrong."""

    value: Any = None
    problem: str = ""


class _Stopped(BaseException):
    """Raised inside a function that takes too long."""


def judge(
    name: str,
    function: Any,
    right: Callable[..., Any],
    cases: Sequence[tuple[Any, ...]],
    mistakes: Sequence[Mistake],
    praise: str = "",
    *,
    time_limit: float = TIME_LIMIT,
) -> Verdict:
    """Judge a function by what it returns.

    Parameters
    ----------
    name : str
        What the exercise calls the function.
    function : callable
        The answer.
    right : callable
        The solution.
    cases : sequence of tuple
        The inputs: the arguments of each call.
    mistakes : sequence of Mistake
        Usual mistakes, the first that fits is named.
    praise : str
        What to say of a right answer, after "Right.".
    time_limit : float
        Time for each input [s].

    Returns
    -------
    Verdict
        Never an error because of what ``function`` is or does.
    """
    came: list[Any] = []
    for case in cases:
        given = copy.deepcopy(case)
        attempt = attempt_call(name, function, given, time_limit)
        if attempt.problem:
            return Verdict(False, attempt.problem)
        if not same(given, case):
            return Verdict(False, f"Not yet: {name} changes its input {described(case)}. Work on a copy.")
        came.append(attempt.value)
    expected = [right(*copy.deepcopy(case)) for case in cases]
    wrong = [i for i in range(len(cases)) if not same(came[i], expected[i])]
    if not wrong:
        return Verdict(True, f"Right. {praise}".strip())
    for mistake in mistakes:
        if all(_gives(mistake.function, cases[i], came[i]) for i in range(len(cases))):
            return Verdict(False, f"Not yet. {mistake.words}")
    i = wrong[0]
    return Verdict(
        False,
        f"Not yet: for {name}{described(cases[i])} came {described(came[i])}, expected was {described(expected[i])}.",
    )


def attempt_call(name: str, function: Any, arguments: tuple[Any, ...], time_limit: float = TIME_LIMIT) -> Attempt:
    """Call ``function``; whatever happens, come back with its value or with a sentence that says what went wrong.

    Parameters
    ----------
    name : str
        What the exercise calls the function.
    function : callable
        What a student wrote.
    arguments : tuple
        The arguments.
    time_limit : float
        A call that takes longer is stopped [s].

    Returns
    -------
    Attempt
    """
    if not callable(function):
        return Attempt(problem=f"Give the function itself, as in check_{name}({name}), not {described(function)}.")
    if problem := _wrong_arguments(name, function, len(arguments)):
        return Attempt(problem=problem)
    outcome: list[Attempt] = []

    def call() -> None:
        try:
            value = function(*arguments)
        except NotImplementedError as error:
            outcome.append(Attempt(problem=_not_written(name, function, str(error))))
        except _Stopped:
            pass
        except BaseException as error:  # also sys.exit() and the like
            outcome.append(Attempt(problem=_words_of(name, arguments, error)))
        else:
            outcome.append(
                Attempt(value)
                if value is not None
                else Attempt(
                    problem=f"Not yet: {name}{described(arguments)} returned nothing. Is there a return at its end?"
                )
            )

    thread = threading.Thread(target=call, daemon=True, name=f"check of {name}")
    thread.start()
    thread.join(time_limit)
    if thread.is_alive():
        ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread.ident or 0), ctypes.py_object(_Stopped))
    if outcome:
        return outcome[0]
    return Attempt(
        problem=f"Not yet: {name}{described(arguments)} was not done after {time_limit:g} s. Is there a loop that does not end?"
    )


def _not_written(name: str, function: Callable[..., Any], stub: str) -> str:
    """Say which exercise is not written: this one, or another function of the notebook that it calls."""
    if stub != name and callable(getattr(function, "__globals__", {}).get(stub)):
        return f"Not yet: {name} calls {stub}, which is not written yet. That exercise comes first."
    return f"{name} is not written yet: it is your turn."


def same(a: Any, b: Any) -> bool:
    """Whether two results are the same: numbers up to rounding, arrays with their shape, and what is in tuples, lists, dicts."""
    if isinstance(a, (tuple, list)) and isinstance(b, (tuple, list)) and _nested(a, b):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, (str, type(None))) or isinstance(b, (str, type(None))):
        return bool(a == b) if isinstance(a, str) and isinstance(b, str) else a is b
    try:
        x, y = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    except Exception:  # not numbers, or too large, or an object of a student's that fails
        return bool(a is b or (type(a) is type(b) and _equal(a, b)))
    return x.shape == y.shape and bool(np.allclose(x, y, rtol=RTOL, atol=ATOL, equal_nan=True))


def described(value: Any) -> str:
    """Return a value as a reader wants to see it: short, numbers with four digits."""
    try:
        if isinstance(value, tuple):
            text = f"({', '.join(described(part) for part in value)})"
        elif isinstance(value, np.ndarray):
            text = " ".join(np.array2string(value, precision=4, separator=", ", threshold=12, edgeitems=3).split())
        elif isinstance(value, (float, np.floating)):
            text = f"{value:.6g}"
        else:
            text = repr(value)
    except Exception:  # a student's class may have a __repr__ that fails
        text = f"a {type(value).__name__}"
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 2]} …"


def _nested(a: Any, b: Any) -> bool:
    """Whether two sequences hold more than plain numbers."""
    return any(not np.isscalar(x) or isinstance(x, str) for x in (*a, *b)) or type(a) is type(b) is tuple


def _equal(a: Any, b: Any) -> bool:
    try:
        return bool(a == b)
    except Exception:
        return False


def _gives(function: Callable[..., Any], case: tuple[Any, ...], came: Any) -> bool:
    """Whether a mistaken function gives what came; where it cannot be computed, it does not."""
    try:
        with np.errstate(all="ignore"):
            return same(function(*copy.deepcopy(case)), came)
    except Exception:
        return False


def _wrong_arguments(name: str, function: Callable[..., Any], wanted: int) -> str:
    try:
        inspect.signature(function).bind(*[None] * wanted)
    except TypeError:
        return f"{name} must take {wanted} argument{'s' if wanted != 1 else ''}; this one has {inspect.signature(function)}."
    except ValueError:
        pass  # some built-in functions have no signature
    return ""


def _words_of(name: str, arguments: tuple[Any, ...], error: BaseException) -> str:
    try:
        said = str(error)
    except Exception:  # an error whose own words fail
        said = ""
    frames = traceback.extract_tb(error.__traceback__)[1:]
    line = f" in line {frames[0].lineno} of its cell" if frames else ""
    said = f": {said}" if said else ""
    return f"Not yet: {name}{described(arguments)} raised {type(error).__name__}{line}{said[:LONGEST]}"
