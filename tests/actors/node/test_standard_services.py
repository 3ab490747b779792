"""What ROS 2 gives every node and action without being declared: parameter services and events, /rosout, the action's own endpoints."""

from __future__ import annotations

import pytest

from actors import (
    Action,
    Child,
    Done,
    Node,
    Parameter,
    Reject,
    Service,
    ServiceUnavailable,
    SetResult,
    Steps,
    Supervisor,
    Topic,
    background,
    every,
    parameter,
    qos,
    temporary,
)
from actors.actions.goals import CancelCode, GoalStatus
from actors.interfaces import derived
from actors.interfaces.action_msgs.msg import GoalInfo, GoalStatusArray
from actors.interfaces.action_msgs.srv import CancelGoal
from actors.interfaces.example_interfaces.action import Fibonacci, Fibonacci_Feedback, Fibonacci_Goal, Fibonacci_Result
from actors.interfaces.rcl_interfaces.msg import Log, ParameterEvent
from actors.interfaces.rcl_interfaces.srv import GetParameters, ListParameters, SetParameters
from actors.interfaces.unique_identifier_msgs.msg import UUID
from actors.parameters.messages import to_parameter
from actors.runtime.incarnation import incarnation_of
from actors.testing import Rig
from tests.stage import events

FIBONACCI = Action(Fibonacci, "fibonacci")
STATUS = Topic(GoalStatusArray, "/fibonacci/_action/status", qos.ACTION_STATUS)
FEEDBACK = Topic(derived.feedback_message(Fibonacci), "/fibonacci/_action/feedback", qos.ACTION_FEEDBACK)
SEND_GOAL = Service(derived.send_goal_service(Fibonacci), "/fibonacci/_action/send_goal")
GET_RESULT = Service(derived.get_result_service(Fibonacci), "/fibonacci/_action/get_result")
CANCEL = Service(CancelGoal, "/fibonacci/_action/cancel_goal")
ROSOUT = Topic(Log, "/rosout", qos.ROSOUT)
EVENTS = Topic(ParameterEvent, "/parameter_events", qos.PARAMETER_EVENTS)
ID = bytes(range(1, 17))


class Arm(Node):
    speed = parameter(0.5, ge=0.0, le=2.0)

    @every(hz=1)
    def talk(self) -> None:
        self.log.info("tick", speed=self.speed)

    @FIBONACCI.accepts
    def check(self, goal: Fibonacci_Goal) -> None:
        if goal.order < 0:
            raise Reject("order is negative")

    @FIBONACCI.serve(arrivals="parallel")
    async def work(self, goal: Fibonacci_Goal) -> Steps[Fibonacci_Feedback, Fibonacci_Result]:
        numbers = [0, 1]
        for _ in range(goal.order):
            await self.clock.sleep(1.0)
            numbers.append(numbers[-1] + numbers[-2])
            yield Fibonacci.Feedback(sequence=numbers)
        yield Done(Fibonacci.Result(sequence=numbers))


async def test_parameters_are_read_and_set_over_their_services(rig: Rig) -> None:
    await rig.start(Arm)
    listed = await rig.call(Service(ListParameters, "/arm/list_parameters"), ListParameters.Request())
    assert "speed" in listed.result.names
    wanted = SetParameters.Request(
        parameters=[to_parameter(Parameter("speed", 1.5)), to_parameter(Parameter("speed", 9.0))]
    )
    good, bad = (await rig.call(Service(SetParameters, "/arm/set_parameters"), wanted)).results
    assert good.successful
    assert not bad.successful
    assert "speed" in bad.reason
    read = await rig.call(Service(GetParameters, "/arm/get_parameters"), GetParameters.Request(names=["speed"]))
    assert read.values[0].double_value == 1.5
    assert rig.node(Arm).speed == 1.5


async def test_a_change_is_told_on_parameter_events(rig: Rig) -> None:
    await rig.start(Arm)
    events = rig.probe(EVENTS)
    assert rig.node(Arm).set_parameter("speed", 1.0).successful
    assert not rig.node(Arm).set_parameter("speed", 3.0).successful
    (event,) = events.messages
    assert event.node == "/arm"
    assert [changed.name for changed in event.changed_parameters] == ["speed"]


async def test_a_late_listener_of_rosout_gets_what_was_said_before(rig: Rig) -> None:
    await rig.start(Arm)
    await rig.advance(3.0)
    heard = rig.probe(ROSOUT)
    assert [log.msg for log in heard.messages if log.name == "arm"] == ["tick speed=0.5"] * 3
    await rig.advance(1.0)
    last = heard.last
    assert last is not None
    assert (last.name, last.level, last.stamp.sec) == ("arm", Log.INFO, 4)


