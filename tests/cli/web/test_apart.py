"""The web server in a process of its own, which shows the tree of the one that has started it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Generator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any
from uuid import uuid4

import pytest
from websockets.asyncio.client import connect

from actors import Child, Node, Supervisor, System, Topic, every, publishes, run
from actors.interfaces.std_msgs.msg import String
from actors.logs import LogRecord
from actors.processes import forked
from actors.processes.preparation import preparation
from actors.transport import Transport
from actors.transport.dds import DdsConfig, DdsTransport
from cli.web.beside import NAME, serve_beside
from tests.cli.web.stage import Foxglove, Talker, Worker, request


@pytest.fixture(scope="module")
def zygote() -> Generator[forked.Zygote | None]:
    """As `robot run` has one for its processes: what they need is imported once."""
    if not forked.can_fork():
        yield None
        return
    zygote = forked.started(
        "the tests", preparation(main=False, modules=(*forked.MODULES, "cli.web.server.server", __name__))
    )
    yield zygote
    zygote.close()


@pytest.fixture(autouse=True)
def _processes_are_forks_of(zygote: forked.Zygote | None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(forked, "_here", zygote)


@dataclass
class Apart:
    """A system, and where the process of its server listens."""

    system: System
    url: str

    @property
    def port(self) -> int:
        return int(self.url.rstrip("/").rpartition(":")[2])

    @property
    def process(self) -> int:
        return next(record.process for record in self.system.nodes.values() if record.identity.name == NAME)

    @asynccontextmanager
    async def viewer(self) -> AsyncIterator[Foxglove]:
        async with connect(self.url.replace("http", "ws", 1), subprotocols=["foxglove.sdk.v1"]) as socket:  # type: ignore[list-item]
            yield Foxglove(socket)


@asynccontextmanager
async def served_apart(*more: Child, transport: Transport | None = None) -> AsyncIterator[Apart]:
    found: asyncio.Queue[str] = asyncio.Queue()

    def look(record: LogRecord) -> None:
        if record.event == "web page":
            found.put_nowait(record.fields["url"])

    tree = Supervisor("tree", children=[Child(Talker), Child(Worker), *more])
    async with run(tree, signals=False, sinks=(look,), transport=transport) as system:

        async def apart(server: Child) -> None:
            assert system.supervisor is not None
            await system.supervisor.start_child(server.replace(process=True))

        await serve_beside(system, host="127.0.0.1", port=0, origins=(), security=None, bags=None, apart=apart)
        async with asyncio.timeout(10):
            yield Apart(system, await found.get())


async def report(viewer: Foxglove, name: str, **facts: Any) -> Any:
    """The first report in which the node of this name has these facts."""
    while True:
        said = await viewer.find("robactor.system")
        for node in said["nodes"]:
            if node["name"] == name and all(node[key] == value for key, value in facts.items()):
                return said


async def test_a_server_in_another_process_shows_the_supervisor_tree_and_what_is_published_there() -> None:
    async with served_apart() as apart, apart.viewer() as viewer:
        await viewer.say("robactor.subscribeSystem")
        await report(viewer, "/talker", path="tree/talker", state="running", incarnation=1)
        said = await report(viewer, f"/{NAME}", process=apart.process)  # told half a second later than the talker
        channel = await viewer.channel("/chatter")

    assert said["canKill"] is True
    assert [node["name"] for node in said["nodes"]].count(f"/{NAME}") == 1
    assert channel["schemaName"] == "std_msgs/msg/String"


async def test_a_server_in_another_process_shows_a_tree_that_is_on_dds() -> None:
    pytest.importorskip("cyclonedds")
    tag = f"<CycloneDDS><Domain><Discovery><Tag>{uuid4().hex}</Tag></Discovery></Domain></CycloneDDS>"
    by_dds = DdsTransport(DdsConfig(discovery_range="LOCALHOST", uri=tag))
    async with served_apart(transport=by_dds) as apart, apart.viewer() as viewer:
        await viewer.say("robactor.subscribeSystem")
        await report(viewer, "/talker", state="running")
        await report(viewer, f"/{NAME}", process=apart.process)
        channel = await viewer.channel("/chatter")

    assert channel["schemaName"] == "std_msgs/msg/String"


async def test_a_node_that_is_killed_there_begins_its_next_life_in_its_own_process() -> None:
    async with served_apart() as apart, apart.viewer() as viewer:
        await viewer.say("robactor.subscribeSystem")
        await report(viewer, "/talker", state="running")
        await viewer.say("robactor.killNode", node="/talker", id=1)
        answer = await viewer.find("robactor.done", id=1)
        said = await report(viewer, "/talker", state="running", incarnation=2)
        await viewer.say("robactor.killNode", node="/nobody", id=2)
        refused = await viewer.find("robactor.done", id=2)

    assert answer["error"] is None
    assert said["restarts"]["/talker"] == 1
    assert "there is no node /nobody" in refused["error"]


async def test_its_figures_and_its_health_are_those_of_the_whole_tree() -> None:
    async with served_apart() as apart:
        async with apart.viewer() as viewer:
            await viewer.say("robactor.subscribeSystem")
            await report(viewer, "/talker", state="running")
        headers = ("GET /metrics HTTP/1.1", f"Host: localhost:{apart.port}")
        status, _, body = await request(apart.port, *headers)

    assert status == 200
    assert b'robactor_node_up{node="/talker",state="running"} 1\n' in body
    assert b'robactor_restarts_total{node="/worker"} 0\n' in body


async def test_the_tree_goes_on_when_the_servers_process_is_killed() -> None:
    async with served_apart() as apart:
        process, system = apart.process, apart.system
        lived = {name: record.incarnation for name, record in system.nodes.items() if record.identity.name != NAME}
        system.kill_process(f"/{NAME}")
        while apart.process in (0, process):
            await asyncio.sleep(0.01)

        assert {
            name: record.incarnation for name, record in system.nodes.items() if record.identity.name != NAME
        } == lived
        assert system.running


class Ticker(Node):
    """Says something, fifty times a second."""

    said = publishes(Topic(String, "/said"))

    @every(hz=50)
    def tick(self) -> None:
        self.said(String(data="tick"))


class Hearer(Node):
    """Takes it."""

    @Topic(String, "/said").on()
    def hear(self, message: String) -> None: ...


async def test_counters_and_rates_are_those_that_the_other_process_tells() -> None:
    async with served_apart(Child(Ticker), Child(Hearer)) as apart, apart.viewer() as viewer:
        await viewer.say("robactor.subscribeSystem")
        while True:
            said = await viewer.find("robactor.system")
            hearer = next((one for one in said["nodes"] if one["name"] == "/hearer"), None)
            topic = next((one for one in said["topics"] if one["name"] == "/said"), None)
            if hearer and topic and hearer["handled"] > 100 and 0 < topic["rate"] < 80:
                break
        headers = ("GET /metrics HTTP/1.1", f"Host: localhost:{apart.port}")
        _, _, body = await request(apart.port, *headers)

    assert topic["messages"] > 100
    handled = next(line for line in body.splitlines() if line.startswith(b'robactor_handled_total{node="/hearer"}'))
    assert int(handled.split()[-1]) > 100
