"""What the lessons are made of: predictions, sliders, animations, and for each lesson the functions that draw its figures.

A lesson draws with plain functions that return a ``Figure``. ``explore`` puts sliders on such a function, ``animate`` plays it,
``predict`` asks before it shows. Where no kernel runs, pictures made beforehand react in their place: a ``Player``.
"""

import os

from stairlab.course.explore import Exploration, explore
from stairlab.course.player import Player, animate
from stairlab.course.predict import Prediction, my_predictions, predict

__all__ = ["Exploration", "Player", "Prediction", "animate", "budget", "explore", "my_predictions", "predict"]


def budget(full: int, fast: int) -> int:
    """Return ``full``, or ``fast`` where the environment variable ``STAIRLAB_FAST`` is set: a quick look, the same steps."""
    return fast if os.environ.get("STAIRLAB_FAST") else full
