"""A router joins processes that know nothing but it."""

from __future__ import annotations

import pytest

from actors.transport import WireUnavailable
from actors.transport.zenoh import ZenohConfig
from actors.transport.zenoh.router import router
from actors.transport.zenoh.transport import ZenohKeys
from tests.actors.transport.contract.parties import Changes, Party
from tests.actors.transport.zenoh.wires import free_port


async def test_two_clients_meet_by_two_routers_that_are_joined() -> None:
    first, second = (f"tcp/127.0.0.1:{free_port()}" for _ in range(2))
    async with router((first,)), router((second,), (first,)):
        changes = Changes()
        a, b = (Party(ZenohKeys(ZenohConfig(mode="client", connect=(where,))), changes) for where in (first, second))
        await a.open()
        await b.open()

        await a.until(lambda: a.is_linked(b.session) and b.is_linked(a.session), "they have found each other")
        await b.transport.close()
        await a.until(lambda: a.has("down", b.session), "one has gone")
        await a.transport.close()


async def test_a_port_that_is_taken_is_one_line() -> None:
    where = f"tcp/127.0.0.1:{free_port()}"
    async with router((where,)):
        with pytest.raises(WireUnavailable) as refused:
            async with router((where,)):
                raise AssertionError("two routers at one port")
    assert all(part in str(refused.value) for part in (where, "another process listens", "choose another port"))
