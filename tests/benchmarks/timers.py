"""Periodic callbacks on the real clock: by how much a 500 Hz tick is late, median and 99th percentile."""

from __future__ import annotations

import asyncio
import importlib
import time
from collections.abc import Callable

from actors.time.real_loop import new_event_loop
from actors.time.ticker import Ticker
from tests.benchmarks import Contestant, Row, contest

HZ = 500
SECONDS = 2.0
"""Of each round; five rounds are ten seconds for each contestant."""


def run() -> list[Row]:
    contestants = [
        Contestant("Ticker on new_event_loop()", "ours", lambda: _ticker(new_event_loop)),
        Contestant("call_at on new_event_loop()", "ours", lambda: _call_at(new_event_loop)),
        Contestant("a loop that spins, one core busy", "floor", _spin),
        Contestant("call_at on asyncio's loop", "peer", lambda: _call_at(asyncio.new_event_loop)),
        Contestant("call_at on uvloop", "peer", lambda: _call_at(_uvloop), needs="uvloop"),
    ]
    return contest(f"lateness of a {HZ} Hz tick on the real clock", ["us p50", "us p99"], contestants, rounds=5)


def _uvloop() -> asyncio.AbstractEventLoop:
    loop: asyncio.AbstractEventLoop = importlib.import_module("uvloop").new_event_loop()
    return loop


def _quantiles(late: list[float]) -> tuple[float, float]:
    late.sort()
    return late[len(late) // 2] * 1e6, late[len(late) * 99 // 100] * 1e6


def _ticker(factory: Callable[[], asyncio.AbstractEventLoop]) -> tuple[float, float]:
    late: list[float] = []
    loop = factory()

    def tick(k: int, due: float) -> None:
        late.append(time.monotonic() - due)
        if k >= HZ * SECONDS:
            loop.stop()

    Ticker(loop).add(HZ, tick)
    loop.run_forever()
    loop.close()
    return _quantiles(late)


def _call_at(factory: Callable[[], asyncio.AbstractEventLoop]) -> tuple[float, float]:
    late: list[float] = []
    loop = factory()
    start = loop.time()

    def tick(k: int) -> None:
        late.append(time.monotonic() - (start + k / HZ))
        if k >= HZ * SECONDS:
            loop.stop()
        else:
            loop.call_at(start + (k + 1) / HZ, tick, k + 1)

    loop.call_at(start + 1 / HZ, tick, 1)
    loop.run_forever()
    loop.close()
    return _quantiles(late)


def _spin() -> tuple[float, float]:
    late: list[float] = []
    start = time.monotonic()
    for k in range(1, int(HZ * SECONDS) + 1):
        while (now := time.monotonic()) < start + k / HZ:
            pass
        late.append(now - (start + k / HZ))
    return _quantiles(late)
