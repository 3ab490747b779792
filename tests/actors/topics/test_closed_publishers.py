"""A publisher that its node closes: it goes away, stays closed, and no other publisher of the node is touched."""

from __future__ import annotations

import gc
from typing import Any

import pytest

from actors import LifecycleNode, Node, Service, Topic, parameter, publishes
from actors.errors import Ended
from actors.interfaces.lifecycle_msgs.msg import Transition
from actors.interfaces.lifecycle_msgs.srv import ChangeState
from actors.interfaces.rcl_interfaces.msg import ParameterEvent
from actors.testing import Rig
from actors.topics.publisher import Publisher
from tests.stage import NUMBERS, number, values

EVENTS = Topic(ParameterEvent, "/parameter_events", 10)


def publishers() -> int:
    """How many publishers there are in memory."""
    gc.collect()
    objects: list[Any] = gc.get_objects()
    return sum(isinstance(one, Publisher) for one in objects)


async def test_nothing_of_a_closed_publisher_stays(rig: Rig) -> None:
    class Talker(Node):
        """Opens publishers while it runs."""

    await rig.start(Talker)
    node = rig.node(Talker)
    before = publishers()
    for _ in range(3):
        publisher = node.publisher(NUMBERS)
        publisher(number(1))
        publisher.close()
        publisher.close()
    del publisher
    assert publishers() == before


async def test_an_own_publisher_on_parameter_events_is_not_that_of_the_parameters(rig: Rig) -> None:
    class Tuned(Node):
        gain = parameter(1)

    await rig.start(Tuned)
    node, heard = rig.node(Tuned), rig.probe(EVENTS)
    mine = node.publisher(EVENTS)
    mine(ParameterEvent(node="/mine"))
    mine.close()
    assert node.set_parameter("gain", 2).successful
    await rig.settled()
    assert [event.node for event in heard.messages] == ["/mine", "/tuned"]


async def test_a_closed_publisher_of_a_lifecycle_node_does_not_come_back_with_its_active_state(rig: Rig) -> None:
    class Managed(LifecycleNode):
        autostart = "active"
        out = publishes(NUMBERS)

    await rig.start(Managed)
    node, heard = rig.node(Managed), rig.probe(NUMBERS)
    extra = node.publisher(NUMBERS)
    extra.close()
    for transition in (Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_ACTIVATE):
        request = ChangeState.Request(transition=Transition(id=transition))
        assert (await rig.call(Service(ChangeState, "/managed/change_state"), request)).success
        with pytest.raises(Ended, match="closed"):
            extra(number(1))
    node.out(number(2))
    await rig.settled()
    assert values(heard.messages) == [2]
