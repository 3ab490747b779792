"""Services and actions: recorded by their introspection, and played as requests and goals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from actors import Child, Done, Node, Reject, Service, StartFailed, temporary
from actors.bag import BagReader, BagTopic, BagWriter, Player, PlayOptions, Recorder, RecordOptions, Selection, type_of
from actors.interfaces import decode
from actors.interfaces.std_srvs.srv import SetBool
from actors.testing import Rig
from tests.actors.bag.bags import BEGIN
from tests.stage import COUNT, events, order, result, step

LIGHT = Service(SetBool, "light")
ON = {"service_configure_introspection": "contents", "action_server_configure_introspection": "contents"}
EVERY_CALL = RecordOptions(selection=Selection(all_services=True, all_actions=True))


class Server(Node):
    def __init__(self) -> None:
        self.asked: list[Any] = []

    @LIGHT.serve()
    async def light(self, request: SetBool.Request) -> SetBool.Response:
        self.asked.append(request.data)
        return SetBool.Response(success=True, message="done")

    @COUNT.accepts
    def accepts(self, goal: Any) -> None:
        if goal.order > 10:
            raise Reject("too far")

    @COUNT.serve()
    async def count(self, goal: Any) -> Any:
        self.asked.append(goal.order)
        yield step(1)
        yield Done(result(1, 2))


async def recorded(path: Path) -> Path:
    """A bag with two calls, a goal, and a goal that was rejected."""
    from actors import GoalRejected

    rig = Rig()
    client = {"client_configure_introspection": "contents"}
    await rig.start(
        Child(Recorder, args=(path, EVERY_CALL)),
        Child(Server, parameters=ON),
        Child(Node, name="user", parameters=client),
    )
    await rig.quiet()
    user = rig.node("user")
    for on in (True, False):
        await user.call(LIGHT, SetBool.Request(data=on))
        await rig.advance(1.0)
    async with user.send_goal(COUNT, order(3)) as goal:
        await goal
    with pytest.raises(GoalRejected):
        async with user.send_goal(COUNT, order(11)):
            pass
    await rig.advance(1.0)
    await rig.close()
    return path


async def test_each_step_of_each_call_is_in_the_bag_and_both_ends_agree_which_call_it_is(
    rig: Rig, tmp_path: Path
) -> None:
    bag = await recorded(tmp_path / "calls")
    found: dict[str, list[Any]] = {}
    with BagReader(bag) as read:
        for one in read.messages():
            found.setdefault(one.topic.name, []).append(decode(type_of(one.topic), one.data))
    calls = found["/light/_service_event"]
    server = [one for one in calls if one.info.event_type in (1, 2)]
    assert [(one.info.event_type, one.info.sequence_number) for one in server] == [(1, 1), (2, 1), (1, 2), (2, 2)]
    assert [one.request[0].data for one in server if one.request] == [True, False]
    assert [one.response[0].message for one in server if one.response] == ["done", "done"]
    client = [one for one in calls if one.info.event_type in (0, 3)]
    assert {tuple(one.info.client_gid) for one in client} == {tuple(one.info.client_gid) for one in server}
    goals = found["/count/_action/send_goal/_service_event"]
    assert [one.request[0].goal.order for one in goals if one.request] == [3, 11]
    assert [one.response[0].accepted for one in goals if one.response] == [True, False]
    (ended,) = found["/count/_action/get_result/_service_event"]
    assert (ended.response[0].status, list(ended.response[0].result.sequence)) == (4, [1, 2])


async def played(rig: Rig, bag: Path, **options: Any) -> list[Any]:
    await rig.start(Server, Child(Player, args=(bag, PlayOptions(**options)), restart=temporary))
    await rig.node(Player).wait()
    return rig.node(Server).asked


@pytest.mark.parametrize(("source", "expected"), [("service", [True, False, 3]), ("client", [True, False])])
async def test_recorded_requests_and_goals_are_sent_again(
    rig: Rig, tmp_path: Path, source: str, expected: list[Any]
) -> None:
    assert await played(rig, await recorded(tmp_path / "calls"), service_requests=source) == expected
    rejected = events(rig.logs, "a recorded request has failed")
    assert [one.fields["topic"] for one in rejected] == ["/count/_action/send_goal/_service_event"] * (
        source == "service"
    )


async def test_without_that_the_events_themselves_are_played(rig: Rig, tmp_path: Path) -> None:
    bag = await recorded(tmp_path / "calls")
    assert await played(rig, bag) == []
    assert "/light/_service_event" in rig.system.graph.topics


async def test_a_service_may_be_played_under_another_name(rig: Rig, tmp_path: Path) -> None:
    bag = await recorded(tmp_path / "calls")
    other: list[bool] = []

    async def dim(request: SetBool.Request) -> SetBool.Response:
        other.append(request.data)
        return SetBool.Response()

    await rig.start(Node)
    rig.me.serve(Service(SetBool, "dim"), dim)
    options = PlayOptions(
        service_requests="service", remap={"/light": "/dim"}, selection=Selection(services=["/light"])
    )
    await rig.system.join(Child(Player, args=(bag, options)))
    await rig.node(Player).wait()
    assert other == [True, False]


async def test_a_server_that_is_not_there_is_said_and_the_rest_is_played(rig: Rig, tmp_path: Path) -> None:
    bag = await recorded(tmp_path / "calls")
    await rig.start(Child(Player, args=(bag, PlayOptions(service_requests="service")), restart=temporary))
    await rig.node(Player).wait()
    assert len(events(rig.logs, "a recorded request has failed")) >= 2


async def test_an_event_that_cannot_be_decoded_is_left_out(rig: Rig, tmp_path: Path) -> None:
    topic = BagTopic("/light/_service_event", "std_srvs/srv/SetBool_Event")
    with BagWriter(tmp_path / "broken") as bag:
        bag.write(topic, b"\0\1\0\0", received_ns=BEGIN, published_ns=BEGIN)
    assert await played(rig, tmp_path / "broken", service_requests="service") == []
    assert events(rig.logs, "an event of the bag cannot be decoded")


async def test_a_service_of_an_unknown_type_is_refused(rig: Rig, tmp_path: Path) -> None:
    with BagWriter(tmp_path / "strange") as bag:
        bag.add(BagTopic("/x/_service_event", "garden_msgs/srv/Water_Event"))
    rig.expect_failure()
    options = PlayOptions(service_requests="service")
    with pytest.raises(StartFailed, match="/x/_service_event: unknown service"):
        await rig.start(Child(Player, args=(tmp_path / "strange", options), restart=temporary))
