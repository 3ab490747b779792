"""The grammar where the vectors say nothing: places in errors, units, lists of strings, odd input."""

from __future__ import annotations

from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from actors.interfaces.parse import DefinitionError, parse, parse_type, parse_value


def test_an_error_says_file_line_and_reason() -> None:
    with pytest.raises(DefinitionError) as error:
        parse("int32 a\n\nint32 B\n", "my_pkg", "Sample", "msg", "Sample.msg")
    assert str(error.value).startswith("Sample.msg, line 3: 'B' is not a name for a field")
    assert (error.value.line, error.value.file) == (3, "Sample.msg")


def test_lines_of_later_parts_count_from_the_top_of_the_file() -> None:
    with pytest.raises(DefinitionError, match="line 4: 'x' is there twice"):
        parse("int32 x\n---\nint32 x\nint32 x\n", "my_pkg", "Sample", "srv")


@pytest.mark.parametrize(
    ("package", "name"), [("My", "Sample"), ("my__pkg", "Sample"), ("my_pkg", "sample"), ("my_pkg", "A_B")]
)
def test_names_of_packages_and_types_are_checked(package: str, name: str) -> None:
    with pytest.raises(DefinitionError, match="is not a"):
        parse("", package, name, "msg")


def test_tabs_and_windows_line_ends_are_blanks() -> None:
    part = parse("int32\tx\t5\t# five [m]\r\nstring   s   'a b'   \r\n", "my_pkg", "Sample", "msg").parts[0]
    assert [(f.name, f.default, f.unit) for f in part.fields] == [("x", 5, "m"), ("s", "a b", None)]


def test_an_indented_comment_continues_the_one_of_its_field() -> None:
    part = parse("\nint32 x  # first\n         # second\n# of y\nint32 y\n", "my_pkg", "Sample", "msg").parts[0]
    assert [field.comment for field in part.fields] == [("first", "second"), ("of y",)]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("['a,b', \"c\", d]", ("a,b", "c", "d")),
        ("[a , b ]", ("a", "b")),
        ("[]", ()),
        ("['it\\'s']", ("it's",)),
        ("[a,]", ("a",)),
    ],
)
def test_lists_of_strings(text: str, value: tuple[str, ...]) -> None:
    assert parse_value(parse_type("string[]", None), text) == value


@pytest.mark.parametrize("text", ["[,a]", "['a]", "['a' b]", "a, b", "["])
def test_lists_of_strings_that_are_refused(text: str) -> None:
    with pytest.raises(DefinitionError) as error:
        parse_value(parse_type("string[]", None), text)
    assert error.value.code == "invalid_value"


def test_a_decimal_number_may_have_leading_zeros() -> None:
    assert parse_value(parse_type("int32", None), "010") == 10
    assert parse_value(parse_type("int32", None), "-0b101") == -5


@given(
    st.text(alphabet="abAB_09 =#[]<>'\"\\,.-/\n\tint32string<=4", max_size=60),
    st.sampled_from(["msg", "srv", "action"]),
)
@settings(deadline=None)
def test_any_text_is_read_or_refused_with_the_one_error(text: str, kind: str) -> None:
    with suppress(DefinitionError):  # and no other error
        assert parse(text, "my_pkg", "Sample", kind).name == f"my_pkg/{kind}/Sample"  # type: ignore[arg-type]


def test_empty_comment_lines_at_the_ends_are_left_out_and_two_become_one() -> None:
    part = parse("\n#\n# first\n#\n#\n# second\n#\nint32 x\n", "my_pkg", "Sample", "msg").parts[0]
    assert [field.comment for field in part.fields] == [("first", "", "second")]
