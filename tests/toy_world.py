"""A world without stairs: a puck on a table. Sampling, effects and prototypes should not notice the difference."""

from dataclasses import dataclass

import numpy as np

LENGTH, WIDTH, SHELF, DECELERATION = 2.0, 1.0, 0.2, 2.0


@dataclass(frozen=True)
class Slide:
    """What came of a push."""

    start: np.ndarray
    end: np.ndarray
    on_map: bool


class PuckWorld:
    """A puck slides over a table until friction or a wall stops it; pushed upward enough, it lands on a shelf.

    Walls stand in the west, north and south; in the east the puck falls off.
    """

    feature_names = ("east", "north", "height")
    motion_names = ("speed", "heading", "lift")

    def __init__(self) -> None:
        self.motion_low = np.array([0.2, -80.0, 0.0])
        self.motion_high = np.array([3.0, 80.0, 1.0])
        self.reset()

    def reset(self, state: np.ndarray | None = None) -> np.ndarray:
        self._state = np.array([0.2, 0.5, 0.0]) if state is None else np.array(state, dtype=float)
        return self._state.copy()

    @property
    def state(self) -> np.ndarray:
        return self._state.copy()

    def noise_scale(self, motion: np.ndarray) -> np.ndarray:
        return np.array([0.02 * motion[0], 1.0, 0.01])

    def draw_start(self, rng: np.random.Generator) -> np.ndarray:
        return np.array([*rng.uniform((0, 0), (LENGTH, WIDTH)), 0.0])

    def perform(self, motion: np.ndarray, rng: np.random.Generator | None = None) -> Slide:
        speed, heading, lift = motion
        start = self._state.copy()
        way = speed**2 / (2 * DECELERATION)
        east = start[0] + way * np.cos(np.radians(heading))
        north = np.clip(start[1] + way * np.sin(np.radians(heading)), 0, WIDTH)
        self._state = np.array([max(east, 0.0), north, start[2] + SHELF * (lift > 0.7)])
        return Slide(start, self._state.copy(), bool(east < LENGTH))
