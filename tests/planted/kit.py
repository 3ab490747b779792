"""What the planted systems share."""

from __future__ import annotations

import asyncio

from actors import Service
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_srvs.srv import Trigger


async def turns(count: int) -> None:
    """Let the others have so many turns of the loop: in plain order they have done by then what they had begun."""
    for _ in range(count):
        await asyncio.sleep(0)


def number(name: str) -> Service[AddTwoInts.Request, AddTwoInts.Response]:
    """A service that takes a number and answers with one."""
    return Service(AddTwoInts, name)


def ok() -> Trigger.Response:
    return Trigger.Response(success=True)
