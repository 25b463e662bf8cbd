"""Lesson 08: pictures of episodes and gaps, and the game played by hand."""

import math

import ipywidgets
import numpy as np
import pytest

from stairlab import Prototypes, Staircase, alt_text, best_return, random_prototypes, uniform_prototypes
from stairlab.course import up_the_stairs as lesson
from stairlab.course.game import READINGS, Game, play, repeat, replay_plan
from stairlab.course.up_the_stairs import StairsGame
from stairlab.fidelity import Rollouts, roll_out
from stairlab.tumbling import TumblingWorld
from stairlab.world import StairWorld

SINGLE, LEAP, HOP = [300.0, 70.0], [600.0, 75.0], [50.0, 89.0]
THREE = np.array([SINGLE, LEAP, HOP])
SHORT = Staircase(3, last_run=10.0)


@pytest.fixture(scope="module")
def sets():
    return {"own": Prototypes(THREE, np.array([1, 2, 3])), "random": random_prototypes(StairWorld(), 4, seed=0)}


@pytest.fixture(scope="module")
def plans(sets):
    stairs = Staircase.fifteen()
    return {name: best_return(stairs, one, max_jumps=4, progress=False) for name, one in sets.items()}


@pytest.fixture(scope="module")
def both(sets, plans):
    """Return plans in both worlds."""
    world = TumblingWorld(Staircase.fifteen())
    return {
        "plane": plans,
        "tumbling": {name: best_return(world, one, max_jumps=4, progress=False) for name, one in sets.items()},
    }


@pytest.fixture
def stairs_game(sets, both):
    return StairsGame(sets, both)


def words_in(figure):
    return " ".join(
        [*(text.get_text() for ax in figure.axes for text in ax.texts), *(ax.get_title("left") for ax in figure.axes)]
    )


# Rewards


@pytest.mark.parametrize("reading", READINGS)
def test_a_reading_is_drawn_over_the_others_and_says_what_it_pays(reading):
    figure = lesson.draw_reading(reading)
    widths = [line.get_linewidth() for line in figure.axes[0].lines]
    assert sum(width > 2 for width in widths) == 1
    assert reading in alt_text(figure)
    assert f"{READINGS[reading](-0.6, 0.3):.3g} for -0.6 m" in alt_text(figure)


# Episodes


@pytest.mark.parametrize("jumps", [None, 0, 1, 3])
def test_an_episode_is_drawn_with_a_bar_for_each_jump_shown(jumps):
    game = play(THREE, lambda seen: 0, max_jumps=3)
    figure = lesson.draw_episode(game, jumps)
    count = 3 if jumps is None else jumps
    _, ledger = figure.axes
    assert len(ledger.patches) == 2 * count
    assert f"first {count} of 3 jumps" in alt_text(figure)
    assert f"return {count}" in alt_text(figure)


def test_an_episode_that_leaves_the_stairs_says_so():
    game = play([[1000.0, 45.0]], lambda seen: 0, Staircase(1))
    assert "off the stairs" in alt_text(lesson.draw_episode(game))


def test_an_episode_that_tumbles_is_drawn_from_above_too():
    game = play(THREE, lambda seen: 1, TumblingWorld(Staircase.fifteen()), max_jumps=2, seed=0)
    figure = lesson.draw_episode(game)
    side, ledger, above = figure.axes
    assert above.get_xlim() == side.get_xlim()
    assert "cm aside, seen from above" in alt_text(figure)
    assert len(lesson.draw_episode(play(THREE, lambda seen: 1, max_jumps=2)).axes) == 2
    assert len(ledger.patches) == 4


def test_a_fall_off_the_side_is_off_the_stairs():
    world = TumblingWorld(Staircase.fifteen())
    game = Game(THREE, world, seed=0)
    game.jump(0)
    game.states[-1][0] = 3.0
    assert "off the stairs" in alt_text(lesson.draw_episode(game))


def test_gaps_are_drawn_for_each_episode_with_the_trap():
    games = {"single steps": repeat(SINGLE), "stuck": repeat((454, 80))}
    figure = lesson.draw_gaps(games, 0.04)
    assert "to the top after 15 jumps" in alt_text(figure)
    assert "trap is 40.0 mm wide" in alt_text(figure)
    assert "trap" in words_in(figure)
    assert "trap" not in words_in(lesson.draw_gaps(games))


# The gap


