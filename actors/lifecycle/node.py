"""`LifecycleNode`: nodes that are configured, activated, deactivated and cleaned up on request, by the rules of ROS 2.

While a node is not active, its publishers discard messages and its timers do not tick; messages, requests and parameters are handled in
every state but finalized, in which a node has its standard services only. After a restart the new incarnation is brought to the state
that was last requested of the node.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Sequence
from typing import Any, ClassVar, Final, Literal, TypeAlias

from actors.errors import NotRunning, ProgramExit, described
from actors.inbox.control import blame
from actors.interfaces.message import Message, ServiceType
from actors.lifecycle.machine import (
    HookResult,
    LifecycleMachine,
    LifecycleState,
    LifecycleTransition,
    TransitionRefused,
    transitions_from,
)
from actors.lifecycle.services import SERVICES, transition_event
from actors.runtime.incarnation import Incarnation, incarnation_of
from actors.runtime.node import Node
from actors.system import System

PrimaryState: TypeAlias = Literal["unconfigured", "inactive", "active"]
"""The states in which a lifecycle node may stay."""
_WAY: Final[dict[str, tuple[str, ...]]] = {
    "unconfigured": (),
    "inactive": ("configure",),
    "active": ("configure", "activate"),
}

_UP: Final = {
    "configure": (LifecycleState.INACTIVE, LifecycleState.ACTIVE),
    "activate": (LifecycleState.ACTIVE,),
}
"""Request -> the states in which it has nothing to do."""


class LifecycleNode(Node):
    """A node with a lifecycle. Hooks get the primary state from which they come; None means SUCCESS, an exception means ERROR.

    `autostart` is the state to which a new node goes by itself, as a part of its start phase; siblings that start after it wait for that.

    Invariants: between two transitions, publishers deliver and timers tick exactly while the node is active. Both are switched at the end
    of a transition, when its hooks have run. A finalized node has no endpoints but its standard services.
    """

    autostart: ClassVar[PrimaryState] = "unconfigured"
    managed = True

    async def on_configure(self, previous: LifecycleState) -> HookResult | None:
        """Get what the node needs: parameters, buffers, connections."""
        return None

    async def on_cleanup(self, previous: LifecycleState) -> HookResult | None:
        """Give back what on_configure took."""
        return None

    async def on_activate(self, previous: LifecycleState) -> HookResult | None:
        """About to work: publishers deliver and timers run once this has succeeded."""
        return None

    async def on_deactivate(self, previous: LifecycleState) -> HookResult | None:
        """About to rest: what is published here is still delivered."""
        return None

    async def on_shutdown(self, previous: LifecycleState) -> HookResult | None:
        """The end, from whichever state."""
        return None

    async def on_fault(self, previous: LifecycleState) -> HookResult | None:
        """A hook failed with ERROR (rclpy's ``on_error``): SUCCESS leads to unconfigured, anything else to finalized."""
        return None

    @property
    def state(self) -> LifecycleState:
        """The state now."""
        return self._machine.state

    async def change_state(self, label: str = "", transition_id: int = 0) -> bool:
        """Run a transition; a label beats an id. True when its hook succeeded. Raises `TransitionRefused`.

        The node always comes to a primary state: an exception that leaves a hook counts as ERROR, and so does a cancellation, which is
        raised again after `on_fault` has run.
        """
        try:
            return await self._change_state(label, transition_id)
        finally:
            if self._machine.state is LifecycleState.FINALIZED:
                incarnation_of(self).endpoints.retire(lambda: NotRunning(f"{self.fqn} has been shut down"))

    async def _change_state(self, label: str, transition_id: int = 0) -> bool:
        machine = self._machine
        hook = machine.begin(label, transition_id)
        ending: BaseException | None = None
        while True:
            try:
                result = await self._run_hook(hook.name, hook.previous)
            except BaseException as error:
                ending = ending or self._hook_failed(hook.name, error)
                result = HookResult.ERROR
            following = machine.finish(result)
            if following is None:
                break
            hook = following
        self._follow()
        if machine.state.label in _WAY:
            incarnation_of(self).record.asked_state = machine.state.label
        if ending is not None:
            raise ending
        return machine.succeeded

    def _hook_failed(self, hook: str, error: BaseException) -> BaseException | None:
        """Log the error of a hook. Returns what is to be raised when the transition has ended: a cancellation or a request to exit.

        Raises `error` at once if the node is killed, since there is no time for `on_fault` then.
        """
        failure = blame(error, f"{self.fqn} {hook}")
        life = incarnation_of(self)
        if failure is None and (life.killed or not isinstance(error, asyncio.CancelledError)):
            raise error
        self.log.error("lifecycle hook failed", hook=hook, error=described(failure or error))
        return None if isinstance(failure, Exception) and not isinstance(failure, ProgramExit) else failure or error

    async def _run_hook(self, name: str, previous: LifecycleState) -> HookResult:
        result = await getattr(self, "on_fault" if name == "on_error" else name)(previous)
        if result is None:
            return HookResult.SUCCESS
        return result if isinstance(result, HookResult) else HookResult.ERROR

    def _follow(self) -> None:
        """Let publishers deliver and timers tick if the node is active, else not."""
        life, active = incarnation_of(self), self._machine.state is LifecycleState.ACTIVE
        life.endpoints.let_publish(active)
        if not active:
            life.timers.stop()
        elif not life.timers.declared:
            life.start_timers()

    async def __begin__(self) -> None:
        self._machine = LifecycleMachine(on_transition=self._tell)
        self._follow()
        goal = incarnation_of(self).record.asked_state or self.autostart
        for label in _WAY[goal]:
            if not await self.change_state(label):
                raise RuntimeError(f"{self.fqn} could not be brought to {goal}: {label} did not succeed")

    async def __finish__(self) -> None:
        if self._machine.state in (LifecycleState.UNCONFIGURED, LifecycleState.INACTIVE, LifecycleState.ACTIVE):
            record = incarnation_of(self).record
            asked = record.asked_state
            await self._change_state("shutdown")  # the endpoints end with the node, or wait for its next life
            record.asked_state = asked

    __standard_services__ = tuple(SERVICES)

    def __standard_service__(
        self, name: str
    ) -> tuple[type[ServiceType[Any, Any]], Callable[[Any], Coroutine[object, None, Message]]] | None:
        """The type and the handler of one of the five services of a lifecycle node, or None."""
        return SERVICES[name](self) if name in SERVICES else None

    def _tell(self, edge: LifecycleTransition) -> None:
        life = incarnation_of(self)
        entry = life.runtime.graph.topics.get(f"{self.fqn}/transition_event")
        if entry is not None and entry.subscriptions:
            from actors.interfaces.lifecycle_msgs.msg import TransitionEvent

            life.endpoints.event_publisher(TransitionEvent, entry).publish(transition_event(edge))


async def bring_up(
    system: System, nodes: Sequence[str] | None = None, *, to: Literal["inactive", "active"] = "active"
) -> None:
    """Configure all lifecycle nodes in the order of the tree, so dependencies first, and then activate them in the same order.

    `nodes` limits it to nodes of these full names. A node that is in the requested state already is left as it is. Raises `RuntimeError`,
    which names the node, when a transition fails or is refused, or the node does not run or does not exist; the nodes before it stay as
    they are.
    """
    for name in nodes or ():
        if not any(life.fqn == name for life in _managed(system, nodes)):
            known = ", ".join(life.fqn for life in _managed(system, None)) or "none"
            raise RuntimeError(f"{name} is no running lifecycle node; there are: {known}")
    for label in _WAY[to]:
        for life in _managed(system, nodes):
            node = life.node
            assert isinstance(node, LifecycleNode)
            if node.state in _UP[label]:
                continue
            try:
                succeeded = await _ask(life, node, label)
            except TransitionRefused as refusal:
                if node.state in _UP[label]:  # another request came first
                    continue
                raise RuntimeError(f"{life.fqn}: {refusal}") from refusal
            if not succeeded:
                raise RuntimeError(f"{life.fqn}: {label} did not succeed; it is {node.state.label}")


async def bring_down(system: System, nodes: Sequence[str] | None = None) -> None:
    """Deactivate all active lifecycle nodes in the reverse order of the tree, then clean up all inactive ones in the same order."""
    for label in ("deactivate", "cleanup"):
        for life in reversed(_managed(system, nodes)):
            node = life.node
            assert isinstance(node, LifecycleNode)
            if label in (edge.label for edge in transitions_from(node.state)):
                await _ask(life, node, label)


def _managed(system: System, nodes: Sequence[str] | None) -> list[Incarnation]:
    lives = [life for record in system.nodes.values() if (life := record.running) is not None]
    return [life for life in lives if isinstance(life.node, LifecycleNode) and (nodes is None or life.fqn in nodes)]


async def _ask(life: Incarnation, node: LifecycleNode, label: str) -> bool:
    """Change a node's state as an item of its inbox. Raises `NodeRestarting` or `NotRunning` if the node ends before that."""
    answer: asyncio.Future[bool] = asyncio.get_running_loop().create_future()

    def ended(_: object) -> None:
        if not answer.done():
            answer.set_exception(life.absent())

    life.create_task(asyncio.wait([answer]), name=label).add_done_callback(ended)  # this task ends with the node, too
    life.inbox.put_control(_Change(node, label, answer))
    return await answer


class _Change:
    """An inbox item that runs a transition requested in this process, and completes `answer`."""

    __slots__ = ("answer", "asked", "node")
    label = "lifecycle transition"

    def __init__(self, node: LifecycleNode, label: str, answer: asyncio.Future[bool]) -> None:
        self.node = node
        self.asked = label
        self.answer = answer

    async def run(self) -> None:
        try:
            done = await self.node.change_state(self.asked)
        except TransitionRefused as refusal:
            if not self.answer.done():
                self.answer.set_exception(refusal)
        else:
            if not self.answer.done():
                self.answer.set_result(done)
