"""What tests of several lessons share."""

import pytest

from stairlab.course.small_climb import Learned, SmallClimb, q_learning


@pytest.fixture(scope="module")
def climb() -> SmallClimb:
    """Return the small climb of lesson 09."""
    return SmallClimb()


@pytest.fixture(scope="module")
def learned(climb) -> Learned:
    """Return what Q-learning learns of it with its defaults."""
    return q_learning(climb)
