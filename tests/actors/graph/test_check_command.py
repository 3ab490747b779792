"""``python -m actors.check MODULE:TREE``: its findings, its exit codes, and what a failing rig test shows of them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from actors.check.__main__ import main
from tests.actors.testing.test_plugin import suite

TREES = """
from actors import Child, DynamicSupervisor, Node, Supervisor, Topic, publishes, subscribes
from actors.interfaces.std_msgs.msg import String, Int32

CHATTER = Topic(String, "chatter")


class Talker(Node):
    '''Talks.'''

    out = publishes(CHATTER)


class Listener(Node):
    '''Listens.'''

    heard = subscribes(CHATTER)


class Deaf(Node):
    heard = subscribes(Topic(Int32, "chater"))


good = Supervisor("good", children=[Child(Talker), Child(Listener)])
bad = Supervisor("bad", children=[Child(Talker), Child(Deaf)])
worse = Supervisor("worse", children=[Child(Talker), Child(Talker, name="t2", remap={"chatter": "words"}), Child(Deaf, remap={"chater": "chatter"})])


def several():
    return [Talker, Child(Listener)]


def twice():
    return [Talker, Talker]


def pool():
    return DynamicSupervisor("pool", Child(Listener))
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "trees_to_check.py").write_text(TREES, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "trees_to_check", raising=False)
    return tmp_path


@pytest.mark.parametrize("name", ["good", "several"])
def test_a_tree_without_findings_exits_with_0(folder: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([f"trees_to_check:{name}"]) == 0
    assert capsys.readouterr().out == f"no findings in trees_to_check:{name}\n"


def test_findings_are_printed_with_their_remedies_and_exit_with_1(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["trees_to_check:bad"]) == 1
    assert capsys.readouterr().out.splitlines() == [
        "warning: Deaf: it has no docstring; say what it does, publishes, takes and serves",
        "warning: bad/deaf: it takes /chater, which nobody publishes; publish it, remap it, or name it as external; did you mean "
        "'/chatter'?",
        "2 findings in trees_to_check:bad",
    ]


def test_external_names_and_errors_only_can_be_asked_for(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["trees_to_check:pool"]) == 1
    assert main(["trees_to_check:pool", "--external", "/chatter"]) == 0
    assert main(["trees_to_check:bad", "--errors"]) == 0
    capsys.readouterr()
    assert main(["trees_to_check:worse", "--errors"]) == 1
    assert capsys.readouterr().out.splitlines() == [
        "error: worse/deaf: it takes /chatter as std_msgs/msg/Int32, but worse/talker publishes it as std_msgs/msg/String; one topic has "
        "one type",
        "1 finding in trees_to_check:worse",
    ]


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("trees_to_check:god", "trees that it has: Deaf, Listener, Talker, bad, good, pool, several, twice, worse"),
        ("trees_to_check", "write MODULE:TREE"),
        ("no_such_module:tree", "no module named 'no_such_module'"),
        ("trees_to_check:twice", "duplicate id 'talker'"),
    ],
)
def test_what_is_no_tree_is_said_in_one_line_and_exits_with_2(
    folder: Path, name: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([name]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    (line,) = shown.err.splitlines()
    assert line.startswith("python -m actors.check: ")
    assert said in line


def test_it_is_a_command(folder: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "actors.check", "trees_to_check:good"], capture_output=True, text=True, timeout=60, check=False
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (0, "no findings in trees_to_check:good\n", "")


FAILING = """
    from actors import Topic, publishes
    from actors.interfaces.std_msgs.msg import String

    HEARD = Topic(String, "said_by_the_test")

    class Talker(Node):
        out = publishes(Topic(String, "chatter"))

    class Listener(Node):
        @Topic(String, "chater").on()
        def take(self, message): ...

        @HEARD.on()
        def hear(self, message): ...

    async def test_it_listens(rig):
        await rig.start(Talker, Listener)
        rig.publish(HEARD, String())
        assert False

    async def test_before_it_starts(rig):
        assert rig.findings() == ()

    async def test_all_is_connected(rig):
        await rig.start(Talker)
        assert rig.findings() == ()
        assert False
"""


def test_a_failing_test_shows_what_is_not_connected(pytester: pytest.Pytester) -> None:
    outcome = suite(pytester, FAILING)
    outcome.assert_outcomes(failed=2, passed=1)
    headlines = [number for number, line in enumerate(outcome.outlines) if "- check_tree -" in line]
    assert len(headlines) == 1
    assert outcome.outlines[headlines[0] + 1] == (
        "warning: system/listener: it takes /chater, which nobody publishes; publish it, remap it, or name it as external; did you mean "
        "'/chatter'?"
    )
