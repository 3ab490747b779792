"""What the processes of a simulated network notice when links are cut, machines crash, processes die and the router goes."""

from __future__ import annotations

import asyncio

import pytest

from actors.time.virtual_loop import Deadlock, VirtualLoop
from actors.transport.protocol import NoAnswer, Replied, WireUnavailable
from actors.transport.simulated.conditions import LAN, LOOPBACK, Conditions
from actors.transport.simulated.topology import Host
from tests.actors.transport.contract.parties import ALL_OF_IT, token
from tests.actors.transport.lab import BEST_EFFORT, KEY, Lab, Timed, numbered

pytestmark = pytest.mark.virtual


def kinds(party: Timed, *told: str) -> list[str]:
    return [one.kind for one in party.told(*told or ("up", "down"))]


# Cuts and the lease --------------------------------------------------------------------------------------------------------


async def test_both_sides_of_a_cut_lose_each_other_within_the_lease() -> None:
    lab = Lab(lease=4.0)
    a, b, c = await lab.parties("a", "b", "c")
    cut = lab.loop.time()

    lab.network.cut("a", "b")
    await lab.unlinked(a, b)
    await lab.unlinked(b, a)

    for one, other in ((a, b), (b, a)):
        assert cut + 3.0 <= one.when("down", other.session) <= cut + 4.0
    assert kinds(c) == ["up", "up"]


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

    assert kinds(a) == kinds(b) == ["up"]


async def test_who_has_not_noticed_yet_when_the_cut_ends_is_told_by_the_other() -> None:
    lab = Lab(lease=4.0)
    a, b = await lab.parties("a", "b")

    lab.network.cut("a", "b")
    await lab.until(lambda: "down" in kinds(a) + kinds(b), "one of them notices")
    assert sorted(kinds(a) + kinds(b)) == ["down", "up", "up"]
    lab.network.heal("a", "b")
    healed = lab.loop.time()
    await lab.until(lambda: "down" in kinds(a) and "down" in kinds(b), "the other one notices")
    assert lab.loop.time() == pytest.approx(healed + LAN.delay)
    await lab.linked(a, b)

    assert kinds(a) == kinds(b) == ["up", "down", "up"]


async def test_who_comes_while_a_link_is_cut_is_found_when_it_is_healed() -> None:
    lab = Lab(discovery=0.1)
    (a,) = await lab.parties("a")
    lab.network.add_host("b")

    lab.network.cut("a", "b", one_way=True)
    b = await lab.party("b")
    await asyncio.sleep(10.0)
    assert kinds(a) == kinds(b) == []
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
    assert kinds(a) == []
    lab.network.heal("a", "b")
    await lab.linked(a, b)

    assert kinds(a) == kinds(b) == ["up"]


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
    assert kinds(a) == ["up"]


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


# Machines and processes ----------------------------------------------------------------------------------------------------


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
    assert kinds(c) == ["up", "up", "down"]


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
    assert kinds(a) == ["up", "down", "up"]


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
    assert kinds(b) == ["up", "up"]


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


# The router ----------------------------------------------------------------------------------------------------------------


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
    assert kinds(new) == []
    lab.network.start_router()
    await lab.linked(client, other, peer, second, new)
    assert kinds(second) == ["up"] * 3 + ["down"] * 2 + ["up"] * 3


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
    assert kinds(a) == ["up"]
    lab.network.heal("a", "hub")
    await lab.linked(a, b, c)

    assert kinds(a) == ["up", "up"]


async def test_without_any_router_peers_find_each_other_and_clients_nobody() -> None:
    lab = Lab()
    peer, _ = await lab.parties("peer1", "peer2")
    lab.network.add_host("client", "client")
    client = await lab.party("client")
    lab.network.stop_router()
    lab.network.start_router()
    await asyncio.sleep(10.0)

    assert kinds(client) == []
    assert kinds(peer) == ["up"]


# Moments -------------------------------------------------------------------------------------------------------------------


async def test_a_question_that_arrives_when_its_server_has_closed_ends_without_answer() -> None:
    lab = Lab()
    a, b = await lab.parties("a", "b")
    server = b.transport.serve("7/add/T/H", lambda query: query.reply(b"", b""))
    await b.told_to(a)

    server.close()
    server.close()

    assert await a.answer("7/add/T/H") == NoAnswer(timed_out=False)