async def test_services_of_a_node_that_is_not_there_are_not_there(rig: Rig) -> None:
    await rig.start(Arm)
    with pytest.raises(ServiceUnavailable, match="/leg/list_parameters"):
        await rig.call(Service(ListParameters, "/leg/list_parameters"), ListParameters.Request())


async def test_derived_services_work_again_after_a_restart(rig: Rig) -> None:
    await rig.start(Arm)
    service = Service(ListParameters, "/arm/list_parameters")
    await rig.call(service, ListParameters.Request())
    rig.crash(Arm)
    await rig.settled()
    assert "speed" in (await rig.call(service, ListParameters.Request())).result.names


async def test_a_goal_goes_over_the_five_endpoints_of_its_action(rig: Rig) -> None:
    await rig.start(Arm)
    status, feedback = rig.probe(STATUS), rig.probe(FEEDBACK)
    goal = SEND_GOAL.request(goal_id=UUID(uuid=ID), goal=Fibonacci.Goal(order=3))
    accepted = await rig.call(SEND_GOAL, goal)
    assert accepted.accepted
    result = await rig.call(GET_RESULT, GET_RESULT.request(goal_id=UUID(uuid=ID)), timeout=10.0)
    assert result.status == GoalStatus.SUCCEEDED
    assert result.result.sequence.tolist() == [0, 1, 1, 2, 3]
    await rig.quiet()
    assert [message.feedback.sequence.tolist()[-1] for message in feedback.messages] == [1, 2, 3]
    seen = [[one.status for one in message.status_list] for message in status.messages]
    assert seen[0] == []
    assert seen[-1] == [GoalStatus.SUCCEEDED]
    assert [GoalStatus.EXECUTING] in seen


async def test_a_long_status_list_is_published_at_a_pace_and_its_last_state_is_never_left_out(rig: Rig) -> None:
    await rig.start(Arm)
    status = rig.probe(STATUS)
    goals = [await rig.send_goal(FIBONACCI, Fibonacci.Goal(order=0)) for _ in range(100)]
    await rig.advance(0.1)
    for goal in goals:
        await goal
    await rig.advance(0.1)
    lists = [message.status_list for message in status.messages]
    assert len(lists) < 60, "each of a hundred goals changes its status three times"
    assert [one.status for one in lists[-1]] == [GoalStatus.SUCCEEDED] * 100


async def test_goal_ids_are_used_once_and_rejections_have_no_stamp(rig: Rig) -> None:
    await rig.start(Arm)
    assert (await rig.call(SEND_GOAL, SEND_GOAL.request(goal_id=UUID(uuid=ID), goal=Fibonacci.Goal(order=1)))).accepted
    again = await rig.call(SEND_GOAL, SEND_GOAL.request(goal_id=UUID(uuid=ID), goal=Fibonacci.Goal(order=1)))
    assert not again.accepted
    negative = await rig.call(
        SEND_GOAL, SEND_GOAL.request(goal_id=UUID(uuid=bytes(16)[:-1] + b"x"), goal=Fibonacci.Goal(order=-1))
    )
    assert not negative.accepted
    assert negative.stamp.sec == 0


async def test_a_result_is_kept_for_ten_seconds_and_then_unknown(rig: Rig) -> None:
    await rig.start(Arm)
    async with rig.me.send_goal(FIBONACCI, Fibonacci.Goal(order=1)) as goal:
        await goal
    ask = GET_RESULT.request(goal_id=UUID(uuid=goal.goal_id))
    assert (await rig.call(GET_RESULT, ask)).status == GoalStatus.SUCCEEDED
    await rig.advance(10.5)
    async with rig.me.send_goal(FIBONACCI, Fibonacci.Goal(order=0)) as other:
        await other
    late = await rig.call(GET_RESULT, ask)
    assert late.status == GoalStatus.UNKNOWN
    assert late.result.sequence.tolist() == []


async def test_all_goals_are_canceled_by_a_request_without_id(rig: Rig) -> None:
    await rig.start(Arm)
    first = await rig.send_goal(FIBONACCI, Fibonacci.Goal(order=100))
    second = await rig.send_goal(FIBONACCI, Fibonacci.Goal(order=100))
    await rig.advance(2.5)
    answer = await rig.call(CANCEL, CancelGoal.Request(goal_info=GoalInfo()))
    assert answer.return_code == CancelCode.NONE
    assert [goal.goal_id.uuid.tobytes() for goal in answer.goals_canceling] == [first.goal_id, second.goal_id]
    await rig.advance(0.0)
    assert (first.status, second.status) == (GoalStatus.CANCELED, GoalStatus.CANCELED)
    late = await rig.call(CANCEL, CancelGoal.Request(goal_info=GoalInfo(goal_id=UUID(uuid=first.goal_id))))
    assert late.return_code == CancelCode.GOAL_TERMINATED


