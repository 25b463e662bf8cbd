"""Predictions: a guess is recorded, the answer revealed, and the two compared; with a widget or without."""

import pytest

from stairlab.course import my_predictions, predict


@pytest.mark.parametrize(
    ("guess", "verdict"),
    [
        (4, "right"),
        (4.2, "close enough"),
        (5, "25 % too high"),
        (3, "25 % too low"),
        (40, "too high, by a factor of 10"),
        (0, "too low, by far"),
        (-4, "too low"),
    ],
)
def test_a_number_is_compared_in_words(guess, verdict):
    assert verdict in repr(predict("How many?", 4, unit="steps", guess=guess))


def test_nought_as_answer_has_no_percentage():
    assert "too high" in repr(predict("How much?", 0, guess=1))
    assert "right" in repr(predict("How much?", 0, guess=0))


def test_a_choice_is_right_or_not_and_the_reason_is_given():
    asked = predict("Which?", "up", ["up", "down"], because="It flies.")
    assert asked.commit("down") == "You said “down”, it is “up”: not this one. It flies."


def test_the_answer_is_worked_out_only_when_it_is_needed():
    asked = predict("How many?", lambda: 1 / 0)
    assert "How many?" in repr(asked)
    with pytest.raises(ZeroDivisionError):
        asked.commit(1)


def test_the_first_guess_counts():
    asked = predict("Which one?", 2)
    asked.commit(1)
    assert "You said 1" in asked.commit(2)


def test_guesses_are_recorded():
    predict("A question for the record?", 10, guess=10)
    row = my_predictions().set_index("question").loc["A question for the record?"]
    assert (row.guess, row.answer, row.verdict) == (10, 10, "right")


def test_a_question_without_a_guess_is_not_recorded():
    predict("Nobody answers this?", 1)
    assert "Nobody answers this?" not in set(my_predictions().question)


@pytest.mark.parametrize("guess", ["", "many", None, float("nan"), [1]])
def test_a_guess_that_is_no_number_is_refused(guess):
    with pytest.raises(ValueError, match="guess must be a number"):
        predict("How many?", 1).commit(guess)


def test_a_guess_must_be_one_of_the_choices_and_so_must_the_answer():
    with pytest.raises(ValueError, match="guess must be one of"):
        predict("Which?", "a", ["a", "b"], guess="c")
    with pytest.raises(ValueError, match="answer must be one of the choices"):
        predict("Which?", "c", ["a", "b"])


def test_the_widget_tells_after_the_button_is_pressed_and_not_before():
    asked = predict("How many now?", 4)
    _, field, button, reply = asked.widget().children
    assert reply.value == ""
    button.click()
    assert "Write a number first" in reply.value
    field.value = "5"
    button.click()
    assert "You said 5, it is 4" in reply.value
    assert field.disabled
    assert asked.guess == 5


def test_the_widget_of_choices_has_none_chosen_at_first():
    _, field, button, reply = predict("Which way?", "up", ["up", "down"]).widget().children
    assert field.value is None
    button.click()
    assert "Choose one first" in reply.value
    field.value = "up"
    button.click()
    assert "right" in reply.value


def test_a_page_without_a_kernel_folds_the_answer():
    page = predict("Is 1 < 2?", "yes", ["yes", "no"], because="Count.")._repr_html_()
    assert "Is 1 &lt; 2?" in page
    assert "<details>" in page
    assert page.index("<details>") < page.index("Count.")
    assert "<li>no</li>" in page


def test_words_of_a_question_are_never_markup(monkeypatch):
    asked = predict("<b>?", 1)
    assert "<b>" not in asked._repr_html_()
    assert "<b>" not in asked.widget().children[0].value
