"""Lesson 09: agents that are watched, and the lesson's pictures."""

import numpy as np
import pandas as pd
import pytest

from stairlab import StairWorld, alt_text, load_published_study, uniform_prototypes
from stairlab.course import learning_to_climb as lesson
from stairlab.course.learning_to_climb import EXPLORATIONS, LEARNING_RATES, draw_learning, draw_table
from stairlab.course.small_climb import EPISODES
from stairlab.drawing import png

QUICK = {"learning_starts": 20, "eval_every": 40}


@pytest.fixture(scope="module")
def study():
    return load_published_study("plane")


@pytest.fixture(scope="module")
def dqn():
    grid = uniform_prototypes(StairWorld())
    return lesson.train_live("dqn", grid, 120, watch=lesson.values_along, target_update_interval=50, **QUICK)


@pytest.fixture(scope="module")
def sac():
    return lesson.train_live("sac", None, 40, watch=lesson.policy_cloud, batch_size=16, **QUICK)


def lines(figure):
    return [line for ax in figure.axes for line in ax.lines]


# Pictures of the small climb


def test_motions_are_drawn_with_their_effects_in_words():
    figure = lesson.draw_motions()
    assert "leap gains 3" in alt_text(figure)
    assert len(lines(figure)) == 4


@pytest.mark.parametrize("episodes", [EPISODES[0], EPISODES[-1]])
@pytest.mark.parametrize("learning_rate", [LEARNING_RATES[0], LEARNING_RATES[-1]])
@pytest.mark.parametrize("exploration", [EXPLORATIONS[0], EXPLORATIONS[-1]])
def test_the_widget_draws_at_the_ends_of_its_controls(episodes, learning_rate, exploration):
    figure = draw_learning(episodes, learning_rate, exploration)
    assert f"{episodes} episode" in alt_text(figure)
    assert "entries not 0" in alt_text(figure)
    assert png(figure, 50)


def test_the_widget_has_a_start_among_its_values():
    assert "10 episodes, " in alt_text(draw_learning())


def test_an_empty_table_is_drawn_and_so_is_a_cube_that_only_hops(climb):
    figure = draw_table(climb.table, climb)
    assert alt_text(figure).startswith("The table of values, 0 of 112")
    assert "return of 0" in alt_text(figure)
    assert png(figure, 50)


def test_the_best_motion_of_each_cell_has_a_triangle(climb, learned):
    figure = draw_table(learned.table, climb, "learned")
    triangles = [line for line in lines(figure) if line.get_marker() == "^"]
    assert len(triangles) == (learned.table[:-1].max(axis=1) > 0).sum()
    assert "step 3 with a return of 3" in alt_text(figure)


# Agents


@pytest.mark.slow
def test_an_agent_that_is_watched_learns_to_the_bit_as_one_that_is_not(dqn):
    from stairlab.agents import train

    grid = uniform_prototypes(StairWorld())
    plain = train("dqn", grid, 0, 120, progress=False, target_update_interval=50, **QUICK)
    pd.testing.assert_frame_equal(plain.evaluations, dqn[0].evaluations, check_dtype=False)
    for mine, other in zip(dqn[0].model.policy.parameters(), plain.model.policy.parameters(), strict=True):
        assert np.array_equal(mine.detach().numpy(), other.detach().numpy())


@pytest.mark.slow
def test_what_is_watched_is_kept_from_the_start(dqn):
    assert list(dqn[1]) == [0, 40, 80, 120]
    y, values = dqn[1][120]
    assert np.nanmin(y) > 0
    assert np.nanmax(y) < 6.21
    assert np.isnan(values).sum() == 15
    assert dqn[0].evaluations["step"].tolist() == [40, 80, 120]


@pytest.mark.slow
def test_pictures_of_an_agent_say_what_they_show(dqn, sac):
    curves = lesson.draw_curves({"one": dqn[0].evaluations, "none yet": dqn[0].evaluations[:0]}, 120)
    assert "one: " in alt_text(curves)
    assert "120 remembered jumps" in alt_text(lesson.draw_memory(dqn[0].model))
    values = {"mine": dqn[1][120], "target": lesson.values_along(dqn[0].model, dqn[0].model.q_net_target)}
    assert "mine" in alt_text(lesson.draw_values(values, "120 jumps"))
    clouds = lesson.draw_clouds({"before": sac[1][0], "after": sac[1][40]})
    assert "it would perform: before" in alt_text(clouds)
    for figure in (curves, clouds):
        assert png(figure, 50)


@pytest.mark.slow
def test_a_cloud_of_motions_lies_in_the_motion_space_and_disturbs_no_generator(sac):
    import torch

    torch.manual_seed(1)
    expected = torch.rand(1)
    torch.manual_seed(1)
    drawn, greedy = lesson.policy_cloud(sac[0].model, n=50)
    assert torch.equal(torch.rand(1), expected)
    assert drawn.shape == (50, 2)
    for motions in (drawn, greedy[None]):
        assert (motions >= [50, 1]).all()
        assert (motions <= [1000, 89]).all()
    again, _ = lesson.policy_cloud(sac[0].model, n=50)
    assert np.array_equal(drawn, again)


def test_a_picture_of_no_evaluations_says_so():
    empty = pd.DataFrame({"step": [], "return": []})
    assert "nothing yet" in alt_text(lesson.draw_curves({"dqn": empty}, 100))


def test_copies_of_the_target_are_counted_in_the_schedule():
    given = {"learning_starts": 3000, "exploration_fraction": 0.1, "exploration_final_eps": 0.05}
    settings = {f"every {every}": given | {"target_update_interval": every} for every in (10_000, 40_000)}
    words = alt_text(lesson.draw_schedule(settings))
    assert "3 copies" in words
    assert "0 copies" in words


def test_a_network_is_drawn_with_its_parameters():
    words = alt_text(lesson.draw_network([4, 64, 64, 16]))
    assert "320 + 4,160 + 1,040 parameters" in words


# The published study


def test_published_curves_are_parted_by_the_copies(study):
    figure = lesson.draw_look_ahead(study)
    assert [text.get_text() for text in figure.axes[0].texts] == [
        "looks 1 jump ahead",
        "looks 2 jumps ahead",
        "looks 3 jumps ahead",
    ]
    assert "2.4, 5.5, 9.6" in alt_text(figure)


def test_sac_s_motions_are_drawn_beside_the_grid(study):
    words = alt_text(lesson.draw_chosen_motions(study))
    assert "16 of the grid" in words
    assert "250 jumps" in words


def test_parameters_are_compared_in_each_way_of_counting():
    dqn = {"deciding": 5520, "trained": 5520, "with targets": 11040, "as published": 5520}
    sac = {"deciding": 68100, "trained": 203782, "with targets": 339464, "as published": 475146}
    words = alt_text(lesson.draw_parameters(dqn, sac))
    for ratio in ("12 times", "37 times", "31 times", "86 times"):
        assert ratio in words
