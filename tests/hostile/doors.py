"""Hostile bytes at each place where bytes from outside are read: what is refused, what it costs, and that nothing else is raised."""

from __future__ import annotations

import random
import re
import resource
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import msgspec
import zstandard

from actors import Child, Node, Topic, every, execute, parameter, publishes, run
from actors.bag import WriterOptions
from actors.bag.contents import BagError
from actors.bag.reader import BagReader
from actors.hosts import messages as hosts
from actors.hosts.events import UnreadableEvent, read_event
from actors.interfaces import encode
from actors.interfaces.cdr import decode
from actors.interfaces.describing import described
from actors.interfaces.errors import InterfaceError
from actors.interfaces.learning import define, definitions_of
from actors.interfaces.std_msgs.msg import Int32
from actors.interfaces.type_description_interfaces.srv import GetTypeDescription
from actors.launch.errors import LaunchError
from actors.launch.loading import load as load_launch
from actors.parameters.files import InvalidParams, ParameterOverrides
from actors.processes.messages import Line, NodeFacts, Nodes, Over
from actors.processes.pickling import pack
from actors.replay import Journal, ReplayError, load
from actors.replay.encoding import frozen, thawed
from actors.replay.parts import FORMAT, MAGIC, SIZE, parts_of
from actors.supervision.reasons import Failed
from actors.transport.format.attachments import Attachment, parse_attachment, write_attachment
from actors.transport.format.errors import WireFormatError
from actors.transport.format.tokens import parse_token
from robot.nodes.map_files import InvalidMap, read_map
from tests.actors.bag.bags import write
from tests.hostile import dds

NUMBERS = Topic(Int32, "numbers")
LONGEST: Final = 0.25
A_BYTE: Final = 2e-5
"""Seconds of a processor that one input may take, and so much more for each of its bytes: PyYAML reads 100 kB a second."""


@dataclass(slots=True)
class Door:
    """A place where bytes from outside are read: right ones, the reader, and what it raises for others."""

    seeds: list[bytes]
    read: Callable[[bytes], object]
    refuses: tuple[type[Exception], ...]


@dataclass(slots=True)
class Outcome:
    """What came of the inputs at one door."""

    sent: int = 0
    refused: int = 0
    longest: float = 0.0
    """Seconds of a processor."""
    worst: bytes = b""
    total: float = 0.0
    grown: int = 0
    """Kilobytes, after the first fifth."""
    raised: Counter[str] = field(default_factory=Counter[str])
    """What else was raised: once each, with an input."""
    examples: dict[str, bytes] = field(default_factory=dict[str, bytes])


def mutated(rng: random.Random, seeds: list[bytes]) -> bytes:
    """A right input with one to four changes: of bytes, of numbers, of words; cut out, repeated, nested, or spliced with another."""
    data = bytearray(rng.choice(seeds))
    for _ in range(rng.choice((1, 1, 2, 4))):
        at = rng.randrange(len(data) + 1)
        end = min(len(data), at + rng.choice((1, 2, 4, 8, 30)))
        match rng.randrange(9):
            case 0:
                data[at:end] = rng.randbytes(end - at)
            case 1:
                data[at:end] = bytes((rng.choice((0, 0x7F, 0x80, 0xFF)),)) * (end - at)
            case 2:
                del data[at : rng.choice((end, len(data)))]
            case 3:
                data[at:at] = data[at:end] * rng.choice((1, 10, 1000))
            case 4:
                other = rng.choice(seeds)
                begin = rng.randrange(len(other) + 1)
                data[at:end] = other[begin : begin + rng.choice((4, 30, 300))]
            case 5:
                data[at:end] = rng.choice((2**31, 2**63 - 1, 2**64 - 1, 1, 0)).to_bytes(8, "little")[: max(1, end - at)]
            case 6:
                data[at:at] = rng.choice(_WORDS)
            case 7:
                places = [place for place, one in enumerate(data) if 0x30 <= one <= 0x39]
                if places:
                    place = rng.choice(places)
                    data[place : place + 1] = rng.choice((b"-1", b"1e308", b".nan", b"9" * 400, b"0x", b"1e-300"))
            case _:
                data[at:at] = rng.choice((b"[", b"{", b"(", b"<a>", b"- ", b"&a *a ", b"}", b"\x85")) * rng.choice(
                    (1, 50, 5000)
                )
    return bytes(data)


