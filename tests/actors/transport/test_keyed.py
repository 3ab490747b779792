"""The handles of a participant that is made of keys, used as the graph does not use them: closed twice, not shown, without a node."""

from __future__ import annotations

from typing import Any

import pytest

from actors import qos
from actors.transport.protocol import TypeInfo
from tests.actors.transport.memory import Network

pytestmark = pytest.mark.virtual
INT32 = TypeInfo("std_msgs/msg/Int32", "TypeHashNotSupported")
ONE = b"\0\1\0\0\1\0\0\0"


class Owner:
    """What a transport tells its owner, which does not matter here."""

    def __getattr__(self, name: str) -> Any:
        return lambda *about, **fields: None


async def test_one_without_a_node_is_heard_and_not_shown_and_a_closed_one_neither_sends_nor_takes() -> None:
    network, messages = Network(), list[Any]()
    transport = network.end()
    here = await transport.join(0, Owner())
    assert here.complete
    hidden = here.publisher(None, "/hidden", INT32, qos.DEFAULT)
    hidden.show()
    hidden.close()
    hidden = here.publisher(None, "/hidden", INT32, qos.DEFAULT)
    hidden.open()
    opened = hidden.put
    hidden.open()
    assert hidden.put is opened
    takes = [
        here.subscription(None, "/hidden", INT32, qos.DEFAULT, lambda *it: messages.append(it), who) for who in "xy"
    ]
    hidden.put(ONE, 1, 0)
    for one in takes:
        one.close()
        one.close()
    hidden.close()
    never = here.publisher(here.node("/node"), "/never", INT32, qos.DEFAULT)
    never.close()
    assert [text for text in network.tokens if "hidden" in text or "never" in text] == []
    await transport.close()
