"""Recorded requests and goals, sent again to the servers of now."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import TYPE_CHECKING, Any, Final

from actors.bag.contents import BagError, BagMessage, BagTopic
from actors.bag.schemas import type_of
from actors.bag.selection import action_of, service_of
from actors.contracts.contracts import Action, Service
from actors.errors import ActorError
from actors.interfaces.cdr import decode
from actors.interfaces.errors import CdrError, InterfaceError
from actors.interfaces.lookup import get_action, get_service

if TYPE_CHECKING:
    from actors.bag.options import PlayOptions
    from actors.interfaces.message import F, G, R, Req, Resp
    from actors.runtime.node import Node

SENT, RECEIVED = 0, 1
"""The kinds of events that hold a request: as its client and its server have recorded it."""

TIMEOUT: Final = 5.0
"""How long a server is waited for and may take to answer, in seconds. A goal may take any time once it is accepted."""

SEND_GOAL: Final = "_SendGoal_Event"


class Requests:
    """Sends the requests of a bag for one node. What becomes of them is logged, if it is an error."""

    def __init__(self, node: Node, options: PlayOptions) -> None:
        self._node = node
        self._options = options
        self._open: set[asyncio.Task[None]] = set()
        """The requests that have not ended."""
        self._wanted = {"service": RECEIVED, "client": SENT}.get(options.service_requests)

    def sink(self, topic: BagTopic) -> Callable[[BagMessage], bool] | None:
        """What takes the messages of a topic that holds events of a service or action; None if they are to be published as they are.

        Raises `BagError` for a service or action whose type is not known here: a bag holds only definitions of messages.
        """
        name, action = service_of(topic.name), action_of(topic.name)
        if self._wanted is None or (name is None and action is None):
            return None
        try:
            if name is not None:
                service = Service(get_service(topic.type.removesuffix("_Event")), self._name(name))
                return self._sending(topic, lambda request: self._call(service, request))
            if action is not None and topic.type.endswith(SEND_GOAL):
                goals = Action(get_action(topic.type.removesuffix(SEND_GOAL)), self._name(action))
                return self._sending(topic, lambda request: self._start(goals, request.goal))
        except InterfaceError as error:
            raise BagError(f"{topic.name}: {error}") from error
        return nothing  # the server tells its feedback and status itself

    async def ended(self) -> None:
        """Wait until the requests have ended, for at most `TIMEOUT` seconds."""
        if self._open:
            await asyncio.wait(self._open, timeout=TIMEOUT)

    def _name(self, name: str) -> str:
        return self._options.remap.get(name, name)

    def _sending(
        self, topic: BagTopic, send: Callable[[Any], Coroutine[object, None, None]]
    ) -> Callable[[BagMessage], bool]:
        kind: Any = type_of(topic)

        def take(message: BagMessage) -> bool:
            try:
                event = decode(kind, message.data)
            except CdrError as error:
                self._node.log.warning("an event of the bag cannot be decoded", topic=topic.name, error=str(error))
                return False
            if event.info.event_type == self._wanted and event.request:
                name = f"request of {topic.name}"
                task = self._node.create_task(self._tried(topic.name, send(event.request[0])), name=name)
                self._open.add(task)
                task.add_done_callback(self._open.discard)
            return True

        return take

    async def _tried(self, topic: str, sending: Coroutine[object, None, None]) -> None:
        try:
            await sending
        except (ActorError, TimeoutError) as error:
            self._node.log.warning("a recorded request has failed", topic=topic, error=str(error))

    async def _call(self, service: Service[Req, Resp], request: Req) -> None:
        await self._node.call(service, request, timeout=TIMEOUT)

    async def _start(self, action: Action[G, R, F], goal: G) -> None:
        async with self._node.send_goal(action, goal, timeout=TIMEOUT) as running:
            await running.ended()


def nothing(message: BagMessage) -> bool:
    """Leave a message out."""
    return False
