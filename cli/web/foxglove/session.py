"""One Foxglove client: its subscriptions, calls and questions."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from actors import ActorError
from actors.interfaces import CdrError
from cli.web.clients.conversion import write_json
from cli.web.clients.errors import Refused
from cli.web.clients.fields import entries, number, objects, text
from cli.web.clients.operations import Op, perform
from cli.web.clients.outbox import Frame, Packet
from cli.web.foxglove.assets import read_asset
from cli.web.foxglove.bag_words import bag_ops
from cli.web.foxglove.connections import Connections
from cli.web.foxglove.frames import (
    ClientMessage,
    ServiceRequest,
    asset_failure,
    asset_frame,
    message_frame,
    playback_frame,
    read_frame,
    time_frame,
)
from cli.web.foxglove.publishing import ENCODINGS, Publishing
from cli.web.foxglove.services import call
from cli.web.foxglove.state import StateReports
from cli.web.graph.parameters import event_values, split
from cli.web.recordings.playback import PlaybackRequest, PlaybackState

if TYPE_CHECKING:
    from actors.graph.snapshot import Snapshot
    from cli.web.clients.client import Client
    from cli.web.graph.catalog import Changes
    from cli.web.graph.feeds import Outgoing
    from cli.web.hub import Hub

SUBPROTOCOLS: Final = ("foxglove.sdk.v1", "foxglove.websocket.v1")
CAPABILITIES: Final = (
    "clientPublish", "parameters", "parametersSubscribe", "services", "connectionGraph", "assets", "robactor",
)  # fmt: skip
TIME: Final = "time"
"""What a graph with a `/clock`, or a recording, is capable of beside all that: viewers that know of it stand still until they get the time."""
PLAYBACK: Final = "playbackControl"
"""What a recording is capable of, too."""
PLAYS: Final = SUBPROTOCOLS[:1]
"""The subprotocols that know of it: clients of the older one take its frames for an error."""
MOST_SUBSCRIPTIONS: Final = 4096
WARNING, ERROR = 1, 2


class FoxgloveSession:
    """The Foxglove WebSocket protocol with one client.

    Invariants: `_subscriptions` holds the function that ends each subscription, by the client's number. The client has been told of exactly
    the channels and services in `_channels` and `_services`.
    """

    def __init__(self, hub: Hub, client: Client) -> None:
        self._hub = hub
        self._client = client
        self._subscriptions: dict[int, Callable[[], None]] = {}
        self._channels: set[int] = set()
        self._services: set[int] = set()
        self._plays = hub.playback is not None and client.subprotocol in PLAYS
        self._publishing = Publishing(hub)
        self._connections: Connections | None = None
        self._state: StateReports | None = None
        self.wants_findings = False
        """Whether `found` is to be called."""
        self._watched: set[str] | None = None
        """The parameters of which changes are sent; empty for all, None for none."""
        self._ops: dict[str, Op] = {
            "subscribe": self._subscribe,
            "unsubscribe": self._unsubscribe,
            "advertise": self._publishing.advertise,
            "unadvertise": self._publishing.unadvertise,
            "getParameters": self._later(self._get_parameters),
            "setParameters": self._later(self._set_parameters),
            "subscribeParameterUpdates": self._watch_parameters,
            "unsubscribeParameterUpdates": self._unwatch_parameters,
            "subscribeConnectionGraph": self._watch_graph,
            "unsubscribeConnectionGraph": self._unwatch_graph,
            "fetchAsset": self._later(self._fetch_asset),
            "robactor.subscribeSystem": self._watch_state,
            "robactor.unsubscribeSystem": self._unwatch_state,
            "robactor.subscribeFindings": partial(self._watch_findings, True),
            "robactor.unsubscribeFindings": partial(self._watch_findings, False),
            "robactor.killNode": self._kill_node,
            **bag_ops(hub.bags, client, self),
        }

    # -- what the connection tells --------------------------------------------------------------------------------------------

    def opened(self) -> None:
        catalog, playback = self._hub.catalog, self._hub.playback
        self.introduce()
        if playback is not None:
            playback.viewers.add(self)
            self.tell_playback(playback.state, sought=False)
        self._announce(list(catalog.channels.values()), list(catalog.services.values()))

    def introduce(self) -> None:
        """Tell what this server is, and is capable of. A client that was told before learns what has changed."""
        system, playback = self._hub.system, self._hub.playback
        clock = system.graph.topics.get("/clock")
        timed = playback is not None or (clock is not None and bool(clock.publishers))
        self._say(
            "serverInfo", name="robactor", capabilities=(*CAPABILITIES, *(TIME,) * timed, *(PLAYBACK,) * self._plays),
            supportedEncodings=ENCODINGS, sessionId=f"{id(system):x}",
            metadata={"ROS_DISTRO": "lyrical", **({} if playback is None else {"recording": playback.name})},
            **({} if playback is None else playback.range),
        )  # fmt: skip

    async def received(self, frame: Frame) -> None:
        if isinstance(frame, bytes):
            await self._binary(frame)
            return
        await perform(self._ops, await self._hub.conversions.object(frame))

    def refuse(self, error: Refused) -> None:
        self._status(ERROR, str(error))

    async def closed(self) -> None:
        for end in self._subscriptions.values():
            end()
        self._subscriptions.clear()
        if self._hub.playback is not None:
            self._hub.playback.viewers.discard(self)
        self._publishing.close()

    # -- what the server tells ------------------------------------------------------------------------------------------------

    def changed(self, changes: Changes) -> None:
        """Tell of channels and services that have come or gone."""
        gone = [one for one in changes.gone_channels if one in self._channels]
        if gone:
            self._channels.difference_update(gone)
            self._say("unadvertise", channelIds=gone)
        gone = [one for one in changes.gone_services if one in self._services]
        if gone:
            self._services.difference_update(gone)
            self._say("unadvertiseServices", serviceIds=gone)
        self._announce(changes.channels, changes.services)

    def graph_changed(self, snapshot: Snapshot) -> None:
        """Tell of connections, if the client wants to know."""
        if self._connections is not None and (difference := self._connections.difference(snapshot)) is not None:
            self._client.answer(write_json(difference))

    def report(self, snapshot: Snapshot) -> None:
        """Tell the state of the system, if the client wants to know."""
        if self._state is not None:
            self._client.outbox.replace("state", write_json(self._state.report(snapshot)))

    def found(self, findings: list[dict[str, Any]]) -> None:
        """Tell what the doctor finds now."""
        self._client.outbox.replace("findings", write_json({"op": "robactor.findings", "findings": findings}))

    def time(self, at_ns: int) -> None:
        """Tell the time of the simulation or of the recording, of which only the newest counts."""
        self._client.outbox.replace("time", time_frame(at_ns))

    def tell_playback(self, state: PlaybackState, *, sought: bool, request: str = "") -> None:
        """Tell how the recording is played. With `sought`, the messages that wait are of another time, and are left out."""
        if sought:
            for lane in (*self._subscriptions, "time"):
                self._client.outbox.forget(lane)
        if self._plays:
            self._client.answer(playback_frame(state, sought=sought, request=request))

    def parameters_changed(self, event: Any) -> None:
        """Tell of an event of `/parameter_events`, if the client wants to know."""
        if self._watched is None:
            return
        values = [one for one in event_values(event) if not self._watched or one["name"] in self._watched]
        if values:
            self._say("parameterValues", parameters=values)

    @property
    def wants_graph(self) -> bool:
        """Whether `graph_changed` tells this client anything."""
        return self._connections is not None

    @property
    def wants_state(self) -> bool:
        """Whether `report` tells this client anything."""
        return self._state is not None

    # -- topics ---------------------------------------------------------------------------------------------------------------

    def _subscribe(self, request: dict[str, Any]) -> None:
        for one in objects(request, "subscriptions"):
            id, wanted = number(one, "id"), number(one, "channelId")
            channel = self._hub.catalog.channels.get(wanted)
            if channel is None:
                raise Refused(f"channel {wanted} is not advertised any more")
            if id in self._subscriptions:
                raise Refused(f"subscription {id} is in use: give the new one another number")
            if len(self._subscriptions) >= MOST_SUBSCRIPTIONS:
                raise Refused(f"a client has at most {MOST_SUBSCRIPTIONS} subscriptions")
            outbox = self._client.outbox
            send = outbox.replace if one.get("newest") is True else outbox.offer
            take = partial(_send, self._client, channel.topic, send, id)
            self._subscriptions[id] = self._hub.feeds.open(channel.topic, channel.type, take)

    def _unsubscribe(self, request: dict[str, Any]) -> None:
        for id in entries(request, "subscriptionIds", int):
            end = self._subscriptions.pop(id, None)
            if end is not None:
                end()
                self._client.outbox.forget(id)

    # -- services, assets -----------------------------------------------------------------------------------------------------

    async def _binary(self, data: bytes) -> None:
        frame = read_frame(data)
        if isinstance(frame, ClientMessage):
            await self._publishing.publish(frame.channel, frame.payload)
            return
        if isinstance(frame, PlaybackRequest):
            if self._hub.playback is None:
                raise Refused("this is no recording: there is nothing to play")
            self._hub.playback.control(frame, self)
            return
        self._client.spawn(self._call(frame), self)

    async def _call(self, request: ServiceRequest) -> None:
        service = self._hub.catalog.services.get(request.service)
        try:
            if service is None:
                raise Refused(f"service {request.service} is not advertised any more")
            self._client.answer(await call(self._hub, service, request))
        except Refused as error:
            self._say("serviceCallFailure", serviceId=request.service, callId=request.call, message=str(error))

    async def _fetch_asset(self, request: dict[str, Any]) -> None:
        id = number(request, "requestId")
        try:
            data = await asyncio.to_thread(read_asset, request.get("uri"))
        except Refused as error:
            self._client.answer(asset_failure(id, str(error)))
        else:
            self._client.answer(asset_frame(id, data))

    # -- parameters -----------------------------------------------------------------------------------------------------------

    async def _get_parameters(self, request: dict[str, Any]) -> None:
        values = await self._hub.parameters.described(entries(request, "parameterNames", str))
        self._say("parameterValues", parameters=values, **_id_of(request))

    async def _set_parameters(self, request: dict[str, Any]) -> None:
        wanted = {text(one, "name"): one.get("value") for one in objects(request, "parameters")}
        for name, value in wanted.items():
            try:
                refusal = await self._hub.parameters.put(*split(name), value)
            except Refused as error:
                refusal = str(error)
            if refusal is not None:
                self._status(ERROR, f"{name} is not set: {refusal}", str(request.get("id") or "parameter"))
        values = await self._hub.parameters.described(wanted) if wanted else []
        self._say("parameterValues", parameters=values, **_id_of(request))

    def _watch_parameters(self, request: dict[str, Any]) -> None:
        names = set(entries(request, "parameterNames", str))
        self._watched = names | (self._watched or set()) if names else set()

    def _unwatch_parameters(self, request: dict[str, Any]) -> None:
        names = set(entries(request, "parameterNames", str))
        left = (self._watched or set()) - names
        self._watched = left if left and names else None

    # -- the graph and the system ---------------------------------------------------------------------------------------------

    def _watch_graph(self, request: dict[str, Any]) -> None:
        self._connections = Connections()
        self.graph_changed(self._hub.overview.snapshot())

    def _unwatch_graph(self, request: dict[str, Any]) -> None:
        self._connections = None

    def _watch_state(self, request: dict[str, Any]) -> None:
        self._state = StateReports(self._hub.overview, virtual=self._hub.system.clock.virtual)
        self.report(self._hub.overview.snapshot())

    def _unwatch_state(self, request: dict[str, Any]) -> None:
        self._state = None

    def _watch_findings(self, wanted: bool, request: dict[str, Any]) -> None:
        self.wants_findings = wanted

    def _kill_node(self, request: dict[str, Any]) -> None:
        name, problem = text(request, "node"), None
        try:
            self._hub.overview.crash(name, RuntimeError(f"killed on the web page, by {self._client.address}"))
        except (LookupError, ActorError) as error:
            problem = str(error.args[0] if error.args else error)
        self._say("robactor.done", id=request.get("id"), error=problem)

    # -- words ----------------------------------------------------------------------------------------------------------------

    def _later(self, work: Callable[[dict[str, Any]], Any]) -> Op:
        return lambda request: self._client.spawn(work(request), self)

    def _announce(self, channels: list[Any], services: list[Any]) -> None:
        if channels:
            self._channels.update(one.id for one in channels)
            self._say("advertise", channels=[one.advertised for one in channels])
        if services:
            self._services.update(one.id for one in services)
            self._say("advertiseServices", services=[one.advertised for one in services])

    def _say(self, op: str, **fields: Any) -> None:
        self._client.answer(write_json({"op": op, **fields}))

    def _status(self, level: int, message: str, id: str | None = None) -> None:
        self._say("status", level=level, message=message[:1000], **({} if id is None else {"id": id}))


def _send(client: Client, topic: str, send: Callable[[int, Packet], None], id: int, message: Outgoing) -> None:
    try:
        cdr = message.cdr
    except CdrError as error:
        client.lose(topic, error)
    else:
        send(id, message_frame(id, message.at_ns, cdr))


def _id_of(request: dict[str, Any]) -> dict[str, Any]:
    id = request.get("id")
    return {"id": id} if isinstance(id, str) else {}
