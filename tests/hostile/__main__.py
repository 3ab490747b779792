"""`python -m tests.hostile wire --messages 1000000 --seed 1`: hostile messages on every key; ends with 1 if a promise is broken.

`python -m tests.hostile web --count 100000`: hostile frames and requests on every protocol of the web server.

`python -m tests.hostile doors --count 100000`: hostile bytes at each place where bytes from outside are read (`--only NAME` for one).

`python -m tests.hostile dds --count 100000`: the same samples, and odd endpoints, from a participant of DDS beside honest nodes.

`python -m tests.hostile crowd --seconds 600`: 20 clients of the web server, of which 5 never read and 2 send garbage.
"""

from __future__ import annotations

import argparse
import asyncio
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from actors import execute
from tests.hostile import crowd, dds, doors, web
from tests.hostile.wire import attack, findings

GROWTH = 32 * 1024
"""By so many kilobytes the process may grow after the first tenth: the honest words that the test itself keeps, and the rings of the logs."""


def main(argv: Sequence[str] | None = None) -> int:
    """The exit code."""
    parser = argparse.ArgumentParser(prog="python -m tests.hostile", description=__doc__)
    parser.add_argument("what", choices=("wire", "web", "doors", "dds", "crowd"))
    parser.add_argument("--messages", "--count", type=int, default=100_000, metavar="N")
    parser.add_argument("--seed", type=int, default=1, metavar="N")
    parser.add_argument("--seconds", type=float, default=600.0, metavar="S", help="of a crowd (600)")
    parser.add_argument("--only", default="", metavar="NAME", help="of the doors, those with this in their name")
    options = parser.parse_args(argv)
    if options.what == "doors":
        return _doors(options.messages, options.seed, options.only)
    if options.what == "dds":
        return _dds(options.messages, options.seed)
    if options.what == "crowd":
        return _crowd(options.seconds)
    if options.what == "web":
        return _web(options.messages, options.seed)
    began = time.monotonic()
    outcome = execute(lambda: attack(options.messages, options.seed), clock="virtual")
    wrong = findings(outcome)
    if outcome.grown > GROWTH:
        wrong.append(f"the process has grown by {outcome.grown} kB after the first tenth")
    print(f"hostile messages       {outcome.sent:>10,}   seed {options.seed}, {time.monotonic() - began:.0f} s")
    print(
        f"counted as unreadable  {outcome.logs.unreadable:>10,}   of which {outcome.unreadable:,} could be read by nobody"
    )
    print(f"lines in the log       {outcome.logs.lines.total():>10,}")
    print(
        f"honest messages heard  {len(outcome.heard):>10,}   of {len(outcome.told):,}, in order; as many calls and goals"
    )
    print(f"calls of a liar        {sum(outcome.answers.values()):>10,}   {outcome.answers}")
    print(f"grown by, kB           {outcome.grown:>10,}")
    for line in wrong:
        print(f"WRONG: {line}")
    return 1 if wrong else 0


def _doors(count: int, seed: int, only: str) -> int:
    wrong: list[str] = []
    print(f"{'door':<20} {'inputs':>9} {'refused':>9} {'mean, ms':>9} {'longest, ms':>12} {'grown by, kB':>13}")
    with tempfile.TemporaryDirectory() as folder:
        for name, door in doors.doors(Path(folder)).items():
            if only not in name:
                continue
            outcome = doors.attack(door, count, seed)
            mean = 1000 * outcome.total / max(1, outcome.sent)
            row = f"{outcome.sent:>9,} {outcome.refused:>9,} {mean:>9.3f} {1000 * outcome.longest:>12.1f} {outcome.grown:>13,}"
            print(f"{name:<20} {row}", flush=True)
            wrong += [f"{name}: {line}" for line in doors.findings(outcome)]
    for line in wrong:
        print(f"WRONG: {line}")
    return 1 if wrong else 0


def _dds(count: int, seed: int) -> int:
    began = time.monotonic()
    outcome = asyncio.run(dds.attack(count, seed, doors.mutated))
    wrong = dds.findings(outcome)
    print(f"hostile samples        {outcome.sent:>10,}   seed {seed}, {time.monotonic() - began:.0f} s")
    print(f"counted as unreadable  {outcome.logs.unreadable:>10,}   in {outcome.logs.lines.total():,} lines of the log")
    print(
        f"honest messages heard  {len(outcome.heard):>10,}   of {len(outcome.told):,}, in order; {dict(outcome.answers)}"
    )
    for line in wrong:
        print(f"WRONG: {line}")
    return 1 if wrong else 0


def _crowd(seconds: float) -> int:
    alone = asyncio.run(crowd.watch(min(seconds, 30.0), readers=0, sleepers=0, vandals=0))
    outcome = asyncio.run(crowd.watch(seconds, readers=13, sleepers=5, vandals=2))
    for name, one in (("alone", alone), ("20 clients", outcome)):
        late = f"lateness p50 {one.lateness(50):6.2f} ms, p99 {one.lateness(99):6.2f} ms"
        print(f"{name:<11} {one.rate:7.2f} Hz, {late}, {100 * one.processor:5.1f} % of a core")
    print(f"heard       {min(outcome.heard):,} to {max(outcome.heard):,} messages by each reader, of {outcome.sent:,}")
    print(f"vandals     {outcome.thrown_out:,} times thrown out; grown by {outcome.grown:,} kB after the first fifth")
    wrong = crowd.findings(outcome)
    for line in wrong:
        print(f"WRONG: {line}")
    return 1 if wrong else 0


def _web(count: int, seed: int) -> int:
    began = time.monotonic()
    outcome = asyncio.run(web.attack(count, seed))
    wrong = web.findings(outcome)
    if outcome.grown > GROWTH:
        wrong.append(f"the process has grown by {outcome.grown} kB after the first fifth")
    print(
        f"hostile frames, requests {outcome.sent.total():>8,}   seed {seed}, {time.monotonic() - began:.0f} s, {dict(outcome.sent)}"
    )
    print(f"closed by the server     {outcome.closed.total():>8,}   {dict(outcome.closed)}")
    print(f"raw requests, answered   {outcome.status.total():>8,}   {dict(outcome.status)}")
    print(f"honest messages heard    {len(outcome.heard):>8,}   of {len(outcome.told):,}, in order")
    print(f"grown by, kB             {outcome.grown:>8,}")
    for line in wrong:
        print(f"WRONG: {line}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
