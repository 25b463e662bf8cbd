"""Predictions: the reader commits to a guess, then sees the answer and how the guess compares."""

from __future__ import annotations

import html
import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import pandas as pd

if TYPE_CHECKING:
    import ipywidgets

CLOSE = 0.1
""" A guess of a number is called right if it is off by at most this share of the answer """
_BOX = "border-left:4px solid #0072B2;padding:.3em .9em;margin:.4em 0;max-width:48em"
_made: dict[str, Prediction] = {}


def predict(
    question: str,
    answer: Any,
    choices: Sequence[str] | None = None,
    *,
    unit: str = "",
    because: str = "",
    close: float = CLOSE,
    guess: Any = None,
) -> Prediction:
    """Ask before showing. In a notebook, the question has a field and a button; without widgets, give ``guess``.

    Parameters
    ----------
    question : str
        What is asked.
    answer : number, str or callable
        The answer, or a function without arguments that works it out when it is needed; with ``choices`` one of them.
    choices : sequence of str, optional
        What can be chosen; by default a number is asked for.
    unit : str
        The unit of the number.
    because : str
        A sentence that explains the answer, shown with it.
    close : float
        A number is right if it is off by at most this share of the answer.
    guess : number or str, optional
        The guess, where no widget can ask for it.

    Returns
    -------
    Prediction

    Raises
    ------
    ValueError
        If ``answer`` is not among the choices.

    Examples
    --------
    >>> predict("How many steps do the stairs have?", answer=4, guess=5)
    How many steps do the stairs have? You said 5, it is 4: 25 % too high.
    """
    prediction = Prediction(question, answer, choices, unit, because, close)
    if guess is not None:
        prediction.commit(guess)
    _made[question] = prediction
    return prediction


def my_predictions() -> pd.DataFrame:
    """Return the predictions of this session: question, guess, answer, and how they compare (only where a guess was made)."""
    rows = [
        {"question": made.question, "guess": made.guess, "answer": made.answer, "verdict": made.verdict}
        for made in _made.values()
        if made.guess is not None
    ]
    return pd.DataFrame(rows, columns=["question", "guess", "answer", "verdict"])


class Prediction:
    """A question, its answer, and the reader's guess. Made by ``predict``.

    Attributes
    ----------
    question : str
        What is asked.
    guess : float, str or None
        The reader's guess; the first one counts.
    """

    def __init__(
        self,
        question: str,
        answer: Any | Callable[[], Any],
        choices: Sequence[str] | None,
        unit: str,
        because: str,
        close: float,
    ) -> None:
        self.question = question
        self.choices = None if choices is None else list(choices)
        self.unit = unit
        self.because = because
        self.close = close
        self.guess: Any = None
        self._answer = answer
        if not callable(answer):
            self._checked(answer)

    @property
    def answer(self) -> Any:
        """The answer; worked out now if it was given as a function."""
        if callable(self._answer):
            self._answer = self._checked(self._answer())
        return self._answer

    def _checked(self, answer: Any) -> Any:
        if self.choices is not None and answer not in self.choices:
            raise ValueError(f"answer must be one of the choices {self.choices}, not {answer!r}.")
        return answer

    def commit(self, guess: float | str) -> str:
        """Record a guess, and say how it compares.

        Raises
        ------
        ValueError
            If the guess is neither a number nor one of the choices.
        """
        if self.choices is None:
            try:
                guess = float(guess)
            except (TypeError, ValueError):
                guess = math.nan
            if not math.isfinite(guess):
                raise ValueError("guess must be a number.")
        elif guess not in self.choices:
            raise ValueError(f"guess must be one of {self.choices}, not {guess!r}.")
        _ = self.answer  # worked out before the guess is recorded, as it may fail
        if self.guess is None:
            self.guess = guess
        return self.reply

    @property
    def verdict(self) -> str:
        """How the guess compares: "right", "not this one", or how far off it is."""
        if self.choices is not None:
            return "right" if self.guess == self.answer else "not this one"
        off = self.guess - self.answer
        if abs(off) <= self.close * abs(self.answer) + 1e-12:
            return "right" if off == 0 else "close enough to call it right"
        way = "too high" if off > 0 else "too low"
        if self.answer == 0 or self.answer * self.guess < 0:
            return way
        factor = max(self.guess / self.answer, self.answer / self.guess) if self.guess else math.inf
        return f"{abs(off / self.answer):.0%} {way}".replace("%", " %") if factor < 3 else f"{way}, {_times(factor)}"

    @property
    def reply(self) -> str:
        """What the reader is told."""
        if self.guess is None:
            return f"{self.question} Write your guess down, then run the cell with guess=..."
        said, answer = self._with_unit(self.guess), self._with_unit(self.answer)
        return " ".join(filter(None, [f"You said {said}, it is {answer}: {self.verdict}.", self.because]))

    def _with_unit(self, value: Any) -> str:
        text = value if isinstance(value, str) else f"{float(value):.4g}"
        return f"“{text}”" if self.choices else f"{text} {self.unit}".strip()

    def __repr__(self) -> str:
        return self.reply if self.guess is None else f"{self.question} {self.reply}"

    def _repr_html_(self) -> str:
        """Show the question, and the answer folded: for pages without a kernel."""
        choices = "".join(f"<li>{html.escape(choice)}</li>" for choice in self.choices or [])
        answer = html.escape(" ".join(filter(None, [f"It is {self._with_unit(self.answer)}.", self.because])))
        return (
            f'<div style="{_BOX}"><strong>Predict.</strong> {html.escape(self.question)}<ul>{choices}</ul>'
            f"<details><summary>I have a guess: show the answer</summary><p>{answer}</p></details></div>"
        )

    def widget(self) -> ipywidgets.Widget:
        """Return the live widget.

        Raises
        ------
        ImportError
            If ipywidgets is not installed.
        """
        import ipywidgets

        wide = ipywidgets.Layout(width="auto")
        if self.choices is None:
            field = ipywidgets.Text(
                placeholder=f"a number{f' [{self.unit}]' if self.unit else ''}", description="my guess"
            )
        else:
            field = ipywidgets.RadioButtons(options=self.choices, value=None, layout=wide)
        button = ipywidgets.Button(description="That is my guess", button_style="primary")
        reply = ipywidgets.HTML()

        def commit(_: Any) -> None:
            try:
                words = self.commit(field.value)
            except ValueError:
                words = "Choose one first." if self.choices else "Write a number first."
            else:
                field.disabled = button.disabled = True
            reply.value = f'<p aria-live="polite">{html.escape(words)}</p>'

        button.on_click(commit)
        question = ipywidgets.HTML(f"<strong>Predict.</strong> {html.escape(self.question)}")
        return ipywidgets.VBox(
            [question, field, button, reply], layout=ipywidgets.Layout(border_left="4px solid #0072B2", padding="0 1em")
        )

    def _repr_mimebundle_(self, **_: Any) -> dict[str, Any]:
        if self.guess is not None:
            return {"text/plain": repr(self)}
        shown = {"text/plain": repr(self), "text/html": self._repr_html_()}
        try:
            return self.widget()._repr_mimebundle_() | shown
        except ImportError:
            return shown


def _times(factor: float) -> str:
    return "by far" if math.isinf(factor) else f"by a factor of {factor:.2g}"
