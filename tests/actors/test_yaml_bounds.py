"""YAML of strangers: aliases and nesting are bounded before anything is built of them."""

from __future__ import annotations

import pytest
import yaml

from actors.bag.yaml_text import load_yaml
from actors.parameters.text import parse_parameter
from actors.yaml_bounds import check_yaml

BOMB = "a0: &a0 [x, x]\n" + "".join(f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]\n" for n in range(1, 30))
MERGES = "a0: &a0 {k0: 1}\n" + "".join(
    f"a{n}: &a{n} {{<<: [{', '.join([f'*a{n - 1}'] * 9)}], k{n}: 1}}\n" for n in range(1, 30)
)


@pytest.mark.parametrize("text", [BOMB, MERGES])
def test_aliases_that_multiply_are_refused_with_their_place(text: str) -> None:
    with pytest.raises(yaml.MarkedYAMLError, match="its aliases stand for too many values") as refused:
        check_yaml(text)
    assert refused.value.problem_mark is not None
    assert 1 < refused.value.problem_mark.line < 10


@pytest.mark.parametrize(
    "text", ["[" * 5000, "{a: " * 3000, "- " * 3000 + "x", "\n".join(f"{' ' * n}k:" for n in range(300)) + " 1"]
)
def test_what_is_nested_too_deeply_is_refused(text: str) -> None:
    with pytest.raises(yaml.YAMLError, match="nested more than 100 levels deep"):
        check_yaml(text)


@pytest.mark.parametrize(
    "text",
    [
        "&a [1, 2, *a]",
        "x: &a 1\ny: [*a, *a]",
        "x: &a {k: 1}\ny: {<<: *a}",
        "a: 1\n" * 5000,
        "[1, 2, 3]\n",
        "- 1\n" * 300,
        "*a",
    ],
)
def test_plain_texts_pass(text: str) -> None:
    check_yaml(text)


def test_readers_say_that_it_is_no_yaml() -> None:
    with pytest.raises(ValueError, match="it is no YAML"):
        load_yaml(BOMB)
    assert parse_parameter("x", "[" * 5000).value == "[" * 5000
