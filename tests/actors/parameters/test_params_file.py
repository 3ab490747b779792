"""Parameter files and values, as a user meets them."""

from __future__ import annotations

import contextlib
import math
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.parameters.files import InvalidParams, Origin, ParameterOverrides, ParamValue, parse_value

EMPTY = ParameterOverrides()


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("yes", True),
        ("Off", False),
        ("tRUE", "tRUE"),
        ("'yes'", "yes"),
        ("!!str 5", "5"),
        ("5", 5),
        ("-5", -5),
        ("0x10", 16),
        ("010", 8),
        ("-0x10", -16),
        ("9223372036854775807", 2**63 - 1),
        ("9223372036854775808", 9223372036854775808.0),
        ("1.", 1.0),
        (".5", 0.5),
        ("1e3", 1000.0),
        ("0x1p3", 8.0),
        ("-.inf", -math.inf),
        ("+.INF", math.inf),
        (".infinite", ".infinite"),
        (".nanx", ".nanx"),
        ("1e999", "1e999"),
        ("0x1p9999", "0x1p9999"),
        ("1_000", "1_000"),
        ("~", "~"),
        ("null", "null"),
        ("2:1", "2:1"),
        ("[1, 2]", (1, 2)),
        ("[1.0, .5]", (1.0, 0.5)),
        ("[on, off]", (True, False)),
        ("[a, 'on']", ("a", "on")),
        ("[]", ()),
        ("1 # one", 1),
    ],
)
def test_a_value_on_the_command_line_is_typed_as_in_a_file(text: str, value: ParamValue) -> None:
    got = parse_value(text)

    assert got == value
    assert type(got) is type(value)
    assert EMPTY.with_text(f"n:\n  ros__parameters:\n    p: {text}\n").for_node("/n") == {"p": value}


def test_a_long_number_takes_time_in_proportion_to_its_length() -> None:
    begun = time.process_time()
    assert parse_value("9" * 30_000 + "x") == "9" * 30_000 + "x"
    assert parse_value("9" * 30_000) == "9" * 30_000
    assert parse_value("0x" + "f" * 30_000 + "y") == "0x" + "f" * 30_000 + "y"
    assert time.process_time() - begun < 2.0


def test_not_a_number_is_a_double() -> None:
    assert isinstance(value := parse_value(".nan"), float)
    assert math.isnan(value)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "there is no value"),
        ("# only a comment", "there is no value"),
        ("[x, y]", "differ; mind that unquoted y"),
        ("[1, 1.0]", "1 is not 1.0"),
        ("[[1]]", "neither lists nor maps"),
        ("{a: 1}", "not a map"),
        ("*a", "aliases are not supported"),
        ("[1", "not valid YAML"),
        ("'a", "not valid YAML"),
        ("a\x00b", "not valid YAML"),
        ("[" * 3000 + "]" * 3000, "nested more than 100 levels deep"),
    ],
)
def test_a_value_without_a_type_is_refused(text: str, why: str) -> None:
    with pytest.raises(InvalidParams, match=why):
        parse_value(text)


def test_parameters_are_nested_at_will() -> None:
    text = """
    front:
      lidar:
        ros__parameters:
          scan: {rate: 10, range.max: 30.0}
          frame: lidar_link
    """

    assert EMPTY.with_text(text).for_node("/front/lidar") == {
        "scan.rate": 10,
        "scan.range.max": 30.0,
        "frame": "lidar_link",
    }


@pytest.mark.parametrize(
    ("pattern", "reached"),
    [
        ("/**", {"/gait", "/spot/gait", "/spot/leg/gait"}),
        ("/*", {"/gait"}),
        ("*", {"/gait"}),
        ("gait", {"/gait"}),
        ("/*/gait", {"/spot/gait"}),
        ("/**/gait", {"/gait", "/spot/gait", "/spot/leg/gait"}),
        ("/spot/**", {"/spot/gait", "/spot/leg/gait"}),
        ("spot/gait", {"/spot/gait"}),
    ],
)
def test_a_pattern_reaches_the_nodes_it_describes(pattern: str, reached: set[str]) -> None:
    overrides = EMPTY.with_mapping({pattern: {"p": 1}}, source="here")

    assert {node for node in ("/gait", "/spot/gait", "/spot/leg/gait") if overrides.for_node(node)} == reached


def test_the_order_of_first_mention_decides_and_not_how_exact_a_pattern_is() -> None:
    text = "/gait: {ros__parameters: {p: exact}}\n/**: {ros__parameters: {p: wild}}"

    assert EMPTY.with_text(text).for_node("/gait") == {"p": "wild"}


