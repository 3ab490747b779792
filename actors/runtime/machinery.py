"""`Machinery`: the Protocol by which a node object uses the incarnation that runs it."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Coroutine
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

if TYPE_CHECKING:
    from random import Random

    from actors.actions.client import Goal
    from actors.contracts.contracts import Action, Service, Topic
    from actors.graph.graph import Graph
    from actors.inbox.inbox import Inbox
    from actors.interfaces.message import Message
    from actors.logs import NodeLog
    from actors.names.identity import Identity
    from actors.parameters import ParameterStore
    from actors.qos.policies import QoS
    from actors.runtime.declarations import Late
    from actors.runtime.placement import Placement
    from actors.runtime.timer import RunningTimer
    from actors.services.client import Client
    from actors.time.clock import Clock
    from actors.time.ros_clock import JumpHandle, JumpThreshold, TimeJump
    from actors.topics.content_filter import ContentFilter
    from actors.topics.handler import Handler, HandlerSubscription
    from actors.topics.publisher import Publisher
    from actors.topics.stream import Stream

__all__ = ["Host", "JumpSource", "Kept", "Machinery", "Offloading"]

M = TypeVar("M", bound="Message")
G = TypeVar("G", bound="Message")
R = TypeVar("R", bound="Message")
F = TypeVar("F", bound="Message")
Req = TypeVar("Req", bound="Message")
Resp = TypeVar("Resp", bound="Message")


class Offloading(Protocol):
    """Runs work outside the event loop."""

    async def run(
        self, function: Callable[..., Any], arguments: tuple[Any, ...], takes: float, *, thread: bool
    ) -> Any: ...


class Host(Protocol):
    """The system in which a node runs, as the node uses it."""

    @property
    def loop(self) -> asyncio.AbstractEventLoop: ...
    @property
    def graph(self) -> Graph: ...
    @property
    def placement(self) -> Placement: ...
    @property
    def offload(self) -> Offloading: ...


class Kept(Protocol):
    """The record of the node, as the node uses it: `saved` is the state for its next incarnation."""

    saved: Any


class JumpSource(Protocol):
    """The ROS time of a node, as the node uses it."""

    def on_jump(
        self,
        threshold: JumpThreshold,
        pre: Callable[[], object] | None,
        post: Callable[[TimeJump], object] | None,
    ) -> JumpHandle: ...


class Machinery(Protocol):
    """One incarnation, as its node object uses it; implemented by `actors.runtime.incarnation.Incarnation`."""

    clock: Clock
    incarnation: int
    clients: dict[Any, Client[Any, Any]]

    @property
    def fqn(self) -> str: ...
    @property
    def identity(self) -> Identity: ...
    @property
    def inbox(self) -> Inbox: ...
    @property
    def log(self) -> NodeLog: ...
    @property
    def parameters(self) -> ParameterStore: ...
    @property
    def record(self) -> Kept: ...
    @property
    def rng(self) -> Random: ...
    @property
    def runtime(self) -> Host: ...

    def check_thread(self) -> None: ...
    def check_use(self) -> None: ...
    def tick(
        self, hz: float, handler: Callable[..., Awaitable[None] | None], late: Late, label: str
    ) -> RunningTimer: ...
    def end_ticks(self, timer: Any) -> None: ...
    def client(self, service: Service[Req, Resp]) -> Client[Req, Resp]: ...
    def goal(self, action: Action[G, R, F], message: G, timeout: float) -> Goal[R, F]: ...
    def handle(self, topic: Topic[M], qos: QoS, handler: Handler[M], label: str) -> None: ...
    def own(self, work: Coroutine[Any, Any, None], *, name: str = "") -> asyncio.Task[None]: ...
    def publisher(self, topic: Topic[M], qos: QoS) -> Publisher[M]: ...
    def request_stop(self, reason: str) -> None: ...
    def ros_time(self) -> JumpSource: ...
    def serve(
        self, service: Service[Req, Resp], handler: Callable[[Req], Coroutine[Any, Any, Resp]], label: str
    ) -> None: ...
    def subscribe(self, topic: Topic[M], qos: QoS, filter: ContentFilter | None = None) -> Stream[M]: ...
    def subscription(self, topic: Topic[M]) -> HandlerSubscription[M]: ...
    def threadsafe(self, function: Callable[[], object]) -> None: ...