_WORDS: Final = (
    b"&a [*a, *a]", b"*a", b"!!python/object/apply:os.system ['x']", b"$(eval 'x')", b"$(var a)", b"$(env PATH)", b"<!ENTITY a 'b'>", b"&a;",
    b"\x1b[31m", b"\r\n", b"%", b"..", b"/", b"a" * 2000, b"cos\nsystem\n", b"\x8c\x02os\x8c\x06system\x93", b"}", b"\x8f", b")", b"\x86", b"h\x00",
    b"\x96\xff\xff\xff\xff\xff\x00\x00\x00", b"r\xff\xff\xff\x7f", b"\xc2\x80", b"\xed\xa0\x80", b"/**", b"[9999999]", b"<=4294967295",
)  # fmt: skip


def attack(door: Door, count: int, seed: int) -> Outcome:
    """Read so many hostile inputs."""
    rng, outcome = random.Random(seed), Outcome()
    before = 0
    for number in range(count):
        data = mutated(rng, door.seeds)
        begun = time.process_time()
        try:
            door.read(data)
        except door.refuses:
            outcome.refused += 1
        except Exception as error:
            name = re.sub(r"[0-9]+|(?<=byte )0x..|'.*?'", "N", f"{type(error).__name__}: {error}")[:80]
            outcome.raised[name] += 1
            outcome.examples.setdefault(name, data)
        took = time.process_time() - begun
        outcome.total += took
        if took > outcome.longest:
            outcome.longest, outcome.worst = took, data
        if number == count // 5:
            before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    outcome.sent = count
    outcome.grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    return outcome


def findings(outcome: Outcome) -> list[str]:
    """What breaks the promises."""
    wrong = [f"{times} times {name}, for {outcome.examples[name]!r:.200}" for name, times in outcome.raised.items()]
    if outcome.longest > LONGEST + A_BYTE * len(outcome.worst):
        wrong.append(f"one input took {outcome.longest:.2f} s: {outcome.worst!r:.300}")
    return wrong


def doors(folder: Path) -> dict[str, Door]:
    """All of them; files are written into the folder."""
    failed = pack(Over(Failed(ValueError("x", 3))))
    line = pack(Line(1.0, 20, "a", 1, "says", {"x": 1, "all": [1.5, "two", None, b"3", (4,), {"five"}]}, 2, "trace"))
    facts = pack(
        Nodes((NodeFacts(("top", "a"), Child(Door, name="a"), "running", 2, 1, ((1.5, "it"),), None, 7, b""),), ())
    )
    events = [failed, line, facts]
    agent = [
        hosts.written(one)
        for one in (
            hosts.LeaseRequest(1, 2.0, 3.0), hosts.Launched(1, 2), hosts.ProcessEvent(1, failed), hosts.ProcessEnded(1, OSError("x")), hosts.Leaving(),
            hosts.LeaseGrant(1), hosts.Watched(1, True), hosts.Signaled(1, False),
        )
    ]  # fmt: skip
    node, topic = (
        "@ros2_lv/0/a1b2/3/3/NN/%/%ns/talker",
        "@ros2_lv/0/a1b2/3/7/MP/%/%ns/talker/%chatter/std_msgs::msg::dds_::String_/RIHS01_" + "0" * 64 + "/::,7:,:,:,,",
    )
    launch = [path.read_bytes() for path in sorted(_LAUNCH.glob("*.launch.*")) if path.suffix in (".xml", ".yaml")]
    return {
        "events of hosts": Door(events, read_event, (UnreadableEvent,)),
        "messages of agents": Door(agent, hosts.from_agent, (msgspec.MsgspecError, UnicodeDecodeError, RecursionError)),
        "messages of trees": Door(agent, hosts.for_agent, (msgspec.MsgspecError, UnicodeDecodeError, RecursionError)),
        "type descriptions": Door(_descriptions(), _describe, (InterfaceError,)),
        "tokens": Door(
            [node.encode(), topic.encode()],
            lambda data: parse_token(data.decode("utf-8", "replace")),
            (WireFormatError,),
        ),
        "attachments": Door(
            [write_attachment(Attachment(1, 2, bytes(16), b"RBA\x01"))], parse_attachment, (WireFormatError,)
        ),
        **{name: Door(seeds, read, (refused,)) for name, (seeds, read, refused) in dds.PLACES.items()},
        "parameter files": Door([_PARAMETERS], _parameters, (InvalidParams,)),
        "maps": Door([_MAP, *_PICTURES], lambda data: _map(folder, data), (InvalidMap, OSError)),
        "launch files": Door(launch, lambda data: _launch(folder, data), (LaunchError,)),
        "journals": Door(_journals(), lambda data: _journal(folder, data), (ReplayError,)),
        "bags": Door(_bags(folder), lambda data: _bag(folder, data), (BagError,)),
    }


