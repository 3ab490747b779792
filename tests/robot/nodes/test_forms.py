"""The forms of the framework in the nodes that are shipped: mailboxes, typed channels, services to await, actions as generators."""

from __future__ import annotations

import ast
import asyncio
import inspect
import pkgutil
from importlib import import_module
from types import ModuleType

from actors import GoalStatus, Node
from actors.testing import Rig
from robot import nodes
from robot.tutorials import move_to_position
from robot.tutorials.move_to_position import MOVE_TO_POSITION, MoveServer

MODULES: list[ModuleType] = [
    import_module(f"robot.nodes.{module.name}") for module in pkgutil.iter_modules(nodes.__path__)
]


def awaited_calls(module: ModuleType) -> int:
    """How often `await self.call(...)` stands in a module."""
    return sum(
        isinstance(part, ast.Await) and isinstance(part.value, ast.Call) and ast.unparse(part.value.func) == "self.call"
        for part in ast.walk(ast.parse(inspect.getsource(module)))
    )


def test_every_form_is_used_by_nodes_of_the_robot() -> None:
    shipped = {
        one for module in MODULES for one in vars(module).values() if inspect.isclass(one) and issubclass(one, Node)
    }
    members = [member for node in shipped for member in vars(node).values()]
    kinds = {type(member).__name__ for member in members}
    assert len(shipped - {Node}) > 15
    assert {"PublisherDeclaration", "ParameterDeclaration"} <= kinds
    assert any(inspect.isasyncgenfunction(member) for member in members)
    assert sum(map(awaited_calls, MODULES)) > 3


async def test_canceling_who_follows_a_goal_closes_its_generator_and_cancels_it(rig: Rig) -> None:
    await rig.start(MoveServer)
    statuses: list[GoalStatus] = []
    followed = 0

    async def follow() -> None:
        nonlocal followed
        goal = rig.me.send_goal(MOVE_TO_POSITION, move_to_position.MoveToPosition.Goal(target_x=50.0))
        try:
            async with goal as running:
                async for _ in running:
                    followed += 1
        finally:
            statuses.append(goal.status)

    consumer = asyncio.create_task(follow())
    await rig.advance(2.0)
    consumer.cancel()
    await asyncio.wait([consumer])
    assert consumer.cancelled() and followed > 0
    assert statuses == [GoalStatus.CANCELED]
    (server,) = (one for one in rig.system.snapshot().services if one.name == "/move_to_position")
    assert server.open == 0  # no goal is left
    stopped_at = rig.node(MoveServer).pose
    await rig.advance(5.0)
    assert 0.0 < stopped_at.x < 50.0
    assert rig.node(MoveServer).pose == stopped_at  # its generator does not run on
