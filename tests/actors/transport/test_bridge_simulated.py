"""The bridge over the simulated network: what takes time on the way arrives, and a cut link that heals loses nothing that was promised."""

from __future__ import annotations

import asyncio

import pytest

from actors import GoalAborted, Node, qos
from actors.errors import NotRunning
from actors.testing import Rig
from actors.transport.simulated.network import Network
from tests.actors.transport.test_bridge_actions import Counter
from tests.actors.transport.test_bridge_services import Adder
from tests.stage import ADD, COUNT, NUMBERS, number, order, result, total, two, values

pytestmark = pytest.mark.virtual


async def hosts_on(network: Network, *trees: type[Node]) -> list[Rig]:
    rigs: list[Rig] = []
    for index, tree in enumerate(trees):
        network.add_host(f"host{index}")
        rigs.append(Rig())
        await rigs[-1].start(tree, transport=network.transport(f"host{index}"))
    await rigs[-1].advance(2.0)
    return rigs


async def end(rigs: list[Rig]) -> None:
    for rig in rigs:
        await rig.system.stop("the test is over")
    for rig in rigs:
        await rig.close()


async def test_topics_services_and_actions_cross_a_simulated_network() -> None:
    rigs = await hosts_on(Network(), Adder, Counter)
    first, second = rigs
    probe = second.probe(NUMBERS)
    await second.advance(1.0)
    for value in range(5):
        first.publish(NUMBERS, number(value))
    async with first.me.send_goal(COUNT, order(2)) as goal:
        feedback = [one.sequence.tolist() async for one in goal]
        answer = await goal

    assert values(probe) == [0, 1, 2, 3, 4]
    assert (feedback, answer) == ([[0], [1]], result(2))
    assert await second.call(ADD, two(1, 2)) == total(3)
    await end(rigs)


async def test_a_cut_link_ends_what_waits_and_after_healing_all_is_as_before() -> None:
    network = Network()
    rigs = await hosts_on(network, Adder, Counter)
    first, second = rigs
    latched = second.probe(NUMBERS, qos=qos.LATCHED)
    out = first.me.publisher(NUMBERS, qos=qos.LATCHED)
    out(number(1))
    goal = await first.send_goal(COUNT, order(60))
    call = asyncio.create_task(second.call(ADD, two(1, 100), timeout=99.0))
    await first.advance(1.0)
    network.cut("host0", "host1")
    out(number(2))
    with pytest.raises(GoalAborted, match="/counter ended or was lost while the goal ran"):
        await goal
    with pytest.raises(NotRunning, match="/adder, which serves /add, has ended or is lost"):
        await call
    lost_at = first.now
    network.heal("host0", "host1")
    await first.advance(30.0)

    assert lost_at < 15.0
    assert values(latched)[-1] == 2
    assert await second.call(ADD, two(1, 2)) == total(3)
    await end(rigs)


async def test_what_was_published_while_the_link_was_down_is_counted_as_lost_by_those_who_listened_before() -> None:
    network = Network()
    rigs = await hosts_on(network, Node, Node)
    first, second = rigs
    probe = second.probe(NUMBERS)
    late = first.me.publisher(NUMBERS)
    await first.advance(1.0)
    late(number(0))
    await first.advance(1.0)
    network.cut("host0", "host1")
    for value in range(1, 300):
        late(number(value))
        await first.advance(0.1)
    network.heal("host0", "host1")
    await first.advance(30.0)
    late(number(300))
    await first.advance(1.0)
    newcomer = second.probe(NUMBERS)
    await first.advance(1.0)
    late(number(301))
    await first.advance(1.0)

    assert values(probe)[-2:] == [300, 301]
    assert probe.dropped == 302 - len(values(probe)) > 200
    assert (values(newcomer), newcomer.dropped) == ([301], 0)
    await end(rigs)