@pytest.mark.parametrize(
    ("gap", "angle", "said"),
    [
        (10, 85, "no step"),
        (10, 89, "+1 step"),
        (5, 75, "no step"),
        (80, 80, "+2 steps"),
        (5, 89, "no step"),
        (80, 89, "rests 632 mm before it"),
    ],
)
def test_a_push_near_a_riser_is_drawn_with_what_becomes_of_it(gap, angle, said):
    figure = lesson.draw_push(gap, angle)
    assert said in alt_text(figure)
    assert f"{gap / 1000 * math.tan(math.radians(angle)):.3f} m" in words_in(figure)


@pytest.mark.parametrize(
    ("gap", "angle", "said"), [(10, 85, "no step, rests 8.93 mm"), (10, 89, "+1 step"), (5, 89, "turned by 44°")]
)
def test_a_push_near_a_riser_can_be_tried_where_the_cube_tumbles(gap, angle, said):
    figure = lesson.draw_push(gap, angle, world="tumbling")
    assert said in alt_text(figure)
    assert "tumbling: " in words_in(figure)


@pytest.mark.parametrize(("jumps", "narrowest"), [(0, 0.3), (3, 0.3), (15, 100)])
def test_a_map_of_gaps_is_drawn_with_its_cobweb(jumps, narrowest):
    figure = lesson.draw_gap_map(SINGLE, jumps, narrowest)
    assert "300 N at 70°" in alt_text(figure)
    assert (f"step {jumps}." in alt_text(figure)) == bool(jumps)
    assert figure.axes[0].get_xscale() == ("log" if narrowest < 10 else "linear")


def test_the_table_of_motions_has_a_cell_for_each_motion_and_gap():
    figure = lesson.draw_action_table(THREE, 0.04)
    assert len(figure.axes[0].patches) == 3 * len(lesson.TABLE_GAPS)
    assert "trap" in words_in(figure)
    assert "Table of the steps that each of 3 motions gains" in alt_text(figure)
    assert "trap" not in words_in(lesson.draw_action_table(Prototypes(THREE)))


def test_a_leap_off_the_stairs_is_named_in_the_table():
    assert "off" in words_in(lesson.draw_action_table(np.array([[1000.0, 60.0]])))


def test_the_grid_finds_a_way_out_and_flat_motions_do_not(monkeypatch):
    monkeypatch.setattr(lesson, "CLOSE_GAPS", np.array([0.0005, 0.002, 0.01, 0.05]))
    figure = lesson.draw_ways_out(
        grid=uniform_prototypes(StairWorld()), flat=Prototypes(np.array([[500.0, 60.0], [300.0, 70.0]]))
    )
    said = alt_text(figure)
    assert "grid" in said
    assert "some motion leads on" in said.split("flat")[0]
    assert "nothing leads out" in said.split("flat")[1]


def test_the_map_of_single_motions_counts_those_that_climb_all_steps():
    figure = lesson.draw_single_motions([300, 330], [70, 76], own=Prototypes(THREE))
    assert "4 motions: 2 return 15" in alt_text(figure)


def test_a_map_of_single_motions_that_all_climb_or_all_fail_is_drawn_too():
    assert "1 motions: 1 return 15" in alt_text(lesson.draw_single_motions([300], [70]))
    assert "1 motions: 0 return 15" in alt_text(lesson.draw_single_motions([100], [60]))


@pytest.mark.slow
def test_the_map_of_single_motions_is_drawn_with_its_defaults():
    assert "143 motions: 14 return 15" in alt_text(lesson.draw_single_motions())


# The trap in both worlds


@pytest.fixture(scope="module")
def rollouts():
    stairs = Staircase.fifteen()
    return {
        name: roll_out(world, 60, progress=False)
        for name, world in {"plane": StairWorld(stairs), "tumbling": TumblingWorld(stairs)}.items()
    }


@pytest.mark.parametrize(
    ("world", "said"),
    [("plane", "rests 8.44 mm before it."), ("tumbling", "mm before it"), (lesson.BUMPS[2], "turned by")],
)
def test_a_bump_is_drawn_from_the_side_and_from_above_with_what_becomes_of_the_cube(world, said):
    figure = lesson.draw_bump(world)
    side, above = figure.axes
    assert side.get_xlim() == above.get_xlim()
    assert said in alt_text(figure)
    assert alt_text(figure).split(". ")[1].startswith(world)


