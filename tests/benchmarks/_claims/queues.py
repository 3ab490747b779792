"""What a queue's depth costs and saves, on the virtual clock: the figures are exact, and the same on every machine."""

from __future__ import annotations

from actors import Child, Node, Topic, every, execute, publishes, run
from actors.interfaces.std_msgs.msg import Float64
from tests.benchmarks import Row

SAMPLES = Topic(Float64, "samples")
SECONDS = 60.0
HZ = 30


class Camera(Node):
    """Publishes the time 30 times a second."""

    out = publishes(SAMPLES)

    @every(hz=HZ)
    def shoot(self) -> None:
        self.out(Float64(data=self.clock.now()))


class Bursts(Node):
    """Publishes 50 messages at once, each second."""

    out = publishes(SAMPLES)

    @every(period=1.0)
    def burst(self) -> None:
        for _ in range(50):
            self.out(Float64(data=self.clock.now()))


class Reader(Node):
    """Takes `busy` seconds for each message, and once `stall` seconds for one that comes after 10 s."""

    def __init__(self, depth: int, busy: float, stall: float = 0.0) -> None:
        self._depth, self._busy, self._stall = depth, busy, stall
        self.ages: list[float] = []

    async def on_start(self) -> None:
        self.stream = self.subscribe(SAMPLES, qos=self._depth)
        self.create_task(self._read())

    async def _read(self) -> None:
        async for message in self.stream:
            now = self.clock.now()
            self.ages.append(now - message.data)
            stalls = self._stall and now > 10.0
            await self.clock.sleep(self._stall if stalls else self._busy)
            if stalls:
                self._stall = 0.0


def dropped_and_age(source: type[Node], depth: int, busy: float, stall: float = 0.0) -> tuple[int, float]:
    """How many messages were dropped in a minute, and the greatest age at which one was taken in its second half, seconds."""

    async def minute() -> tuple[int, float]:
        async with run(Child(Reader, args=(depth, busy, stall)), Child(source), sinks=(), signals=False) as system:
            reader = system.node(Reader)
            await reader.clock.sleep(SECONDS - 1e-3)
            return reader.stream.dropped, max(reader.ages[len(reader.ages) // 2 :])

    return execute(minute, clock="virtual")


def rows() -> list[Row]:
    """Drops and age over the depth (overload), bursts, and a short stall."""
    found: list[Row] = []
    overload = (
        "30 Hz into a callback of 50 ms, one minute (small queues lower latency, deep ones are the cure for delay)"
    )
    for depth in (1, 5, 10, 30, 60, 100):
        dropped, age = dropped_and_age(Camera, depth, 0.05)
        found.append(Row(overload, f"depth {depth}", "messages dropped", dropped, "ours"))
        found.append(Row(overload, f"depth {depth}", "s oldest", age, "ours"))
    stalled = "30 Hz, one stall of 0.5 s (depth 10 to 100 as the cure)"
    for depth in (5, 10, 15, 100):
        dropped, _ = dropped_and_age(Camera, depth, 0.001, stall=0.5)
        found.append(Row(stalled, f"depth {depth}", "messages dropped", dropped, "ours"))
    bursts = "50 messages at once each second into a callback of 10 ms (a larger queue delivers 1.5 times as much)"
    for depth in (10, 100):
        dropped, _ = dropped_and_age(Bursts, depth, 0.01)
        found.append(Row(bursts, f"depth {depth}", "messages dropped", dropped, "ours"))
    return found
