"""Two that take turns by a lease which runs out: one that is late believes that it still has it, and both act."""

from __future__ import annotations

from actors import Child, Node, Supervisor, background


class Lease:
    """Who has it, and until when, seconds."""

    def __init__(self) -> None:
        self.owner, self.until = "", 0.0


class Actor(Node):
    def __init__(self, lease: Lease, careful: bool) -> None:
        self.lease = lease
        self.careful = careful

    @background
    async def act(self) -> None:
        lease = self.lease
        while True:
            await self.clock.sleep(0.2)
            now = self.clock.now()
            if lease.owner not in ("", self.name) and now < lease.until:
                continue
            lease.owner, lease.until = self.name, now + 0.5
            await self.clock.sleep(0.3)  # it has the lease for longer than that
            if self.careful and (lease.owner != self.name or self.clock.now() >= lease.until):
                continue
            assert lease.owner == self.name, f"{self.name} acts with the lease of {lease.owner}"
            lease.owner = ""


def two(*, careful: bool) -> Supervisor:
    lease = Lease()
    return Supervisor("lease", children=[Child(Actor, name=name, args=(lease, careful)) for name in ("one", "two")])


def tree() -> Supervisor:
    return two(careful=False)


def healthy() -> Supervisor:
    """Looks once more whether it still has the lease."""
    return two(careful=True)
