"""The clients that look at one graph, and what is sent to all of them."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Sequence
from functools import partial
from itertools import count
from typing import TYPE_CHECKING, Any, Final

from actors import Topic
from actors.interfaces.rcl_interfaces.msg import ParameterEvent
from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.qos import CLOCK, PARAMETER_EVENTS
from cli.web.clients.client import Client, Session
from cli.web.foxglove.session import FoxgloveSession
from cli.web.graph.findings import LOOK_EVERY, examining
from cli.web.rosbridge.session import RosbridgeSession

if TYPE_CHECKING:
    from actors.topics.peers import PublisherPeer
    from actors.typing import Stream
    from cli.web.hub import Hub

SETTLE: Final = 0.1
"""Seconds from a change of the graph to the look at it: changes that come together are sent together."""
AGAIN: Final = 1.0
"""Seconds from the first failure to the next attempt; the pauses grow."""
LATEST: Final = 60.0
METRICS: Final = 120.0
"""Seconds for which figures are kept ready after somebody has asked for metrics."""
REPORT_EVERY: Final = 1.0
"""Seconds between two reports of the state of the system."""


class Audience:
    """The clients of one graph. What is sent to all of them comes from tasks of the hub's node, from `begin` until that node stops.

    Invariant: `_sessions` holds the session of every client that is served, by its number.
    """

    def __init__(self, hub: Hub) -> None:
        self.hub = hub
        self._sessions: dict[int, Session] = {}
        self._changed = asyncio.Event()
        self._clock: Stream[Clock] | None = None
        self._metrics_until = 0.0

    async def begin(self) -> Callable[[], None]:
        """Follow the graph. The returned function ends that, for a node that goes on."""
        hub = self.hub
        await hub.catalog.update()
        forget = hub.system.graph.on_change(self._graph_changed)
        self._spawn("what changes", self._tell_changes)
        self._spawn("the state of the system", self._report_state)
        self._spawn("what the doctor finds", self._report_findings)
        if hub.playback is None:
            self._follow_clock()
            self._spawn("parameters", self._tell_parameters)
        else:
            self._spawn("playback", hub.playback.follow)
        return forget

    def _spawn(self, what: str, work: Callable[[], Coroutine[Any, Any, None]]) -> None:
        """Do this for as long as the node runs. What fails is logged and begun again: it does not take the page, and its STOP, away."""

        async def again_and_again() -> None:
            for failures in count():
                try:
                    await work()
                    return
                except Exception as error:
                    self.hub.node.log.error(
                        "the web server goes on after a failure", doing=what, error=repr(error)[:500]
                    )
                await asyncio.sleep(min(AGAIN * 2.0 ** min(failures, 16), LATEST))

        self.hub.node.create_task(again_and_again(), name=f"web: {what}")

    async def serve(self, client: Client) -> None:
        """Serve a client until it leaves, or has to."""
        session: Session = (FoxgloveSession if client.protocol == "foxglove" else RosbridgeSession)(self.hub, client)
        self._sessions[client.number] = session
        try:
            await client.run(session)
        finally:
            del self._sessions[client.number]

    def end(self, code: int, why: str) -> None:
        """Disconnect all clients."""
        for number in self._sessions:
            self.hub.clients[number].end(code, why)

    def _viewers(self) -> list[FoxgloveSession]:
        return [one for one in self._sessions.values() if isinstance(one, FoxgloveSession)]

    def _graph_changed(self) -> None:
        self.hub.feeds.refit()
        self._changed.set()

    async def _tell_changes(self) -> None:
        while True:
            await self._changed.wait()
            await asyncio.sleep(SETTLE)
            self._changed.clear()
            try:
                changes = await self.hub.catalog.update()
            except Exception:
                self._changed.set()
                raise
            if self.hub.playback is None:  # a recording has its own time
                self._follow_clock()
            for viewer in self._viewers():
                viewer.changed(changes)
            watching = [viewer for viewer in self._viewers() if viewer.wants_graph]
            snapshot = self.hub.overview.snapshot() if watching else None
            for viewer in watching:
                assert snapshot is not None
                viewer.graph_changed(snapshot)

    async def _report_state(self) -> None:
        while True:
            await asyncio.sleep(REPORT_EVERY)
            watching = [viewer for viewer in self._viewers() if viewer.wants_state]
            if watching:
                snapshot = self.hub.overview.snapshot()
                for viewer in watching:
                    viewer.report(snapshot)

    async def _report_findings(self) -> None:
        while True:
            await asyncio.sleep(REPORT_EVERY)
            if not self._watched():
                continue
            async with examining(self.hub.node, self.hub.system) as examination:
                self.hub.overview.figures.source = lambda: examination.others
                while self._watched():
                    findings = await examination.findings()
                    for viewer in self._viewers():
                        if viewer.wants_findings:
                            viewer.found(findings)
                    await asyncio.sleep(LOOK_EVERY)
            self.hub.overview.figures.source = tuple

    def _watched(self) -> bool:
        """Whether somebody looks at nodes, or at what the doctor finds, on the page or by `/metrics`."""
        watching = any(viewer.wants_findings or viewer.wants_state for viewer in self._viewers())
        return watching or asyncio.get_running_loop().time() < self._metrics_until

    def asked_for_metrics(self) -> None:
        """Have other processes tell their figures: a client that asks for metrics will ask again."""
        self._metrics_until = asyncio.get_running_loop().time() + METRICS

    async def _tell_parameters(self) -> None:
        async for event in self.hub.node.subscribe(Topic(ParameterEvent, "/parameter_events"), qos=PARAMETER_EVENTS):
            for viewer in self._viewers():
                viewer.parameters_changed(event)

    def _follow_clock(self) -> None:
        """Pass `/clock` on while somebody publishes it."""
        entry = self.hub.system.graph.topics.get("/clock")
        publishers: Sequence[PublisherPeer] = entry.publishers if entry is not None else ()
        if publishers and self._clock is None:
            self._clock = self.hub.node.subscribe(Topic(Clock, "/clock"), qos=CLOCK)
            self._spawn("clock", partial(self._pass_clock_on, self._clock))
        elif not publishers and self._clock is not None:
            self._clock.close()
            self._clock = None
        else:
            return
        for viewer in self._viewers():
            viewer.introduce()

    async def _pass_clock_on(self, stream: Stream[Clock]) -> None:
        async for message in stream:
            at_ns = message.clock.sec * 10**9 + message.clock.nanosec
            for viewer in self._viewers():
                viewer.time(at_ns)
