"""What the depth of a queue costs and saves, in numbers that anybody can compute."""

from __future__ import annotations

import pytest

from actors import Node
from actors.interfaces.std_msgs.msg import Float64
from actors.testing import Rig
from tests.benchmarks._claims.queues import SAMPLES, Bursts, Camera, dropped_and_age


@pytest.mark.parametrize(
    ("depth", "dropped", "oldest"),
    [(1, 599, 0.033), (5, 595, 0.167), (10, 590, 0.333), (30, 570, 1.0), (60, 540, 2.0), (100, 500, 3.33)],
)
def test_under_overload_a_deep_queue_saves_few_messages_and_makes_all_of_them_old(
    depth: int, dropped: int, oldest: float
) -> None:
    """30 Hz into a callback of 50 ms: 600 of 1,800 messages are too many, but for those that wait at the end."""
    measured, age = dropped_and_age(Camera, depth, 0.05)
    assert measured == dropped
    assert age == pytest.approx(oldest, rel=0.01, abs=0.001)


@pytest.mark.parametrize(("depth", "dropped"), [(5, 9), (10, 4), (15, 0), (100, 0)])
def test_after_a_stall_a_deep_queue_loses_nothing(depth: int, dropped: int) -> None:
    """In a stall of 0.5 s 15 messages come; the last one just as it ends."""
    assert dropped_and_age(Camera, depth, 0.001, stall=0.5)[0] == dropped


@pytest.mark.parametrize(("depth", "dropped"), [(10, 59 * 40), (100, 0)])
def test_a_burst_that_fits_into_the_queue_is_delivered_whole(depth: int, dropped: int) -> None:
    """Fifty at once, each second from the first on; a callback of 10 ms keeps up with all of them."""
    assert dropped_and_age(Bursts, depth, 0.01)[0] == dropped


class Detector(Node):
    """Works 40 ms on each picture, outside the event loop, on two at once."""

    def __init__(self) -> None:
        self.ages: list[float] = []

    @SAMPLES.on(concurrent=2)
    async def look(self, message: Float64) -> None:
        await self.offload(abs, -1, takes=0.04)
        self.ages.append(self.clock.now() - message.data)


async def test_heavy_work_moved_off_the_callback_drops_nothing_and_keeps_pictures_young(rig: Rig) -> None:
    await rig.start(Detector, Camera)
    await rig.advance(60.0)
    (edge,) = next(topic for topic in rig.system.snapshot().topics if topic.name == "/samples").subscriptions
    assert edge.dropped == 0
    ages = rig.node(Detector).ages
    assert len(ages) >= 30 * 60 - 2
    assert max(ages) < 0.05
