"""What the tests of all checks ask of a verdict."""

from stairlab.checks import Verdict


def assert_right(check, solution):
    """Assert that a check calls a solution right, for its own inputs and for twenty more."""
    for verdict in (check(solution), check(solution, more=20)):
        assert verdict, verdict
        assert repr(verdict).startswith("Right.")


def answered(check, answer, **options) -> str:
    """Return what a check says of an answer that is not right."""
    verdict = check(answer, **options)
    assert isinstance(verdict, Verdict)
    assert not verdict
    assert repr(verdict) == verdict.words
    assert 20 < len(verdict.words) < 600
    return verdict.words
