"""What the exercises check: each function takes a student's function, tries it, and answers in one or two sentences.

All are called alike: the first parameter is the student's function; ``more`` asks for that many further inputs, drawn with a fixed
seed; the answer is a ``Verdict``, which is true if the function is right. A check does not crash, hang or show a traceback because of
what a student wrote, and recognises the usual mistakes by name.
"""

from stairlab.checks._judge import Verdict
from stairlab.checks.action_prototypes import (
    check_class_prototypes,
    check_medoid,
    check_reached_class,
    check_reliable_share,
)
from stairlab.checks.does_it_hold_up import (
    check_difference_interval,
    check_interquartile_mean,
    check_judge_claim,
    check_probability_of_improvement,
)
from stairlab.checks.effect_classes import (
    check_histogram_bin,
    check_inertia,
    check_nearest_centers,
    check_update_centers,
)
from stairlab.checks.growing_neural_gas import (
    check_bounded_pulls,
    check_new_node,
    check_update_nodes,
    check_winner_and_runner_up,
)
from stairlab.checks.how_many_classes import (
    check_choose_k,
    check_davies_bouldin_ratio,
    check_scale_max_abs,
    check_silhouette_of,
)
from stairlab.checks.how_many_prototypes import (
    check_coefficient_of_variation,
    check_ignores_units,
    check_mean_and_spread,
    check_xi,
)
from stairlab.checks.learning_to_climb import (
    check_dense_parameters,
    check_discounted_returns,
    check_epsilon_greedy,
    check_q_update,
)
from stairlab.checks.sampling import (
    check_draw_motions,
    check_effects_on_map,
    check_motion_sampling,
    check_standard_error,
)
from stairlab.checks.the_world import check_effect, check_height_at, check_velocity_after_push, check_ways_out
from stairlab.checks.up_the_stairs import (
    check_better_reward,
    check_climb,
    check_env_is_right,
    check_reward_of_jump,
)

__all__ = [
    "Verdict",
    "check_better_reward",
    "check_bounded_pulls",
    "check_choose_k",
    "check_class_prototypes",
    "check_climb",
    "check_coefficient_of_variation",
    "check_davies_bouldin_ratio",
    "check_dense_parameters",
    "check_difference_interval",
    "check_discounted_returns",
    "check_draw_motions",
    "check_effect",
    "check_effects_on_map",
    "check_env_is_right",
    "check_epsilon_greedy",
    "check_height_at",
    "check_histogram_bin",
    "check_ignores_units",
    "check_inertia",
    "check_interquartile_mean",
    "check_judge_claim",
    "check_mean_and_spread",
    "check_medoid",
    "check_motion_sampling",
    "check_nearest_centers",
    "check_new_node",
    "check_probability_of_improvement",
    "check_q_update",
    "check_reached_class",
    "check_reliable_share",
    "check_reward_of_jump",
    "check_scale_max_abs",
    "check_silhouette_of",
    "check_standard_error",
    "check_update_centers",
    "check_update_nodes",
    "check_velocity_after_push",
    "check_ways_out",
    "check_winner_and_runner_up",
    "check_xi",
]
