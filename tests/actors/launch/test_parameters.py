"""Parameters in launch files: their types, their order, files and their wildcards."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from actors.launch.errors import LaunchError
from actors.launch.parameters import Layer, Parameter, ParameterFile, ParameterValue, effective, layers_of, value_of
from actors.launch.substitution import TextSubstitution
from actors.launch.substitutions.values import LaunchConfiguration
from tests.actors.launch.files import context, written


def of_yaml(text: str) -> Any:
    return value_of(context(), TextSubstitution(text=text))


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1", 1),
        ("1.0", 1.0),
        ("true", True),
        ("'1'", "1"),
        ("spot", "spot"),
        ("", ""),
        ("[1, 2.5]", (1.0, 2.5)),
        ("[a, b]", ("a", "b")),
        ("a: [", "a: ["),
        ("5e-1", 0.5),
        ("[1.0, 1e-9]", (1.0, 1e-9)),
        ("12:30", "12:30"),
        ("2001-01-01", "2001-01-01"),
        ("null", "null"),
    ],
)
def test_a_substitution_is_typed_by_the_rules_of_yaml(text: str, value: Any) -> None:
    assert of_yaml(text) == value
    assert type(of_yaml(text)) is type(value)


@pytest.mark.parametrize(
    ("given", "value"),
    [
        ("1", "1"),
        (True, True),
        (3, 3),
        (Path("/x"), "/x"),
        (b"\x01\x02", (b"\x01", b"\x02")),
        ([1, 2], (1, 2)),
        ([1, 2.5], (1.0, 2.5)),
        (["a", 1, True], ("a", "1", "true")),
        ((), ()),
        ([[TextSubstitution(text="1")], ["2"]], (1, 2)),
        (["a", TextSubstitution(text="b")], "ab"),
        (ParameterValue("1"), 1),
        (ParameterValue("1", value_type=str), "1"),
        (ParameterValue(1), 1),
        (ParameterValue(1, value_type=int), 1),
        (ParameterValue(TextSubstitution(text="1"), value_type=float), 1.0),
        (ParameterValue(["tr", TextSubstitution(text="ue")], value_type=bool), True),
        (ParameterValue("[1, 2]", value_type=list[float]), (1.0, 2.0)),
    ],
)
def test_a_value_of_python_keeps_its_type(given: Any, value: Any) -> None:
    assert value_of(context(), given) == value


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (object(), "of type object is no value of a parameter"),
        ([True, 2.5], "the items of an array are of one type"),
        (
            TextSubstitution(text="{a: 1}"),
            "which YAML reads as dict: no value of a parameter; if it is meant as a text",
        ),
        (TextSubstitution(text="[1, [2]]"), "the items of an array are of one type"),
        (ParameterValue("x", value_type=int), "'x' is no int"),
        (ParameterValue("3", value_type=list[int]), "'3' is no list"),
    ],
)
def test_what_is_no_value_is_refused(given: Any, words: str) -> None:
    with pytest.raises((LaunchError, TypeError), match=words):
        value_of(context(), given)


def test_the_last_source_counts_after_those_of_all_nodes(tmp_path: Path) -> None:
    file = written(
        tmp_path,
        "p.yaml",
        "/**: {ros__parameters: {a: 1, b: 1}}\n/arm/*: {ros__parameters: {c: 1}}\nmotor: {ros__parameters: {d: 1}}\n/arm/motor: {ros__parameters: {b: 2}}",
    )
    here = context(arguments={"name": "e"})
    here.scoped.parameters += [("a", 9), ("z", 9)]

    layers = layers_of(
        here,
        [
            file,
            {"c": 3, "deep": {"er": [1, 2]}, (LaunchConfiguration("name"),): "x"},
            Parameter("f", "5"),
            ParameterFile(file),
        ],
    )

    assert effective("/arm/motor", layers) == {"a": 1, "z": 9, "b": 2, "c": 3, "deep.er": (1, 2), "e": "x", "f": 5}
    assert effective("/n", [*layers[:2], Layer({}, source="/none.yaml")]) == {"a": 9, "z": 9}
    assert effective("/leg/motor", layers[2:3]) == {"a": 1, "b": 1}


def test_substitutions_in_a_file_are_replaced_where_that_is_allowed(tmp_path: Path) -> None:
    file = written(tmp_path, "p.yaml", "/**: {ros__parameters: {a: $(var a)}}")
    here = context(arguments={"a": "7", "yes": "true"})

    allowed = layers_of(
        here, [ParameterFile(file, allow_substs=LaunchConfiguration("yes")), ParameterFile(file, allow_substs=True)]
    )
    plain = layers_of(here, [ParameterFile(file, allow_substs="false")])

    assert effective("/n", allowed) == {"a": 7}
    assert effective("/n", plain) == {"a": "$(var a)"}


def test_a_file_that_cannot_be_read_is_left_out_with_a_note(tmp_path: Path) -> None:
    (tmp_path / "latin.yaml").write_bytes(b"\xff\xfe\xff")
    here = context()
    here.scoped.parameters.append("/none.yaml")

    layers = layers_of(here, [tmp_path / "latin.yaml"])

    assert [layer.text for layer in layers] == [None, None]
    assert [str(one) for one in here.problems] == [
        "parameter file /none.yaml cannot be read, so it is left out: No such file or directory",
        f"parameter file {tmp_path}/latin.yaml cannot be read, so it is left out: it is not UTF-8",
    ]


def test_parameters_for_names_that_no_node_has_are_refused() -> None:
    with pytest.raises(LaunchError, match=r"launch file: /n/\[: not a node name or pattern"):
        effective("/n", [Layer({"a": 1}, pattern="/n/[")])


@pytest.mark.parametrize("given", [{"a": 1}, "file.yaml", 3])
def test_parameters_are_a_list(given: Any) -> None:
    with pytest.raises(LaunchError, match="parameters must be a list of files and of dictionaries, not "):
        layers_of(context(), given)
