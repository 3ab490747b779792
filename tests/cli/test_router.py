"""`router`: two programs that do not know each other meet through it."""

from __future__ import annotations

import asyncio
import signal

import pytest

from actors import Node, Topic, every, publishes, run
from actors.interfaces.std_msgs.msg import String
from actors.transport.zenoh import ZenohConfig, ZenohTransport
from tests.cli.conftest import Command, Start

CHATTER = Topic(String, "chatter", 10)


class Talker(Node):
    chatter = publishes(CHATTER)

    @every(hz=20)
    def talk(self) -> None:
        self.chatter.publish(String(data="hello"))


async def test_programs_meet_through_a_router_until_it_is_interrupted(
    port: int, environment: dict[str, str], robot: Command, start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    endpoint = f"tcp/127.0.0.1:{port}"
    environment["ROBACTOR_GOSSIP_PORT"] = "0"  # as on another machine: nobody is met without the router
    process = await start("router", "--listen", endpoint)
    async with asyncio.timeout(30):
        said = (await process.stdout.readline()).decode()
    assert said.endswith(f" listens at {endpoint}; Ctrl-C ends it\n")
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    transport = ZenohTransport(ZenohConfig(gossip_port=0, connect=(endpoint,)))
    async with run(Talker, transport=transport, signals=False, sinks=()):
        heard = await robot("topic", "echo", "/chatter", "std_msgs/msg/String", "--once", "--connect", endpoint)
    assert (heard.code, heard.out) == (0, "data: hello\n---\n")
    process.send_signal(signal.SIGINT)
    async with asyncio.timeout(30):
        _, error = await process.communicate()
    assert (process.returncode, error.decode()) == (130, "")


async def test_a_port_in_use_is_one_line(port: int, robot: Command) -> None:
    server = await asyncio.start_server(lambda reader, writer: writer.close(), "127.0.0.1", port)
    async with server:
        refused = await robot("router", "--listen", f"tcp/127.0.0.1:{port}")
    assert (refused.code, refused.out) == (1, "")
    assert refused.err == (
        f"cannot listen at tcp/127.0.0.1:{port}: another process listens there; choose another port\n"
    )
