"""Messages as bytes: for `topic hz`, `topic bw` and `topic echo --raw`, which need not know their types, and read them as they arrive."""

from __future__ import annotations

import argparse
import asyncio
import os
import time
from collections.abc import AsyncGenerator, Callable, Generator, Sequence
from contextlib import ExitStack, asynccontextmanager, contextmanager
from typing import NamedTuple

from actors.suggest import did_you_mean
from actors.transport.protocol import NodeHere, Participant, TypeInfo
from cli.command import CommandFailed, Exit
from cli.graph.view import PUBLISHER, SUBSCRIPTION, Endpoint, GraphView, absolute, watching
from cli.output import clear_screen, print_json
from cli.parsing import complain
from cli.quality import fitting_qos, objections


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

    Each is shown, as that of a node would be, so that publishers that look for listeners find one.
    """

    _node: NodeHere

    def __init__(self, view: GraphView, participant: Participant, name: str) -> None:
        self._view = view
        self._participant = participant
        self._name = name

    @contextmanager
    def node(self) -> Generator[None]:
        """Show the node, for as long as the block lasts."""
        self._node = self._participant.node(f"/{self._name}")
        try:
            yield
        finally:
            self._node.close()

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
        publishers = [end for end in ends if end.about.kind is PUBLISHER]
        quality = fitting_qos([end.about.qos for end in publishers], options)
        for line in objections([(end.node, end.about.qos) for end in publishers], quality):
            complain(f"{name}: {line}")

        def arrived(takers: object, gid: bytes, number: int, sent: int, payload: bytes, since: float | None) -> None:
            take(Arrival(payload, sent, number, gid))

        stack = ExitStack()
        for kind, type_hash in dict.fromkeys((end.about.type, end.about.type_hash) for end in ends):
            type = TypeInfo(kind, type_hash)
            stack.callback(self._participant.subscription(self._node, name, type, quality, arrived, self).close)
        return stack


@asynccontextmanager
async def listening(options: argparse.Namespace) -> AsyncGenerator[tuple[GraphView, Ear]]:
    """The graph, and an ear for its topics."""
    async with watching(options) as (view, participant):
        await view.settle(options.spin_time)
        ear = Ear(view, participant, getattr(options, "node_name", None) or f"_robactor_cli_{os.getpid()}")
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
