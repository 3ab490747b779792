"""The shape of the command line: typing errors, and commands of other packages."""

from __future__ import annotations

from pathlib import Path

import pytest

from cli.command import COMMANDS, added, found
from cli.parsing import actions_of
from cli.verb import Group, Verb
from tests import warm
from tests.cli.conftest import Command

ROOT = Path(__file__).parents[2]


def every_verb() -> list[tuple[str, ...]]:
    verbs: list[tuple[str, ...]] = []
    for name in (*(entry.name for entry in added()), *COMMANDS):
        command = found(name)
        if isinstance(command, Group):
            verbs += [(name, verb) for verb in command.verbs]
        elif isinstance(command, Verb):
            verbs.append((name,))
    return verbs


def verb_of(words: tuple[str, ...]) -> Verb:
    command = found(words[0])
    verb = command.verbs[words[1]] if isinstance(command, Group) else command
    assert isinstance(verb, Verb)
    return verb


def misspelt(word: str) -> str:
    """With two letters exchanged."""
    at = next(at for at in range(len(word) - 1, 0, -1) if word[at] != word[at - 1])
    return word[: at - 1] + word[at] + word[at - 1] + word[at + 1 :]


OTHERS = (("launch",), ("wtf",))
"""Whose words are another program's, or another name of a verb."""


@pytest.mark.parametrize("words", [words for words in every_verb() if words not in OTHERS], ids=" ".join)
async def test_a_misspelt_option_is_one_line_with_the_nearest_one(words: tuple[str, ...], command: Command) -> None:
    options = [option for action in actions_of(verb_of(words).parser()) for option in action.option_strings]
    option = max(options, key=len)
    wrong = await command(*words, misspelt(option), "x", "x", "x")
    assert (wrong.code, wrong.out) == (2, "")
    assert wrong.err.count("\n") == 1
    assert wrong.err.startswith(f"robactor {' '.join(words)}: ")
    assert f"(see robactor {' '.join(words)} --help)" in wrong.err


async def test_the_nearest_option_verb_choice_and_command_are_named(command: Command) -> None:
    for words, near in (
        (("topic", "list", "--shw-types"), "--show-types"),
        (("topic", "ecko", "/a"), "echo"),
        (("bag", "inof", "x"), "info"),
        (("security", "chekc"), "check"),
        (("bag", "info", "x", "--sort", "nmae"), "name"),
        (("pkg", "create", "a", "--build-type", "ament_pyhton"), "ament_python"),
        (("topci", "list"), "topic"),
        (("map_savre_cli",), "map_saver_cli"),
    ):
        wrong = await command(*words)
        assert (wrong.code, wrong.out) == (2, ""), words
        assert f"; did you mean {near}? (see robactor" in wrong.err, words
        assert wrong.err.count("\n") == 1


def test_every_verb_can_be_carried_out() -> None:
    """Where it says it is, there is a function."""
    for words in every_verb():
        assert callable(verb_of(words).loaded()), words


GREETING = """
from cli.verb import Verb

async def greet(options):
    print(f"hello {options.name}")
    return 0

def arguments(parser):
    parser.add_argument("name", nargs="?", default="robot")
    parser.add_argument("--loudly", action="store_true")

GREET = Verb("greet", "says hello", arguments, greet)
"""


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """An installed package that adds a command, and one whose module is not there."""
    (tmp_path / "greeting.py").write_text(GREETING)
    info = tmp_path / "greeting-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: greeting\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[robactor.verbs]\ngreet = greeting:GREET\nlost = nowhere:LOST\n")
    for name, content in (("empty", b""), ("odd", b"[robactor.verbs\n\xff=\n=\n[]\n")):
        (tmp_path / f"{name}-1.0.dist-info").mkdir()
        (tmp_path / f"{name}-1.0.dist-info" / "entry_points.txt").write_bytes(content)
    return tmp_path


def test_another_package_adds_a_command(package: Path) -> None:
    def robactor(*words: str) -> tuple[int, str, str]:
        done = warm.run(*words, env={"PYTHONPATH": f"{package}:{ROOT}"})
        return done.returncode, done.stdout, done.stderr

    assert robactor("greet") == (0, "hello robot\n", "")
    assert robactor("greet", "you") == (0, "hello you\n", "")
    assert robactor("greet", "--luodly") == (
        2,
        "",
        "robactor greet: unrecognized arguments: --luodly; did you mean --loudly? (see robactor greet --help)\n",
    )
    assert robactor("completion", "words", "gr") == (0, "greet\ngraph\n", "")
    assert robactor("completion", "words", "greet", "--l") == (0, "--loudly\n", "")
    helped = robactor("--help")[1]
    assert "  greet         says hello\n" in helped
    assert "  lost          (lost cannot be loaded from nowhere:LOST: No module named 'nowhere')\n" in helped
    assert robactor("lost") == (1, "", "lost cannot be loaded from nowhere:LOST: No module named 'nowhere'\n")
    assert robactor("gret")[2] == "robactor: there is no command 'gret'; did you mean greet? (see robactor --help)\n"
