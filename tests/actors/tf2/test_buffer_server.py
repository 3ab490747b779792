"""A buffer in another node: who asks gets what a buffer of its own would give, and says so when nobody answers."""

from __future__ import annotations

import asyncio

import pytest

from actors import Aborted, Child, Done, Node, Steps, Supervisor, every
from actors.interfaces.builtin_interfaces.msg import Time as Stamp
from actors.interfaces.geometry_msgs.msg import Point, PointStamped
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.tf2_msgs.action import (
    LookupTransform,
    LookupTransform_Feedback,
    LookupTransform_Goal,
    LookupTransform_Result,
)
from actors.interfaces.tf2_msgs.msg import TF2Error
from actors.nodes import BufferServer
from actors.testing import Rig
from actors.tf2 import (
    LOOKUP,
    BufferClient,
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    StaticTransformBroadcaster,
    TimeoutException,
    Transform,
    TransformBroadcaster,
    TransformException,
    stamped,
)
from actors.time import Duration


class Cart(Node):
    """Drives along x at 1 m/s, with a camera 0.5 m above it; an island is connected to nothing."""

    async def on_start(self) -> None:
        self._tf = TransformBroadcaster(self)
        StaticTransformBroadcaster(self).send_transform(
            [
                stamped("cart", "camera", Transform((0.0, 0.0, 0.5)), Stamp()),
                stamped("sea", "island", Transform(), Stamp()),
            ]
        )

    @every(hz=10)
    def tell(self) -> None:
        now = self.clock.now()
        self._tf.send_transform(stamped("map", "cart", Transform((now, 0.0, 0.0)), self.clock.stamp(now)))


async def asker(rig: Rig) -> BufferClient:
    await rig.start(Supervisor("lab", children=[Child(BufferServer), Child(Cart)]))
    await rig.advance(1.0)
    return BufferClient(rig.me)


async def test_a_client_gets_the_transform_at_a_time_and_the_newest(rig: Rig) -> None:
    client = await asker(rig)
    there = await client.lookup_transform_async("map", "camera", rig.system.clock.stamp(0.75))
    assert there.transform.translation.x == pytest.approx(0.75) and there.transform.translation.z == 0.5
    assert (await client.lookup_transform_async("map", "camera")).header.stamp == rig.system.clock.stamp(1.0)
    assert repr(client) == "<BufferClient of tf2_buffer_server>"


async def test_a_client_waits_for_what_has_not_come(rig: Rig) -> None:
    client = await asker(rig)
    later = rig.system.clock.stamp(1.35)
    asked = asyncio.create_task(client.lookup_transform_async("map", "cart", later, timeout=Duration(seconds=1)))
    await rig.advance(0.39)
    assert not asked.done()
    await rig.advance(0.1)
    assert asked.result().transform.translation.x == pytest.approx(1.35)


async def test_a_client_asks_with_a_fixed_frame_and_moves_messages(rig: Rig) -> None:
    client = await asker(rig)
    clock = rig.system.clock
    past = await client.lookup_transform_full_async("cart", clock.stamp(1.0), "cart", clock.stamp(0.2), "map")
    assert past.transform.translation.x == pytest.approx(-0.8)
    spot = PointStamped(header=Header(frame_id="camera", stamp=clock.stamp(0.5)), point=Point(z=1.0))
    moved = (await client.transform_async(spot, "map")).point
    assert (moved.x, moved.y, moved.z) == pytest.approx((0.5, 0.0, 1.5))
    then = await client.transform_full_async(spot, "cart", clock.stamp(1.0), "map")
    assert (then.point.x, then.header.frame_id) == (pytest.approx(-0.5), "cart")
    assert await client.can_transform_full_async("cart", clock.stamp(1.0), "cart", clock.stamp(0.2), "map")
    assert not await client.can_transform_full_async("cart", clock.stamp(9.0), "cart", None, "map", timeout=0)
    assert await client.can_transform_async("map", "cart")
    assert not await client.can_transform_async("map", "kart", timeout=0)


async def test_the_errors_are_those_of_a_buffer(rig: Rig) -> None:
    client = await asker(rig)
    for target, kind, text in (
        ("kart", LookupException, "did you mean cart?"),
        ("island", ConnectivityException, "island hangs from sea|are not connected"),
        ("/map", InvalidArgumentException, "ask for 'map'"),
    ):
        with pytest.raises(kind, match=text):
            await client.lookup_transform_async(target, "camera", timeout=0)
    with pytest.raises(ExtrapolationException, match="after the last known transform"):
        await client.lookup_transform_async("map", "cart", rig.system.clock.stamp(9.0), timeout=0.5)
    with pytest.raises(ValueError, match="timeout=None: a buffer server is asked for a time"):
        await client.lookup_transform_async("map", "cart", timeout=None)


async def test_a_server_that_is_not_there_is_late(rig: Rig) -> None:
    await rig.start(Node)
    client = BufferClient(rig.me, "elsewhere", timeout_padding=Duration(seconds=0.5))
    asked = asyncio.create_task(client.lookup_transform_async("map", "cart"))
    await rig.advance(1.4)
    assert not asked.done()
    await rig.advance(0.2)
    with pytest.raises(TimeoutException, match=r"elsewhere.* after 1.5 s"):
        await asked
    assert issubclass(TimeoutException, TimeoutError) and issubclass(TimeoutException, TransformException)


class Other(Node):
    """A server that gives up as ROS 2's does, without a word, or with an error that nobody knows, or that never answers."""

    @LOOKUP.serve(arrivals="preempt")
    async def look_up(self, goal: LookupTransform_Goal) -> Steps[LookupTransform_Feedback, LookupTransform_Result]:
        if goal.target_frame == "silent":
            yield Aborted(LookupTransform.Result())
        elif goal.target_frame == "crash":
            raise RuntimeError("no buffer")
        elif goal.target_frame == "hang":
            await self.clock.sleep(100.0)
        else:
            error = TF2Error(error=200, error_string="the moon is in the way")
            yield Done(LookupTransform.Result(error=error))


@pytest.mark.parametrize("target", ["silent", "crash"])
async def test_a_server_that_gives_up_without_a_word_was_too_late(rig: Rig, target: str) -> None:
    await rig.start(Other)
    with pytest.raises(TimeoutException, match=f"cart -> {target} has not become known .* within 0.25 s"):
        await BufferClient(rig.me).lookup_transform_async(target, "cart", timeout=0.25)


async def test_a_server_that_hangs_is_left_after_the_padding(rig: Rig) -> None:
    await rig.start(Other)
    with pytest.raises(TimeoutException, match="after 3 s: it is late"):
        await BufferClient(rig.me).lookup_transform_async("hang", "cart")
    assert rig.now == pytest.approx(3.0)


async def test_an_error_of_an_unknown_number_is_a_transform_exception(rig: Rig) -> None:
    await rig.start(Other)
    with pytest.raises(TransformException, match="the moon is in the way") as raised:
        await BufferClient(rig.me).lookup_transform_async("moon", "cart")
    assert type(raised.value) is TransformException