def test_a_pattern_that_comes_again_is_merged_into_its_first_place() -> None:
    overrides = EMPTY.with_rule("p:=1").with_text("/gait: {ros__parameters: {p: 2}}").with_rule("p:=3")

    assert overrides.entries == (("/**", {"p": 3}), ("/gait", {"p": 2}))
    assert overrides.for_node("/gait") == {"p": 2}


def test_an_empty_list_leaves_an_earlier_value_alone() -> None:
    assert EMPTY.with_rule("p:=[1]").with_rule("p:=[]").for_node("/n") == {"p": (1,)}


def test_a_list_with_one_map_is_that_map_and_binary_data_are_bytes() -> None:
    text = "/**:\n  ros__parameters:\n    io:\n      - names: [a]\n        deep: {x: [1, 2]}\n    rest: 1\n    key: !!binary AQID\n"

    assert ParameterOverrides().with_text(text).for_node("/n") == {
        "io.names": ("a",),
        "io.deep.x": (1, 2),
        "rest": 1,
        "key": (b"\x01", b"\x02", b"\x03"),
    }


def test_keys_may_repeat_and_documents_may_follow() -> None:
    text = "n: {ros__parameters: {a: 1}}\nn: {ros__parameters: {b: 2, b: 3}}\n---\nn: {ros__parameters: {c: 4}}"

    assert EMPTY.with_text(text).for_node("/n") == {"a": 1, "b": 3, "c": 4}


def test_overrides_never_change() -> None:
    first = EMPTY.with_rule("p:=1")
    second = first.with_rule("p:=2")
    second.entries[0][1]["p"] = 99

    assert not EMPTY
    assert first.for_node("/n") == {"p": 1}
    assert second.for_node("/n") == {"p": 2}
    assert first != second
    assert first == EMPTY.with_mapping({"/**": {"p": 1}}, source="here")


@pytest.mark.parametrize(
    ("text", "line", "key", "why"),
    [
        ("n:\n  speed: 1", 2, "n/speed", "put 'ros__parameters:' between"),
        ("ros__parameters:\n  a: 1", 1, "ros__parameters", "put '/[*][*]:' above"),
        ("n:\n  ros__parameters: 5", 2, "n", "must hold a map of parameters"),
        ("n:\n  ros__parameters:\n    a:", 3, "a", "has no value"),
        ("n:\n  ros__parameters:\n    a: {b: {c: }}", 3, "a.b.c", "has no value"),
        ("n:\n  ros__parameters:\n    a:\n      - {b: 1}", 4, "a.b", "must be a list"),
        ("n:\n  ros__parameters:\n    a:\n      - {b: [1]}\n      - {b: [2]}", 5, "a", "one map, not more"),
        ("n:\n  ros__parameters:\n    a:\n      - [1]", 4, "a", "neither lists nor maps"),
        ("n:\n  ros__parameters:\n    a: !!binary '?'", 3, "a", "no base64"),
        ("n:\n  ros__parameters:\n    [a]: 1", 3, "n", "a key must be a name"),
        ("/foo*:\n  ros__parameters:\n    a: 1", 2, "/foo*", "wildcards .* whole words"),
        ("a//b:\n  ros__parameters:\n    a: 1", 2, "a//b", "empty word"),
        ("/a:\n  /b:\n    ros__parameters:\n      a: 1", 3, "/a//b", "empty word"),
        ("n:\n  ros__parameters:\n    a: &x 1\n    b: *x", 4, "", "aliases are not supported.*x"),
        ("n:\n\tros__parameters: {}", 2, "", "no tabs"),
        ("just text", 1, "", "start a line with 'node_name:'"),
        ("- a", 1, "", "a map of node names"),
    ],
)
def test_a_mistake_is_told_with_file_line_key_and_remedy(text: str, line: int, key: str, why: str) -> None:
    with pytest.raises(InvalidParams, match=why) as caught:
        EMPTY.with_text(text, source="gait.yaml")

    assert (caught.value.source, caught.value.line, caught.value.key) == ("gait.yaml", line, key)
    assert str(caught.value).startswith(f"gait.yaml:{line}: ")


@pytest.mark.parametrize("text", ["", "# nothing yet\n", "n: {}", "---\n"])
def test_an_empty_file_is_fine(text: str) -> None:
    assert not EMPTY.with_text(text)


def test_a_file_that_is_not_text_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "photo.yaml"
    file.write_bytes(b"\xff\xfe\x00")

    with pytest.raises(InvalidParams, match="not UTF-8"):
        EMPTY.with_file(file)


def test_a_rule_of_many_letters_is_refused_at_once() -> None:
    with pytest.raises(InvalidParams):
        EMPTY.with_rule("a_" * 20_000 + "!:=1")


