"""How an answer is judged: whatever a student wrote, the check answers in a sentence."""

import sys

import numpy as np
import pytest

from stairlab.checks import _judge
from stairlab.checks._judge import Mistake, Verdict, attempt_call, described, judge, same


def double(x):
    return 2 * x


SQUARED = Mistake("This is the square.", lambda x: x**2)
CASES = [(3.0,), (5.0,)]


def verdict(function, **options) -> Verdict:
    return judge("double", function, double, CASES, [SQUARED], "Well done.", **options)


def test_the_solution_is_right():
    assert verdict(double)
    assert repr(verdict(double)) == "Right. Well done."


def test_a_usual_mistake_is_named():
    assert repr(verdict(lambda x: x * x)) == "Not yet. This is the square."


def test_another_mistake_is_shown_by_its_first_case():
    assert repr(verdict(lambda x: x + 1)) == "Not yet: for double(3) came 4, expected was 6."


def forever(x):
    while True:
        pass


def endless(x):
    return endless(x)


class Odd:
    def __repr__(self):
        raise RuntimeError

    def __eq__(self, other):
        raise RuntimeError

    __hash__ = None


def fails_badly(x):
    class Mute(Exception):
        def __str__(self):
            raise ValueError

    raise Mute


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (None, "Give the function itself"),
        (3, "Give the function itself"),
        (lambda: 1, "must take 1 argument"),
        (lambda x, y: 1, "must take 1 argument"),
        (lambda x: None, "Is there a return"),
        (lambda x: 1 / 0, "raised ZeroDivisionError"),
        (lambda x: sys.exit(), "raised SystemExit"),
        (lambda x: (_ for _ in ()).throw(KeyboardInterrupt), "raised KeyboardInterrupt"),
        (endless, "raised RecursionError"),
        (fails_badly, "raised Mute"),
        (lambda x: "6", "came '6', expected was 6"),
        (lambda x: [6], "came [6], expected was 6"),
        (lambda x: np.array([1.0, 2.0]), "expected was 6"),
        (lambda x: float("nan"), "came nan"),
        (lambda x: Odd(), "expected was 6"),
        (lambda x: {1: 2}, "expected was 6"),
        (lambda x: 10**400, "expected was 6"),
        (lambda x: "x" * 10_000, "…"),
    ],
)
def test_whatever_a_function_does_the_answer_is_a_sentence(function, words):
    judged = verdict(function)
    assert not judged
    assert words in judged.words
    assert len(judged.words) < 500


def test_a_stub_is_told_that_it_is_its_turn():
    def stub(x):
        raise NotImplementedError("double")

    assert "not written yet" in verdict(stub).words


def halve(*_):
    raise NotImplementedError("halve")


def test_a_function_that_calls_an_exercise_which_is_not_done_is_told_so():
    words = verdict(lambda *arguments: halve(*arguments)).words
    assert "calls halve, which is not written yet" in words
    assert "your turn" not in words


@pytest.mark.parametrize("words", ["", "todo", "not yet"])
def test_a_stub_with_words_of_a_students_own_is_told_that_it_is_its_turn(words):
    def stub(x):
        raise NotImplementedError(words)

    assert "it is your turn" in verdict(stub).words


def test_a_function_that_never_ends_is_stopped():
    assert "a loop that does not end" in verdict(forever, time_limit=0.2).words


def test_a_function_that_changes_its_input_is_told_so():
    def clears(x):
        x[:] = 0
        return x

    judged = judge("clears", clears, lambda x: 0 * x, [(np.ones(2),)], [])
    assert "changes its input" in judged.words


def test_a_mistake_that_is_right_for_a_case_is_not_taken_for_another():
    judged = judge("double", lambda x: 4.0, double, [(2.0,), (3.0,)], [SQUARED])
    assert "came 4, expected was 6" in judged.words


def test_a_verdict_is_shown_with_a_mark_and_without_markup_of_the_student():
    page = verdict(lambda x: "<b>")._repr_html_()
    assert "✗" in page
    assert "<b>" not in page
    assert "✓" in verdict(double)._repr_html_()


@pytest.mark.parametrize(
    ("a", "b", "equal"),
    [
        (1, 1.0, True),
        (0.1 + 0.2, 0.3, True),
        (1, 1.001, False),
        ([1, 2], np.array([1, 2]), True),
        (np.array([[1, 2]]), np.array([1, 2]), False),
        ((1, "a"), (1, "a"), True),
        ((1, np.array([1.0])), (1, np.array([1.0])), True),
        ("a", "a", True),
        ("1", 1, False),
        (float("nan"), float("nan"), True),
        ({"a": 1}, {"a": 1.0}, True),
        ({"a": 1}, {"b": 1}, False),
        (True, 1, True),
        (None, 0, False),
    ],
)
def test_results_are_compared_as_a_teacher_would(a, b, equal):
    assert same(a, b) is equal


def test_long_inputs_are_shown_short():
    assert len(described(np.arange(10_000))) < 100
    assert described((1.23456789, [1])) == "(1.23457, [1])"


def test_an_attempt_has_a_value_or_a_problem():
    assert attempt_call("double", double, (2,)).value == 4
    assert attempt_call("double", double, (2,)).problem == ""
    assert _judge.attempt_call("double", double, ("a", "b")).problem
