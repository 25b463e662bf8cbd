"""How fast the worlds are, and how near the plane is to a plain loop: ``python benchmarks/world.py [--jumps N]``.

The plain loop steps the same space 1 ms at a time and looks once per simulated second whether the cube has stopped, by the published
rule. The tumbling world is measured against the plane. What is compared runs in turns in one process, so that other load on the
machine hits both.
"""

import argparse
import math
import time
from collections.abc import Callable

import numpy as np
import pandas as pd
from tqdm import tqdm

from stairlab.physics import CUBE_EDGE, MAX_STEPS, PUSH_STEPS, RELEASE_VELOCITY, TIME_STEP, Staircase, build_space
from stairlab.sampling import sample_motions
from stairlab.tumbling import TumblingWorld
from stairlab.world import CubeWorld, StairWorld, recall_or_fly

TURN = 20
""" Jumps that one of the two makes before it is the other's turn """
POLL_STEPS = 1000
STOPPED = 1e-3
""" A cube that moved less than this between two polls has stopped [m] """


def plain_loop(staircase: Staircase, state: np.ndarray, magnitude: float, angle: float) -> tuple[float, float]:
    """Return y and z where a jump ends, step by step [m]."""
    space, cube = build_space(staircase, state)
    cube.velocity = (0.0, RELEASE_VELOCITY)
    force = magnitude * math.cos(math.radians(angle)), magnitude * math.sin(math.radians(angle))
    polled = cube.position
    for step in range(1, MAX_STEPS + 1):
        if step <= PUSH_STEPS:
            cube.apply_force_at_world_point(force, cube.position)
        space.step(TIME_STEP)
        if step % POLL_STEPS == 0:
            if abs(cube.position.x - polled.x) + abs(cube.position.y - polled.y) < STOPPED:
                break
            polled = cube.position
    return cube.position.x, cube.position.y


def world_jump(world: StairWorld, motion: np.ndarray) -> tuple[float, float]:
    """Return y and z where the world's jump from the start pose ends [m]; it is made, not remembered."""
    recall_or_fly.cache_clear()
    world.reset()
    end = world.jump(*motion.tolist()).end
    return float(end[1]), float(end[2])


def in_turns(motions: np.ndarray, *ways: Callable[[np.ndarray], tuple[float, float]]) -> tuple[list[float], np.ndarray]:
    """Make the same jumps in each way, in turns; return the seconds each took, and the ends, shape (n_ways, n, 2)."""
    seconds, ends = [0.0] * len(ways), np.empty((len(ways), len(motions), 2))
    for begin in tqdm(range(0, len(motions), TURN), unit=f" x {TURN} jumps", leave=False):
        turn = slice(begin, begin + TURN)
        for i, way in enumerate(ways):
            started = time.perf_counter()
            ends[i, turn] = [way(motion) for motion in motions[turn]]
            seconds[i] += time.perf_counter() - started
    return seconds, ends


def compare(name: str, motions: np.ndarray, world: StairWorld) -> dict[str, object]:
    """Return a line of the table: the world against the plain loop on ``motions``."""
    start = world.start
    seconds, (fast, plain) = in_turns(
        motions,
        lambda motion: world_jump(world, motion),
        lambda motion: plain_loop(world.staircase, start, *motion.tolist()),
    )
    classes = [outcome_classes(world, ends) for ends in (fast, plain)]
    return {
        "jumps": name,
        "n": len(motions),
        "world [jumps/s]": round(len(motions) / seconds[0]),
        "plain loop [jumps/s]": round(len(motions) / seconds[1]),
        "ratio": round(seconds[1] / seconds[0], 2),
        "same step": f"{np.mean(classes[0] == classes[1]):.2%}",
        "median |y difference| [m]": f"{np.median(np.abs(fast[:, 0] - plain[:, 0])):.1e}",
    }


def outcome_classes(world: StairWorld, ends: np.ndarray) -> np.ndarray:
    """Return the step each jump ended on, -1 off the map."""
    on_map = [world.on_map(world.state_at(y, z)) for y, z in ends]
    return np.where(on_map, np.round((ends[:, 1] - CUBE_EDGE / 2) / world.staircase.rise), -1)


def tumbling(start: str, n: int) -> dict[str, object]:
    """Return a line of the table: n random jumps of the tumbling world against the plane, warm.

    Parameters
    ----------
    start : {"the start", "treads"}
        From the start pose of four steps, or, on fifteen, from upright on a tread that is drawn.
    n : int
        Jumps.
    """
    staircase = Staircase.fifteen() if start == "treads" else Staircase()
    worlds: list[CubeWorld] = [TumblingWorld(staircase), StairWorld(staircase)]
    rng = np.random.default_rng(1)
    motions = rng.uniform(worlds[0].motion_low, worlds[0].motion_high, (n, 2))
    starts = [worlds[0].draw_start(rng) if start == "treads" else worlds[0].start for _ in range(n)]
    seconds = [0.0, 0.0]
    for world in worlds:
        world.jump(600, 70, rng)  # compiled, or loaded, before the clock runs
    for begin in tqdm(range(0, n, TURN), unit=f" x {TURN} jumps", leave=False):
        for i, world in enumerate(worlds):
            recall_or_fly.cache_clear()  # the plane's jumps are made, not remembered
            started = time.perf_counter()
            for motion, state in zip(motions[begin : begin + TURN], starts[begin : begin + TURN], strict=True):
                world.reset(state)
                world.perform(motion, rng)
            seconds[i] += time.perf_counter() - started
    return {
        "jumps": f"random, from {start}",
        "n": n,
        "tumbling [jumps/s]": round(n / seconds[0]),
        "plane [jumps/s]": round(n / seconds[1]),
        "ratio": round(seconds[1] / seconds[0], 2),
    }


def processes(n: int) -> dict[str, object]:
    """Return jumps per second of ``sample_motions`` in one and in two processes, in turns, the processes started before."""
    seconds = {1: 0.0, 2: 0.0}
    world = StairWorld()
    sample_motions(world, 100, n_jobs=2, progress=False)
    samples = {}
    for part in range(4):
        for n_jobs in seconds:
            started = time.perf_counter()
            samples[n_jobs] = sample_motions(world, n // 4, seed=part, n_jobs=n_jobs, progress=False)
            seconds[n_jobs] += time.perf_counter() - started
        assert np.array_equal(samples[1].effects, samples[2].effects)
    made = n // 4 * 4
    return {
        "jumps": "sample_motions",
        "n": made,
        "n_jobs=1 [jumps/s]": round(made / seconds[1]),
        "n_jobs=2 [jumps/s]": round(made / seconds[2]),
        "ratio": round(seconds[1] / seconds[2], 2),
    }


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--jumps", type=int, default=10_000, metavar="N", help="random jumps (default 10000)")
    n = parser.parse_args().jumps
    if n < 8:
        parser.error(f"--jumps must be at least 8, not {n}")
    world = StairWorld()
    samples = sample_motions(world, n, seed=1)
    climbing = samples[samples.on_map & (samples.effects[:, 2] > world.staircase.rise / 2)]
    lines = [compare("random", samples.motions, world), compare("climbing", climbing.motions, world)]
    print(pd.DataFrame(lines).to_string(index=False), end="\n\n")
    print(pd.DataFrame([processes(min(n, 2000))]).to_string(index=False), end="\n\n")
    print(pd.DataFrame([tumbling(start, min(n, 2000)) for start in ("the start", "treads")]).to_string(index=False))


if __name__ == "__main__":
    main()
