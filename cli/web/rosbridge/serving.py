"""Services and actions that a browser serves: a hidden node stands for each of them, and asks the browser.

An action of a browser runs its goals side by side; the browser tells one from the other by their ids.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Awaitable, Callable, Mapping
from functools import partial
from itertools import count
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from actors import Aborted, Action, Done, GoalStatus, Node, Service
from cli.web.clients.conversion import plain
from cli.web.clients.errors import BadRequest, Refused
from cli.web.clients.fields import flag, text
from cli.web.clients.names import absolute, interface
from cli.web.graph.client_nodes import MOST

if TYPE_CHECKING:
    from actors.runtime.joined import JoinedNode
    from cli.web.hub import Hub

PATIENCE: Final = 30.0
"""Seconds that a browser has to answer a request, and to end a goal that is canceled."""
CONCURRENT: Final = 64

Say = Callable[..., None]
"""Sends an op with its fields to the client."""


class BrowserFailed(Exception):
    """The browser has not done what it serves."""


def service_node(service: Service[Any, Any], answer: Callable[[Any], Awaitable[Any]]) -> type[Node]:
    """A node that serves `service` by `answer`."""

    class ServiceOfBrowser(Node):
        @service.serve(concurrent=CONCURRENT)
        async def answered(self, request: Any) -> Any:
            return await answer(request)

    return ServiceOfBrowser


def action_node(action: Action[Any, Any, Any], steps: Callable[[Any], AsyncGenerator[Any, None]]) -> type[Node]:
    """A node that carries out the goals of `action` by `steps`."""

    class ActionOfBrowser(Node):
        @action.serve(arrivals="parallel")
        async def carried_out(self, goal: Any) -> AsyncGenerator[Any, None]:
            async for step in steps(goal):
                yield step

    return ActionOfBrowser


def _refuse_second(entries: Mapping[str, Any], name: str) -> None:
    entry = entries.get(name)
    if entry is not None and entry.local is not None:
        raise Refused(f"{entry.local.host} serves {entry.name} already")


def _settle(waiting: asyncio.Future[Any], outcome: Any) -> None:
    """Give a waiting request its outcome, unless it has ended meanwhile."""
    if waiting.done():
        return
    if isinstance(outcome, BrowserFailed):
        waiting.set_exception(outcome)
    else:
        waiting.set_result(outcome)


def _reason(values: Any) -> str:
    """Why a client has failed, as far as it says so."""
    return f"{values}"[:1000] if values else "the client that serves it gives no reason"


class _Request(NamedTuple):
    """A request that the client has to answer."""

    service: str
    type: Any
    answer: asyncio.Future[Any]


class ServicesServed:
    """The services of one client.

    Invariant: `_open` holds the requests that the client has not answered, by their ids.
    """

    def __init__(self, hub: Hub, say: Say) -> None:
        self._hub = hub
        self._say = say
        self._numbers = count(1)
        self._served: dict[str, JoinedNode] = {}
        self._open: dict[str, _Request] = {}

    async def advertise(self, request: dict[str, Any]) -> None:
        """Serve a service from now on. Raises `Refused`."""
        from actors import Service

        name = absolute(text(request, "service"))
        if name in self._served:
            raise Refused(f"this client serves {name} already")
        if len(self._served) >= MOST:
            raise Refused(f"a client serves at most {MOST} services")
        _refuse_second(self._hub.system.graph.services, name)
        kind = await self._hub.types.service(name, interface(text(request, "type"), "srv"))

        async def answer(message: Any) -> Any:
            return await self._ask(name, kind, message)

        node = service_node(Service(kind, name), answer)
        free = partial(_refuse_second, self._hub.system.graph.services, name)
        self._served[name] = await self._hub.client_nodes.serve(node, free)

    async def unadvertise(self, request: dict[str, Any]) -> None:
        """Serve it no more; requests that are open fail. Raises `Refused` if it is not served."""
        name = absolute(text(request, "service"))
        node = self._served.pop(name, None)
        if node is None:
            raise Refused(f"this client does not serve {name}")
        self._fail(f"the client serves {name} no more", name)
        await self._hub.client_nodes.leave(node)

    async def respond(self, request: dict[str, Any]) -> None:
        """The client's answer to a request. Raises `BadRequest` if there is no such request."""
        asked = self._open.get(text(request, "id"))
        if asked is None:
            raise BadRequest(f"there is no open request {request.get('id')!r:.60}")
        values = request.get("values")
        if request.get("result") is not True:
            _settle(asked.answer, BrowserFailed(_reason(values)))
            return
        try:
            answer = await self._hub.conversions.message(asked.type.Response, values)
        except Refused as error:
            _settle(asked.answer, BrowserFailed(str(error)))
            raise
        _settle(asked.answer, answer)

    async def close(self) -> None:
        """Serve nothing any more; requests that are open fail."""
        self._fail("the client that serves it has gone")
        served, self._served = list(self._served.values()), {}
        for node in served:
            await self._hub.client_nodes.leave(node)

    def _fail(self, reason: str, service: str | None = None) -> None:
        for asked in self._open.values():
            if service in (None, asked.service):
                _settle(asked.answer, BrowserFailed(reason))

    async def _ask(self, name: str, kind: Any, message: Any) -> Any:
        id = f"service_request:{name}:{next(self._numbers)}"
        waiting: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
        self._open[id] = _Request(name, kind, waiting)
        self._say("call_service", id=id, service=name, type=kind.__ros_type__, args=plain(message))
        try:
            async with asyncio.timeout(PATIENCE):
                return await waiting
        except TimeoutError:
            raise BrowserFailed(f"the client that serves {name} has not answered for {PATIENCE:g} s") from None
        finally:
            self._open.pop(id, None)


