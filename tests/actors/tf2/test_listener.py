"""Frames between nodes: broadcast, latched, looked up with time, forgotten when time is set back."""

from __future__ import annotations

import asyncio
from math import pi

import pytest

from actors import Child, Node, Supervisor, Topic, every
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import TransformStamped
from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.interfaces.tf2_msgs.msg import TFMessage
from actors.interfaces.tf2_msgs.srv import FrameGraph
from actors.nodes import CLOCK
from actors.testing import Rig
from actors.tf2 import (
    FRAMES,
    TF,
    TF_STATIC,
    Buffer,
    ForwardExtrapolationException,
    LookupException,
    StaticTransformBroadcaster,
    Transform,
    TransformBroadcaster,
    TransformListener,
    stamped,
)

ARM = Transform.planar(0.3, 0.0, 0.0)
HEAD = Transform((0.0, 0.0, 0.2))


class Eyes(Node):
    """Somebody who listens to the frames."""

    async def on_start(self) -> None:
        self.tf = Buffer()
        TransformListener(self.tf, self)


class Turntable(Node):
    """Turns `table` in `world` once in 2 s, told 20 times a second."""

    async def on_start(self) -> None:
        self._tf = TransformBroadcaster(self)

    @every(hz=20)
    def tell(self) -> None:
        now = self.clock.now()
        self._tf.send_transform(stamped("world", "table", Transform.planar(0.0, 0.0, pi * now), self.clock.stamp(now)))


class Mounts(Node):
    """Two static transforms, told one after the other, as two parts of a node would."""

    async def on_start(self) -> None:
        tf = StaticTransformBroadcaster(self)
        tf.send_transform(stamped("table", "arm", ARM, Time()))
        tf.send_transform(stamped("table", "head", HEAD, Time()))


class Lamp(Node):
    """A second static broadcaster."""

    async def on_start(self) -> None:
        StaticTransformBroadcaster(self).send_transform(stamped("head", "lamp", HEAD, Time()))


def lab(*nodes: type[Node]) -> Supervisor:
    return Supervisor("lab", children=[Child(node) for node in nodes])


async def test_a_moving_frame_is_found_between_two_of_its_transforms(rig: Rig) -> None:
    system = await rig.start(lab(Eyes, Turntable, Mounts))
    await rig.advance(1.0)
    at = system.clock.stamp(0.475)  # half way between two tellings
    there = Transform.from_msg(rig.node(Eyes).tf.lookup_transform("world", "arm", at))
    turned = Transform.planar(0.0, 0.0, pi * 0.475) @ ARM
    assert there.translation == pytest.approx(turned.translation, abs=1e-9)
    assert there.rotation == pytest.approx(turned.rotation, abs=1e-9)


async def test_a_late_joiner_gets_all_static_transforms_of_all_broadcasters(rig: Rig) -> None:
    system = await rig.start(lab(Mounts, Lamp))
    await rig.advance(5.0)
    await system.join(Child(Eyes))
    await rig.quiet()
    tf = rig.node(Eyes).tf
    assert tf.all_frame_names() == ("arm", "head", "lamp", "table")
    assert Transform.from_msg(tf.lookup_transform("table", "lamp")).translation == pytest.approx((0.0, 0.0, 0.4))


async def test_a_restarted_listener_knows_the_static_transforms_again(rig: Rig) -> None:
    await rig.start(lab(Mounts, Lamp, Eyes))
    await rig.advance(1.0)
    rig.crash(Eyes)
    await rig.until(lambda: rig.incarnation(Eyes) == 2)
    await rig.quiet()
    assert Transform.from_msg(rig.node(Eyes).tf.lookup_transform("table", "lamp")).translation == pytest.approx(
        (0.0, 0.0, 0.4)
    )


async def test_a_listener_waits_for_what_has_not_come_yet(rig: Rig) -> None:
    system = await rig.start(lab(Eyes, Turntable))
    await rig.advance(0.5)
    tf = rig.node(Eyes).tf
    soon = system.clock.stamp(0.62)
    with pytest.raises(ForwardExtrapolationException, match="after the last known transform"):
        tf.lookup_transform("world", "table", soon)
    waiting = asyncio.ensure_future(tf.lookup_transform_async("world", "table", soon, timeout=1.0))
    await rig.advance(0.5)
    assert waiting.done()
    assert Transform.from_msg(await waiting).rotation == pytest.approx(Transform.planar(0.0, 0.0, pi * 0.62).rotation)
    hopeless = asyncio.ensure_future(tf.lookup_transform_async("world", "moon", timeout=0.3))
    await rig.advance(0.4)
    with pytest.raises(LookupException, match="no frame 'moon'"):
        await hopeless


async def test_a_transform_that_cannot_be_is_left_out_and_told_once(rig: Rig) -> None:
    system = await rig.start(lab(Eyes, Mounts))
    for _ in range(3):
        rig.publish(TF, _message(stamped("arm", "table", ARM, Time(sec=1))))
    await rig.quiet()
    told = [record for record in system.records if record.event == "a transform was left out"]
    assert len(told) == 1
    assert "loop: table in arm in table" in str(told[0].fields["reason"])
    assert rig.node(Eyes).tf.frames()["arm"].parent == "table"