_LAUNCH: Final = Path(__file__).parents[2] / "robot" / "tutorials" / "launch"
_PARAMETERS: Final = b"""/**:
  ros__parameters: {speed: 1.5, names: [a, "b"], deep: {x: 0x10, flag: yes}}
/arm/*:
  ros__parameters:
    limits: [1, 2, 3]
    text: !!str 12
    wide: &w 7
    same: *w
"""
_MAP: Final = b"image: m.pgm\nmode: trinary\nresolution: 0.05\norigin: [-1.0, 2.0, 0.1]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
_PICTURES: Final = (b"P5\n# made\n4 3\n255\n" + bytes(range(12)), b"P2\n2 2\n255\n0 1 2 3\n")


class Adder(Node):
    """Makes a journal with messages and parameters in it."""

    limit = parameter(1000)

    @NUMBERS.on()
    def add(self, message: Int32) -> None:
        self.log.info("added", data=message.data)


class Talker(Node):
    """Sends what the other takes."""

    out = publishes(NUMBERS)

    @every(hz=100)
    def tick(self) -> None:
        self.out(Int32(data=self.out.count))


def _journals() -> list[bytes]:
    """The chunks of a small journal."""

    async def kept() -> Journal:
        journal = Journal("/adder", folder=None)
        async with run(Talker, Adder, observers=(journal,), sinks=()) as system:
            await system.clock.sleep(0.3)
        return journal

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "j"
        execute(kept, clock="virtual").save(path, "/adder")
        parts = list(parts_of(path.read_bytes()))
    return [chunk for part in parts for chunk in thawed(zstandard.decompress(part))[2]]


def _bags(folder: Path) -> list[bytes]:
    """The files of small bags."""
    options = (None, WriterOptions(compression="zstd"))
    for number, one in enumerate(options):
        write(folder / f"bag{number}", [f"word {count}" for count in range(30)], one)
    return [path.read_bytes() for number in range(2) for path in (folder / f"bag{number}").glob("*.mcap")]


def _descriptions() -> list[bytes]:
    """Of types that are not known here."""
    answers = (
        described(GetTypeDescription.Request(type_name=one, type_hash="", include_type_sources=True)) for one in _TYPES
    )
    return [encode(answer).replace(b"nav_msgs", b"off_msgs") for answer in answers]


_TYPES: Final = ("nav_msgs/msg/Path", "nav_msgs/msg/Goals", "nav_msgs/msg/MapMetaData")


def _describe(data: bytes) -> None:
    try:
        answer = decode(GetTypeDescription.Response, data)
    except ValueError as error:
        raise InterfaceError(str(error)) from error
    name = answer.type_description.type_description.type_name
    if name.startswith("off_msgs/"):
        define(definitions_of(name, [answer]))


def _parameters(data: bytes) -> None:
    ParameterOverrides().with_text(data.decode("utf-8", "replace"))


def _map(folder: Path, data: bytes) -> None:
    right = data[:1] == b"P"
    (folder / "m.pgm").write_bytes(data if right else _PICTURES[0])
    (folder / "m.yaml").write_bytes(_MAP if right else data)
    read_map(folder / "m.yaml")


def _launch(folder: Path, data: bytes) -> None:
    path = folder / ("a.launch.xml" if data.lstrip()[:1] == b"<" else "a.launch.yaml")
    path.write_bytes(data)
    load_launch(path)


def _journal(folder: Path, data: bytes) -> None:
    path = folder / "a.journal"
    part = zstandard.compress(frozen((FORMAT, 0, [data])))
    path.write_bytes(MAGIC + len(part).to_bytes(SIZE, "little") + part)
    load(path)


def _bag(folder: Path, data: bytes) -> None:
    path = folder / "a.mcap"
    path.write_bytes(data)
    with BagReader(path) as bag:
        for _ in bag.messages():
            pass
