"""Lifecycle nodes in a launch: transitions that are asked of them, and those that they make."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from actors.contracts.contracts import Service, Topic
from actors.interfaces.lifecycle_msgs.msg import State as State
from actors.interfaces.lifecycle_msgs.msg import Transition, TransitionEvent
from actors.interfaces.lifecycle_msgs.srv import ChangeState
from actors.launch import events
from actors.runtime.node import Node

WAIT_SECONDS = 30.0
"""How long a lifecycle node is waited for, and how long its hook may take."""

UP = (1, 3)
"""The transitions to active: configure, activate."""


async def transit(node: Node, names: Iterable[str], transition: int) -> None:
    """Ask lifecycle nodes, by their full names, for one transition each; `node` asks."""
    for name in names:
        await _ask(node, name, transition)


async def take_through(node: Node, name: str, transitions: Iterable[int]) -> None:
    """Take a lifecycle node through transitions in order, up to the first that does not succeed."""
    for transition in transitions:
        if not await _ask(node, name, transition):
            return


async def follow(node: Node, action: Any, emit: Callable[[events.StateTransition], None]) -> None:
    """Emit an event for every transition that the lifecycle node of `action` makes from now on."""
    topic = Topic(TransitionEvent, f"{action.node_name}/transition_event")
    async for message in node.subscribe(topic):
        emit(events.StateTransition(action=action, msg=message))


async def _ask(node: Node, name: str, transition: int) -> bool:
    contract = Service(ChangeState, f"/{name.lstrip('/')}/change_state")
    await node.wait_for(contract, timeout=WAIT_SECONDS)
    request = ChangeState.Request(transition=Transition(id=transition))
    answer = await node.call(contract, request, timeout=WAIT_SECONDS)
    if not answer.success:
        node.log.error(f"{name} did not make the transition {transition}")
    return answer.success
