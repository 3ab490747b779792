"""Who has heard of no leader at its start says that it is one: two that look before either has spoken both do."""

from __future__ import annotations

from actors import Child, Node, Supervisor, Topic, background, publishes, qos
from actors.interfaces.std_msgs.msg import String
from tests.planted.kit import turns

LEADER = Topic(String, "leader", qos.LATCHED)


class Member(Node):
    claims = publishes(LEADER)

    def __init__(self, late: int, yields: bool) -> None:
        self.late = late
        self.yields = yields

    async def on_start(self) -> None:
        self.leader = ""

    @LEADER.on()
    def hear(self, message: String) -> None:
        assert self.yields or self.leader in ("", message.data), f"two leaders: {self.leader} and {message.data}"
        self.leader = min(filter(None, [self.leader, message.data]))

    @background
    async def stand(self) -> None:
        await turns(self.late)  # whoever leads already has been heard by now
        if not self.leader:
            await turns(1)
            self.claims(String(data=self.name))


def members(*, yields: bool) -> Supervisor:
    both = [Child(Member, name=name, args=(late, yields)) for name, late in (("ann", 0), ("bob", 10))]
    return Supervisor("members", children=both)


def tree() -> Supervisor:
    return members(yields=False)


def healthy() -> Supervisor:
    """Of two that claim it the one with the lower name leads; all agree in the end."""
    return members(yields=True)
