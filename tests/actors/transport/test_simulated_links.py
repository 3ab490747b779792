"""What a simulated link does to the messages on it: delay, jitter, bandwidth, loss, duplication, reordering, cuts."""

from __future__ import annotations

import asyncio
import math

import pytest

from actors.transport.keyed.protocol import Delivery, Outlet
from actors.transport.simulated.link import LAN, Conditions
from actors.transport.simulated.session import matcher
from tests.actors.transport.contract.parties import ALL_OF_IT
from tests.actors.transport.lab import BEST_EFFORT, KEY, Lab, Timed, numbered

pytestmark = pytest.mark.virtual


async def way(
    lab: Lab, conditions: Conditions, delivery: Delivery
) -> tuple[Timed, Timed, Outlet, list[tuple[float, int]]]:
    """Two parties, an outlet of the one, what the other has heard; then the link gets these conditions."""
    a, b = await lab.parties("a", "b")
    heard, _ = lab.hear(b)
    outlet = await a.outlet(KEY, delivery)
    lab.network.set_conditions("a", "b", conditions)
    return a, b, outlet, heard


def numbers(heard: list[tuple[float, int]]) -> list[int]:
    return [number for _, number in heard]


# Delay and jitter ----------------------------------------------------------------------------------------------------------


async def test_a_sample_arrives_after_the_delay() -> None:
    lab = Lab()
    _, _, outlet, heard = await way(lab, Conditions(delay=0.25), ALL_OF_IT)
    start = lab.loop.time()

    outlet.put(numbered(1), b"")
    await lab.until(lambda: heard, "it arrives")

    assert heard == [(pytest.approx(start + 0.25, abs=1e-9), 1)]


async def test_processes_of_one_machine_are_closer_to_each_other() -> None:
    lab = Lab()
    lab.network.add_host("a")
    one, other = await lab.party("a"), await lab.party("a")
    await lab.linked(one, other)
    heard, _ = lab.hear(other)
    outlet = await one.outlet(KEY)
    start = lab.loop.time()

    outlet.put(numbered(1), b"")
    await lab.until(lambda: heard, "it arrives")

    assert heard == [(pytest.approx(start + 0.00005, abs=1e-9), 1)]
    assert [(link.host, link.process) for link in one.transport.report()] == [("a", 2)]


@pytest.mark.parametrize("delivery", [ALL_OF_IT, BEST_EFFORT])
async def test_jitter_makes_samples_late_but_does_not_change_their_order(delivery: Delivery) -> None:
    lab = Lab()
    _, _, outlet, heard = await way(lab, Conditions(delay=0.01, jitter=0.1), delivery)
    put = []

    for number in range(100):
        put.append(lab.loop.time())
        outlet.put(numbered(number), b"")
        await asyncio.sleep(0.05)
    await lab.until(lambda: len(heard) == 100, "all arrive")

    late = [at - put[number] for at, number in heard]
    assert numbers(heard) == list(range(100))
    assert 0.01 <= min(late) < 0.03
    assert 0.09 < max(late) <= 0.11


# Bandwidth and queues ------------------------------------------------------------------------------------------------------

SLOW = Conditions(delay=0.001, bandwidth=1000.0)
"""100 bytes take 0.1 s."""


async def test_what_is_faster_than_the_bandwidth_waits_for_its_turn() -> None:
    lab = Lab()
    _, _, outlet, heard = await way(lab, SLOW, ALL_OF_IT)
    start = lab.loop.time()

    for number in range(3):
        outlet.put(numbered(number, size=36), b"")  # and a header of 64 bytes
    await lab.until(lambda: len(heard) == 3, "all arrive")
    await asyncio.sleep(1.0)
    later = lab.loop.time()
    outlet.put(numbered(3, size=36), b"")
    await lab.until(lambda: len(heard) == 4, "the last one arrives")

    assert heard == [
        (pytest.approx(start + 0.101), 0),
        (pytest.approx(start + 0.201), 1),
        (pytest.approx(start + 0.301), 2),
        (pytest.approx(later + 0.101), 3),
    ]


@pytest.mark.parametrize("reliable", [True, False])
async def test_a_queue_keeps_the_newest_samples_and_the_others_are_counted(reliable: bool) -> None:
    lab = Lab()
    a, b, outlet, heard = await way(lab, SLOW, Delivery(reliable=reliable, depth=2))

    for number in range(6):
        outlet.put(numbered(number), b"")
    await lab.until(lambda: 5 in numbers(heard), "the last one arrives")

    assert numbers(heard) == [0, 4, 5]
    assert a.dropped(b) == 3
    assert b.dropped(a) == 0


async def test_what_has_left_a_queue_takes_no_place_in_it() -> None:
    lab = Lab()
    a, b, outlet, heard = await way(lab, SLOW, Delivery(depth=1))

    for round_ in range(3):
        outlet.put(numbered(2 * round_), b"")
        outlet.put(numbered(2 * round_ + 1), b"")
        await asyncio.sleep(1.0)

    assert numbers(heard) == [0, 1, 2, 3, 4, 5]
    assert a.dropped(b) == 0