async def test_one_of_two_servers_in_a_process_may_leave_a_question_to_the_other() -> None:
    lab = Lab()
    a, b = await lab.parties("a", "b")
    first, second = b.serve("7/add/T/H"), b.serve("7/add/T/H")
    await b.told_to(a)
    answers, _ = a.ask("7/add/T/H")
    await lab.until(lambda: first and second, "both are asked")

    first[0].drop()
    first[0].drop()
    await asyncio.sleep(1.0)
    assert answers == []
    second[0].reply(b"mine", b"")
    await lab.until(lambda: answers, "it is answered")

    assert answers == [Replied(b"mine", b"")]


def test_a_question_that_has_ended_leaves_no_timer() -> None:
    async def main() -> None:
        lab = Lab()
        a, b = await lab.parties("a", "b")
        b.serve("7/add/T/H", lambda query: query.reply(b"", b""))
        await b.told_to(a)
        await a.answer("7/add/T/H", timeout=3600.0)
        await asyncio.Event().wait()

    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        with pytest.raises(Deadlock):
            runner.run(main())
        assert runner.get_loop().time() < 10.0


async def test_a_process_that_dies_while_it_is_told_of_a_loss_hears_no_more_of_it() -> None:
    lab = Lab()
    a, b = await lab.parties("a", "b")
    b.transport.announce(token("of_b"))
    await b.told_to(a)
    write = a._write

    def die(kind: str, of: object) -> None:
        write(kind, of)
        if kind == "down":
            lab.network.kill(a.transport)

    a._write = die  # type: ignore[method-assign]
    lab.network.kill(b.transport)
    await lab.unlinked(a, b)
    await asyncio.sleep(1.0)

    assert a.log[-1] == ("down", b.session)


async def test_an_answer_to_a_process_that_has_gone_reaches_nobody() -> None:
    lab = Lab()
    a, b = await lab.parties("a", "b")
    queries = b.serve("7/add/T/H")
    await b.told_to(a)
    answers, _ = a.ask("7/add/T/H")
    await lab.until(lambda: queries, "it is asked")
    lab.network.kill(a.transport)
    await lab.unlinked(b, a)

    queries[0].reply(b"", b"")
    await asyncio.sleep(1.0)

    assert answers == []


async def test_a_process_that_dies_while_it_is_found_is_lost_again() -> None:
    lab = Lab()
    for name in ("a", "b"):
        lab.network.add_host(name)
    a, b = await lab.party("a"), await lab.party("b")
    write = b._write

    def kill(kind: str, of: object) -> None:
        write(kind, of)
        lab.network.kill(a.transport)

    b._write = kill  # type: ignore[method-assign]
    await lab.until(lambda: b.log, "it is found")
    await lab.unlinked(b, a)

    assert kinds(b) == ["up", "down"]
    assert a.log == []


async def test_tokens_that_are_not_watched_for_do_not_vanish_either() -> None:
    lab = Lab()
    a, b = await lab.parties("a", "b")
    other = a.transport.announce("@ros2_lv/8/other")
    await a.told_to(b)

    other.close()
    await a.told_to(b)

    assert kinds(b, "vanished") == []


# What is the same for all --------------------------------------------------------------------------------------------------


async def test_a_token_of_two_processes_lives_until_both_have_withdrawn_it() -> None:
    lab = Lab()
    a, b, c = await lab.parties("a", "b", "c")
    first = a.transport.announce(token("shared"))
    b.transport.announce(token("shared"))
    await a.told_to(c)
    await b.told_to(c)

    first.close()
    await a.told_to(c)
    assert kinds(c, "vanished") == []
    lab.network.kill(b.transport)
    await lab.unlinked(c, b)

    assert [one for one in c.log if one.of == token("shared")] == [
        ("appeared", token("shared")),
        ("vanished", token("shared")),
    ]


