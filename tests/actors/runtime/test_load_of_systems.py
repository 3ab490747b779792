"""How busy nodes are, as the system tells it."""

from __future__ import annotations

import asyncio

import pytest

from actors import Child, Node, QoS, Topic, every, publishes
from actors.interfaces.std_msgs.msg import Int32
from actors.testing import Rig
from tests.stage import NUMBERS, number

IMAGES = Topic(Int32, "images", QoS(depth=60))


class Camera(Node):
    out = publishes(IMAGES)

    @every(hz=30)
    async def shoot(self) -> None:
        self.out(number(1))


class Detector(Node):
    """Needs 50 ms for a picture."""

    @IMAGES.on()
    async def detect(self, picture: Int32) -> None:
        await self.clock.sleep(0.05)


async def test_late_messages_are_explained_by_their_age_the_queue_and_the_callback(rig: Rig) -> None:
    """30 pictures a second, 50 ms each, depth 60: the queue is full after 6 s, and what is taken out is 2 s old."""
    await rig.start(Detector, Camera)
    await rig.advance(60.0)
    load = rig.state(Detector).load
    assert load.waiting == 60
    assert 1.9 <= load.longest_wait <= 2.04
    assert load.slowest is not None
    assert load.slowest.handler == "Detector.detect"
    assert load.slowest.mean == pytest.approx(0.05)
    view = next(node for node in rig.system.snapshot().nodes if node.name == "/detector")
    assert (view.waiting, view.handled, view.slowest) == (60, load.handled, "Detector.detect 0.05 s")
    assert view.inbox_age == pytest.approx(load.age, abs=1e-6)


async def test_with_depth_1_messages_are_fresh(rig: Rig) -> None:
    class Quick(Node):
        @IMAGES.on(qos=1)
        async def detect(self, picture: Int32) -> None:
            await self.clock.sleep(0.05)

    await rig.start(Quick, Camera)
    await rig.advance(60.0)
    assert rig.state(Quick).load.longest_wait <= 0.034


async def test_a_handler_with_tasks_of_its_own_is_measured_too(rig: Rig) -> None:
    class Parallel(Node):
        @NUMBERS.on(concurrent=4)
        async def work(self, message: Int32) -> None:
            await asyncio.sleep(message.data / 10)

    await rig.start(Child(Parallel))
    out = rig.me.publisher(NUMBERS)
    for value in (1, 2, 3, 4, 5, 6):
        out(number(value))
    await rig.advance(5.0)
    (work,) = rig.state(Parallel).load.handlers
    assert (work.samples, work.longest) == (6, pytest.approx(0.6))


async def test_what_waits_over_a_restart_is_delivered_and_measured(rig: Rig) -> None:
    class Fragile(Node):
        seen = 0

        async def on_start(self) -> None:
            await self.clock.sleep(0.0 if self.incarnation == 1 else 1.0)

        @NUMBERS.on()
        async def take(self, message: Int32) -> None:
            await self.clock.sleep(0.2)
            Fragile.seen += message.data

    await rig.start(Fragile)
    out = rig.me.publisher(NUMBERS)
    for _ in range(3):
        out(number(1))
    await rig.quiet()
    out(number(10))
    rig.crash(Fragile)
    await rig.settled()
    assert Fragile.seen == 13
    load = rig.state(Fragile).load
    assert (load.waiting, load.age) == (0, 0.0)
    assert load.longest_wait == pytest.approx(1.4)
