"""Two hundred nodes in a ring: each passes a token on to the next, until it has come round."""

from __future__ import annotations

from actors import Child, Node, Supervisor, Topic, parameter, transient
from actors.interfaces.std_msgs.msg import Int32
from robot.tutorials.program import Job, main, system

NODES = 200


def hop(number: int) -> Topic[Int32]:
    """What leads to link `number`."""
    return Topic(Int32, f"/ring/hop_{number}", 1)


class Link(Node):
    """One of the ring: takes /ring/hop_n and passes the token on to /ring/hop_n+1, one hop older.

    Parameters: number (n), size of the ring.
    """

    number = parameter(0, ge=0, read_only=True)
    size = parameter(NODES, ge=1, read_only=True)

    async def on_start(self) -> None:
        self.on(hop(self.number), self.pass_on)
        self.next = self.publisher(hop(self.number + 1))

    def pass_on(self, token: Int32) -> None:
        self.next(Int32(data=token.data + 1))


class Starter(Job):
    """Sends a token into the ring by /ring/hop_0 and waits for it at the ring's end.

    Parameters: size, patience.
    """

    size = parameter(NODES, ge=1, read_only=True)

    async def job(self) -> None:
        begun = self.clock.now()
        async with self.subscribe(hop(self.size)) as end:
            self.publisher(hop(0))(Int32(data=0))
            token = await end.next(timeout=self.patience)
        took = self.clock.now() - begun
        self.log.info(f"The token came round: {token.data} hops", milliseconds=round(took * 1e3, 1))


def ring(size: int) -> Supervisor:
    """So many nodes in a ring, and one that sends a token round."""
    links = [Child(Link, name=f"link_{n}", parameters={"number": n, "size": size}) for n in range(size)]
    return system("ring", *links, Child(Starter, restart=transient, significant=True, parameters={"size": size}))


def tree() -> Supervisor:
    """200 nodes in a ring, and a token that goes round once."""
    return ring(NODES)


if __name__ == "__main__":
    main(tree)
