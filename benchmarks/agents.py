"""What the world costs a training: DQN on the stairs against the same DQN on an environment whose step costs nothing, in one run."""

import argparse
import time

import gymnasium as gym
import numpy as np
import pandas as pd
import torch
from stable_baselines3 import DQN

from stairlab import EffectClasses, StairWorld, effect_prototypes, random_prototypes, sample_motions, uniform_prototypes
from stairlab.agents import PUBLISHED_SETTINGS, make_env, train
from stairlab.world import recall_or_fly


class FreeSteps(gym.Env):
    """Spaces and episode length of Up The Stairs; its step costs nothing."""

    def __init__(self, n_actions: int) -> None:
        self.observation_space = make_env().observation_space
        self.action_space = gym.spaces.Discrete(n_actions)
        self.observation = np.zeros(self.observation_space.shape, dtype=np.float32)
        self.jumps = 0

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.jumps = 0
        return self.observation, {}

    def step(self, action):
        self.jumps += 1
        return self.observation, 0.0, False, self.jumps >= 50, {}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--timesteps", type=int, default=10_000, help="training steps (default: 10,000)")
    timesteps = parser.parse_args().timesteps
    torch.set_num_threads(1)
    world = StairWorld()
    classes = EffectClasses.from_samples(sample_motions(world, progress=False))
    sets = {
        "effect": effect_prototypes(classes, world=world),
        "effect, core": effect_prototypes(classes, refine="core", world=world),
        "fixed": effect_prototypes(classes, fixed=5, world=world),
        "uniform": uniform_prototypes(world),
        "random": random_prototypes(world),
    }
    rows = []
    for name, motions in sets.items():
        free = _free_time(len(motions), timesteps)
        recall_or_fly.cache_clear()  # a training begins without remembered jumps
        stairs = train("dqn", motions, total_timesteps=timesteps, progress=False).wall_time
        rows.append(
            {"motions": name, "actions": len(motions), "stairs [s]": stairs, "free [s]": free, "ratio": stairs / free}
        )
    print(f"DQN, {timesteps} steps and an evaluation every 500, one torch thread")
    print(pd.DataFrame(rows).round(2).to_string(index=False))


def _free_time(n_actions: int, timesteps: int) -> float:
    model = DQN("MlpPolicy", FreeSteps(n_actions), seed=0, device="cpu", **PUBLISHED_SETTINGS["dqn"])
    began = time.perf_counter()
    model.learn(timesteps)
    return time.perf_counter() - began


if __name__ == "__main__":
    main()
