from actors import Node, publishes
from actors.testing import Rig
from tests.stage import *

async def test_x(rig: Rig) -> None:
    class Listener(Node):
        def __init__(self) -> None:
            self.got = []
        @NUMBERS.on()
        async def take(self, m: Int32) -> None:
            self.got.append(m.data)
    await rig.start(Listener)
    for i in range(5):
        rig.publish(NUMBERS, number(i))
    await rig.quiet()
    assert rig.node(Listener).got == [0,1,2,3,4]
