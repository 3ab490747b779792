"""Types that only other processes know: a recorder asks the nodes that use them, and subscribes when it has learnt them."""

from __future__ import annotations

from collections.abc import AsyncGenerator
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import pytest
import pytest_asyncio

from actors import Child, Node, Service, qos
from actors.bag import Recorder, RecordOptions, Selection
from actors.bag.offers import known_type
from actors.interfaces import from_plain, get_message, load, registry, to_plain
from actors.interfaces.describing import described
from actors.interfaces.foreign import ForeignType
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.type_description_interfaces.srv import (
    GetTypeDescription,
    GetTypeDescription_Request,
    GetTypeDescription_Response,
)
from actors.testing import Rig
from actors.transport.remote_topics import RemotePublisher
from tests.stage import events

EVERYTHING = Selection(all_topics=True, all_services=True, all_actions=True)
UNKNOWN = "not recorded: its type is not known here"


class Owner(Node):
    """Stands for a node of another process: describes types of a package that this process does not know."""

    def __init__(self, package: str, known: str, valid: bool = True) -> None:
        self._package = package
        self._known = known
        self._valid = valid
        self.asked: list[str] = []

    async def on_start(self) -> None:
        self.serve(Service(GetTypeDescription, "~/get_type_description"), self._describe)

    async def _describe(self, request: GetTypeDescription_Request) -> GetTypeDescription_Response:
        self.asked.append(request.type_name)
        known = request.type_name.replace(self._package, self._known)
        answer = described(GetTypeDescription.Request(type_name=known, include_type_sources=True))
        text = msgspec.json.encode(to_plain(answer)).decode().replace(self._known, self._package)
        return from_plain(
            GetTypeDescription.Response,
            msgspec.json.decode(
                text if self._valid else text.replace("float64", "no type").replace('"type_id":11', '"type_id":99')
            ),
        )


async def record(rig: Rig, path: Path, *owners: Child) -> Recorder:
    await rig.start(
        *owners,
        Child(Recorder, name="rosbag2_recorder", args=(path, RecordOptions(selection=EVERYTHING))),
    )
    return rig.node(Recorder)


def owner(name: str, package: str, known: str, *, valid: bool = True) -> Child:
    silent = {"start_type_description_service": False}
    return Child(Owner, name=name, args=(package, known, valid), parameters=silent)


@dataclass(eq=False)
class Server:
    """Stands for a server of a node of another process."""

    type: ForeignType
    host: str


