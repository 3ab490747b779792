"""Processes of one host find each other without a daemon, in whatever order they are started and ended."""

from __future__ import annotations

import asyncio

import pytest

from actors import System
from tests.actors.transport.zenoh.wires import free_port
from tests.stories.conftest import Program, Start, nodes, until
from tests.wires import wire as wire

pytestmark = pytest.mark.realtime

TALKER = ("robot.tutorials", "talker_listener", "--only", "talker")
LISTENER = ("robot.tutorials", "talker_listener", "--only", "listener")


async def hears(listener: Program, talker: Program) -> None:
    """The listener hears what the talker says from now on."""
    before = len(listener.lines)
    await talker.says("Publishing: Hello World", len(talker.lines))
    await listener.says("Received: Hello World", before)


async def test_the_listener_first_and_then_the_talker(start: Start, observer: System) -> None:
    listener = await start(*LISTENER)
    await until(observer, lambda: "/listener" in nodes(observer))
    talker = await start(*TALKER)
    await hears(listener, talker)


async def test_the_talker_first_and_then_the_listener(start: Start) -> None:
    talker = await start(*TALKER)
    await talker.says("Publishing: Hello World 1")
    listener = await start(*LISTENER)
    await hears(listener, talker)


async def test_both_at_once(start: Start) -> None:
    talker, listener = await asyncio.gather(start(*TALKER), start(*LISTENER))
    await hears(listener, talker)


async def test_the_first_is_killed_and_then_a_third_is_started(start: Start) -> None:
    first, listener = await start(*TALKER), await start(*LISTENER)
    await hears(listener, first)

    await first.kill()
    third = await start(*TALKER)

    await hears(listener, third)


async def test_processes_of_different_domains_do_not_meet_and_those_of_one_do(start: Start) -> None:
    first, other = await start(*TALKER, ROS_DOMAIN_ID="1"), await start(*LISTENER, ROS_DOMAIN_ID="2")
    await first.says("Publishing: Hello World 3")
    listener = await start(*LISTENER, ROS_DOMAIN_ID="1")

    await hears(listener, first)

    assert "Received" not in other.text


async def test_a_router_that_runs_is_used_and_when_it_has_gone_newcomers_are_found_as_well(
    start: Start, port: int
) -> None:
    router = await start("robot", "router", "--listen", f"tcp/127.0.0.1:{port}")
    await router.says("listens at")
    listener = await start(*LISTENER)
    first = await start(*TALKER)
    await hears(listener, first)

    await router.kill()
    await hears(listener, first)
    late = await start(*LISTENER)

    await hears(late, first)


@pytest.mark.parametrize("wire", ["zenoh"])
async def test_a_router_at_the_gossip_point_says_that_its_port_is_taken_and_nothing_breaks(
    start: Start, port: int
) -> None:
    listener = await start(*LISTENER)
    talker = await start(*TALKER)
    await hears(listener, talker)

    router = await start("robot", "router", "--listen", f"tcp/127.0.0.1:{port}")

    assert await router.ended() == 1
    assert router.lines == [
        f"cannot listen at tcp/127.0.0.1:{port}: another process listens there; choose another port"
    ]
    await hears(listener, talker)


@pytest.mark.parametrize("wire", ["zenoh"])
async def test_a_router_at_another_port_joins_those_who_connect_to_it_and_may_come_later(start: Start) -> None:
    elsewhere = f"tcp/127.0.0.1:{free_port()}"
    talker = await start(*TALKER, "--connect", elsewhere)
    await talker.says("Publishing: Hello World 1")

    router = await start("robot", "router", "--listen", elsewhere)
    await router.says("listens at")
    other_host = f"scouting/gossip/enabled=true;connect/endpoints=['{elsewhere}']"  # it knows the router only
    listener = await start(*LISTENER, ROBACTOR_GOSSIP_PORT="0", ZENOH_CONFIG_OVERRIDE=other_host)

    await hears(listener, talker)
