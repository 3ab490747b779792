"""What the processes of a simulated network notice when links are cut, machines crash and processes die."""

from __future__ import annotations

import asyncio

import pytest

from actors.transport.protocol import NoAnswer, WireUnavailable
from actors.transport.simulated.link import LAN, LOOPBACK, Conditions
from tests.actors.transport.lab import BEST_EFFORT, KEY, Lab, numbered

pytestmark = pytest.mark.virtual


# Cuts and the lease ---------------------------------------------------------------------------------------------------


async def test_both_sides_of_a_cut_lose_each_other_within_the_lease() -> None:
    lab = Lab(lease=4.0)
    a, b, c = await lab.parties("a", "b", "c")
    cut = lab.loop.time()

    lab.network.cut("a", "b")
    await lab.unlinked(a, b)
    await lab.unlinked(b, a)

    for one, other in ((a, b), (b, a)):
        assert cut + 3.0 <= one.when("down", other.session) <= cut + 4.0
    assert c.kinds() == ["up", "up"]


async def test_in_a_one_way_cut_the_deaf_side_notices_and_the_other_hears_it_from_there() -> None:
    lab = Lab(lease=4.0)
    a, b = await lab.parties("a", "b")
    heard, _ = lab.hear(a)
    outlet = await b.outlet(KEY)
    cut = lab.loop.time()

    lab.network.cut("a", "b", one_way=True)
    outlet.put(numbered(1), b"")
    await lab.unlinked(a, b)

    assert heard == [(pytest.approx(cut + LAN.delay), 1)]
    assert cut + 3.0 <= b.when("down", a.session) <= cut + 4.0
    assert a.when("down", b.session) == pytest.approx(b.when("down", a.session) + LAN.delay)


async def test_a_cut_that_ends_before_the_lease_is_not_noticed_and_the_next_one_counts_anew() -> None:
    lab = Lab(lease=4.0)
    a, b = await lab.parties("a", "b")

    for _ in range(5):
        lab.network.cut("a", "b")
        lab.network.cut("a", "b")
        await asyncio.sleep(2.9)
        lab.network.heal("a", "b")
        await asyncio.sleep(0.01)

    assert a.kinds() == b.kinds() == ["up"]


async def test_who_has_not_noticed_yet_when_the_cut_ends_is_told_by_the_other() -> None:
    lab = Lab(lease=4.0)
    a, b = await lab.parties("a", "b")

    lab.network.cut("a", "b")
    await lab.until(lambda: "down" in a.kinds() + b.kinds(), "one of them notices")
    assert sorted(a.kinds() + b.kinds()) == ["down", "up", "up"]
    lab.network.heal("a", "b")
    healed = lab.loop.time()
    await lab.until(lambda: "down" in a.kinds() and "down" in b.kinds(), "the other one notices")
    assert lab.loop.time() == pytest.approx(healed + LAN.delay)
    await lab.linked(a, b)

    assert a.kinds() == b.kinds() == ["up", "down", "up"]


async def test_who_comes_while_a_link_is_cut_is_found_when_it_is_healed() -> None:
    lab = Lab(discovery=0.1)
    (a,) = await lab.parties("a")
    lab.network.add_host("b")

    lab.network.cut("a", "b", one_way=True)
    b = await lab.party("b")
    await asyncio.sleep(10.0)
    assert a.kinds() == b.kinds() == []
    lab.network.heal("a", "b", one_way=True)
    healed = lab.loop.time()
    await lab.linked(a, b)

    assert healed + 0.05 <= a.when("up", b.session) <= healed + 0.1


async def test_a_cut_while_two_connect_lets_them_find_each_other_later() -> None:
    lab = Lab(discovery=0.1)
    for name in ("a", "b"):
        lab.network.add_host(name)
    a, b = await lab.party("a"), await lab.party("b")

    lab.network.cut("a", "b")
    await asyncio.sleep(1.0)
    assert a.kinds() == []
    lab.network.heal("a", "b")
    await lab.linked(a, b)

    assert a.kinds() == b.kinds() == ["up"]


async def test_a_farewell_waits_for_the_end_of_a_cut() -> None:
    lab = Lab(lease=4.0)
    a, b = await lab.parties("a", "b")

    lab.network.cut("a", "b")
    await a.transport.close()
    await asyncio.sleep(1.0)
    assert b.is_linked(a.session)
    lab.network.heal("a", "b")
    healed = lab.loop.time()
    await lab.unlinked(b, a)

    assert healed <= b.when("down", a.session) <= healed + LAN.resend + LAN.delay
    assert a.kinds() == ["up"]


async def test_what_was_put_before_the_farewell_arrives_before_it() -> None:
    lab = Lab()
    a, b, _ = await lab.parties("a", "b", "c")
    heard, _ = lab.hear(b)
    outlet = await a.outlet(KEY)
    lab.network.set_conditions("a", "b", Conditions(bandwidth=1000.0))

    for number in range(3):
        outlet.put(numbered(number), b"")
    await a.transport.close()
    lab.network.cut("b", "c")  # elsewhere
    await lab.unlinked(b, a)

    assert [number for _, number in heard] == [0, 1, 2]


async def test_what_waits_when_two_lose_each_other_does_not_come_when_they_find_each_other() -> None:
    lab = Lab(lease=4.0)
    a, b = await lab.parties("a", "b")
    heard, _ = lab.hear(b)
    outlet = await a.outlet(KEY)

    lab.network.cut("a", "b")
    outlet.put(numbered(1), b"")
    await lab.unlinked(a, b)
    await lab.unlinked(b, a)
    lab.network.heal("a", "b")
    await lab.until(lambda: outlet.wanted, "they have found each other")
    outlet.put(numbered(2), b"")
    await lab.until(lambda: heard, "a sample arrives")

    assert [number for _, number in heard] == [2]