def test_yaml_is_loaded_only_when_parameters_are_read() -> None:
    code = "import sys; import actors.parameters.files, actors.running.arguments; sys.exit('yaml' in sys.modules)"

    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


names = st.from_regex(r"[a-z]{1,5}", fullmatch=True)
scalars = st.one_of(st.booleans(), st.integers(-(2**63), 2**63 - 1), st.floats(allow_nan=False), st.text(max_size=8))


def written(value: bool | int | float | str) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return '"' + "".join(f"\\U{ord(character):08x}" for character in value) + '"'
    if isinstance(value, float):
        return {math.inf: ".inf", -math.inf: "-.inf"}.get(value) or f"{value:.17e}"
    return str(value)


@given(st.dictionaries(names, scalars, max_size=5))
def test_what_is_written_is_read_back(values: dict[str, bool | int | float | str]) -> None:
    lines = [f"    {name}: {written(value)}\n" for name, value in values.items()]
    got = EMPTY.with_text("n:\n  ros__parameters:\n" + "".join(lines) if lines else "").for_node("/n")

    assert got == values
    assert [type(value) for value in got.values()] == [type(value) for value in values.values()]


@given(st.text(max_size=40))
def test_any_text_is_read_or_refused(text: str) -> None:
    for read in (parse_value, EMPTY.with_text, EMPTY.with_rule):
        with contextlib.suppress(InvalidParams):
            read(text)


def test_the_repr_shows_the_entries() -> None:
    assert repr(EMPTY.with_rule("gait:speed:=0.5")) == "ParameterOverrides({'gait': {'speed': 0.5}})"
    assert EMPTY != {}


@pytest.mark.parametrize("text", ["1\n---\n2", "--- a\n--- b"])
def test_two_values_where_one_is_wanted_are_refused(text: str) -> None:
    with pytest.raises(InvalidParams, match="more than one value; put quotes around a text"):
        parse_value(text)


def test_values_from_a_program_are_kept_as_they_are() -> None:
    overrides = EMPTY.with_mapping({"gait": {"gains": [1, 2.5], "pid.p": 3}, "/**": {"name": b"x"}}, source="here")

    assert overrides.for_node("/gait") == {"gains": [1, 2.5], "pid.p": 3, "name": b"x"}
    assert overrides.for_node("/arm") == {"name": b"x"}


@pytest.mark.parametrize(
    ("mapping", "told"),
    [
        ({"speed": 0.5}, r"here: 'speed': write \{node: \{parameter: value\}\}, where the node '/\*\*' means all"),
        ({"gait": {"pid": {"p": 1.0}}}, "here: gait: pid: a value cannot be a mapping; write 'group.name': value"),
        ({"ga it": {"p": 1.0}}, "here: ga it: not a node name or pattern"),
    ],
)
def test_a_mapping_of_another_form_is_refused(mapping: dict[str, Any], told: str) -> None:
    with pytest.raises(InvalidParams, match=told):
        EMPTY.with_mapping(mapping, source="here")


def test_where_a_value_was_said_is_remembered_until_another_one_takes_its_place() -> None:
    text = "gait:\n  ros__parameters:\n    speed: 1.0\n    pid:\n      p: 2.0\n"
    overrides = EMPTY.with_text(text, source="gait.yaml").with_rule("name:=trot")

    assert overrides.origin("gait", "speed") == Origin("gait.yaml", 3)
    assert overrides.origin("gait", "pid.p") == Origin("gait.yaml", 5)
    assert overrides.origin("/**", "name") == Origin("-p name:=trot")
    again = overrides.with_rule("gait:speed:=3.0")
    assert again.origin("gait", "speed") == Origin("-p gait:speed:=3.0")
    assert overrides.origin("gait", "speed") == Origin("gait.yaml", 3)
    assert str(again.origin("gait", "pid.p").error("too much", "pid.p")) == "gait.yaml:5: pid.p: too much"


def test_what_a_node_is_told_by_its_name_is_known_apart_from_what_patterns_say() -> None:
    overrides = EMPTY.with_rule("a:=1").with_rule("gait:b:=2").with_mapping({"/*": {"c": 3}}, source="here")

    assert overrides.for_node("/gait") == {"a": 1, "b": 2, "c": 3}
    assert overrides.named("/gait") == {"b"}
    assert overrides.named("/arm") == frozenset()


def test_a_surrogate_pair_of_json_is_its_character_and_half_of_one_is_refused() -> None:
    assert parse_value('"a\\ud83d\\ude00"') == "a\U0001f600"
    with pytest.raises(InvalidParams, match="half of a surrogate pair"):
        parse_value('"a\\ud83d"')
