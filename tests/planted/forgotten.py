"""An odometer that hands its state over when it is asked to stop: a crash asks nobody, and the distance begins anew."""

from __future__ import annotations

from typing import Any

from actors import Child, Node, Supervisor, Topic, every, publishes
from actors.interfaces.std_msgs.msg import Int32

DISTANCE = Topic(Int32, "distance", 10)


class Odometer(Node):
    out = publishes(DISTANCE)

    def __init__(self, store: dict[str, int] | None) -> None:
        self.store = store
        self.metres = 0

    async def on_start(self) -> None:
        if self.store is not None:
            self.metres = self.store.get("metres", 0)

    def handover(self) -> Any:
        return self.metres

    def resume(self, state: Any) -> None:
        self.metres = state

    @every(hz=5)
    def drive(self) -> None:
        self.metres += 1
        if self.store is not None:
            self.store["metres"] = self.metres
        self.out(Int32(data=self.metres))


class Dashboard(Node):
    async def on_start(self) -> None:
        self.highest = 0

    @DISTANCE.on()
    def show(self, message: Int32) -> None:
        assert message.data > self.highest - 15, f"{self.highest} m were driven, and now {message.data} m"
        self.highest = max(self.highest, message.data)


def tree() -> Supervisor:
    return Supervisor("car", children=[Child(Odometer, args=(None,)), Child(Dashboard)])


def healthy() -> Supervisor:
    """What must outlive a crash is kept outside the node."""
    return Supervisor("car", children=[Child(Odometer, args=({},)), Child(Dashboard)])