async def test_static_transforms_are_one_latched_message_of_each_broadcaster(rig: Rig) -> None:
    await rig.start(lab(Mounts, Lamp))
    probe = rig.probe(TF_STATIC)
    await rig.quiet()
    assert [[one.child_frame_id for one in message.transforms] for message in probe] == [["arm", "head"], ["lamp"]]


async def test_what_comes_too_late_to_be_kept_is_told_once(rig: Rig) -> None:
    system = await rig.start(lab(Eyes))
    for second in (30, 5, 6):
        rig.publish(TF, _message(stamped("map", "odom", ARM, Time(sec=second))))
    await rig.quiet()
    told = [record.fields["reason"] for record in system.records if record.event == "a transform was left out"]
    assert told == ["it is older than what the buffer keeps"]


async def test_when_time_is_set_back_what_moves_is_forgotten_and_what_is_static_stays(rig: Rig) -> None:
    """As when a bag is played again."""
    children = [Child(Eyes, parameters={"use_sim_time": True}), Child(Mounts)]
    await rig.start(Supervisor("lab", children=children))
    rig.publish(CLOCK, Clock(clock=Time(sec=100)))
    rig.publish(TF, _message(stamped("world", "table", ARM, Time(sec=100))))
    await rig.quiet()
    tf = rig.node(Eyes).tf
    assert tf.can_transform("world", "arm")
    rig.publish(CLOCK, Clock(clock=Time(sec=10)))
    await rig.quiet()
    assert not tf.can_transform("world", "arm")
    assert tf.can_transform("table", "arm")
    rig.publish(TF, _message(stamped("world", "table", ARM, Time(sec=10))))
    await rig.quiet()
    assert tf.lookup_transform("world", "arm").header.stamp == Time(sec=10)


async def test_topics_and_qos_may_be_others(rig: Rig) -> None:
    class Elsewhere(Node):
        async def on_start(self) -> None:
            self.tf = Buffer(node=self)
            self.listener = TransformListener(
                self.tf,
                self,
                tf_topic="/robot1/tf",
                tf_static_topic="/robot1/tf_static",
                qos=5,
                static_qos=TF_STATIC.qos,
            )
            TransformBroadcaster(self, qos=5)
            StaticTransformBroadcaster(self, qos=TF_STATIC.qos)

    await rig.start(lab(Elsewhere))
    rig.publish(Topic(TFMessage, "/robot1/tf", TF.qos), _message(stamped("map", "odom", ARM, Time(sec=1))))
    await rig.quiet()
    elsewhere = rig.node(Elsewhere)
    assert repr(elsewhere.listener) == "<TransformListener of /elsewhere: <Buffer of map, odom>>"
    answer = await rig.call(FRAMES, FrameGraph.Request())
    assert answer.frame_yaml == elsewhere.tf.all_frames_as_yaml()
    assert answer.frame_yaml.startswith("'odom':\n  parent: 'map'\n  broadcaster: 'default_authority'\n")


async def test_a_static_listener_hears_nothing_else(rig: Rig) -> None:
    class Fixed(Node):
        async def on_start(self) -> None:
            self.tf = Buffer()
            TransformListener(self.tf, self, static_only=True)

    await rig.start(lab(Fixed, Turntable, Mounts))
    await rig.advance(1.0)
    assert rig.node(Fixed).tf.all_frame_names() == ("arm", "head", "table")
    assert not rig.system.graph.topics["/tf"].subscriptions


async def test_a_closed_listener_hears_no_more(rig: Rig) -> None:
    class Once(Node):
        async def on_start(self) -> None:
            self.tf = Buffer()
            self.listener = TransformListener(self.tf, self)

    await rig.start(lab(Once, Turntable))
    await rig.advance(1.0)
    once = rig.node(Once)
    once.listener.close()
    once.listener.close()
    await rig.advance(1.0)
    assert once.tf.lookup_transform("world", "table").header.stamp == Time(sec=1)
    once.listener = TransformListener(once.tf, once)  # as a lifecycle node does that is configured again
    await rig.advance(1.0)
    assert once.tf.lookup_transform("world", "table").header.stamp == Time(sec=3)


async def test_broadcasters_say_what_they_are(rig: Rig) -> None:
    class Teller(Node):
        async def on_start(self) -> None:
            moving, fixed = TransformBroadcaster(self), StaticTransformBroadcaster(self)
            assert repr(moving) == "<TransformBroadcaster of /teller>"
            assert repr(fixed) == "<StaticTransformBroadcaster of /teller: nothing told>"
            fixed.sendTransform([stamped("a", "b", ARM, Time()), stamped("a", "c", ARM, Time())])
            fixed.sendTransform(stamped("a", "b", HEAD, Time()))
            assert repr(fixed) == "<StaticTransformBroadcaster of /teller: b, c>"

    await rig.start(lab(Teller, Eyes))
    await rig.quiet()
    assert Transform.from_msg(rig.node(Eyes).tf.lookup_transform("a", "b")) == HEAD  # the later one


def _message(*transforms: TransformStamped) -> TFMessage:
    return TFMessage(transforms=transforms)
