"""Leads when it has heard no leader for a while, and never steps down: after a partition there are two leaders on two hosts, and both stay."""

from __future__ import annotations

from actors import Child, Node, Supervisor, Topic, every, publishes
from actors.interfaces.std_msgs.msg import String

BEAT = Topic(String, "beat")
SILENCE = {"ann": 1.0, "bob": 3.0}
"""Seconds without a beat after which a member leads."""
RIVALRY = 10.0
"""Seconds for which two may lead while they hear each other."""
GAP = 1.5
"""Seconds without a beat after which a rival does not count as heard."""


class Member(Node):
    beat = publishes(BEAT)

    def __init__(self, yields: bool) -> None:
        self.yields = yields

    async def on_start(self) -> None:
        self.leads = False
        self.heard_at = self.clock.now()
        self.rival_since: float | None = None

    @BEAT.on()
    def hear(self, message: String) -> None:
        now = self.clock.now()
        if message.data == self.name:
            return
        if not self.leads or self.rival_since is None or now - self.heard_at > GAP:
            self.rival_since = now
        self.heard_at = now
        if self.yields and message.data < self.name:
            self.leads = False
        assert not self.leads or now - self.rival_since < RIVALRY, f"{self.name} and {message.data} both lead"

    @every(hz=2)
    def look(self) -> None:
        if self.clock.now() - self.heard_at > SILENCE[self.name]:
            self.leads = True
        if self.leads:
            self.beat(String(data=self.name))


def members(*, yields: bool) -> dict[str, Supervisor]:
    return {
        f"{name}s_host": Supervisor(f"{name}s_tree", children=[Child(Member, name=name, args=(yields,))])
        for name in SILENCE
    }


def tree() -> dict[str, Supervisor]:
    return members(yields=False)


def healthy() -> dict[str, Supervisor]:
    """Of two leaders that hear each other the one with the lower name stays."""
    return members(yields=True)
