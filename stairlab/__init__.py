"""stairlab: learn a paper by running it.

A robot cube jumps at random before stairs, sorts its jumps by what they did, and keeps a few good jumps of each kind:
"Unsupervised Learning of Effective Actions in Robotics" (Zaric, Hollenstein, Piater, Renaudo 2024). Every public name can be imported
from here; its module is loaded when the name is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from stairlab.agents import Training, count_parameters, load_agent, make_env, play, save_agent, train
    from stairlab.beyond import along_stairs_prototypes
    from stairlab.claims import compare_claims, paper_claims
    from stairlab.clustering import (
        HistogramBins,
        KMeans,
        RobustGrowingNeuralGas,
        davies_bouldin_score,
        silhouette_samples,
        silhouette_score,
        silhouette_scores,
    )
    from stairlab.drawing import alt_text, new_figure, save_figure
    from stairlab.effects import EffectClasses
    from stairlab.envs import DiscreteMotions, UpTheStairs
    from stairlab.fidelity import (
        Fidelity,
        Rollouts,
        TreadFidelity,
        TreadMeasures,
        climb_table,
        corner_gaps,
        fidelity_table,
        jump_again,
        measure_fidelity,
        measure_tread_fidelity,
        outcome_table,
        riser_gaps,
        roll_out,
        tread_fidelity_table,
    )
    from stairlab.physics import Staircase, Trajectory
    from stairlab.pipeline import Run, run_pipeline
    from stairlab.planning import Plan, best_return, jump_reward, jumps_to_climb, trap_width
    from stairlab.plots import plot_jump_views
    from stairlab.prototypes import (
        Prototypes,
        Reliability,
        effect_prototypes,
        prototype_counts,
        random_prototypes,
        reliability,
        uniform_prototypes,
    )
    from stairlab.results import StudyResults, load_published_study, published_studies
    from stairlab.sampling import Samples, replay_motions, sample_motions
    from stairlab.study import Study
    from stairlab.study_plots import (
        method_style,
        plot_improvement,
        plot_last_episodes,
        plot_learning_certainty,
        plot_learning_curves,
        plot_study_scores,
        plot_traps,
    )
    from stairlab.tumbling import TumblingWorld
    from stairlab.world import CubeWorld, Jump, StairWorld, World

__version__ = "0.1.0"

try:  # the core works without Gymnasium
    from gymnasium.envs.registration import register as _register
except ImportError:
    pass
else:
    for _version, _world in (("v0", "plane"), ("v1", "tumbling")):
        _register(
            f"stairlab/UpTheStairs-{_version}",
            entry_point="stairlab.envs:make_up_the_stairs",
            max_episode_steps=50,
            kwargs={"world": _world},
        )

_MODULES = {
    "physics": ("Staircase", "Trajectory"),
    "world": ("CubeWorld", "Jump", "StairWorld", "World"),
    "tumbling": ("TumblingWorld", "stair_world"),
    "sampling": ("Samples", "replay_motions", "sample_motions"),
    "clustering": (
        "HistogramBins",
        "KMeans",
        "KMeansStep",
        "RGNGStep",
        "RobustGrowingNeuralGas",
        "davies_bouldin_score",
        "silhouette_samples",
        "silhouette_score",
        "silhouette_scores",
    ),
    "effects": ("PRESETS", "EffectClasses"),
    "prototypes": (
        "Prototypes",
        "Reliability",
        "effect_prototypes",
        "prototype_counts",
        "random_prototypes",
        "reliability",
        "uniform_prototypes",
    ),
    "planning": ("Plan", "best_return", "jump_reward", "jumps_to_climb", "trap_width"),
    "beyond": ("along_stairs_prototypes",),
    "fidelity": (
        "Fidelity",
        "Rollouts",
        "TreadFidelity",
        "TreadMeasures",
        "climb_table",
        "corner_gaps",
        "fidelity_table",
        "jump_again",
        "measure_fidelity",
        "measure_tread_fidelity",
        "outcome_table",
        "riser_gaps",
        "roll_out",
        "tread_fidelity_table",
    ),
    "envs": ("DiscreteMotions", "UpTheStairs"),
    "agents": ("Training", "count_parameters", "load_agent", "make_env", "play", "save_agent", "train"),
    "results": ("StudyResults", "load_published_study", "published_studies"),
    "claims": ("compare_claims", "paper_claims"),
    "study": ("Study",),
    "pipeline": ("Run", "run_pipeline"),
    "report": ("save_run", "write_report"),
    "plots": (
        "plot_effect_classes",
        "plot_effect_distributions",
        "plot_feature_comparison",
        "plot_fidelity",
        "plot_jump_views",
        "plot_prototype_counts",
        "plot_prototype_trajectories",
        "plot_prototypes",
        "plot_reliability",
        "plot_score_curve",
        "plot_tread_fidelity",
        "plot_world",
    ),
    "drawing": ("alt_text", "new_figure", "save_figure"),
    "study_plots": (
        "method_style",
        "plot_improvement",
        "plot_last_episodes",
        "plot_learning_certainty",
        "plot_learning_curves",
        "plot_study_scores",
        "plot_traps",
    ),
    "study_report": ("save_study",),
}
_HOME = {name: module for module, names in _MODULES.items() for name in names}

_EXTRA = ("envs", "agents", "study")
""" Modules that need the extra rl; a star import leaves them out """
__all__ = sorted(name for name, module in _HOME.items() if module not in _EXTRA)


def __getattr__(name: str) -> Any:
    """Import a public name, or a module, when it is first used (PEP 562)."""
    if name in _MODULES:
        return import_module(f"stairlab.{name}")
    if name not in _HOME:
        raise AttributeError(f"module 'stairlab' has no attribute {name!r}")
    try:
        return getattr(import_module(f"stairlab.{_HOME[name]}"), name)
    except ModuleNotFoundError as error:
        if _HOME[name] not in _EXTRA:
            raise
        raise ImportError(f"stairlab.{name} needs {error.name}: pip install 'stairlab[rl]'.") from error


def __dir__() -> list[str]:
    """Return the public names."""
    return sorted([*_HOME, "__version__"])
