"""Hostile messages on every key of a system, between honest ones: nothing of these is lost, and nothing grows."""

from __future__ import annotations

import asyncio
import gc
import resource
from collections import deque
from contextlib import AsyncExitStack
from dataclasses import dataclass, field
from random import Random
from typing import Any, NamedTuple

from actors import ActorError, Child, run
from actors.transport.format.gids import gid_of
from actors.transport.format.keys import write_key
from actors.transport.format.tokens import EndpointKind, EndpointToken, NodeToken, parse_token, write_token
from actors.transport.keyed.protocol import Delivery, Outlet, Query
from actors.transport.protocol import Handle
from actors.transport.simulated.network import Network
from actors.transport.simulated.session import SimulatedTransport
from tests.hostile import bytes as hostile
from tests.hostile.scene import ORACLE, Honest, Logs, Tokens, Victim
from tests.stage import two

BURST = 50
"""Hostile messages between two honest exchanges."""
PAUSE = 10.0
"""Virtual seconds after each exchange, so that results of goals, which are kept for some minutes, come to an end."""
HELD = 100
"""Tokens that the stranger holds at once."""
ENDLESS = Delivery(reliable=True, depth=10 * BURST)


@dataclass
class Outcome:
    """What has become of it."""

    sent: int = 0
    unreadable: int = 0
    """How many of them nobody can read, whatever a reader does."""
    told: list[str] = field(default_factory=list[str])
    heard: list[str] = field(default_factory=list[str])
    answers: dict[str, int] = field(default_factory=dict[str, int])
    """What the victim's own calls of a hostile server have ended with, by the name of the error."""
    logs: Logs = field(default_factory=Logs)
    errors: list[str] = field(default_factory=list[str])
    """What has reached the event loop's exception handler."""
    grown: int = 0
    """By so many kilobytes the process has grown after the first tenth of the messages."""


