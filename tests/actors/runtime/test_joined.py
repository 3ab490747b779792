"""Nodes beside the tree: when they are known, and when they end."""

from __future__ import annotations

import asyncio

import pytest

from actors import Child, Node, Supervisor, System, run
from actors.checks import create
from actors.errors import NotRunning
from actors.runtime.incarnation import incarnation_of
from actors.supervision.reasons import ExitReason
from actors.system import system_of
from actors.testing import Rig
from tests.stage import events

pytestmark = pytest.mark.virtual


class Part(Node):
    """Notes its end."""

    async def on_stop(self, reason: ExitReason) -> None:
        await self.clock.sleep(0.1)
        story.append(f"{self.name}: {reason}")


story: list[str] = []


@pytest.fixture(autouse=True)
def _new_story() -> None:
    story.clear()


async def joined(system: System, name: str) -> Node:
    return (await system.join(Child(Part, name=name))).node


async def test_nodes_beside_the_tree_end_before_the_tree_the_newest_first_and_one_after_the_other() -> None:
    async with run(Supervisor("system", children=[Child(Part, name="tree")]), sinks=()) as system:
        for name in ("first", "second", "third"):
            await joined(system, name)
        before = system.clock.now()
    assert story == [f"{name}: it stopped: the block was left" for name in ("third", "second", "first", "tree")]
    assert asyncio.get_running_loop().time() - before == pytest.approx(0.4)


@pytest.mark.parametrize("root", ["guests", "unsupervised", "rig", "replay", "system", "(unsupervised)"])
async def test_a_tree_of_any_name_is_supervised_and_cleaned_up(root: str) -> None:
    async with run(Supervisor(root, [Child(Part, name="tree")]), sinks=()) as system:
        (record,) = system.nodes.values()
        tree = system.runtime.tree
        assert (record.state, tree.holds(record.path)) == ("running", True)
        system.crash(Part, RuntimeError("boom"))
        await asyncio.sleep(0.2)
        assert story == ["tree: it raised RuntimeError: boom"]
        assert (record.state, record.incarnation) == ("running", 2)
        beside = await joined(system, "beside")
        assert [tree.holds(path) for path in system.nodes] == [True, False]
        assert system_of(beside).nodes[("/unsupervised", "beside")].state == "running"


async def test_one_that_failed_and_that_nobody_has_left_is_known_until_the_system_ends() -> None:
    async with run(Supervisor("system", children=[Child(Part, name="tree")]), sinks=()) as system:
        broken, sound = await joined(system, "broken"), await joined(system, "sound")
        incarnation_of(broken).fail(OSError("a loose wire"), "the test")
        await asyncio.sleep(1.0)
        assert [(identity.fqn, str(error)) for identity, error in system.master.joined.failed()] == [
            ("/broken", "a loose wire")
        ]
        assert len(system.master.joined) == 2
        (line,) = events(system.records, "a node beside the tree failed")
        assert line.fields["node_name"] == "/broken"
        assert incarnation_of(sound).child is not None
        assert incarnation_of(broken).child is None
    assert len(system.master.joined) == 0
    assert [line.split(":")[0] for line in story] == ["broken", "sound", "tree"]
    assert system.nodes.keys() == {("system", "tree")}


async def test_who_leaves_twice_or_by_two_tasks_leaves_once() -> None:
    system = create(System, sinks=())
    await system.start(Supervisor("system"))
    life = await system.join(Child(Part, name="guest"))
    await asyncio.gather(system.leave(life), system.leave(life), system.stop())
    await system.leave(life)
    assert story == ["guest: it stopped: left"]
    assert asyncio.all_tasks() == {asyncio.current_task()}


async def test_of_two_that_open_a_system_at_once_one_that_gives_up_does_not_end_it_for_the_other() -> None:
    system = create(System, sinks=())
    joins = [asyncio.create_task(system.join(Child(Part, name=name))) for name in ("first", "second")]
    await asyncio.sleep(0)
    joins[0].cancel()
    second = await joins[1]
    assert joins[0].cancelled()
    assert (second.node.name, len(system.nodes)) == ("second", 1)
    await system.leave(second)
    await system.stop()
    assert story == ["second: it stopped: left"]
    assert asyncio.all_tasks() == {asyncio.current_task()}


async def test_one_that_joins_while_the_system_is_stopped_is_refused() -> None:
    system = create(System, sinks=())
    join = asyncio.create_task(system.join(Child(Part)))
    await asyncio.sleep(0)
    await system.stop("enough")
    with pytest.raises(NotRunning, match=r"has been stopped \(enough\)"):
        await join
    assert asyncio.all_tasks() == {asyncio.current_task()}


async def test_one_that_leaves_while_the_system_stops_waits_for_its_turn() -> None:
    system = create(System, sinks=())
    await system.start(Supervisor("system"))
    first, _ = [await system.join(Child(Part, name=name)) for name in ("first", "second")]
    stop = asyncio.create_task(system.stop())
    await asyncio.sleep(0)
    await system.leave(first)
    assert story == ["second: it stopped: stop", "first: it stopped: stop"]
    await stop


async def test_the_nodes_of_two_namespaces_may_have_one_name_and_a_name_is_free_again_after_an_end() -> None:
    async with run(Supervisor("system"), sinks=()) as system:
        left, right = [await system.join(Child(Part, name="eye", namespace=side)) for side in ("left", "right")]
        assert [left.node.fqn, right.node.fqn] == ["/left/eye", "/right/eye"]
        incarnation_of(left.node).fail(OSError("a loose wire"), "the test")
        await asyncio.sleep(1.0)
        again = await system.join(Child(Part, name="eye", namespace="left"))
        with pytest.raises(OSError, match="a loose wire"):
            await system.leave(left)
        assert again.node.incarnation == 2
        assert [record.state for record in system.nodes.values()] == ["running", "running"]
        assert not system.reports


async def test_what_runs_nowhere_is_stopped_and_not_in_the_tree(rig: Rig) -> None:
    await rig.start(Node)
    tree = rig.system.runtime.tree
    assert (tree.state_of(("nowhere", "node")), tree.holds(("nowhere", "node"))) == ("stopped", False)
