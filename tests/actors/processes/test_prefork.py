"""Where there is no zygote, the interpreters of a tree are started together: a child waits for those before it to be ready, not for Python."""

from __future__ import annotations

import os
import signal

import pytest

from actors import Child, DynamicSupervisor, Node, StartFailed, Supervisor, run
from actors.hosts.launcher import transport_here
from actors.processes import os_process, prefork
from actors.processes.messages import Order
from actors.processes.os_process import Started
from actors.processes.prefork import PreforkPool
from tests.actors.processes.kit import Diary, Scripted, in_order, running, until


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> dict[str, Started]:
    """The last interpreter that was started for each child, by its path, in order."""
    found: dict[str, Started] = {}
    start = os_process.start

    def noted(name: str, *, fenced: bool) -> Started:
        found.pop(name, None)
        found[name] = start(name, fenced=fenced)
        return found[name]

    monkeypatch.setattr(os_process, "start", noted)
    monkeypatch.setattr(prefork, "can_fork", lambda: False)
    return found


async def test_the_interpreters_of_a_tree_start_before_the_first_child_is_ready_and_are_used_in_their_turn(
    diary: Diary, started: dict[str, Started]
) -> None:
    first, second, third = in_order(diary, "first", "second", "third")
    inner = Supervisor("inner", children=[second, DynamicSupervisor("pool", Child(Scripted, args=("", {}))), third])

    async with running(Supervisor("tree", children=[first, inner])):
        assert list(started) == ["tree/first", "tree/inner/second", "tree/inner/third"]
        assert diary.lines("start", "ready") == [
            *("start first", "ready first", "start second", "ready second", "start third", "ready third"),
        ]
        for name, path in (("first", "first"), ("second", "inner/second"), ("third", "inner/third")):
            assert diary.processes(name) == [started[f"tree/{path}"].popen.pid]


async def test_those_whose_turn_never_comes_end_with_the_system(diary: Diary, started: dict[str, Started]) -> None:
    children = in_order(diary, "first", "second", first={"refuse": 1_000})
    with pytest.raises(StartFailed):
        async with run(Supervisor("tree", children=children), signals=False):
            pass

    assert started["tree/second"].popen.returncode == -signal.SIGKILL
    assert diary.lines("start") == ["start first"]


async def test_one_that_dies_before_its_turn_is_replaced(diary: Diary, started: dict[str, Started]) -> None:
    dead: list[int] = []

    class Kills(Scripted):
        """In the first process of the tree: there is none before the second child's."""

        async def on_start(self) -> None:
            await until(lambda: "tree/second" in started)
            popen = started["tree/second"].popen
            os.kill(popen.pid, signal.SIGKILL)
            dead.append(popen.pid)
            await until(lambda: popen.poll() is not None)

    first, second = in_order(diary, "first", "second")
    kills = Child(Kills, name="kills", args=(str(diary.path), {}))
    async with run(Supervisor("tree", children=[first, kills, second]), signals=False):
        assert diary.processes("second") == [started["tree/second"].popen.pid] != dead


def test_a_subtree_gets_one_interpreter_with_all_its_modules_and_a_child_of_another_machine_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made: dict[str, bytes] = {}

    def prepared(name: str, frame: bytes, *, fenced: bool, zygote: None) -> None:
        made[name] = frame

    monkeypatch.setattr(prefork, "can_fork", lambda: False)
    monkeypatch.setattr(prefork, "prepared", prepared)
    first = Child(Scripted, name="first", args=("", {}), process=True)
    pair = Supervisor("pair", children=[Child(Scripted, args=("", {})), Supervisor("pool", children=[Child(Node)])])
    far = Child(Scripted, name="far", args=("", {}), host="base")
    tree = Supervisor("tree", children=[first, pair.replace(process=True), far])
    order = Order(first, ("tree", "first"), 0, 20, None, transport_here, 0)

    PreforkPool(tree, ("tree",), order)

    assert list(made) == ["tree/first", "tree/pair"]
    assert Scripted.__module__.encode() in made["tree/pair"] and Node.__module__.encode() in made["tree/pair"]