async def attack(messages: int, seed: int) -> Outcome:
    """Send so many, to be run on a virtual clock."""
    outcome, loop = Outcome(), asyncio.get_running_loop()
    loop.set_exception_handler(lambda _, context: outcome.errors.append(str(context)))
    network = Network(seed)
    for host in ("victim", "honest", "stranger"):
        network.add_host(host)
    async with AsyncExitStack() as stack:
        victim_system = await stack.enter_async_context(
            run(
                Child(Victim, name="victim"),
                transport=network.transport("victim"),
                sinks=(outcome.logs,),
                signals=False,
            )
        )
        honest_system = await stack.enter_async_context(
            run(Child(Honest, name="honest"), transport=network.transport("honest"), sinks=(), signals=False)
        )
        await asyncio.sleep(1.0)
        stranger = _Stranger(network.transport("stranger"), Random(seed), outcome)
        await stranger.open()
        victim, honest = victim_system.node("victim"), honest_system.node("honest")
        assert isinstance(victim, Victim)
        assert isinstance(honest, Honest)
        begun = None
        for number in range(max(1, messages // BURST)):
            for _ in range(BURST):
                stranger.strike()
            await _consult(victim, outcome)
            await honest.talk(number)
            await asyncio.sleep(PAUSE)
            if begun is None and outcome.sent * 10 >= messages:
                begun = _kilobytes()
        outcome.grown = _kilobytes() - (begun or 0)
        await asyncio.sleep(1.0)
        outcome.told, outcome.heard = honest.told, victim.heard
    return outcome


async def _consult(victim: Victim, outcome: Outcome) -> None:
    """The victim asks the hostile server; whatever comes is an answer or an error of this library."""
    try:
        await victim.call(ORACLE, two(1, 2), timeout=5.0)
        name = "an answer"
    except ActorError as error:
        name = type(error).__name__
    outcome.answers[name] = outcome.answers.get(name, 0) + 1


def _kilobytes() -> int:
    gc.collect()
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * resource.getpagesize() // 1024


class _Target(NamedTuple):
    """A topic to which somebody listens."""

    outlet: Outlet
    gid: bytes | None
    """That of an honest publisher."""
    by_victim: bool
    """Whether it is the victim who listens."""


class _Stranger:
    """A process without a system: it sends what it likes, on the keys that it has learned from the tokens of the others."""

    def __init__(self, transport: SimulatedTransport, rng: Random, outcome: Outcome) -> None:
        self._transport = transport
        self._rng = rng
        self._outcome = outcome
        self._events = Tokens()
        self._targets: list[_Target] = []
        self._servers: list[str] = []
        """Those of the victim."""
        self._held: deque[Handle] = deque()
        self._known: list[str] = []

    async def open(self) -> None:
        """Learn what there is, and offer a service."""
        await self._transport.open("@ros2_lv/0/**", self._events)
        await asyncio.sleep(1.0)
        self._known = list(self._events.tokens)
        publishers: dict[str, bytes] = {}
        heard: dict[str, bool] = {}
        for text in self._known:
            token = parse_token(text)
            if isinstance(token, EndpointToken):
                key, victim = write_key(token.key), token.node.name == "victim"
                if token.kind is EndpointKind.SERVER and victim:
                    self._servers.append(key)
                elif token.kind is EndpointKind.SUBSCRIPTION:
                    heard[key] = heard.get(key, False) or victim
                elif token.kind is EndpointKind.PUBLISHER:
                    publishers[key] = gid_of(text)
        for key, by_victim in heard.items():
            self._targets.append(_Target(self._transport.outlet(key, ENDLESS), publishers.get(key), by_victim))
        self._offer_oracle()

    def strike(self) -> None:
        """Send one hostile message."""
        self._outcome.sent += 1
        rng = self._rng
        rng.choice((self._sample, self._sample, self._question, self._token))()

    def _sample(self) -> None:
        rng = self._rng
        outlet, gid, by_victim = rng.choice(self._targets)
        match rng.randrange(3):
            case 0:
                outlet.put(hostile.payload(rng), hostile.broken_attachment(rng))
                self._outcome.unreadable += by_victim
            case 1:
                outlet.put(hostile.payload(rng), hostile.attachment(rng))
            case _:  # in the name of another: its bytes cannot be read, so that it is no message of the other
                outlet.put(b"\0\1\0\0\xff", hostile.attachment(rng, gid))

    def _question(self) -> None:
        rng = self._rng
        key, broken = rng.choice(self._servers), rng.random() < 0.5
        attachment = hostile.broken_attachment(rng) if broken else hostile.attachment(rng)
        self._outcome.unreadable += broken
        self._transport.ask(key, hostile.payload(rng), attachment, 10.0, lambda answer: None)

    def _token(self) -> None:
        self._held.append(self._transport.announce(hostile.token(self._rng, self._known, self._transport.session)))
        if len(self._held) > HELD:
            self._held.popleft().close()

    def _offer_oracle(self) -> None:
        node = NodeToken(0, self._transport.session, 0, "stranger")
        name, type = "/oracle", "example_interfaces/srv/AddTwoInts"
        text = next(text for text in self._known if "/SS/" in text and "%add/" in text)
        add = parse_token(text)
        assert isinstance(add, EndpointToken)
        token = EndpointToken(node, 1, EndpointKind.SERVER, name, type, add.type_hash, add.qos)
        self._transport.serve(write_key(token.key), self._mislead)
        self._transport.announce(write_token(node))
        self._transport.announce(write_token(token))

    def _mislead(self, query: Query) -> None:
        rng = self._rng
        match rng.randrange(3):
            case 0:
                query.reply(hostile.payload(rng), hostile.noise(rng))
            case 1:
                query.fail(hostile.reply_error(rng))
            case _:
                query.drop()


def findings(outcome: Outcome) -> list[str]:
    """What is wrong with it; nothing, if all promises were kept."""
    wrong: list[str] = [f"in the event loop: {error}" for error in outcome.errors]
    if outcome.heard != outcome.told:
        wrong.append(f"{len(outcome.told)} honest messages were sent, and {len(outcome.heard)} heard in order")
    if not outcome.unreadable <= outcome.logs.unreadable <= outcome.sent:
        wrong.append(f"{outcome.unreadable} at least cannot be read, and {outcome.logs.unreadable} were counted")
    repeated: dict[Any, int] = {
        line: count for line, count in outcome.logs.lines.items() if count > 1 and "cannot be" in line[0]
    }
    wrong += [f"logged {count} times: {line}" for line, count in repeated.items()]
    return wrong
