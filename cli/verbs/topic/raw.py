"""Messages as bytes: for `topic hz`, `topic bw` and `topic echo --raw`, which need not know their types, and read them as they arrive."""

from __future__ import annotations

import argparse
import asyncio
import os
import time
from collections.abc import AsyncGenerator, Callable, Generator, Sequence
from contextlib import ExitStack, asynccontextmanager, contextmanager
from typing import TYPE_CHECKING, NamedTuple

from actors.suggest import did_you_mean
from actors.transport.environment import domain_from_environment
from actors.transport.format.attachments import parse_attachment
from actors.transport.format.errors import WireFormatError
from actors.transport.format.keys import write_key
from actors.transport.format.tokens import EndpointToken, NodeToken, write_token
from actors.transport.protocol import Delivery, Sample, Transport
from cli.command import CommandFailed, Exit
from cli.graph.view import PUBLISHER, SUBSCRIPTION, Endpoint, GraphView, absolute, watching
from cli.output import clear_screen, print_json
from cli.parsing import complain
from cli.quality import fitting_qos, objections

if TYPE_CHECKING:
    from actors import QoS

__all__ = ["Arrival", "Ear", "echo_raw", "listening", "topic_names"]


class Arrival(NamedTuple):
    """A message that has arrived."""

    payload: bytes
    source_time: int
    """When it was sent, in nanoseconds since 1970."""
    sequence_number: int
    """Its number among those of its publisher, from 1."""
    publisher: bytes
    """The GID of the publisher."""


class Ear:
    """Subscriptions of this command to topics, of whatever type these are.

    Each is shown by a token, as that of a node would be, so that publishers that look for listeners find one.
    """

    def __init__(self, view: GraphView, transport: Transport, name: str) -> None:
        self._view = view
        self._transport = transport
        self._node = NodeToken(domain_from_environment(os.environ), transport.session, 0, name)
        self._numbers = 0

    @contextmanager
    def node(self) -> Generator[None]:
        """Show the node, for as long as the block lasts."""
        handle = self._transport.announce(write_token(self._node))
        try:
            yield
        finally:
            handle.close()

    async def ends(self, name: str) -> list[Endpoint]:
        """The ends of a topic; if there are none, wait until there are, and say so."""
        ends = self._view.endpoints(PUBLISHER, name=name) or self._view.endpoints(SUBSCRIPTION, name=name)
        if not ends:
            hint = did_you_mean(name, list(self._view.topics(hidden=False)))
            complain(f"WARNING: topic [{name}] does not appear to be published yet{hint}")
        while not ends:
            await self._view.changed()
            ends = self._view.endpoints(PUBLISHER, name=name)
        return ends

    def subscribe(
        self, name: str, ends: Sequence[Endpoint], options: argparse.Namespace, take: Callable[[Arrival], None]
    ) -> ExitStack:
        """Call `take` with each message of a topic until the stack is closed. Messages of all its types are taken."""
        publishers = [end for end in ends if end.token.kind is PUBLISHER]
        quality = fitting_qos([end.token.qos for end in publishers], options)
        for line in objections([(end.node, end.token.qos) for end in publishers], quality):
            complain(f"{name}: {line}")

        def arrived(sample: Sample) -> None:
            try:
                sent = parse_attachment(sample.attachment)
            except WireFormatError:
                return  # as in ROS 2
            take(Arrival(sample.payload, sent.source_time, sent.sequence_number, sent.gid))

        stack = ExitStack()
        for kind, type_hash in dict.fromkeys((end.token.type, end.token.type_hash) for end in ends):
            self._numbers += 1
            token = EndpointToken(self._node, self._numbers, SUBSCRIPTION, name, kind, type_hash, quality)
            handle = self._transport.subscribe(write_key(token.key), _delivery(quality), arrived)
            stack.callback(handle.close)
            stack.callback(self._transport.announce(write_token(token)).close)
        return stack


def _delivery(wanted: QoS) -> Delivery:
    """What a transport must know of the quality of service of a subscription. Its priority is that of the sender."""
    history = wanted.limit if wanted.transient_local else 0
    return Delivery(reliable=wanted.reliable, keep_all=False, depth=wanted.limit, history=history)


@asynccontextmanager
async def listening(options: argparse.Namespace) -> AsyncGenerator[tuple[GraphView, Ear]]:
    """The graph, and an ear for its topics."""
    async with watching(options) as (view, transport):
        await view.settle(options.spin_time)
        ear = Ear(view, transport, getattr(options, "node_name", None) or f"_robactor_cli_{os.getpid()}")
        with ear.node():
            yield view, ear


def topic_names(options: argparse.Namespace, view: GraphView) -> list[str]:
    """The topics that the options name, or all there are."""
    if options.all_topics and options.topic_name:
        raise CommandFailed("Cannot specify both --all/-a and topic names")
    names = list(view.topics(hidden=False)) if options.all_topics else [absolute(name) for name in options.topic_name]
    if not names:
        raise CommandFailed("No topics available" if options.all_topics else "give the name of a topic, or --all")
    return list(dict.fromkeys(names))


async def echo_raw(options: argparse.Namespace) -> Exit:
    """Print the bytes of messages, until Ctrl-C or until the options say so."""
    if options.field or options.filter:
        raise CommandFailed("--field and --filter need the fields of a message, and --raw does not know them")
    async with listening(options) as (_, ear):
        name = absolute(options.topic_name)
        arrivals: asyncio.Queue[Arrival] = asyncio.Queue()
        with ear.subscribe(name, await ear.ends(name), options, arrivals.put_nowait):
            while True:
                try:
                    async with asyncio.timeout(options.timeout):
                        arrival = await arrivals.get()
                except TimeoutError:
                    raise CommandFailed(f"no message on {name} for {options.timeout:g} s") from None
                _print(arrival, options)
                if options.once:
                    return Exit.DONE


def _print(arrival: Arrival, options: argparse.Namespace) -> None:
    info = {
        "source_timestamp": arrival.source_time,
        "received_timestamp": time.time_ns(),
        "publication_sequence_number": arrival.sequence_number,
    }
    if options.json:
        print_json({"payload": arrival.payload.hex(), **info})
        return
    if options.clear:
        clear_screen()
    if options.include_message_info:
        print(f"---Got new message, message info:---\n{info}\n---Message data:---")
    print(f"{arrival.payload!r}\n---")