async def test_what_is_declared_before_a_transport_is_open_is_shown_when_it_is() -> None:
    lab = Lab()
    (a,) = await lab.parties("a")
    heard, _ = lab.hear(a)
    lab.network.add_host("b")
    early = lab.network.transport("b")
    early.announce(token("early"))
    outlet = early.outlet(KEY, ALL_OF_IT)
    outlet.put(numbered(1), b"")

    await early.open("@ros2_lv/**", Timed(early, lab.changes))
    await lab.until(lambda: a.has("appeared", token("early")) and outlet.wanted, "it is shown")
    outlet.put(numbered(2), b"")
    await lab.until(lambda: heard, "a sample arrives")

    assert [number for _, number in heard] == [2]


async def test_a_closed_transport_reaches_nobody_whatever_is_asked_of_it() -> None:
    lab = Lab()
    a, b = await lab.parties("a", "b")
    heard, subscription = lab.hear(b)
    outlet = await a.outlet(KEY)
    token_handle = a.transport.announce(token("gone"))
    await a.transport.close()
    await lab.unlinked(b, a)
    before = list(a.log)

    outlet.put(numbered(1), b"")
    outlet.close()
    token_handle.close()
    a.transport.announce(token("late"))
    answers, _ = a.ask("7/add/T/H")
    late = a.transport.outlet(KEY, ALL_OF_IT)
    late.put(numbered(2), b"")
    subscription.close()
    subscription.close()
    await asyncio.sleep(10.0)

    assert (heard, answers, a.log) == ([], [], before)
    assert not b.has("appeared", token("late"))
    assert not late.wanted


async def test_an_error_of_a_callback_goes_to_the_loop_and_the_rest_arrives() -> None:
    lab = Lab()
    a, b = await lab.parties("a", "b")
    reported: list[dict[str, object]] = []
    lab.loop.set_exception_handler(lambda _, context: reported.append(context))

    def fail(sample: object) -> None:
        raise RuntimeError("a bug")

    b.transport.subscribe("7/bug/T/H", ALL_OF_IT, fail)
    heard, _ = lab.hear(b)
    await b.told_to(a)
    bad, outlet = await a.outlet("7/bug/T/H"), await a.outlet(KEY)

    bad.put(b"", b"")
    outlet.put(numbered(1), b"")
    await lab.until(lambda: heard, "the other sample arrives")

    assert [str(one["exception"]) for one in reported] == ["a bug"]


@pytest.mark.parametrize("how", ["wanted", "unwanted", "vanished"])
async def test_outlets_may_be_closed_while_they_are_told_of_a_change(how: str) -> None:
    lab = Lab()
    a, b = await lab.parties("a", "b")
    outlets = [a.transport.outlet(KEY, ALL_OF_IT) for _ in range(2)]
    write = a._write

    def close_all(kind: str, of: object) -> None:
        write(kind, of)
        if kind == how:
            for outlet in outlets:
                outlet.close()

    a._write = close_all  # type: ignore[method-assign]
    b.transport.announce(token("of_b"))
    _, subscription = lab.hear(b)
    await b.told_to(a)
    if how == "vanished":
        lab.network.kill(b.transport)
        await lab.unlinked(a, b)
    else:
        subscription.close()
        await b.told_to(a)

    assert [outlet.wanted for outlet in outlets] == [False, False]
    assert (
        kinds(a, "wanted", "unwanted")
        == {
            "wanted": ["wanted"],
            "unwanted": ["wanted", "wanted", "unwanted"],
            "vanished": ["wanted", "wanted"],
        }[how]
    )


async def test_a_network_names_what_it_does_not_have() -> None:
    lab = Lab()
    lab.network.add_host("robot", router=True, clock_offset=0.5)

    with pytest.raises(ValueError, match="no host 'robt'; did you mean 'robot'"):
        lab.network.transport("robt")
    with pytest.raises(ValueError, match="no host 'base'"):
        lab.network.cut("robot", "base")
    with pytest.raises(ValueError, match="'robot' already"):
        lab.network.add_host("robot")
    with pytest.raises(ValueError, match="it is on 'robot'"):
        lab.network.add_host("base", router=True)
    robot = lab.network.host("robot")
    assert isinstance(robot, Host)
    assert (robot.clock_offset, repr(robot)) == (0.5, "<Host robot peer>")
    assert repr(lab.network.transport("robot")).endswith(" on robot>")


# Replay --------------------------------------------------------------------------------------------------------------------

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
