"""Sliders on a function that draws, players that need no kernel, and budgets."""

import re

import numpy as np
import pytest

from stairlab import StairWorld, alt_text, new_figure, plot_world
from stairlab.course import animate, budget, explore
from stairlab.course.player import Control, Player
from stairlab.drawing import img, png, quick_png, small_png


def draw(height: float = 2, word: str = "a", flag: bool = False):
    figure, ax = new_figure(f"A bar of height {height}, {word}, {flag}.", size=(2, 1.5))
    ax.bar([0], [height], hatch="/" if flag else None)
    return figure


def draw_jump(magnitude=450, angle=65):
    return plot_world(StairWorld().jump(magnitude, angle, trajectory=True))


CONTROLS = {"height": range(1, 6), "word": ["a", "b"], "flag": (False, True)}


def alts(page: str) -> list[str]:
    return re.findall(r'"alt": "([^"]*)"', page)


def test_an_exploration_starts_where_the_functions_defaults_are():
    widget = explore(draw, **CONTROLS).widget()
    *controls, picture = widget.children
    assert [control.value for control in controls] == [2, "a", False]
    assert 'alt="A bar of height 2, a, False."' in picture.value


def test_moving_a_control_draws_anew():
    *controls, picture = explore(draw, **CONTROLS).widget().children
    for control, value in zip(controls, (5, "b", True), strict=True):
        control.value = value
    assert 'alt="A bar of height 5, b, True."' in picture.value


def test_numbers_and_many_words_are_sliders_few_words_buttons_and_truth_is_ticked():
    kinds = [type(child).__name__ for child in explore(draw, **CONTROLS).widget().children]
    assert kinds == ["SelectionSlider", "ToggleButtons", "Checkbox", "HTML"]
    many = explore(draw, word=list("abcdefgh")).widget()
    assert type(many.children[0]).__name__ == "SelectionSlider"


def test_a_control_has_its_label_and_unit():
    widget = explore(draw, {"height": "height [m]"}, height=np.arange(1.0, 4)).widget()
    assert widget.children[0].description == "height [m]"


def test_what_goes_wrong_while_drawing_is_shown_in_place_of_the_picture():
    def fails(height: int = 1):
        return draw(height) if height < 2 else draw(1 / 0)

    control, picture = explore(fails, height=[1, 2]).widget().children
    with pytest.raises(ZeroDivisionError):
        control.value = 2
    assert "ZeroDivisionError: division by zero" in picture.value
    control.value = 1
    assert "<img" in picture.value


def test_without_a_kernel_there_is_a_picture_for_each_combination():
    page = explore(draw, **CONTROLS).player()._repr_html_()
    assert len(alts(page)) == 5 * 2 * 2
    assert alts(page)[-1] == "A bar of height 5, b, True."
    assert page.count('type="range"') == 3
    assert "://" not in re.sub(r"base64,[^\"]*", "", page)


def test_a_fine_slider_has_some_of_its_values_without_a_kernel_and_its_start_is_one():
    player = explore(draw, height=range(1, 400)).player(most=8)
    assert len(player) <= 8
    (control,) = player.controls
    assert control.values[control.start] == "2"
    assert control.values[-1] == "399"


def test_the_book_shows_both_and_a_notebook_only_what_is_live(monkeypatch):
    monkeypatch.delenv("STAIRLAB_BOOK", raising=False)
    assert "text/html" not in explore(draw, height=[1, 2])._repr_mimebundle_()
    monkeypatch.setenv("STAIRLAB_BOOK", "1")
    both = explore(draw, height=[1, 2])._repr_mimebundle_()
    assert "stairlab-player" in both["text/html"]
    assert "application/vnd.jupyter.widget-view+json" in both


def test_without_ipywidgets_there_is_the_player(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "ipywidgets", None)
    shown = explore(draw, height=[1, 2])._repr_mimebundle_()
    assert set(shown) == {"text/plain", "text/html"}


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda: explore(draw), "needs a control"),
        (lambda: explore(draw, width=[1, 2]), "an argument width with a default"),
        (lambda: explore(draw, height=[7, 8]), "starts at its default 2, which is not among its values"),
        (lambda: explore(draw, height=[]), "not among its values"),
        (lambda: Player([], []), "figures must be"),
        (lambda: Player([draw()], [Control("a", ["1", "2"])]), "2 in all, not 1"),
        (lambda: animate(draw, []), "figures must be"),
        (lambda: new_figure(" "), "alt must say"),
        (lambda: new_figure("A figure.", panels=0), "at least 1"),
    ],
)
def test_errors_say_what_was_expected(wrong, words):
    with pytest.raises(ValueError, match=words):
        wrong()


def test_an_animation_can_be_played_paused_and_stepped_through():
    page = animate(draw, [1, 2, 3], "height [m]")._repr_html_()
    assert alts(page) == [f"A bar of height {i}, a, False." for i in (1, 2, 3)]
    assert 'aria-label="one step back"' in page
    assert ">Play</button>" in page
    assert "height [m]" in page


def test_two_players_on_a_page_have_different_ids():
    player = animate(draw, [1, 2])
    assert player._repr_html_().split()[1] != player._repr_html_().split()[1]


def test_alternative_text_cannot_break_out_of_its_page():
    def nasty(height: int = 1):
        return new_figure('</script><b onload="x">&' + str(height), size=(1, 1))[0]

    page = explore(nasty, height=[1, 2]).player()._repr_html_()
    assert page.count("</script>") == 2
    assert "<b onload" not in page


def test_a_new_figure_has_its_words_and_as_many_panels_as_asked_for():
    figure, axes = new_figure("Three panels.", panels=3)
    assert len(axes) == len(figure.axes) == 3
    assert alt_text(figure) == "Three panels."
    assert 'alt="Three panels."' in figure._repr_html_()


def test_small_and_quick_pictures_show_the_same():
    import io

    from PIL import Image

    figure = draw_jump()
    exact, small = (
        np.asarray(Image.open(io.BytesIO(data)).convert("RGB"), dtype=int) for data in (png(figure), small_png(figure))
    )
    assert np.abs(exact - small).mean() < 1
    assert len(small_png(figure)) < 0.6 * len(png(figure))
    assert quick_png(figure).startswith(b"\x89PNG")
    assert img(png(figure), 'a "quoted" word').count('"') == 8


def test_a_budget_is_smaller_where_a_quick_look_is_asked_for(monkeypatch):
    monkeypatch.delenv("STAIRLAB_FAST", raising=False)
    assert budget(3000, 30) == 3000
    monkeypatch.setenv("STAIRLAB_FAST", "1")
    assert budget(3000, 30) == 30
