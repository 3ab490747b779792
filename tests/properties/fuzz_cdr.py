"""Throws mutated bytes at every decoder: `python -m tests.properties.fuzz_cdr --mutations 1000000`.

Valid messages of all types that ship are encoded, their bytes are changed, cut, spliced and lied to, and decoded again. Each
decoding must end in a message or a `CdrError`, within 10 ms of processor time and within ten times its input of memory.

Memory is the peak above what was held before, by tracemalloc, on every `--traced`-th mutation (tracing slows all down by an
order of magnitude). `ALLOWANCE` is for what any result costs however short its input: a numpy array of one octet takes 112
bytes, a message of five empty sequences some hundreds. A mutation "gets past the first field" if its first field can be decoded.
"""

from __future__ import annotations

import argparse
import gc
import random
import struct
import sys
import time
import tracemalloc
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from actors.interfaces import CdrError, Message, decode, encode
from actors.interfaces.cdr_layout import has_loop
from actors.interfaces.message import make_message
from actors.interfaces.types import default
from tests.properties.messages import random_message, shipped_types

TIME_LIMIT = 0.010
MEMORY_FACTOR = 10
ALLOWANCE = 4096
HEADER = 4
LIES = (0, 1, 2, 0x7F, 0x80, 0xFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x524F5332)


@dataclass
class Target:
    """A type with valid encodings, and a type of its first field alone, to see how far a mutation gets."""

    cls: type[Message]
    first: type[Message] | None
    seeds: list[bytes]


@dataclass
class Report:
    """What came of a run."""

    mutations: int = 0
    decoded: int = 0
    refused: int = 0
    past_first: int = 0
    traced: int = 0
    slowest: tuple[float, str] = (0.0, "")
    largest: tuple[float, str] = (0.0, "")
    per_type: Counter[str] = field(default_factory=Counter)
    failures: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        lines = [
            f"{self.mutations} mutations of {len(self.per_type)} types: {self.decoded} decoded, {self.refused} refused",
            f"{self.past_first} ({100 * self.past_first / max(self.mutations, 1):.1f} %) got past the first field",
            f"slowest: {1000 * self.slowest[0]:.2f} ms ({self.slowest[1]}), limit {1000 * TIME_LIMIT:.0f} ms",
            f"memory: {self.traced} traced, worst {self.largest[0]:.2f} times its input beyond {ALLOWANCE} bytes "
            f"({self.largest[1]}), limit {MEMORY_FACTOR}",
            *(f"FAILED {failure}" for failure in self.failures[:20]),
            f"{len(self.failures)} failures",
        ]
        return "\n".join(lines)


def targets(rng: random.Random, seeds: int, most: int) -> list[Target]:
    """Every type that has a field, with some valid encodings of it."""
    found: list[Target] = []
    for number, cls in enumerate(shipped_types()):
        if cls.__ros_fields__:
            encoded = [encode(random_message(cls, rng, most=most)) for _ in range(seeds)]
            found.append(Target(cls, _first_field(cls, number), encoded))
    for target in found:  # compiled now: only decoding is measured
        for data in target.seeds:
            decode(target.cls, data)
    return found


def _first_field(cls: type[Message], number: int) -> type[Message] | None:
    annotations = {cls.__ros_fields__[0].name: cls.__annotations__[cls.__ros_fields__[0].name]}
    body = {"__module__": __name__, "__annotations__": annotations, "__ros_type__": f"fuzz/msg/First{number}"}
    return make_message("First", {**body, cls.__ros_fields__[0].name: default()})


def flip(data: bytearray, rng: random.Random) -> None:
    """Some bits."""
    for _ in range(rng.randint(1, 8)):
        data[_place(data, rng)] ^= 1 << rng.randrange(8)


def overwrite(data: bytearray, rng: random.Random) -> None:
    """Some bytes."""
    for _ in range(rng.randint(1, 8)):
        data[_place(data, rng)] = rng.randrange(256)


