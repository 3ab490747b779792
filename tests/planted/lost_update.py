"""Two tellers read a balance and write it back, more by one: whoever reads between the other's read and write undoes its deposit."""

from __future__ import annotations

import asyncio

from actors import ActorError, Child, Node, Supervisor, every
from actors.interfaces.example_interfaces.srv import AddTwoInts
from tests.planted.kit import number, turns

READ, WRITE = number("read"), number("write")


class Ledger(Node):
    async def on_start(self) -> None:
        self.balance = self.deposits = 0

    @READ.serve()
    async def read(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=self.balance)

    @WRITE.serve()
    async def write(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        self.balance = request.a
        self.deposits += 1
        assert self.balance == self.deposits, "a deposit was lost"
        return AddTwoInts.Response(sum=self.balance)


class Teller(Node):
    def __init__(self, late: int, lock: asyncio.Lock | None) -> None:
        self.late = late
        self.lock = lock

    @every(hz=1)
    async def deposit(self) -> None:
        await turns(self.late)
        try:
            if self.lock is None:
                await self.add_one()
            else:
                async with self.lock:
                    await self.add_one()
        except ActorError as error:
            self.log.warning("no deposit", why=str(error))

    async def add_one(self) -> None:
        balance = (await self.call(READ, AddTwoInts.Request())).sum
        await self.call(WRITE, AddTwoInts.Request(a=balance + 1))


def tree() -> Supervisor:
    tellers = [Child(Teller, name=f"teller_{k}", args=(10 * k, None)) for k in range(2)]
    return Supervisor("bank", children=[Child(Ledger), *tellers])


def healthy() -> Supervisor:
    """One lock around both, and a ledger that counts what it holds."""
    lock = asyncio.Lock()
    tellers = [Child(Teller, name=f"teller_{k}", args=(10 * k, lock)) for k in range(2)]
    return Supervisor("bank", children=[Child(Ledger), *tellers])
