"""YAML of strangers: aliases and nesting are bounded before anything is built of them."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from actors.bag.yaml_text import load_yaml
from actors.interfaces.std_msgs.msg import String
from actors.launch.errors import LaunchError
from actors.launch.loading import load as load_launch
from actors.parameters import ros_yaml
from actors.parameters.files import InvalidParams, ParameterOverrides
from actors.parameters.text import parse_parameter
from actors.transport.security.document import Document, SecurityError
from actors.yaml_bounds import check_yaml
from cli.command import CommandFailed
from cli.values import read_values
from robot.nodes.map_files import InvalidMap, read_map

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


ODD = [
    'x: "\\U00110000"', 'x: "\\UFFFFFFFF"', "x: !!timestamp foo", "x: !!bool maybe", "x: !!int ''", "x: !!int abc", f"x: {'9' * 5000}",
    "x: 2001-99-99", "x: !!float a", "x: 2001-01-01 00:00:00 +99:99", f"%YAML 1.{'1' * 5000}\n--- 1", "x: a\0", "!!set [a]", "? [a]\n: 1",
]  # fmt: skip
"""At each of these PyYAML raises something of its own, or what is no error of YAML at all."""


@pytest.mark.parametrize("text", ODD)
def test_whatever_stands_in_a_file_its_reader_refuses_it_by_its_own_error_of_one_line(
    text: str, tmp_path: Path
) -> None:
    (tmp_path / "a.launch.yaml").write_text(text)
    (tmp_path / "m.yaml").write_text(text)
    refusals: list[str] = []
    for read, refuses in (
        (lambda: ParameterOverrides().with_text(f"/**:\n  ros__parameters:\n    {text}"), InvalidParams),
        (lambda: load_launch(tmp_path / "a.launch.yaml"), LaunchError),
        (lambda: Document(text, "security.yaml"), SecurityError),
        (lambda: load_yaml(text), ValueError),
        (lambda: ros_yaml.load_yaml(text), yaml.YAMLError),
        (lambda: read_values(text.replace("x:", "data:"), String), CommandFailed),
        (lambda: read_map(tmp_path / "m.yaml"), InvalidMap),
        (lambda: parse_parameter("x", text), ()),
    ):
        try:
            read()
        except refuses as refused:  # nothing else may come
            if not isinstance(refused, yaml.YAMLError):
                refusals.append(str(refused))
    assert len(refusals) >= 4
    assert not any("\n" in line for line in refusals)
