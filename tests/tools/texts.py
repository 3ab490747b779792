"""Texts that YAML could take for something else, through every writer and reader of parameters: each must come back as it was.

Run as ``python -m tests.tools.texts [--texts N] [--seed S]``; it prints the texts that did not, and ends with 1 if there are any.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from random import Random

from actors.launch.parameters import Layer, effective
from actors.launch.plan import NodeSpec
from actors.launch.program import ros_arguments
from actors.parameters.files import ParameterOverrides
from actors.parameters.ros_yaml import dump_yaml, load_yaml
from actors.parameters.text import parameter_file
from actors.parameters.values import Parameter

ODD = (
    "", " ", "y", "n", "Yes", "off", "true", "null", "~", "1e3", "0483", "0x10", "0o7", "08", "12:30", "1_000", "inf", "-inf", ".nan",
    "Infinity", "NaN", "0x1p3", "123E5", "2001-01-01", "a: b", "- a", "? a", "# no", "a #b", "*a", "&a", "!a", "!!int 3", "%a", "@a", "`a",
    "{a: 1}", "[1, 2]", "|", ">", "---", "...", "<<", "=", "'", '"', "''", "a\nb", "a\n", "\n", "a\tb", "\t", " a", "a ", "a\\b", "é", "\U0001f600",
    "\x85", "\u2028", "\ufeff", "$(var x)", "C:\\dev", "\\d+", "1,5", "1.", ".5", "+1", "-", "--", ",", ":", "a:", ":a", "9" * 20, "1e400",
)  # fmt: skip
LETTERS = "ynYNeE01x.:-+_#'\"[]{}, \n\\|>&*!%@~" + "aé"


def texts(count: int, seed: int) -> Iterator[str]:
    """The odd texts, then texts made at random of what has a meaning in YAML, and of two odd ones."""
    random = Random(seed)
    yield from ODD[:count]
    for number in range(count - len(ODD)):
        if number % 2:
            yield random.choice(ODD) + random.choice(ODD)
        else:
            yield "".join(random.choices(LETTERS, k=random.randint(1, 8)))


def changed(text: str, folder: Path) -> list[str]:
    """The ways on which a text does not come back as it was."""
    values = {"one": text, "list": (text, "plain", text)}
    dumped = parameter_file("/n", [Parameter(name, value) for name, value in values.items()])
    file = folder / "dumped.yaml"
    file.write_text(dumped, encoding="utf-8", newline="")
    for old in folder.glob("launch_params_*"):
        old.unlink()
    words = ros_arguments(NodeSpec("p", "e", "n", "/", [Layer(values)], [], [], [], None), folder)
    found = {
        "param dump, load": ParameterOverrides().with_text(dumped).for_node("/n"),
        "param dump, file": ParameterOverrides().with_file(file).for_node("/n"),
        "launch, program": ParameterOverrides().with_file(words[-1]).for_node("/n"),
        "launch, node": effective("/n", [Layer(values)]),
        "YAML": {name: tuple(v) if isinstance(v, list) else v for name, v in load_yaml(dump_yaml(values)).items()},
    }
    return [way for way, got in found.items() if got != values]


def main() -> int:
    """Print what changed; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--texts", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        for text in texts(options.texts, options.seed):
            for way in changed(text, Path(folder)):
                wrong += 1
                print(f"{text!r}: {way}")
    print(f"{options.texts} texts, {wrong} changed")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