class _Execution(NamedTuple):
    """A goal that the client carries out."""

    action: str
    type: Any
    steps: asyncio.Queue[Any]


class ActionsServed:
    """The actions of one client.

    Invariant: `_open` holds the goals that the client carries out, by their ids.
    """

    def __init__(self, hub: Hub, say: Say) -> None:
        self._hub = hub
        self._say = say
        self._numbers = count(1)
        self._served: dict[str, JoinedNode] = {}
        self._open: dict[str, _Execution] = {}

    async def advertise(self, request: dict[str, Any]) -> None:
        """Carry out the goals of an action from now on. Raises `Refused`."""
        from actors import Action

        name = absolute(text(request, "action"))
        if name in self._served:
            raise Refused(f"this client serves {name} already")
        if len(self._served) >= MOST:
            raise Refused(f"a client serves at most {MOST} actions")
        _refuse_second(self._hub.system.graph.actions, name)
        kind = await self._hub.types.action(name, interface(text(request, "type"), "action"))
        node = action_node(Action(kind, name), lambda goal: self._carry_out(name, kind, goal))
        free = partial(_refuse_second, self._hub.system.graph.actions, name)
        self._served[name] = await self._hub.client_nodes.serve(node, free)

    async def unadvertise(self, request: dict[str, Any]) -> None:
        """Carry out no more of them; goals that run are aborted. Raises `Refused` if it is not served."""
        name = absolute(text(request, "action"))
        node = self._served.pop(name, None)
        if node is None:
            raise Refused(f"this client does not serve {name}")
        self._abort(f"the client serves {name} no more", name)
        await self._hub.client_nodes.leave(node)

    async def feedback(self, request: dict[str, Any]) -> None:
        """The client's feedback about a goal."""
        goal = self._goal(request)
        goal.steps.put_nowait(await self._hub.conversions.message(goal.type.Feedback, request.get("values")))

    async def result(self, request: dict[str, Any]) -> None:
        """The client's result of a goal."""
        goal = self._goal(request)
        if not flag(request, "result"):
            goal.steps.put_nowait(Aborted(goal.type.Result(), _reason(request.get("values"))))
            return
        result = await self._hub.conversions.message(goal.type.Result, request.get("values"))
        status = request.get("status", 4)
        goal.steps.put_nowait(Aborted(result) if status == GoalStatus.ABORTED else Done(result))

    async def close(self) -> None:
        """Carry out nothing any more; goals that run are aborted."""
        self._abort("the client that serves it has gone")
        served, self._served = list(self._served.values()), {}
        for node in served:
            await self._hub.client_nodes.leave(node)

    def _abort(self, reason: str, action: str | None = None) -> None:
        for goal in self._open.values():
            if action in (None, goal.action):
                goal.steps.put_nowait(Aborted(goal.type.Result(), reason))

    def _goal(self, request: dict[str, Any]) -> _Execution:
        goal = self._open.get(text(request, "id"))
        if goal is None:
            raise BadRequest(f"there is no open goal {request.get('id')!r:.60}")
        return goal

    async def _carry_out(self, name: str, kind: Any, goal: Any) -> AsyncGenerator[Any, None]:
        id = f"action_goal:{name}:{next(self._numbers)}"
        steps: asyncio.Queue[Any] = asyncio.Queue()
        self._open[id] = _Execution(name, kind, steps)
        self._say(
            "send_action_goal", id=id, action=name, action_type=kind.__ros_type__, args=plain(goal), feedback=True
        )
        try:
            while True:
                try:
                    step = await steps.get()
                except asyncio.CancelledError:
                    self._say("cancel_action_goal", id=id, action=name)
                    yield await self._end_of(steps)
                    return
                yield step
                if isinstance(step, (Done, Aborted)):
                    return
        finally:
            del self._open[id]

    async def _end_of(self, steps: asyncio.Queue[Any]) -> Any:
        """What the client says at the end of a goal that is canceled."""
        async with asyncio.timeout(PATIENCE):
            while True:
                step = await steps.get()
                if isinstance(step, (Done, Aborted)):
                    return step  # pyright: ignore[reportUnknownVariableType]
