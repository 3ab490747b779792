"""Laws of names."""

from __future__ import annotations

import string
from collections.abc import Callable

from hypothesis import given
from hypothesis import strategies as st

from actors.names import names
from actors.names.names import InvalidName

words = st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,6}", fullmatch=True)
namespaces = st.lists(words, max_size=3).map(lambda parts: "/" + "/".join(parts))
relative = st.lists(words, min_size=1, max_size=3).map("/".join)
anything = st.text(alphabet=string.ascii_letters + string.digits + "_/~{}- é\n", max_size=12)


def objection(validate: Callable[[str], None], text: str) -> InvalidName | None:
    try:
        validate(text)
    except InvalidName as error:
        return error
    return None


@given(relative, words, namespaces)
def test_a_full_name_is_expanded_to_itself_by_everybody(name: str, node: str, namespace: str) -> None:
    full = names.expand(name, node, namespace)

    assert names.expand(full, "other", "/elsewhere") == full
    names.validate_full_name(full)


@given(relative, words, namespaces)
def test_a_private_name_is_the_relative_name_of_a_namespace_called_like_the_node(
    name: str, node: str, namespace: str
) -> None:
    below = names.fully_qualified(namespace, node)

    assert names.expand(f"~/{name}", node, namespace) == names.expand(name, node, below)


@given(anything)
def test_every_validator_answers_or_points_into_the_text(text: str) -> None:
    validators = (names.validate_name, names.validate_full_name, names.validate_namespace, names.validate_node_name)
    for validate in validators:
        error = objection(validate, text)
        assert error is None or (error.text == text and 0 <= error.index <= max(len(text) - 1, 0))


@given(anything)
def test_a_full_name_is_also_a_name_and_a_namespace(text: str) -> None:
    if objection(names.validate_full_name, text) is None:
        names.validate_name(text)
        names.validate_namespace(text)


@given(anything)
def test_the_cached_expansion_agrees_with_the_plain_one(text: str) -> None:
    def answer(substitutions: dict[str, str] | None) -> str:
        try:
            return names.expand(text, "node", "/ns", substitutions)
        except InvalidName as error:
            return error.code

    assert answer(None) == answer({})


@given(relative)
def test_hidden_means_that_some_word_begins_with_an_underscore(name: str) -> None:
    hidden = any(word.startswith("_") for word in name.split("/"))

    assert names.is_hidden(name) == names.is_hidden(f"/{name}") == hidden
