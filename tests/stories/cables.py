"""Cables between machines, carried by this process: packets are read from one machine's interface and written to another's.

What a cable does to a packet is said by the same `Conditions` as in the simulated network. Here they hit packets of the internet protocol, so
TCP sends again what is lost, and UDP does not.
"""

from __future__ import annotations

import asyncio
import math
import os
from collections import deque
from random import Random
from typing import Final

from actors.transport.simulated.link import Conditions

QUEUE_SECONDS: Final = 0.05
"""What a cable of limited bandwidth holds, at most. A packet that finds it full is lost, as in a switch."""
LEAST_QUEUE: Final = 32 * 1024
AT_ONCE: Final = 64
"""Packets that are read from an interface in one turn of the loop."""
LARGEST: Final = 65536


class Cable:
    """One direction between two machines.

    Invariants: packets leave in the order in which they came; while one is on its way, `_timer` runs for the first of them.
    """

    def __init__(self, target: int, conditions: Conditions, random: Random) -> None:
        self.conditions = conditions
        self.is_cut = False
        self.carried_bytes = 0
        self.lost = 0
        """Packets that were lost by chance, in the queue, or because the cable was cut."""
        self._target = target
        self._random = random
        self._loop = asyncio.get_running_loop()
        self._free_at = 0.0
        self._on_the_way: deque[tuple[float, bytes]] = deque()
        self._timer: asyncio.TimerHandle | None = None

    def send(self, packet: bytes) -> None:
        """Take a packet in."""
        now, is_like = self._loop.time(), self.conditions
        begin = max(now, self._free_at)
        room = math.inf if is_like.bandwidth == math.inf else max(LEAST_QUEUE / is_like.bandwidth, QUEUE_SECONDS)
        if self.is_cut or self._random.random() < is_like.loss or begin - now > room:
            self.lost += 1
            return
        self.carried_bytes += len(packet)
        self._free_at = begin + len(packet) / is_like.bandwidth
        due = self._free_at + is_like.delay + self._random.random() * is_like.jitter
        if self._on_the_way:
            due = max(due, self._on_the_way[-1][0])
        self._on_the_way.append((due, packet))
        if self._timer is None:
            self._timer = self._loop.call_at(due, self._arrive)

    def _arrive(self) -> None:
        self._timer = None
        now = self._loop.time()
        while self._on_the_way and self._on_the_way[0][0] <= now + 0.0002:
            _, packet = self._on_the_way.popleft()
            if self.is_cut:
                self.lost += 1
                continue
            try:
                os.write(self._target, packet)
            except OSError:  # its interface is gone or full
                self.lost += 1
        if self._on_the_way:
            self._timer = self._loop.call_at(self._on_the_way[0][0], self._arrive)

    def close(self) -> None:
        """Carry nothing any more."""
        self._on_the_way.clear()
        if self._timer is not None:
            self._timer.cancel()


class Cables:
    """A cable in each direction between each two machines, which are known by the last byte of their addresses."""

    def __init__(self, ends: dict[int, int], conditions: Conditions, seed: int = 0) -> None:
        """`ends` are the other ends of the machines' interfaces."""
        self._ends = ends
        self.of = {
            (one, other): Cable(ends[other], conditions, Random(f"cable/{seed}/{one}>{other}"))
            for one in ends
            for other in ends
            if one != other
        }
        self._loop = asyncio.get_running_loop()
        for number, end in ends.items():
            os.set_blocking(end, False)
            self._loop.add_reader(end, self._read, number, end)

    def _read(self, number: int, end: int) -> None:
        for _ in range(AT_ONCE):
            try:
                packet = os.read(end, LARGEST)
            except BlockingIOError:
                return
            if packet[0] >> 4 == 4:  # not what machines say of themselves in version 6
                cable = self.of.get((number, packet[19]))
                if cable is not None:
                    cable.send(packet)

    def between(self, one: int, other: int) -> tuple[Cable, Cable]:
        """The cables of both directions."""
        return self.of[one, other], self.of[other, one]

    def set(self, one: int, other: int, conditions: Conditions) -> None:
        """Say what the cables between two machines are like."""
        for cable in self.between(one, other):
            cable.conditions = conditions

    def cut(self, one: int, other: int) -> None:
        """Let nothing pass between two machines."""
        for cable in self.between(one, other):
            cable.is_cut = True

    def heal(self, one: int, other: int) -> None:
        """Undo `cut`."""
        for cable in self.between(one, other):
            cable.is_cut = False

    def close(self) -> None:
        """Unplug everything."""
        for end in self._ends.values():
            self._loop.remove_reader(end)
            os.close(end)
        for cable in self.of.values():
            cable.close()
