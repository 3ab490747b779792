"""What spoken words ask for."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.geometry.planar import ZERO_TWIST, Twist2
from robot.nodes.voice import WORDS, interpret


@pytest.mark.parametrize(
    ("words", "vx", "wz"),
    [
        (("forward", "frente", "FORWARD", "Frente", " forward! "), 1.0, 0.0),
        (("back", "trás", "tras", "TRÁS", "tra\u0301s"), -1.0, 0.0),
        (("left", "esquerda", "Esquerda."), 0.0, 1.0),
        (("right", "direita"), 0.0, -1.0),
        (("stop", "parar", "STOP", "Parar!"), 0.0, 0.0),
    ],
)
def test_x_07_words_in_english_and_portuguese(words: tuple[str, ...], vx: float, wz: float) -> None:
    for word in words:
        assert interpret(word) == Twist2(vx, 0.0, wz)


@pytest.mark.parametrize("text", ["stop going forward", "forward stop", "don't stop", "Parar, não frente", "stop_now"])
def test_x_07b_stop_wins_over_any_other_word(text: str) -> None:
    assert interpret(text) == ZERO_TWIST


@pytest.mark.parametrize(
    "text",
    ["don't go forward", "go forward", "forward left", "forwards", "straightforward", "backpack", "", "  ", "jump"],
)
def test_x_07b_anything_but_one_exact_word_moves_nothing(text: str) -> None:
    assert interpret(text) is None


sentences = st.lists(st.sampled_from([*WORDS, "go", "please", "não", "now"]), min_size=2, max_size=6)


@given(sentences, st.sampled_from([" ", ", ", "-", "_", "  "]))
def test_x_07b_a_sentence_stops_or_does_nothing(words: list[str], between: str) -> None:
    expected = ZERO_TWIST if {"stop", "parar"} & set(words) else None
    assert interpret(between.join(words)) == expected


@given(st.sampled_from(sorted(WORDS)), st.sampled_from(["", " ", "!", "...", "\t"]), st.booleans())
def test_one_word_means_the_same_in_any_dress(word: str, around: str, loud: bool) -> None:
    assert interpret(around + (word.upper() if loud else word) + around) == WORDS[word]


@given(st.text(max_size=30))
def test_whatever_is_heard_moves_only_if_it_is_one_of_the_words(text: str) -> None:
    found = interpret(text)
    assert found is None or found in WORDS.values()


def test_the_words_of_both_languages_come_in_pairs_that_mean_the_same() -> None:
    for english, portuguese in (
        ("forward", "frente"),
        ("back", "tras"),
        ("left", "esquerda"),
        ("right", "direita"),
        ("stop", "parar"),
    ):
        assert WORDS[english] == WORDS[portuguese]
    assert len(WORDS) == 10
