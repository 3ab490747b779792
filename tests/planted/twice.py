"""Every order is carried out when it comes, also when it comes twice."""

from __future__ import annotations

from actors import Child, Node, Supervisor, Topic, every, publishes
from actors.interfaces.std_msgs.msg import Int32

ORDERS = Topic(Int32, "orders", 10)


class Shop(Node):
    out = publishes(ORDERS)

    async def on_start(self) -> None:
        self.number = 1000 * self.__machinery__.incarnation if self.__machinery__ is not None else 0

    @every(hz=3)
    def order(self) -> None:
        self.number += 1
        self.out(Int32(data=self.number))


class Kitchen(Node):
    def __init__(self, careful: bool) -> None:
        self.careful = careful

    async def on_start(self) -> None:
        self.made: list[int] = []

    @ORDERS.on()
    def make(self, message: Int32) -> None:
        if self.careful and message.data in self.made:
            return
        self.made.append(message.data)
        assert len(set(self.made)) == len(self.made), f"order {message.data} was made twice"


def tree() -> Supervisor:
    return Supervisor("shop", children=[Child(Shop), Child(Kitchen, args=(False,))])


def healthy() -> Supervisor:
    """An order that has been made is not made again."""
    return Supervisor("shop", children=[Child(Shop), Child(Kitchen, args=(True,))])