# Machines and processes -----------------------------------------------------------------------------------------------


async def test_a_machine_that_crashes_is_silent_and_its_transports_are_dead() -> None:
    lab = Lab(lease=4.0)
    a, b, c = await lab.parties("a", "b", "c")
    asked = b.serve("7/add/T/H")
    await b.told_to(a)
    answers, _ = a.ask("7/add/T/H")
    mine, _ = b.ask("7/add/T/H/nobody")
    before = len(b.log)
    unopened = lab.network.transport("b")
    crashed = lab.loop.time()

    lab.network.crash("b")
    await lab.until(lambda: answers, "the question ends")
    await lab.unlinked(c, b)

    assert answers == [NoAnswer(timed_out=False)]
    assert crashed + 3.0 <= a.when("down", b.session) <= crashed + 4.0
    assert (asked, mine, b.log[before:]) == ([], [], [])
    assert repr(lab.network.host("b")) == "<Host b peer down>"
    assert repr(b.transport) == f"<SimulatedTransport {b.session} on b closed>"
    with pytest.raises(WireUnavailable, match="b is down"):
        await lab.party("b")
    lab.network.reboot("b")
    with pytest.raises(WireUnavailable, match="make another one"):
        await unopened.open("**", b)
    await b.transport.close()
    assert c.kinds() == ["up", "up", "down"]


async def test_a_machine_that_reboots_says_at_once_that_its_processes_are_gone() -> None:
    lab = Lab(lease=4.0)
    a, b = await lab.parties("a", "b")

    lab.network.crash("b")
    await asyncio.sleep(1.0)
    lab.network.reboot("b")
    lab.network.reboot("b")
    rebooted = lab.loop.time()
    again = await lab.party("b")
    await lab.linked(a, again)

    assert a.when("down", b.session) == pytest.approx(rebooted + LAN.delay)
    assert again.session != b.session
    assert a.kinds() == ["up", "down", "up"]


async def test_what_waits_on_a_machine_that_crashes_is_lost_and_so_is_its_farewell() -> None:
    lab = Lab(lease=4.0)
    a, b = await lab.parties("a", "b")
    heard, _ = lab.hear(b)
    outlet = await a.outlet(KEY)
    lab.network.set_conditions("a", "b", Conditions(bandwidth=1000.0))

    for number in range(3):
        outlet.put(numbered(number), b"")
    await a.transport.close()
    crashed = lab.loop.time()
    lab.network.crash("a")
    await lab.unlinked(b, a)

    assert [number for _, number in heard] == [0]
    assert crashed + 3.0 <= b.when("down", a.session) <= crashed + 4.0


async def test_a_process_that_is_killed_is_lost_at_once_and_those_beside_it_are_not() -> None:
    lab = Lab(lease=4.0)
    a, b = await lab.parties("a", "b")
    beside = await lab.party("b")
    await lab.linked(a, b, beside)
    killed = lab.loop.time()

    lab.network.kill(b.transport)
    lab.network.kill(b.transport)
    await lab.unlinked(a, b)
    await lab.unlinked(beside, b)

    assert a.when("down", b.session) == pytest.approx(killed + LAN.delay)
    assert beside.when("down", b.session) == pytest.approx(killed + LOOPBACK.delay)
    await asyncio.sleep(10.0)
    assert a.is_linked(beside.session)
    assert b.kinds() == ["up", "up"]


async def test_a_process_that_is_killed_while_it_is_cut_off_is_lost_when_the_cut_ends() -> None:
    lab = Lab(lease=4.0)
    a, b = await lab.parties("a", "b")

    lab.network.cut("a", "b")
    lab.network.kill(b.transport)
    await asyncio.sleep(1.0)
    assert a.is_linked(b.session)
    lab.network.heal("a", "b")
    healed = lab.loop.time()
    await lab.unlinked(a, b)

    assert a.when("down", b.session) == pytest.approx(healed + LAN.delay)


# Replay ---------------------------------------------------------------------------------------------------------------


BAD = Conditions(delay=0.01, jitter=0.02, loss=0.1, duplication=0.1, reordering=0.1, resend=0.05)


async def course(seed: int, more_traffic: bool = False) -> list[tuple[float, int]]:
    """What one of three parties hears over a bad wire that is cut for some time."""
    lab = Lab(seed=seed)
    a, b, c = await lab.parties("a", "b", "c")
    heard, _ = lab.hear(b)
    outlet = await a.outlet(KEY, BEST_EFFORT)
    lab.hear(c, "7/other/T/H")
    await c.told_to(a)
    other = await a.outlet("7/other/T/H", BEST_EFFORT)
    lab.network.set_conditions("a", "b", BAD)
    lab.network.set_conditions("a", "c", BAD)
    start = lab.loop.time()
    for number in range(300):
        outlet.put(numbered(number), b"")
        if more_traffic:
            other.put(numbered(number), b"")
        await asyncio.sleep(0.01)
    return [(round(at - start, 9), number) for at, number in heard]


async def test_the_same_seed_gives_the_same_course_and_another_one_another() -> None:
    first = await course(1)

    assert await course(1) == first
    assert await course(2) != first


async def test_what_happens_on_one_link_does_not_depend_on_the_traffic_of_others() -> None:
    assert await course(1, more_traffic=True) == await course(1)
