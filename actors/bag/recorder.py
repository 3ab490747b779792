"""`Recorder`: a node that records topics, services and actions into a bag, from this process and others."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path
from typing import Final, TypeVar

from actors.bag.capture import Capture, fitting
from actors.bag.control_services import serve_recorder
from actors.bag.offers import Offer, RemoteTypes, offers
from actors.bag.options import RecordOptions
from actors.bag.ring import Channel, Entry, Ring, Source, placed, weight_of
from actors.bag.write_queue import Taken, WriteQueue
from actors.bag.writer import BagWriter, Split
from actors.contracts.contracts import Topic
from actors.interfaces.message import Message
from actors.interfaces.rosbag2_interfaces.msg import WriteSplitEvent
from actors.runtime.declarations import background, publishes
from actors.runtime.incarnation import incarnation_of
from actors.runtime.node import Node
from actors.supervision.reasons import ExitReason
from actors.topics.lazy_message import LazyMessage
from actors.topics.peers import PublisherPeer

T = TypeVar("T")

CADENCE: Final = 0.05
"""How often what waits is written, in seconds."""

SPLIT: Final = Topic(WriteSplitEvent, "events/write_split")


class Recorder(Node):
    """Records what `options` say into a new bag at `path`, from its start until its stop.

    It subscribes to each topic as soon as there is a publisher, with what fits the offers, so that what is published only while somebody
    listens is recorded, too. A type that is not known here is asked of the nodes that use it, by `get_type_description`; a type that
    nobody describes is named in the log. Each message has the time at which it was sent and that of its arrival here; with `use_sim_time` that of
    arrival is the time of `/clock`, and nothing is recorded before the first one. Encoding, compression and writing are done in a thread;
    on the virtual clock in the event loop, so that the run waits for the disk.

    No message is lost without being counted in `dropped`. When the bag cannot be written any further, that is logged, `failure` is set,
    recording ends, and the node goes on; what was written is readable. Raises `BagError` at its start if the bag cannot be begun.

    The services are those of `ros2 bag record`: `~/pause`, `~/resume`, `~/toggle_paused`, `~/is_paused`, `~/split_bagfile`, `~/snapshot`,
    `~/stop`, `~/is_discovery_running`, `~/start_discovery`, `~/stop_discovery`.
    """

    # Invariants:
    # * `_captures` holds the subscription of each channel that is recorded, and none once recording is over.
    # * Messages go through `_outbox`, or with `snapshot` wait in `_ring`. the thread that uses the writer holds `_lock`.

    node_name = "rosbag2_recorder"
    no_replay = "writes files, which no journal carries"
    splits = publishes(SPLIT)

    def __init__(self, path: str | os.PathLike[str], options: RecordOptions | None = None) -> None:
        self.path = Path(path)
        self.options = options or RecordOptions()
        self.paused = self.options.paused
        self._discovery = self.options.discovery
        self.failure: OSError | None = None
        """Why recording has ended, if the bag could not be written."""
        self._writer = BagWriter(self.path, self.options.writer)
        self._outbox = WriteQueue(self._writer, self.options.max_cache_bytes)
        self._ring = Ring(self.options.max_cache_bytes)
        self._captures: dict[Channel, Capture] = {}
        self._channels: dict[tuple[str, str], Channel] = {}
        self._remote_types = RemoteTypes()
        self._unknown: set[str] = set()
        """The types that cannot be recorded, because nobody describes them. Each has been told of once."""
        self._lost = 0
        """What was lost by captures that have been closed."""
        self._listening = True
        """Whether topics are subscribed to; False for good when recording ends."""
        self._order = count()
        self._lock = asyncio.Lock()
        self._changed = asyncio.Event()
        self._over = asyncio.Event()

    async def on_start(self) -> None:
        serve_recorder(self)
        self._discover()

    async def on_stop(self, reason: ExitReason) -> None:
        await self.finish()

    # -- for users ----------------------------------------------------------------------------------------------------------

    @property
    def recorded(self) -> int:
        """The number of messages given to the bag so far, without those that it has lost."""
        return self._writer.given - self._writer.lost

    @property
    def over(self) -> bool:
        """Whether recording has ended."""
        return self._over.is_set()

    @property
    def discovery(self) -> bool:
        """Whether topics that appear are recorded, too. Set to True again, what has appeared meanwhile is."""
        return self._discovery

    @discovery.setter
    def discovery(self, wanted: bool) -> None:
        self._discovery = wanted
        self._changed.set()

    @property
    def dropped(self) -> int:
        """The number of messages of recorded topics that are not in the bag: lost on their way here, for want of room, or by an error."""
        arriving = sum(capture.dropped for capture in self._captures.values())
        outbox = self._outbox
        return self._lost + arriving + outbox.dropped + outbox.unencodable + self._ring.lost + self._writer.lost

    @property
    def topics(self) -> list[str]:
        """The topics that are recorded now."""
        return sorted(channel.topic for channel in self._captures)

    @property
    def size(self) -> int:
        """The size of the bag so far, in bytes."""
        return self._writer.size

    def pause(self) -> None:
        """Record nothing until `unpause`. Messages of that time are not counted as lost."""
        self.paused = True

    def unpause(self) -> None:
        """Record again after `pause`."""
        self.paused = False

    async def wait(self) -> None:
        """Wait until recording has ended: by `finish`, by the service `~/stop`, or because of a `failure`."""
        await self._over.wait()

    async def snapshot(self) -> bool:
        """Write what is kept in memory to a file of its own. False without `RecordOptions.snapshot`, and after the end."""
        if not self.options.snapshot or self._over.is_set():
            return False
        async with self._lock:
            if self._writer.given:
                await self._do(self._writer.split)
            for taken in self._kept():
                self._outbox.add(taken)
            await self._drain()
            await self._do(self._writer.flush)
        return self.failure is None

    async def split(self) -> None:
        """Close the present file of the bag and begin the next one."""
        async with self._lock:
            await self._drain()
            split = await self._do(self._writer.split)
            if split is not None:
                self._tell(split)

    async def finish(self) -> None:
        """Write what waits, close the bag and record no more. Calling it twice is harmless."""
        self._release()
        async with self._lock:
            await self._drain()
            await self._do(self._outbox.note)
            await self._do(self._writer.close)
        self._over.set()

    # -- what is recorded ---------------------------------------------------------------------------------------------------

    @background
    async def follow(self) -> None:
        """Subscribe to what appears."""
        leave = incarnation_of(self).runtime.graph.on_change(self._changed.set)
        try:
            while self._listening:
                if self._discovery:
                    self._discover()
                await self._changed.wait()
                self._changed.clear()
        finally:
            leave()

    def _discover(self) -> None:
        life = incarnation_of(self)
        for offer in offers(life.runtime.graph, life, unpublished=self.options.unpublished):
            if self._wanted(offer):
                self._follow(offer)

    def _wanted(self, offer: Offer) -> bool:
        if not self.options.selection.takes(offer.entry.name, offer.type_name):
            return False
        if not self.options.leaf_topics and not offer.used:
            return False
        if offer.type is None and (owners := self._remote_types.owners(offer)):
            self.create_task(self._learn(offer, owners))
        return offer.type is not None

    async def _learn(self, offer: Offer, owners: list[str]) -> None:
        """Fetch a type that is not known here from the nodes that use it, and subscribe to its topics."""
        life = incarnation_of(self)
        graph = life.runtime.graph
        if await self._remote_types.fetch(self, graph, offer, owners):
            for known in offers(graph, life, unpublished=self.options.unpublished):
                if self._listening and known.type_name == offer.type_name and self._wanted(known):
                    self._follow(known)
        elif offer.type_name not in self._unknown:
            self._unknown.add(offer.type_name)
            self.log.warning(
                "not recorded: its type is not known here", topic=offer.entry.name, type=offer.type_name,
                remedy="load the folder of its definition: --interfaces DIR, or actors.interfaces.load_folder",
            )  # fmt: skip

    def _follow(self, offer: Offer) -> None:
        """Subscribe to a topic, or again with less if what is requested now is more than is offered."""
        assert offer.type is not None
        name, life = offer.entry.name, incarnation_of(self)
        channel = self._channels.get((name, offer.type_name))
        if channel is None:
            channel = self._channels[name, offer.type_name] = Channel(name, offer.type)
            self._outbox.channels.append(channel)
        for qos in offer.offered:
            channel.offer(qos)
        requested = self.options.qos.get(name) or fitting(offer.offered)
        present = self._captures.get(channel)
        if present is not None:
            less = (requested.reliable, requested.transient_local)
            if less >= (present.qos.reliable, present.qos.transient_local):
                return
            self._lost += present.dropped
            present.close()
        self._captures[channel] = Capture(
            life, offer.entry, channel, requested, self._take, decoded=self.options.snapshot
        )

    def _take(self, channel: Channel, publisher: PublisherPeer, arrival: LazyMessage) -> None:
        # Runs for every recorded message, while it is published.
        if self.paused:
            return
        clock = self.clock
        received_ns = clock.wall_ns()
        if received_ns == 0 and incarnation_of(self).sim is not None:
            return  # simulated time has not begun
        sent_ns = received_ns if arrival.sent_ns is None else arrival.sent_ns
        if self.options.snapshot:
            self._keep(channel, publisher, arrival.message, sent_ns)
        else:
            weight = weight_of(channel.type)(arrival.message) if arrival.size is None else arrival.size
            self._outbox.add(Taken(channel, arrival, received_ns, sent_ns, weight))

    def _keep(self, channel: Channel, publisher: PublisherPeer, message: Message, sent_ns: int) -> None:
        """Hold a message in memory, until it is too old or a snapshot is taken."""
        qos, at = publisher.qos, incarnation_of(self).runtime.clock.now()
        source = Source(channel, publisher.node.fqn, qos.limit if qos.transient_local else 0)
        entry = Entry(next(self._order), at, source, message, weight_of(channel.type)(message), sent_ns)
        self._ring.append(entry, at - self.options.snapshot_seconds)

    def _kept(self) -> Iterator[Taken]:
        """What is held in memory, which it leaves, but for the latched messages."""
        clock, ring = incarnation_of(self).runtime.clock, self._ring
        ring.trim(clock.now() - self.options.snapshot_seconds)
        latched = sorted(entry for channel in self._channels.values() for entry in channel.held())
        for one, at in placed(latched, ring.release()):
            sent_ns = clock.wall_ns_at(one.at) if one.sent_ns is None else one.sent_ns
            yield Taken(one.source.channel, LazyMessage(one.message), clock.wall_ns_at(at), sent_ns)

    # -- what is written ----------------------------------------------------------------------------------------------------

    @background
    async def write(self) -> None:
        """Write what waits, again and again."""
        clock = incarnation_of(self).runtime.clock
        while not self._over.is_set():
            await clock.sleep(CADENCE)
            async with self._lock:
                await self._drain()

    async def _drain(self) -> None:
        if self._outbox.take():
            for split in await self._do(self._outbox.write) or ():
                self._tell(split)

    async def _do(self, function: Callable[[], T]) -> T | None:
        """Use the writer, in a thread. Its error ends the recording."""
        if self.failure is not None:
            return None
        try:
            return await self.offload(function, thread=True)
        except OSError as error:
            self.failure = error
            self._release()
            self.log.error(
                "recording has ended: the bag cannot be written", bag=str(self.path), because=error.strerror or str(error),
                remedy="make room on the disk, and record into another folder",
            )  # fmt: skip
            try:
                await self.offload(self._writer.close, thread=True)
            except OSError:
                self.log.warning("the index of the bag could not be written", bag=str(self.path), remedy="bag reindex")
            self._over.set()
            return None

    def _release(self) -> None:
        """Leave all topics, for good."""
        self._listening = False
        for capture in self._captures.values():
            self._lost += capture.dropped
            capture.close()
        self._captures.clear()

    def _tell(self, split: Split) -> None:
        self.splits(WriteSplitEvent(closed_file=split.closed, opened_file=split.opened, node_name=self.fqn))