def test_a_turned_cube_gets_away_from_the_riser_and_one_that_stands_square_to_it_does_not():
    away = {world: float(alt_text(lesson.draw_bump(world)).split("rests ")[1].split()[0]) for world in lesson.BUMPS}
    assert max(away["plane"], away["tumbling"]) < 30 < away[lesson.BUMPS[2]]


def test_no_ordinary_push_climbs_from_the_trap_however_the_cube_is_turned():
    world, rng = TumblingWorld(), np.random.default_rng(0)
    for turned in (0, 2, 10, 30):
        for _ in range(25):
            motion, gap = rng.uniform([350, 55], [650, 75]), rng.uniform(0, 0.03)
            reach = 0.05 * (math.cos(math.radians(turned)) + math.sin(math.radians(turned)))
            world.reset(world.state_at(0.6 - gap - reach, 0.05, yaw=math.radians(turned)))
            assert world.perform(motion, rng).dz < 0.05


def test_the_trap_lets_cubes_out_where_they_tumble_and_hardly_in_the_plane(rollouts):
    free = {name: lesson.after_bumps(jumps)["free"].mean() for name, jumps in rollouts.items()}
    assert free["plane"] < 0.05
    assert 0.4 < free["tumbling"] < 0.65  # the authors' engine: 0.51
    turned = lesson.after_bumps(rollouts["tumbling"]).query("yaw >= 5")["free"].mean()
    square = lesson.after_bumps(rollouts["tumbling"]).query("yaw < 0.5")["free"].mean()
    assert turned > square + 0.2
    shares = {name: len(lesson.after_bumps(jumps)) / (jumps.jump > 0).sum() for name, jumps in rollouts.items()}
    assert shares["plane"] > 2 * shares["tumbling"]


def test_free_is_who_is_higher_or_farther_from_the_riser_and_on_the_map():
    world = StairWorld(Staircase.fifteen())
    before = world.state_at(0.54, 0.05)[:7]
    higher, far, near = world.state_at(0.9, 0.35)[:7], world.state_at(0.3, 0.05)[:7], world.state_at(0.53, 0.05)[:7]
    behind, aside = world.state_at(-0.5, 0.05)[:7], world.state_at(0.3, 0.05, x=3.0)[:7]
    ends = np.array([higher, far, near, behind, aside, far])
    jump = np.array([1, 2, 3, 4, 5, 0])  # the last one starts from the start pose, and does not count
    made = Rollouts(np.zeros(6, int), jump, np.tile([500.0, 60.0], (6, 1)), np.tile(before, (6, 1)), ends)
    table = lesson.after_bumps(made)
    assert table["free"].tolist() == [True, True, False, False, False]
    assert table["climbs"].tolist() == [True, False, False, False, False]


def test_the_trap_in_both_worlds_is_drawn_by_turn_and_by_gap(rollouts):
    figure = lesson.draw_trap_in_worlds(**rollouts)
    assert "plane: free after one more jump" in alt_text(figure)
    assert alt_text(figure).count("0% at 0 to 3 cm") == 2
    left, right = figure.axes
    assert len(left.containers) == len(right.containers) == 2
    assert right.get_xticklabels()[0].get_text() == "0–3"


# The game, played by hand


@pytest.mark.parametrize("preview", [False, True])
def test_a_game_is_drawn_with_return_gap_and_planner(sets, plans, preview):
    game, rival = Game(sets["own"]), replay_plan(sets["own"], plans["own"])
    for _ in range(3):
        assert "The planner after as many jumps" in alt_text(lesson.draw_game(game, rival, 0, preview))
        game.jump(0)
    said = alt_text(lesson.draw_game(game, rival, 1, preview))
    assert "step 3 of 15, return 3" in said
    assert "Chosen is motion 1, 600 N at 75°" in said


def test_a_game_on_the_top_is_drawn_without_a_gap():
    game = Game(THREE, SHORT)
    game.jump(1)
    assert "the top" in alt_text(lesson.draw_game(game))


def test_a_game_that_tumbles_is_drawn_from_above_too(sets):
    game = Game(sets["own"], TumblingWorld(Staircase.fifteen()))
    game.jump(1)
    figure = lesson.draw_game(game, chosen=0, preview=True)
    *_, above = figure.axes
    assert len(figure.axes) == 4
    assert above.get_xlim() == figure.axes[1].get_xlim()
    assert np.mean(above.get_ylim()) == pytest.approx(game.states[-1][0])


