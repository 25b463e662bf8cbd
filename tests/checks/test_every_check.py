"""Whatever a student wrote, every check answers it with a sentence; what is special to a check is tested in its lesson's file."""

import inspect
import math
import re
import threading

import numpy as np
import pytest

from stairlab import checks
from stairlab.checks import _judge

from .verdicts import answered

CHECKS = [getattr(checks, name) for name in checks.__all__ if name.startswith("check_")]
BY_PROPERTIES = {
    checks.check_better_reward,
    checks.check_climb,
    checks.check_difference_interval,
    checks.check_draw_motions,
    checks.check_env_is_right,
    checks.check_motion_sampling,
}
""" They have no single right result to show; the others say what came and what was expected """
each = pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)


def exercise(check) -> tuple[str, str, int]:
    """Return the name, the signature and the number of arguments of the function that a check is for, from its docstring."""
    found = re.match(r"Check ``((\w+)\((.*?)\))``", inspect.getdoc(check))
    return found[2], found[1], len(found[3].split(", "))


@each
def test_a_check_says_in_its_docstring_what_it_is_for_and_which_mistakes_it_knows(check):
    name, signature, _ = exercise(check)
    assert check.__name__ == f"check_{name}"
    text = " ".join(inspect.getdoc(check).split())
    assert len(text) > len(f"Check ``{signature}``") + 80
    assert "usual mistakes: " in text


@each
@pytest.mark.parametrize("more", [0, 2])
def test_a_stub_is_told_that_it_is_its_turn(check, more):
    name = exercise(check)[0]

    def stub(*arguments):
        raise NotImplementedError(name)

    assert f"{name} is not written yet: it is your turn." in answered(check, stub, more=more)


def divides_by_zero(*arguments):
    return 1 / 0


def misses_a_key(*arguments):
    raise KeyError("no such thing")


def misses_an_attribute(*arguments):
    return arguments[0].no_such_thing


@each
@pytest.mark.parametrize(
    ("answer", "error"),
    [
        (divides_by_zero, "ZeroDivisionError"),
        (misses_a_key, "KeyError"),
        (misses_an_attribute, "AttributeError"),
    ],
)
def test_an_error_in_a_function_is_named_and_not_raised(check, answer, error):
    for more in (0, 2):
        assert f"raised {error}" in answered(check, answer, more=more)


@each
def test_a_function_without_a_return_is_told_so(check):
    for more in (0, 2):
        assert "returned nothing. Is there a return at its end?" in answered(check, lambda *_: None, more=more)


def unhelpful(error):
    """Return an object whose methods fail, its words too."""

    def fails(self, *_, **__):
        raise error

    names = ["array", "bool", "eq", "float", "getitem", "hash", "index", "int", "iter", "len", "repr"]
    return type("Unhelpful", (), {f"__{name}__": fails for name in names})()


WRONG = {
    "a word": "three",
    "a number": 17.0,
    "nan": math.nan,
    "a huge number": 10**400,
    "a number too long to write": 10**5000,
    "an empty list": [],
    "a pair": (1, 2),
    "a list": [1, 2, 3],
    "a ragged list": [[1, 2], [3]],
    "a table": np.zeros((3, 3)),
    "a dict": {"low": 1},
    "an object": object(),
    "an object whose methods raise ValueError": unhelpful(ValueError),
    "an object whose methods raise ZeroDivisionError": unhelpful(ZeroDivisionError),
    "a pair of such objects": (unhelpful(ZeroDivisionError), unhelpful(ZeroDivisionError)),
}


@each
@pytest.mark.parametrize("kind", WRONG)
def test_a_result_of_a_wrong_kind_gets_a_sentence(check, kind):
    for more in (0, 2):
        words = answered(check, lambda *_: WRONG[kind], more=more)
        assert "Not yet" in words
        assert check in BY_PROPERTIES or ("came " in words and "expected was " in words)


@each
@pytest.mark.parametrize("answer", [lambda: 1, lambda a, b, c, d, e, f, g, h: 1], ids=["none", "eight"])
def test_a_function_with_a_wrong_number_of_arguments_is_told_how_many_it_must_take(check, answer):
    name, _, number = exercise(check)
    for more in (0, 2):
        assert re.match(rf"{name} must take {number} arguments?;", answered(check, answer, more=more))


@each
@pytest.mark.parametrize("answer", [None, 7, "climb"])
def test_what_is_no_function_is_told_what_to_give(check, answer):
    name = exercise(check)[0]
    for more in (0, 2):
        assert f"Give the function itself, as in check_{name}({name})" in answered(check, answer, more=more)


def test_a_loop_is_stopped_after_ten_seconds_unless_a_test_asks_for_less():
    assert _judge.judge.__kwdefaults__["time_limit"] == _judge.attempt_call.__defaults__[0] == _judge.TIME_LIMIT == 10


@each
def test_an_endless_loop_is_stopped(check, monkeypatch):
    def endless(*arguments):
        while True:
            pass

    monkeypatch.setitem(_judge.judge.__kwdefaults__, "time_limit", 0.1)
    monkeypatch.setattr(_judge.attempt_call, "__defaults__", (0.1,))
    assert "was not done after 0.1 s. Is there a loop that does not end?" in answered(check, endless)
    for thread in threading.enumerate():
        if thread.name.startswith("check of "):
            thread.join(5)
            assert not thread.is_alive()