def lie(data: bytearray, rng: random.Random) -> None:
    """A number where a length may be."""
    place = HEADER + 4 * rng.randrange(max((len(data) - HEADER) // 4, 1))
    value = rng.choice((*LIES, rng.randrange(2 * len(data))))
    data[place : place + 4] = struct.pack("<I", value)


def cut(data: bytearray, rng: random.Random) -> None:
    """The end missing."""
    del data[rng.randrange(len(data) + 1) :]


def insert(data: bytearray, rng: random.Random) -> None:
    """Bytes too many."""
    place = _place(data, rng)
    data[place:place] = rng.randbytes(rng.randint(1, 16))


def remove(data: bytearray, rng: random.Random) -> None:
    """Bytes missing in the middle."""
    place = _place(data, rng)
    del data[place : place + rng.randint(1, 16)]


def repeat(data: bytearray, rng: random.Random) -> None:
    """A stretch many times over."""
    place = _place(data, rng)
    stretch = bytes(data[place : place + rng.randint(1, 32)])
    data[place:place] = stretch * rng.randint(1, 30)


def swap_order(data: bytearray, rng: random.Random) -> None:
    """The header of the other byte order, or another header."""
    data[1:2] = bytes([rng.choice((0, 0, 0, 3, 7, 255))])


MUTATIONS: Sequence[Callable[[bytearray, random.Random], None]] = (
    flip, flip, overwrite, overwrite, lie, lie, lie, cut, insert, remove, repeat, swap_order
)  # fmt: skip


def _place(data: bytearray, rng: random.Random) -> int:
    return rng.randrange(min(HEADER, len(data) - 1), len(data))


def mutate(data: bytes, rng: random.Random) -> bytes:
    """The data, changed in one to three ways."""
    changed = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        if len(changed) > HEADER:
            rng.choice(MUTATIONS)(changed, rng)
    return bytes(changed)


def run(mutations: int, seed: int, *, seeds: int = 6, most: int = 4, traced: int = 20) -> Report:
    """Decodes so many mutations, spread evenly over all types."""
    rng = random.Random(seed)
    pool = targets(rng, seeds, most)
    report = Report()
    for number in range(mutations):
        target = pool[number % len(pool)]
        data = mutate(rng.choice(target.seeds), rng)
        _decode(target, data, report, traced > 0 and (number // len(pool)) % traced == 0)
        report.per_type[target.cls.__ros_type__] += 1
    return report


def _decode(target: Target, data: bytes, report: Report, trace: bool) -> None:
    name = f"{target.cls.__ros_type__}, {len(data)} bytes"
    report.mutations += 1
    decode_once(target.cls, b"\0\0\0\0")  # the other byte order may not be compiled yet
    if trace:
        tracemalloc.start()
        before = tracemalloc.get_traced_memory()[0]
        decode_once(target.cls, data)
        peak = tracemalloc.get_traced_memory()[1] - before
        tracemalloc.stop()
        report.traced += 1
        factor = (peak - ALLOWANCE) / max(len(data), 1)
        report.largest = max(report.largest, (factor, name))
        if factor > MEMORY_FACTOR:
            report.failures.append(f"{name}: {peak} bytes of memory for {data.hex()}")
    begin = time.process_time()
    error = decode_once(target.cls, data)
    taken = time.process_time() - begin
    if taken > TIME_LIMIT:  # once more: the first may have met a pause of the interpreter or of the machine
        begin = time.process_time()
        decode_once(target.cls, data)
        taken = min(taken, time.process_time() - begin)
    report.slowest = max(report.slowest, (taken, name))
    if taken > TIME_LIMIT:
        report.failures.append(f"{name}: {1000 * taken:.1f} ms for {data.hex()}")
    if error is None:
        report.decoded += 1
    elif isinstance(error, CdrError):
        report.refused += 1
    else:
        report.failures.append(f"{name}: {type(error).__name__}: {error} for {data.hex()}")
    if error is None or (target.first is not None and decode_once(target.first, data) is None):
        report.past_first += 1


def decode_once(cls: type[Message], data: bytes) -> Exception | None:
    """The error of decoding, None if there is none. The message is dropped."""
    try:
        decode(cls, data)
    except Exception as error:
        return error
    return None


def main() -> int:
    """Exit status 1 if any mutation broke a rule."""
    parser = argparse.ArgumentParser(prog="python -m tests.properties.fuzz_cdr", description="Fuzz the CDR decoders.")
    parser.add_argument("--mutations", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--traced", type=int, default=20, help="trace the memory of every n-th mutation (0: of none)")
    options = parser.parse_args()
    gc.disable()  # a collection in the middle of a decoding would be counted as its time
    begin = time.monotonic()
    report = run(options.mutations, options.seed, traced=options.traced)
    print(report)
    print(
        f"seed {options.seed}, {time.monotonic() - begin:.0f} s, {sum(has_loop(cls) for cls in shipped_types())} types with sequences"
    )
    return 1 if report.failures else 0


if __name__ == "__main__":
    sys.exit(main())