def test_a_set_without_a_plan_is_refused(sets, both):
    with pytest.raises(ValueError, match="in the plane world none for other"):
        StairsGame(sets | {"other": sets["own"]}, both)


def test_the_game_says_how_it_stands_and_how_it_ended(stairs_game):
    assert "step 0 of 15" in stairs_game.words()
    assert "0: +1" in stairs_game.leads()
    for _ in range(15):
        stairs_game.game.jump(0)
    assert "You are on the top, with a return of 15" in stairs_game.words()


def test_where_the_cube_tumbles_the_game_says_how_it_is_turned(stairs_game):
    stairs_game.start("tumbling", "random")
    stairs_game.game.states[-1] = TumblingWorld().state_at(0.3, 0.05, yaw=math.radians(12))
    assert "mm, turned by 12°. The planner" in stairs_game.words()


def test_without_a_kernel_the_planners_games_can_be_stepped_through(stairs_game, both, monkeypatch):
    assert "text/html" not in stairs_game._repr_mimebundle_()
    monkeypatch.setenv("STAIRLAB_BOOK", "1")
    page = stairs_game._repr_mimebundle_()["text/html"]
    assert "stairlab-player" in page
    assert page.count("data:image/png") == 2 * (max(len(plans["own"]) for plans in both.values()) + 1) + 1  # one twice
    assert f"return {both['plane']['own'].value:.0f}" in page


def controls_of(widget):
    found = {}
    waiting = [widget]
    while waiting:
        one = waiting.pop()
        waiting += getattr(one, "children", ())
        if isinstance(
            one, (ipywidgets.Button, ipywidgets.SelectionSlider, ipywidgets.ToggleButtons, ipywidgets.Checkbox)
        ):
            found[one.description] = one
        elif isinstance(one, ipywidgets.HTML):
            found["picture" if "<img" in one.value else "words"] = one
    return found


def test_in_the_widget_buttons_jump_undo_and_restart(stairs_game):
    there = controls_of(stairs_game.widget())
    pictures = [there["picture"].value]
    assert there["Undo"].disabled
    there["motion"].value = 1
    there["Jump"].click()
    assert stairs_game.game.actions == [1]
    assert "+3 steps" in there["words"].value
    pictures.append(there["picture"].value)
    there["show where each motion leads"].value = True
    assert "From here" in there["words"].value
    there["show where each motion leads"].value = False
    there["Undo"].click()
    assert stairs_game.game.actions == []
    there["motion"].value = 0
    there["Jump"].click()
    pictures.append(there["picture"].value)
    there["Restart"].click()
    assert stairs_game.game.actions == []
    assert len(set(pictures)) == 3


def test_in_the_widget_another_set_begins_another_game(stairs_game):
    there = controls_of(stairs_game.widget())
    there["Jump"].click()
    there["set"].value = "random"
    assert (stairs_game.name, stairs_game.game.actions) == ("random", [])
    assert len(there["motion"].options) == 4
    assert ", C" not in there["motion"].options[0][0]
    there["set"].value = "own"
    assert there["motion"].options[1][0] == "1: 600 N, 75°, C2"


def test_in_the_widget_another_world_begins_another_game(stairs_game):
    there = controls_of(stairs_game.widget())
    there["Jump"].click()
    there["world"].value = "tumbling"
    assert (stairs_game.world, stairs_game.game.actions, stairs_game.game.tumbles) == ("tumbling", [], True)
    there["Jump"].click()
    assert stairs_game.game.actions == [0]


def test_in_the_widget_a_finished_game_takes_no_jump_until_one_is_undone(stairs_game):
    there = controls_of(stairs_game.widget())
    stairs_game.game.max_jumps = 2
    for _ in range(2):
        there["Jump"].click()
    assert there["Jump"].disabled
    assert "the end of the episode, with a return of 2" in there["words"].value
    there["Undo"].click()
    assert not there["Jump"].disabled


def test_in_the_widget_a_jump_that_does_not_come_to_rest_is_told(stairs_game, monkeypatch):
    there = controls_of(stairs_game.widget())

    def tumble(action):
        raise RuntimeError("The jump was not over.")

    monkeypatch.setattr(stairs_game.game, "jump", tumble)
    there["Jump"].click()
    assert "was not over" in there["words"].value
