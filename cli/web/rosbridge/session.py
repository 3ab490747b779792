"""One rosbridge client: version 2 of the protocol, in JSON."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Final

from actors import ActorError, Service
from actors.interfaces import InterfaceError
from actors.interfaces.action_msgs.srv import CancelGoal
from actors.typing import Publisher
from cli.web.clients.conversion import plain, write_json
from cli.web.clients.errors import BadRequest, Refused
from cli.web.clients.fields import by_name, flag, optional_number, text
from cli.web.clients.names import absolute, interface
from cli.web.clients.operations import Op, perform
from cli.web.clients.outbox import Frame
from cli.web.graph.client_nodes import Publications
from cli.web.rosbridge.fragments import Fragments, fragments_of
from cli.web.rosbridge.goals import Goals
from cli.web.rosbridge.png import png_text
from cli.web.rosbridge.rosapi import Rosapi
from cli.web.rosbridge.serving import ActionsServed, ServicesServed
from cli.web.rosbridge.subscriptions import Subscriptions

if TYPE_CHECKING:
    from cli.web.clients.client import Client
    from cli.web.hub import Hub

PATIENCE: Final = 10.0
"""Seconds for the answer of a service, if a client names no other limit."""
LONGEST: Final = 600.0
LEVELS: Final = ("none", "error", "warning", "info")
ROSAPI: Final = "/rosapi/"


class RosbridgeSession:
    """The rosbridge protocol with one client.

    Requests are handled in their order. Calls of services and goals go on beside the requests that follow.
    """

    def __init__(self, hub: Hub, client: Client) -> None:
        self._hub = hub
        self._client = client
        self._level = LEVELS.index("error")
        self._id: Any = None
        """The id of the request that is being handled."""
        self._fragments = Fragments()
        self._subscriptions = Subscriptions(hub, client, self)
        self._publications = Publications(hub.client_nodes)
        self._publishers: dict[str, Publisher[Any]] = {}
        self._rosapi = Rosapi(hub)
        self._services = ServicesServed(hub, self._say)
        self._actions = ActionsServed(hub, self._say)
        self._goals = Goals(hub, self._say)
        self._ops: Mapping[str, Op] = {
            "advertise": self._advertise, "unadvertise": self._unadvertise, "publish": self._publish,
            "subscribe": self._subscriptions.subscribe, "unsubscribe": self._subscriptions.unsubscribe,
            "call_service": self._later(self._call), "advertise_service": self._services.advertise,
            "unadvertise_service": self._services.unadvertise, "service_response": self._services.respond,
            "send_action_goal": self._later(self._goals.send), "cancel_action_goal": self._later(self._goals.cancel),
            "advertise_action": self._actions.advertise, "unadvertise_action": self._actions.unadvertise,
            "action_feedback": self._actions.feedback, "action_result": self._actions.result,
            "fragment": self._fragment, "set_level": self._set_level, "status": self._ignore, "auth": self._ignore,
        }  # fmt: skip

    def opened(self) -> None:
        """Say nothing: the client begins."""

    async def received(self, frame: Frame) -> None:
        if isinstance(frame, bytes):
            raise BadRequest("a binary frame: requests come as JSON texts")
        await self._handle(await self._hub.conversions.object(frame))

    def refuse(self, error: Refused) -> None:
        if self._level >= LEVELS.index("error"):
            asked = self._id if error.id is None else error.id
            id = asked if isinstance(asked, (str, int)) else None
            self._say("status", level="error", msg=str(error)[:1000], **({} if id is None else {"id": id}))

    async def closed(self) -> None:
        self._subscriptions.close()
        self._publishers.clear()
        self._publications.close()
        for part in (self._services, self._actions):
            await part.close()

    async def _handle(self, request: dict[str, Any]) -> None:
        self._id = request.get("id")
        await perform(self._ops, request)

    # -- topics ---------------------------------------------------------------------------------------------------------------

    async def _advertise(self, request: dict[str, Any]) -> None:
        name = interface(text(request, "type"), "msg")
        await self._open(absolute(text(request, "topic")), name, request)

    async def _open(self, topic: str, name: str, request: dict[str, Any]) -> Publisher[Any]:
        kind = await self._hub.types.topic(topic, name)
        depth = int(min(optional_number(request, "queue_size") or 100, 1000))
        publisher = await self._publications.open(topic, kind, latch=flag(request, "latch"), depth=depth)
        self._publishers[topic] = publisher
        return publisher

    def _unadvertise(self, request: dict[str, Any]) -> None:
        topic = absolute(text(request, "topic"))
        if self._publishers.pop(topic, None) is None:
            raise Refused(f"{topic} is not advertised")

    async def _publish(self, request: dict[str, Any]) -> None:
        topic = absolute(text(request, "topic"))
        publisher = self._publishers.get(topic) or await self._open(topic, "", request)
        stamp = self._hub.system.clock.stamp()
        publisher.publish(await self._hub.conversions.message(publisher.type, request.get("msg"), stamp))

    # -- services -------------------------------------------------------------------------------------------------------------

    async def _call(self, request: dict[str, Any]) -> None:
        asked = text(request, "service")
        told: dict[str, Any] = {"op": "service_response", "service": asked}
        if request.get("id") is not None:
            told["id"] = request["id"]
        try:
            told |= {"values": await self._answered(absolute(asked), request), "result": True}
        except (Refused, ActorError, InterfaceError) as error:
            told |= {"values": str(error), "result": False}
        whole = write_json(told)
        if request.get("compression") == "png":
            whole = write_json({"op": "png", "data": await asyncio.to_thread(png_text, whole)})
        size = optional_number(request, "fragment_size")
        for part in fragments_of(whole, int(min(size, 1e9)) if size else None):
            self._client.answer(part)

    async def _answered(self, name: str, request: dict[str, Any]) -> Any:
        arguments = request.get("args")
        if name.startswith(ROSAPI):
            return await self._rosapi.answer(name.removeprefix(ROSAPI), arguments)
        named = text(request, "type", "")
        if name.endswith("/_action/cancel_goal"):
            kind: Any = CancelGoal
        else:
            kind = await self._hub.types.service(name, interface(named, "srv") if named else "")
        arguments = by_name((field.name for field in kind.Request.__ros_fields__), arguments)
        message = await self._hub.conversions.message(kind.Request, arguments, self._hub.system.clock.stamp())
        patience = min(optional_number(request, "timeout") or PATIENCE, LONGEST)
        contract: Service[Any, Any] = Service(kind, name)
        return plain(await self._hub.node.call(contract, message, timeout=patience))

    # -- the connection -------------------------------------------------------------------------------------------------------

    async def _fragment(self, request: dict[str, Any]) -> None:
        whole = self._fragments.add(request)
        if whole is not None:
            inner = await self._hub.conversions.object(whole)
            if inner.get("op") == "fragment":
                raise BadRequest("a fragment of fragments")
            await self._handle(inner)

    def _set_level(self, request: dict[str, Any]) -> None:
        level = text(request, "level")
        if level not in LEVELS:
            raise BadRequest(f"level {level!r:.40}: there are {', '.join(LEVELS)}")
        self._level = LEVELS.index(level)

    def _ignore(self, request: dict[str, Any]) -> None:
        """Do nothing: the client may say this, and nothing follows from it."""

    def _later(self, work: Callable[[dict[str, Any]], Any]) -> Op:
        async def done(request: dict[str, Any]) -> None:
            try:
                await work(request)
            except Refused as error:
                error.id = request.get("id")
                raise

        return lambda request: self._client.spawn(done(request), self)

    def _say(self, op: str, **fields: Any) -> None:
        self._client.answer(write_json({"op": op, **fields}))