@pytest.mark.parametrize(
    "name",
    [
        "/fibonacci/_action/pause",
        "/nowhere/_action/send_goal",
        "/arm/get_state",
        "/leg/get_state",
    ],
)
async def test_a_service_that_only_looks_like_a_derived_one_is_not_there(rig: Rig, name: str) -> None:
    await rig.start(Arm)
    with pytest.raises(ServiceUnavailable, match=name):
        await rig.call(Service(ListParameters, name), ListParameters.Request(), timeout=0.1)


@pytest.mark.parametrize("name", ["/fibonacci/_action/mood", "/nowhere/_action/status"])
async def test_a_topic_that_only_looks_like_a_derived_one_is_silent(rig: Rig, name: str) -> None:
    await rig.start(Arm)
    heard = rig.probe(STATUS, name=name)
    await rig.send_goal(FIBONACCI, Fibonacci.Goal(order=1))
    await rig.advance(2.0)
    assert len(heard) == 0


async def test_many_may_listen_and_each_hears_everything_once(rig: Rig) -> None:
    """The second listener of a derived topic does not open it a second time."""
    await rig.start(Arm)
    probes = [rig.probe(topic) for topic in (FEEDBACK, FEEDBACK, ROSOUT, ROSOUT, STATUS, STATUS)]
    await rig.send_goal(FIBONACCI, Fibonacci.Goal(order=2))
    await rig.advance(2.0)
    assert [len(probe) for probe in probes[:2]] == [2, 2]
    assert [[log.msg for log in probe.messages if log.name == "arm"] for probe in probes[2:4]] == [  # type: ignore[attr-defined]
        ["tick speed=0.5"] * 2
    ] * 2
    assert probes[4].messages == probes[5].messages


async def test_a_callback_that_breaks_fails_the_request_and_is_logged(rig: Rig) -> None:
    await rig.start(Arm)

    def broken(parameters: object) -> SetResult:
        raise OSError("no such register")

    incarnation_of(rig.node(Arm)).parameters.add_on_set_callback(broken)
    wanted = SetParameters.Request(parameters=[to_parameter(Parameter("speed", 1.5))])
    (outcome,) = (await rig.call(Service(SetParameters, "/arm/set_parameters"), wanted)).results
    assert not outcome.successful
    (line,) = events(rig.logs, "service handler failed")
    assert line.fields["handler"] == "/arm/set_parameters"
    assert "no such register" in str(line.fields["error"])
    assert rig.incarnation(Arm) == 1


async def test_who_listens_to_an_action_hears_its_next_incarnation_as_well(rig: Rig) -> None:
    await rig.start(Arm)
    status, feedback = rig.probe(STATUS), rig.probe(FEEDBACK)
    rig.crash(Arm)
    await rig.settled()
    goal = await rig.send_goal(FIBONACCI, Fibonacci.Goal(order=1))
    await rig.advance(1.5)
    assert [message.feedback.sequence.tolist() for message in feedback.messages] == [[0, 1, 1]]  # type: ignore[attr-defined]
    last = status.last
    assert last is not None
    assert [(one.goal_info.goal_id.uuid.tobytes(), one.status) for one in last.status_list] == [
        (goal.goal_id, GoalStatus.SUCCEEDED)
    ]


async def test_a_node_may_start_under_a_name_whose_services_somebody_wanted_who_has_gone(rig: Rig) -> None:
    wanted = Service(GetParameters, "/late/get_parameters")

    class Asker(Node):
        @background
        async def ask(self) -> None:
            with pytest.raises(ServiceUnavailable):
                await self.call(wanted, GetParameters.Request(names=("a",)), timeout=0.1)
            self.stop("nobody is there")

    await rig.start(Supervisor("s", children=[Child(Node)]))
    root = rig.system.supervisor
    assert root is not None
    await root.start_child(Child(Asker, restart=temporary))
    await rig.advance(1.0)
    assert wanted.name not in rig.system.graph.services
    await root.start_child(Child(Node, name="late"))
    assert len((await rig.call(wanted, GetParameters.Request(names=("use_sim_time",)))).values) == 1
