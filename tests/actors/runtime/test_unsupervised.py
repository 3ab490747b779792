"""Nodes beside the tree, in the books and out of them."""

from __future__ import annotations

import asyncio

import pytest

from actors import Child, Node, Supervisor, System, run
from actors.runtime.incarnation import incarnation_of
from actors.runtime.record import UNSUPERVISED
from actors.supervision.reasons import ExitReason
from actors.system import system_of
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
        assert (record.state, record.supervised) == ("running", True)
        system.crash(Part, RuntimeError("boom"))
        await asyncio.sleep(0.2)
        assert story == ["tree: it raised RuntimeError: boom"]
        assert (record.state, record.incarnation) == ("running", 2)
        beside = await joined(system, "beside")
        assert [one.supervised for one in system.nodes.values()] == [True, False]
        assert system_of(beside).nodes[(UNSUPERVISED, "beside")].state == "running"


async def test_one_that_failed_and_that_nobody_has_left_is_known_until_the_system_ends() -> None:
    async with run(Supervisor("system", children=[Child(Part, name="tree")]), sinks=()) as system:
        broken, sound = await joined(system, "broken"), await joined(system, "sound")
        incarnation_of(broken).fail(OSError("a loose wire"), "the test")
        await asyncio.sleep(1.0)
        assert [(identity.fqn, str(error)) for identity, error in system.runtime.tree.unsupervised.failed()] == [
            ("/broken", "a loose wire")
        ]
        assert len(system.runtime.tree.unsupervised) == 2
        (line,) = events(system.records, "a node beside the tree failed")
        assert line.fields["node_name"] == "/broken"
        assert system_of(sound).runtime.child_of(incarnation_of(sound)) is not None
        assert system.runtime.child_of(incarnation_of(broken)) is None
    assert len(system.runtime.tree.unsupervised) == 0
    assert [line.split(":")[0] for line in story] == ["broken", "sound", "tree"]
    assert system.nodes.keys() == {("system", "tree")}


async def test_who_leaves_twice_or_by_two_tasks_leaves_once() -> None:
    system = System(sinks=())
    await system.start(Supervisor("system"))
    life = await system.join(Child(Part, name="guest"))
    await asyncio.gather(system.leave(life), system.leave(life), system.stop())
    await system.leave(life)
    assert story == ["guest: it stopped: left"]
    assert asyncio.all_tasks() == {asyncio.current_task()}
