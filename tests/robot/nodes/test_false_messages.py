"""Messages of a peer that no sensor and no node of the robot sends: none of its nodes fails by them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from actors import Topic
from actors.interfaces.message import Message
from actors.testing import Rig
from actors.testing.simulation.links import not_a_number
from tests.robot.stage import whole

OTHERS = ("/rosout", "/parameter_events", "/clock")


def empty(message: Message) -> Message:
    """As a program makes it that sets no field: images without pixels, scans without beams, joints without a name."""
    return type(message)()


def heard(rig: Rig) -> dict[str, type[Message]]:
    """The topics that nodes of the robot subscribe to, each with its type."""
    system = rig.system
    tree: Any = system.runtime.tree
    found: dict[str, type[Message]] = {}
    for name, entry in sorted(system.graph.topics.items()):
        for subscription in entry.subscriptions:
            life: Any = subscription.node
            if name not in OTHERS and tree.holds(life.record.path):
                found[name] = subscription.type
    return found


@pytest.mark.parametrize("make", [empty, not_a_number], ids=["empty", "nan"])
async def test_no_node_fails_by_a_message_without_content_or_numbers(
    rig: Rig, make: Callable[[Message], Message]
) -> None:
    await rig.start(whole())
    topics = {name: Topic(kind, name, 10) for name, kind in heard(rig).items()}
    probes = {name: rig.probe(topic) for name, topic in topics.items()}
    await rig.advance(3.0)
    assert len(topics) > 25
    for name, topic in topics.items():
        message = probes[name].newest if len(probes[name]) else topic.type()
        for _ in range(2):
            rig.publish(topic, make(message))
            await rig.advance(0.05)
    await rig.advance(1.0)  # a node that had failed would have failed the test
