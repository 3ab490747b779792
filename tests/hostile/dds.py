"""Hostile discovery data and samples of DDS: at the places where they are read, and from a participant beside honest nodes."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from random import Random
from typing import Any, Final

from actors import ActorError, Child, Node, QoS, Topic, run
from actors.interfaces import encode
from actors.interfaces.std_msgs.msg import String
from actors.qos import History
from actors.transport.dds.discovery import RemoteEndpoint, RemoteParticipant
from actors.transport.dds.endpoints import Status, Writer
from actors.transport.dds.format.names import DISCOVERY_TOPIC, Role
from actors.transport.dds.format.participants import (
    NodeEntities,
    ParticipantEntities,
    parse_participant,
    write_participant,
)
from actors.transport.dds.format.qos import EndpointQos
from actors.transport.dds.format.requests import RequestId, parse_request, write_request
from actors.transport.dds.format.user_data import (
    EndpointData,
    parse_endpoint_data,
    parse_participant_data,
    parse_process,
)
from actors.transport.dds.known import Known
from actors.transport.dds.participant import Participant
from actors.transport.dds.services import Extra, add_extra, split_extra
from actors.transport.format.errors import WireFormatError
from tests.actors.transport.dds.meeting import HERE, MeetingTransport, free_domain
from tests.hostile.scene import Logs
from tests.stage import ADD, total, two

# -- where it is read -------------------------------------------------------------------------------------------------------

_PREFIXES: Final = [bytes((1, 0x10 - one % 2, one)) + bytes(9) for one in range(4)]
"""Of participants; every second one is of Fast DDS."""
_PARTICIPANT: Final = bytes.fromhex("000001c1")
_END: Final = b"\xff\x00\xff"
_TYPE: Final = "std_msgs::msg::dds_::String_"
_REQUEST: Final = "example_interfaces::srv::dds_::AddTwoInts_Request_"
_GID: Final = _PREFIXES[0] + _PARTICIPANT
_INFO: Final = write_participant(ParticipantEntities(_GID, (NodeEntities("/a", "b", (_GID,), (_GID, bytes(16))),)))


def piece(step: int, *words: bytes) -> bytes:
    """One event: what happens, to whom, and its words."""
    return bytes((step, *range(3))) + _END.join(words)


EVENTS: Final = [
    piece(0, b"enclave=/;robactor=a1.12.host;"),
    piece(1),
    piece(2, b"rt/chatter", _TYPE.encode(), b"typehash=RIHS01_" + b"0" * 64 + b";"),
    piece(2, b"rq/addRequest", _REQUEST.encode(), b"clientid= 1.2.3.4.5.6.7.8.9.a.b.c.0.0.0.1;"),
    piece(3),
    piece(4, _INFO),
    piece(5, b"\x01"),
]


class Discovery:
    """Feeds a `Known` with events, as the reading thread orders them, and looks whether what it tells is in order."""

    def __init__(self) -> None:
        self.known = Known(0, self)  # type: ignore[arg-type]
        self._participants: set[bytes] = set()
        self._ends: dict[bytes, RemoteEndpoint] = {}
        self.nodes: set[int] = set()
        self.shown: set[bytes] = set()
        self.links: set[str] = set()

    def read(self, data: bytes) -> None:
        """Raises AssertionError if something appears twice, or vanishes without having appeared."""
        step, whose, which, kind, *_ = (*data[:4], 0, 0, 0, 0)
        prefix, words = _PREFIXES[whose % len(_PREFIXES)], data[4:].split(_END)
        guid, end = prefix + _PARTICIPANT, prefix + bytes((0, 0, which % 16, kind % 8))
        match step % 6:
            case 0 if guid not in self._participants:
                self._participants.add(guid)
                self.known.participant_appeared(RemoteParticipant(guid, words[0]))
            case 1 if guid in self._participants:
                for one in [one for one in self._ends if one.startswith(prefix)]:
                    self.known.endpoint_vanished(self._ends.pop(one))
                self._participants.discard(guid)
                self.known.participant_vanished(guid)
            case 2 if guid in self._participants and end not in self._ends:
                topic, type_name, user_data, *_ = (*(word.decode(errors="replace") for word in words), "", "", "")
                qos = EndpointQos(
                    reliable=bool(which & 1),
                    manual_liveliness=bool(which & 2),
                    depth=kind,
                    user_data=user_data.encode(),
                )
                self._ends[end] = found = RemoteEndpoint(end, guid, bool(kind & 1), topic, type_name, qos, which)
                self.known.endpoint_appeared(found)
            case 3 if end in self._ends:
                self.known.endpoint_vanished(self._ends.pop(end))
            case 4:
                told = parse_participant(data[4:])
                self.known.told(told._replace(gid=guid))
            case 5:
                ends = frozenset(one for one, found in self._ends.items() if found.writes)
                silent = min(which % 8, len(ends))
                self.known.judged(ends, Status("liveliness_changed", len(ends) - silent, 0, not_alive=silent, peer=end))
            case _:
                pass

    def node(self, node: Any, there: bool) -> None:
        assert (id(node) in self.nodes) != there
        (self.nodes.add if there else self.nodes.discard)(id(node))
        assert len(self.nodes) <= 10_000

    def appeared(self, endpoint: Any) -> None:
        assert endpoint.gid not in self.shown
        self.shown.add(endpoint.gid)

    def vanished(self, endpoint: Any) -> None:
        self.shown.remove(endpoint.gid)

    def link(self, session: str, up: bool) -> None:
        """What others tell of their sessions may be the same twice."""

    def liveliness(self, gid: bytes) -> None:
        assert gid in self._ends

    def unreadable(self, *_: object, **__: object) -> None:
        """It is counted."""


def user_data(data: bytes) -> None:
    if parse_participant_data(data) is parse_process(data) is None and parse_endpoint_data(data) == EndpointData():
        raise WireFormatError("nothing of ROS")


def request(data: bytes) -> None:
    split_extra(parse_request(data)[1])


REQUESTS: Final = [
    write_request(RequestId(2**64 - 1, 7), encode(two(1, 2))),
    add_extra(write_request(RequestId(1, 1), encode(two(1, 2))), Extra(b"RBE\x01why", is_error=True)),
]
PLACES: Final[dict[str, tuple[list[bytes], Callable[[bytes], object], type[Exception]]]] = {
    "nodes of DDS": ([_INFO, _INFO.replace(_GID, _GID + bytes(8))], parse_participant, WireFormatError),
    "user data of DDS": ([event[4:] for event in EVENTS], user_data, WireFormatError),
    "requests of DDS": (REQUESTS, request, WireFormatError),
    "discovery of DDS": (EVENTS, Discovery().read, WireFormatError),
}

# -- from a participant -----------------------------------------------------------------------------------------------------

WORDS: Final = Topic(String, "words", QoS(history=History.KEEP_ALL))
BURST: Final = 200


@dataclass
class Outcome:
    """What has become of it."""

    sent: int = 0
    told: list[str] = field(default_factory=list[str])
    heard: list[str] = field(default_factory=list[str])
    answers: Counter[str] = field(default_factory=Counter[str])
    logs: Logs = field(default_factory=Logs)
    errors: list[str] = field(default_factory=list[str])


class Victim(Node):
    """Hears words, and adds."""

    async def on_start(self) -> None:
        self.heard: list[str] = []

    @WORDS.on()
    def hear(self, message: String) -> None:
        if message.data.startswith("honest "):
            self.heard.append(message.data)

    @ADD.serve()
    async def add(self, request: Any) -> Any:
        return total((request.a + request.b) % 2**62)


class Liar:
    """A participant of ROS that writes what it likes on all topics that the others read."""

    def __init__(self, domain: int, rng: Random) -> None:
        self.participant = Participant(replace(HERE, domain=domain), b"enclave=/;robactor=ff.1.liar;")
        self.rng = rng
        self.writers: list[tuple[Writer, list[bytes]]] = []

    def __getattr__(self, name: str) -> Callable[[object], None]:
        """Who comes and goes does not matter."""
        return lambda _: None

    async def open(self) -> None:
        await self.participant.open(self)
        kept = EndpointQos(transient_local=True, depth=1000)
        add = "example_interfaces::srv::dds_::AddTwoInts"
        mine = _INFO.replace(_GID, self.participant.guid)
        for topic, type_name, qos, seeds in (
            (*DISCOVERY_TOPIC, kept, [_INFO, mine]),
            ("rt/words", _TYPE, EndpointQos(depth=1000), [encode(String(data="a lie"))]),
            ("rq/addRequest", f"{add}_Request_", EndpointQos(depth=1000), REQUESTS),
            ("rr/addReply", f"{add}_Response_", EndpointQos(depth=1000), REQUESTS),
            ("robactor/told", "robactor::msg::dds_::Told_", EndpointQos(depth=1000), [b"\0\1\0\0" + bytes(40)]),
        ):
            self.writers.append((self.participant.writer(topic, type_name, qos), seeds))

    def strike(self, mutated: Callable[[Random, list[bytes]], bytes]) -> None:
        writer, seeds = self.rng.choice(self.writers)
        writer.put(b"\0\1\0\0" + mutated(self.rng, seeds)[4:60_000] + b"\0")

    def appear(self) -> None:
        """An endpoint with odd names comes and goes."""
        with suppress(ValueError):  # some are refused here
            role, odd = (
                self.rng.choice(tuple(Role)),
                self.rng.choice(("\x1b[31m", "%s", "\u202e", "a" * 3000, "\n", "")),
            )
            data = self.rng.choice((b"typehash=" + self.rng.randbytes(30), b"clientid=" + b"f." * 15 + b"f;", b";;=;"))
            qos = EndpointQos(user_data=data)
            self.participant.writer(
                f"{role}/x{self.rng.randrange(9)}Request", f"{odd}::srv::dds_::{odd}_Request_", qos
            ).close()


async def attack(count: int, seed: int, mutated: Callable[[Random, list[bytes]], bytes]) -> Outcome:
    """Send so many, with honest words and calls between them."""
    outcome, place, rng = Outcome(), free_domain(), Random(seed)
    asyncio.get_running_loop().set_exception_handler(lambda _, context: outcome.errors.append(str(context)))
    liar = Liar(place, rng)
    async with (
        run(
            Child(Victim, name="victim"), transport=MeetingTransport(place), sinks=(outcome.logs,), signals=False
        ) as near,
        run(Child(Node, name="honest"), transport=MeetingTransport(place), sinks=(), signals=False) as far,
    ):
        victim, honest = near.node("victim"), far.node("honest")
        assert isinstance(victim, Victim)
        words = honest.publisher(WORDS)
        await liar.open()
        try:
            await honest.wait_for(ADD, timeout=20.0)
            while not words.subscription_count:
                await asyncio.sleep(0.01)
            while outcome.sent < count:
                for _ in range(BURST):
                    liar.strike(mutated)
                liar.appear()
                outcome.sent += BURST
                outcome.told.append(f"honest {outcome.sent}")
                words.publish(String(data=outcome.told[-1]))
                try:
                    answer = await honest.call(ADD, two(outcome.sent, 1), timeout=20.0)
                    name = "right" if answer.sum == outcome.sent + 1 else "wrong"
                except ActorError as error:
                    name = type(error).__name__
                outcome.answers[name] += 1
            async with asyncio.timeout(20.0):
                while len(victim.heard) < len(outcome.told):
                    await asyncio.sleep(0.01)
        except TimeoutError:
            pass
        finally:
            outcome.heard = victim.heard
            await liar.participant.close()
    return outcome


def findings(outcome: Outcome) -> list[str]:
    """What breaks the promises."""
    wrong = [f"the event loop was told: {error}" for error in outcome.errors]
    if outcome.heard != outcome.told:
        wrong.append(f"{len(outcome.heard)} of {len(outcome.told)} honest words were heard, or in another order")
    if set(outcome.answers) - {"right"}:
        wrong.append(f"calls have ended otherwise: {outcome.answers}")
    if outcome.logs.lines.total() > 100:
        wrong.append(f"{outcome.logs.lines.total()} lines in the log")
    return wrong
