"""An exercise: a sensor sends 30 times a second, and its processor misses messages. Why, and what helps?

The processor's handler takes 50 ms, so it is done with 20 messages a second; its queue holds five. Once that is full, ten a second are lost,
whatever the reliability. Asking for best effort recovers nothing. What helps is beside it: the work outside of the node's inbox, two pieces of
it at once, and a queue that is deep enough for a hiccup.
"""

from __future__ import annotations

from actors import Node, Supervisor, Topic, every, publishes, system_of
from actors.interfaces.std_msgs.msg import Int32
from robot.tutorials.program import main, system

READINGS = Topic(Int32, "readings", 5)

RATE = 30
"""Hz."""
WORK = 0.05
"""Seconds that it takes to process one reading."""
CORES = 2
ROOM = 3 * RATE
"""Readings that may wait: worker processes take a moment to start."""
TOLD_EVERY = 5.0
"""s."""


def process(reading: int) -> int:
    """Some work for the processor; in simulated time it counts as 50 ms."""
    return max(range(reading, reading - 5_000, -1))


def diagnosis(node: Node) -> str:
    """What there is to know about missed readings: the losses, the queue, how long the callback takes, and the profiles of both ends."""
    queue = node.subscription(READINGS)
    load = next(record.load for record in system_of(node).nodes.values() if record.node is node)
    slowest = load.slowest
    callback = f"{slowest.handler} takes {slowest.mean:.3f} s" if slowest is not None else "no callback has run yet"
    offers = ", ".join(f"{publisher.node.fqn} offers {publisher.qos}" for publisher in queue.entry.publishers)
    return (
        f"{queue.entry.name}: {queue.dropped} of {queue.received} messages lost; {len(queue.messages)} of {queue.depth} wait; {callback}; "
        f"it requests {queue.qos}; {offers}"
    )


class FastSensor(Node):
    """Counts: readings at 30 Hz, from 0."""

    readings = publishes(READINGS)

    async def on_start(self) -> None:
        self.count = 0
        self.log.info(f"Sensor started @ {RATE:g} Hz")

    @every(hz=RATE)
    def publish(self) -> None:
        self.readings(Int32(data=self.count))
        self.count += 1


class SlowProcessor(Node):
    """Takes readings, and cannot keep up: its handler waits 50 ms for each. `done` are those it has processed."""

    async def on_start(self) -> None:
        self.done: list[int] = []

    @READINGS.on()
    async def take(self, message: Int32) -> None:
        await self.clock.sleep(WORK)
        self.done.append(message.data)

    @every(period=TOLD_EVERY)
    def tell(self) -> None:
        self.log.warning(diagnosis(self))


class MendedProcessor(Node):
    """Takes readings, too, and loses none: two at once in worker processes, and room for three seconds' worth to wait."""

    async def on_start(self) -> None:
        self.done: list[int] = []

    @READINGS.on(qos=ROOM, concurrent=CORES)
    async def take(self, message: Int32) -> None:
        self.done.append(await self.offload(process, message.data, takes=WORK))

    @every(period=TOLD_EVERY)
    def tell(self) -> None:
        self.log.info(diagnosis(self))


def tree() -> Supervisor:
    """A sensor of 30 Hz, a processor that cannot keep up, and one that can; both say every five seconds how they are doing."""
    return system("slow_processor", FastSensor, SlowProcessor, MendedProcessor)


if __name__ == "__main__":
    main(tree)
