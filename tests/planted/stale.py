"""The last that comes wins, also when it was sent before the one that came first."""

from __future__ import annotations

from actors import Child, Node, Supervisor, Topic, every, publishes
from actors.interfaces.std_msgs.msg import Int32

POSE = Topic(Int32, "pose", 10)


class Localizer(Node):
    out = publishes(POSE)

    @every(hz=10)
    def locate(self) -> None:
        self.out(Int32(data=round(self.clock.now() * 100.0)))


class Map(Node):
    def __init__(self, careful: bool) -> None:
        self.careful = careful

    async def on_start(self) -> None:
        self.newest = self.shown = 0

    @POSE.on()
    def place(self, message: Int32) -> None:
        self.newest = max(self.newest, message.data)
        if not self.careful or message.data > self.shown:
            self.shown = message.data
        assert self.shown == self.newest, f"shows the pose of {self.shown}, and has that of {self.newest}"


def tree() -> Supervisor:
    return Supervisor("map", children=[Child(Localizer), Child(Map, args=(False,))])


def healthy() -> Supervisor:
    """What is older than what is shown is not shown."""
    return Supervisor("map", children=[Child(Localizer), Child(Map, args=(True,))])