class Elsewhere:
    """The publishers and servers of nodes of another process."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._publishers: list[RemotePublisher] = []
        self._servers: list[tuple[dict[Any, None], Server]] = []

    def publish(self, topic: str, type_name: str, node: str) -> None:
        where: Any = SimpleNamespace(fqn=node, warn=lambda event, **fields: None)
        side: Any = SimpleNamespace(wall_ns=self._rig.system.clock.wall_ns, unreadable=None)
        entry = self._rig.system.graph.topic(topic)
        publisher = RemotePublisher(where, entry, ForeignType(type_name, ""), qos.DEFAULT, side)
        entry.add_publisher(publisher)
        self._publishers.append(publisher)

    def serve(self, service: str, type_name: str, node: str) -> None:
        servers: Any = self._rig.system.graph.service(service).remotes
        server = Server(ForeignType(type_name, ""), node)
        servers[server] = None
        self._servers.append((servers, server))

    def leave(self) -> None:
        for publisher in self._publishers:
            publisher.entry.remove_publisher(publisher)  # type: ignore[attr-defined]
        for servers, server in self._servers:
            del servers[server]


@pytest_asyncio.fixture
async def elsewhere(rig: Rig) -> AsyncGenerator[Elsewhere]:
    there = Elsewhere(rig)
    yield there
    there.leave()


async def test_a_topic_is_recorded_as_soon_as_its_owner_has_described_its_type(
    rig: Rig, elsewhere: Elsewhere, tmp_path: Path
) -> None:
    load("float64 x\n", "known1_msgs/msg/Inner")
    load("Inner[] all\n", "known1_msgs/msg/Outer")
    recorder = await record(rig, tmp_path / "walk", owner("elsewhere", "first1_msgs", "known1_msgs"))
    elsewhere.publish("/secret", "first1_msgs/msg/Outer", "/elsewhere")
    elsewhere.publish("/other", "first1_msgs/msg/Outer", "/elsewhere")
    await rig.until(lambda: "/secret" in recorder.topics and "/other" in recorder.topics)
    assert rig.node(Owner).asked == ["first1_msgs/msg/Outer"]
    assert str(get_message("first1_msgs/msg/Outer").__ros_fields__[0].type) == "first1_msgs/Inner[]"
    assert not events(rig.logs, UNKNOWN)


async def test_the_events_of_a_service_make_its_type_known(rig: Rig, elsewhere: Elsewhere, tmp_path: Path) -> None:
    load("float64 x\n---\nfloat64 y\n", "known2_msgs/srv/Ask")
    recorder = await record(rig, tmp_path / "walk", owner("elsewhere", "first2_msgs", "known2_msgs"))
    elsewhere.publish("/ask/_service_event", "first2_msgs/srv/Ask_Event", "/elsewhere")
    await rig.until(lambda: "/ask/_service_event" in recorder.topics)
    assert rig.node(Owner).asked == ["first2_msgs/srv/Ask_Event"]


async def test_the_feedback_of_an_action_makes_its_type_known(rig: Rig, elsewhere: Elsewhere, tmp_path: Path) -> None:
    """Goal and result are in the types of its services, which its server announces, too."""
    load("float64 x\n---\nfloat64 y\n---\nfloat64 z\n", "known3_msgs/action/Dig")
    recorder = await record(rig, tmp_path / "walk", owner("elsewhere", "first3_msgs", "known3_msgs"))
    elsewhere.serve("/dig/_action/send_goal", "first3_msgs/action/Dig_SendGoal", "/elsewhere")
    elsewhere.serve("/dig/_action/get_result", "first3_msgs/action/Dig_GetResult", "/elsewhere")
    elsewhere.publish("/dig/_action/feedback", "first3_msgs/action/Dig_FeedbackMessage", "/elsewhere")
    await rig.until(lambda: "/dig/_action/feedback" in recorder.topics)
    assert sorted(rig.node(Owner).asked) == [
        f"first3_msgs/action/Dig_{part}" for part in ("FeedbackMessage", "GetResult", "SendGoal")
    ]


async def test_another_owner_is_asked_when_one_does_not_describe_it(
    rig: Rig, elsewhere: Elsewhere, tmp_path: Path
) -> None:
    load("float64 x\n", "known4_msgs/msg/Inner")
    good, bad = owner("good", "first4_msgs", "known4_msgs"), owner("bad", "first4_msgs", "known4_msgs", valid=False)
    recorder = await record(rig, tmp_path / "walk", good, bad)
    elsewhere.publish("/secret", "first4_msgs/msg/Inner", "/nobody")
    await rig.advance(5.0)
    elsewhere.publish("/secret", "first4_msgs/msg/Inner", "/bad")
    await rig.advance(5.0)
    assert len(events(rig.logs, UNKNOWN)) == 1
    assert "/secret" not in recorder.topics
    elsewhere.publish("/secret", "first4_msgs/msg/Inner", "/good")
    await rig.until(lambda: "/secret" in recorder.topics)
    assert len(events(rig.logs, UNKNOWN)) == 1


async def test_a_type_that_is_learnt_after_the_end_is_not_recorded(
    rig: Rig, elsewhere: Elsewhere, tmp_path: Path
) -> None:
    load("float64 x\n", "known5_msgs/msg/Inner")
    recorder = await record(rig, tmp_path / "walk", owner("elsewhere", "first5_msgs", "known5_msgs"))
    await recorder.finish()
    elsewhere.publish("/secret", "first5_msgs/msg/Inner", "/elsewhere")
    await rig.advance(5.0)
    assert recorder.topics == []


async def test_an_owner_that_does_not_know_its_own_type_is_told_of(
    rig: Rig, elsewhere: Elsewhere, tmp_path: Path
) -> None:
    recorder = await record(rig, tmp_path / "walk", owner("elsewhere", "first6_msgs", "nowhere6_msgs"))
    elsewhere.publish("/secret", "first6_msgs/msg/Inner", "/elsewhere")
    await rig.advance(5.0)
    (line,) = events(rig.logs, UNKNOWN)
    assert line.fields["type"] == "first6_msgs/msg/Inner"
    assert "/secret" not in recorder.topics


def test_a_type_whose_definition_is_none_is_an_unknown_type(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "odd_msgs" / "msg").mkdir(parents=True)
    (tmp_path / "odd_msgs" / "msg" / "Odd.msg").write_text("this is no definition!\n")
    monkeypatch.setattr(registry, "_folders", [*registry._folders, registry.Folder(str(tmp_path), None)])
    assert known_type(ForeignType("odd_msgs/msg/Odd", "")) is None
    assert known_type(ForeignType("std_msgs/msg/String", "")) is known_type(String) is String