async def test_the_queues_of_two_outlets_do_not_disturb_each_other() -> None:
    lab = Lab()
    a, b, outlet, heard = await way(lab, SLOW, Delivery(depth=1))
    other = await a.outlet(KEY, Delivery(depth=3))

    for number in range(4):
        outlet.put(numbered(number), b"")
        other.put(numbered(10 + number), b"")
    await lab.until(lambda: 13 in numbers(heard), "the last one arrives")

    assert sorted(numbers(heard)) == [0, 3, 11, 12, 13]
    assert a.dropped(b) == 3


async def test_an_outlet_that_keeps_all_is_held_back() -> None:
    lab = Lab()
    a, b, outlet, heard = await way(lab, SLOW, Delivery(keep_all=True, depth=1))

    for number in range(20):
        outlet.put(numbered(number), b"")
    await lab.until(lambda: len(heard) == 20, "all arrive")

    assert numbers(heard) == list(range(20))
    assert a.dropped(b) == 0


async def test_a_sample_of_a_lower_priority_number_overtakes_the_others_in_the_queue() -> None:
    lab = Lab()
    a, _, outlet, heard = await way(lab, SLOW, Delivery(keep_all=True, priority=7))
    urgent = await a.outlet(KEY, Delivery(keep_all=True, priority=1))

    for number in range(3):
        outlet.put(numbered(number), b"")
    for number in range(10, 12):
        urgent.put(numbered(number), b"")
    await lab.until(lambda: len(heard) == 5, "all arrive")

    assert numbers(heard) == [0, 10, 11, 1, 2]


# Loss, duplication, reordering ---------------------------------------------------------------------------------------------


async def test_best_effort_is_lost_in_its_share() -> None:
    lab = Lab()
    a, _, outlet, heard = await way(lab, Conditions(loss=0.3), BEST_EFFORT)

    for number in range(1000):
        outlet.put(numbered(number), b"")
    await asyncio.sleep(1.0)

    assert 650 < len(heard) < 750
    assert numbers(heard) == sorted(set(numbers(heard)))
    assert lab.network.link(a.transport.host, "b").lost == 1000 - len(heard)


async def test_a_reliable_sample_that_is_lost_is_sent_again_and_those_behind_it_wait() -> None:
    lab = Lab()
    _, _, outlet, heard = await way(lab, Conditions(delay=0.001, loss=0.3, resend=0.5), ALL_OF_IT)
    start = lab.loop.time()

    for number in range(100):
        outlet.put(numbered(number), b"")
    await lab.until(lambda: len(heard) == 100, "all arrive")

    times = sorted({round(at - start - 0.001, 6) for at, _ in heard})
    assert numbers(heard) == list(range(100))
    assert times[:3] == [0.0, 0.5, 1.0]
    assert lab.network.link("a", "b").lost == 0


async def test_what_arrives_twice_is_heard_once() -> None:
    lab = Lab()
    a, b, outlet, heard = await way(lab, Conditions(delay=0.01, duplication=0.5), BEST_EFFORT)

    for number in range(200):
        outlet.put(numbered(number), b"")
        await asyncio.sleep(0.02)
    await asyncio.sleep(1.0)

    assert numbers(heard) == list(range(200))
    assert 70 < b.dropped(a) < 130


async def test_a_best_effort_sample_that_was_overtaken_is_dropped_and_counted() -> None:
    lab = Lab()
    a, b, outlet, heard = await way(lab, Conditions(delay=0.01, reordering=0.3), BEST_EFFORT)

    for number in range(200):
        outlet.put(numbered(number), b"")
        await asyncio.sleep(0.001)
    await asyncio.sleep(1.0)

    assert numbers(heard) == sorted(set(numbers(heard)))
    assert 40 < b.dropped(a) < 80
    assert len(heard) == 200 - b.dropped(a)


async def test_reliable_samples_are_neither_doubled_nor_overtaken() -> None:
    lab = Lab()
    a, b, outlet, heard = await way(lab, Conditions(jitter=0.01, duplication=0.5, reordering=0.5), ALL_OF_IT)

    for number in range(200):
        outlet.put(numbered(number), b"")
        await asyncio.sleep(0.001)
    await lab.until(lambda: len(heard) == 200, "all arrive")

    assert numbers(heard) == list(range(200))
    assert b.dropped(a) == 0


async def test_conditions_may_hold_for_one_direction_and_for_a_time() -> None:
    lab = Lab()
    a, b, outlet, heard = await way(lab, Conditions(delay=0.1), ALL_OF_IT)
    back, _ = lab.hear(a)
    answering = await b.outlet(KEY)
    await asyncio.sleep(1.0)

    lab.network.impair("a", "b", Conditions(delay=1.0), one_way=True)
    start = lab.loop.time()
    outlet.put(numbered(1), b"")
    answering.put(numbered(2), b"")
    await lab.until(lambda: heard and back, "both arrive")
    lab.network.repair("a", "b")
    later = lab.loop.time()
    outlet.put(numbered(3), b"")
    await lab.until(lambda: len(heard) == 2, "the last one arrives")

    assert back == [(pytest.approx(start + 0.1), 2)]
    assert heard == [(pytest.approx(start + 1.0), 1), (pytest.approx(later + 0.1), 3)]


