"""What the router of a simulated network is for, and what is noticed when it goes."""

from __future__ import annotations

import asyncio

import pytest

from actors.transport.simulated.link import LAN, Conditions
from tests.actors.transport.lab import BEST_EFFORT, KEY, Lab, Timed, numbered

pytestmark = pytest.mark.virtual


async def routed(lab: Lab) -> tuple[Timed, Timed, Timed, Timed]:
    """Two clients and two peers on machines of their own, and the machine of the router; all are linked."""
    lab.network.add_host("hub", router=True)
    for name in ("client1", "client2"):
        lab.network.add_host(name, "client")
    for name in ("peer1", "peer2"):
        lab.network.add_host(name)
    one, other, peer, second = [await lab.party(name) for name in ("client1", "client2", "peer1", "peer2")]
    await lab.linked(one, other, peer, second)
    return one, other, peer, second


async def test_clients_reach_everybody_by_the_router_and_peers_each_other_directly() -> None:
    lab = Lab()
    client, other, peer, second = await routed(lab)
    heard = [lab.hear(party)[0] for party in (client, other, peer)]
    outlet = await second.outlet(KEY)
    for party in (client, other, peer):
        await party.told_to(second)
    start = lab.loop.time()

    outlet.put(numbered(1), b"")
    await lab.until(lambda: all(heard), "all have heard it")

    assert [one[0][0] for one in heard] == [pytest.approx(start + hops * LAN.delay) for hops in (2, 2, 1)]


async def test_without_its_router_clients_are_alone_and_peers_find_nobody_new() -> None:
    lab = Lab(lease=4.0)
    client, other, peer, second = await routed(lab)
    stopped = lab.loop.time()

    lab.network.stop_router()
    await lab.until(lambda: not client.transport.report() and not other.transport.report(), "the clients are alone")

    assert client.when("down", peer.session) == pytest.approx(stopped + 2 * LAN.delay)
    lab.network.add_host("peer3")
    new = await lab.party("peer3")
    await asyncio.sleep(10.0)
    assert [link.session for link in peer.transport.report()] == [second.session]
    assert new.kinds() == []
    lab.network.start_router()
    await lab.linked(client, other, peer, second, new)
    assert second.kinds() == ["up"] * 3 + ["down"] * 2 + ["up"] * 3


async def test_when_the_machine_of_the_router_crashes_clients_notice_its_silence() -> None:
    lab = Lab(lease=4.0)
    client, other, peer, second = await routed(lab)
    crashed = lab.loop.time()

    lab.network.crash("hub")
    lab.network.start_router()  # in vain: its machine is down
    await lab.unlinked(client, other)
    await lab.unlinked(peer, client)
    await asyncio.sleep(10.0)

    assert client.transport.report() == ()
    assert crashed + 3.0 <= client.when("down", other.session) <= crashed + 4.0
    assert peer.is_linked(second.session)
    lab.network.reboot("hub")
    await lab.linked(client, other, peer, second)


async def test_a_router_that_comes_back_before_the_lease_knows_nobody_any_more() -> None:
    lab = Lab(lease=4.0)
    client, other, _, _ = await routed(lab)

    lab.network.crash("hub")
    await asyncio.sleep(1.0)
    lab.network.reboot("hub")
    rebooted = lab.loop.time()
    await lab.unlinked(client, other)
    assert client.when("down", other.session) == pytest.approx(rebooted + 2 * LAN.delay)
    await lab.linked(client, other)

    assert client.when("up", other.session) < rebooted + 0.1


async def test_what_is_on_its_way_to_a_router_that_stops_is_lost() -> None:
    lab = Lab()
    client, other, _, _ = await routed(lab)
    heard, _ = lab.hear(other)
    outlet = await client.outlet(KEY)

    outlet.put(numbered(1), b"")
    await asyncio.sleep(LAN.delay / 2)
    lab.network.stop_router()
    lab.network.start_router()
    await lab.unlinked(client, other)
    await lab.linked(client, other)
    again = await client.outlet(KEY)
    again.put(numbered(2), b"")
    await lab.until(lambda: heard, "the new one arrives")

    assert [number for _, number in heard] == [2]


async def test_what_is_doubled_before_the_router_arrives_once() -> None:
    lab = Lab()
    client, other, _, _ = await routed(lab)
    heard, _ = lab.hear(other)
    outlet = await client.outlet(KEY, BEST_EFFORT)
    lab.network.set_conditions("client1", "hub", Conditions(duplication=0.9))

    put: list[float] = []
    for number in range(50):
        put.append(lab.loop.time())
        outlet.put(numbered(number), b"")
        await asyncio.sleep(0.1)

    assert [number for _, number in heard] == list(range(50))
    assert [at - put[number] for at, number in heard] == [pytest.approx(2 * LAN.delay)] * 50
    assert other.dropped(client) > 30


async def test_a_client_that_is_cut_off_from_the_router_loses_everybody() -> None:
    lab = Lab(lease=4.0)
    client, other, peer, second = await routed(lab)

    lab.network.cut("client1", "hub")
    await lab.until(lambda: not client.transport.report(), "it is alone")
    await lab.unlinked(other, client)

    assert other.is_linked(peer.session)
    lab.network.heal("client1", "hub")
    await lab.linked(client, other, peer, second)


async def test_a_peer_that_does_not_reach_the_router_finds_nobody_new_and_keeps_whom_it_knows() -> None:
    lab = Lab(lease=4.0)
    lab.network.add_host("hub", router=True)
    a, b = await lab.parties("a", "b")

    lab.network.cut("a", "hub", one_way=True)
    lab.network.add_host("c")
    c = await lab.party("c")
    await lab.linked(b, c)
    await asyncio.sleep(10.0)
    assert a.kinds() == ["up"]
    lab.network.heal("a", "hub")
    await lab.linked(a, b, c)

    assert a.kinds() == ["up", "up"]


async def test_without_any_router_peers_find_each_other_and_clients_nobody() -> None:
    lab = Lab()
    peer, _ = await lab.parties("peer1", "peer2")
    lab.network.add_host("client", "client")
    client = await lab.party("client")
    lab.network.stop_router()
    lab.network.start_router()
    await asyncio.sleep(10.0)

    assert client.kinds() == []
    assert peer.kinds() == ["up"]