@pytest.mark.parametrize(
    "bad",
    [
        {"delay": 0.0}, {"delay": math.inf}, {"delay": math.nan}, {"bandwidth": 0.0}, {"bandwidth": math.nan}, {"jitter": -1.0},
        {"jitter": math.inf}, {"resend": -0.1}, {"loss": 1.0}, {"loss": -0.1}, {"duplication": 1.5}, {"reordering": math.nan},
    ],
)  # fmt: skip
def test_conditions_that_no_link_has_are_refused(bad: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(bad))):
        Conditions(**bad)


# Cuts ----------------------------------------------------------------------------------------------------------------------


async def test_best_effort_is_lost_while_a_link_is_cut() -> None:
    lab = Lab()
    _, _, outlet, heard = await way(lab, LAN, BEST_EFFORT)

    outlet.put(numbered(1), b"")  # on its way already
    lab.network.cut("a", "b")
    outlet.put(numbered(2), b"")
    await asyncio.sleep(0.5)
    lab.network.heal("a", "b")
    outlet.put(numbered(3), b"")
    await lab.until(lambda: len(heard) == 2, "the last one arrives")

    assert numbers(heard) == [1, 3]
    assert lab.network.link("a", "b").lost == 1


async def test_reliable_samples_wait_for_the_end_of_a_short_cut() -> None:
    lab = Lab(lease=2.0)
    a, b, outlet, heard = await way(lab, LAN, ALL_OF_IT)

    lab.network.cut("a", "b")
    for number in range(3):
        outlet.put(numbered(number), b"")
    await asyncio.sleep(1.0)
    assert heard == []
    lab.network.heal("a", "b")
    healed = lab.loop.time()
    outlet.put(numbered(3), b"")
    await lab.until(lambda: len(heard) == 4, "all arrive")

    assert numbers(heard) == [0, 1, 2, 3]
    assert healed < heard[0][0] <= healed + LAN.resend + LAN.delay
    await asyncio.sleep(10.0)
    assert [kind for _, kind, _ in a.times if kind == "down"] == []
    assert b.is_linked(a.session)


async def test_in_a_cut_a_queue_keeps_the_newest_samples() -> None:
    lab = Lab()
    a, b, outlet, heard = await way(lab, LAN, Delivery(depth=2))

    lab.network.cut("a", "b")
    for number in range(5):
        outlet.put(numbered(number), b"")
    lab.network.heal("a", "b")
    lab.network.cut("a", "b")
    await asyncio.sleep(1.0)
    outlet.put(numbered(5), b"")
    lab.network.heal("a", "b")
    await lab.until(lambda: 5 in numbers(heard), "the last one arrives")

    assert numbers(heard) == [4, 5]
    assert a.dropped(b) == 4


async def test_best_effort_that_waits_in_a_queue_when_the_link_is_cut_is_lost() -> None:
    lab = Lab()
    a, _, outlet, heard = await way(lab, SLOW, Delivery(reliable=False, depth=2))
    reliable = await a.outlet(KEY, Delivery(depth=1))

    for number in range(4):
        outlet.put(numbered(number), b"")  # one leaves, two wait
        reliable.put(numbered(10 + number), b"")
    lab.network.cut("a", "b")
    await asyncio.sleep(0.5)
    lab.network.heal("a", "b")
    await lab.until(lambda: 13 in numbers(heard), "the reliable one arrives")
    await asyncio.sleep(1.0)

    assert numbers(heard) == [0, 13]
    assert lab.network.link("a", "b").lost == 2


# Key expressions -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("expression", "matches", "others"),
    [
        ("a/b", ["a/b"], ["a", "a/b/c", "a/c", "b/a/b"]),
        ("a/*", ["a/b", "a/*"], ["a", "a/b/c", "a/@b"]),
        ("a/*/c", ["a/b/c"], ["a/c", "a/b/b/c"]),
        ("a/**", ["a", "a/b", "a/b/c"], ["b/a", "ab", "a/@b", "a/b/@c"]),
        ("**", ["a", "a/b"], ["@a", "a/@b"]),
        ("@a/**/c", ["@a/c", "@a/b/c", "@a/b/b/c"], ["a/c", "@a/c/b", "@a/@b/c"]),
        ("a.b/c", ["a.b/c"], ["aXb/c"]),
    ],
)
def test_a_key_expression_matches_chunk_by_chunk(expression: str, matches: list[str], others: list[str]) -> None:
    pattern = matcher(expression)

    assert [key for key in matches + others if pattern.fullmatch("/" + key)] == matches
