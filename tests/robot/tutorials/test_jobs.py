"""The tutorials' larger lessons: parameters (Y-20), missed messages (Y-12), two hundred nodes (X-19), a job with progress (K-04)."""

from __future__ import annotations

import time
from itertools import pairwise
from math import nan

import pytest

from actors import Child, GoalCanceled, GoalRejected, Node, Parameter, Service, StartFailed, execute, publishes, run
from actors.interfaces.rcl_interfaces.msg import SetParametersResult
from actors.interfaces.rcl_interfaces.srv import SetParameters, SetParametersAtomically
from actors.interfaces.std_msgs.msg import Int32
from actors.parameters.messages import to_parameter
from actors.qos import SENSOR_DATA
from actors.testing import Rig
from robot.tutorials import map_sweep, motor_controller, slow_processor
from robot.tutorials.map_sweep import SWEEP, Sweep, SweepClient, SweepServer
from robot.tutorials.motor_controller import MOTOR_VELOCITY, MotorController
from robot.tutorials.ring import Link, ring, tree
from robot.tutorials.slow_processor import READINGS, FastSensor, MendedProcessor, SlowProcessor, diagnosis
from tests.robot.stage import said, warnings
from tests.robot.tutorials.kit import alone, increasing

# -- parameters -------------------------------------------------------------------------------------------------------------

SET = Service(SetParameters, "/motor_controller/set_parameters")
SET_ALL = Service(SetParametersAtomically, "/motor_controller/set_parameters_atomically")


async def put(rig: Rig, name: str, value: object) -> SetParametersResult:
    """Set one parameter from outside, as `ros2 param set` does."""
    request = SetParameters.Request(parameters=[to_parameter(Parameter(name, value))])  # type: ignore[arg-type]
    return (await rig.call(SET, request)).results[0]


async def test_the_parameters_are_said_at_the_start(rig: Rig) -> None:
    await rig.start(motor_controller.tree())
    assert said(rig, "motor_controller") == ["Max velocity: 1.0", "PID gains: [1.0, 0.1, 0.01]"]


async def test_a_change_counts_from_the_next_step_without_a_restart(rig: Rig) -> None:
    await rig.start(MotorController)
    velocities = rig.probe(MOTOR_VELOCITY)
    await rig.advance(10.0)
    assert velocities[-1].data == pytest.approx(1.0, abs=0.02)
    assert (await put(rig, "max_velocity", 2.5)).successful
    await rig.advance(0.1)
    assert velocities[-1].data > 1.5
    await rig.advance(10.0)
    assert velocities[-1].data == pytest.approx(2.5, abs=0.05)
    assert (await put(rig, "max_velocity", 0.5)).successful
    await rig.advance(0.1)
    assert velocities[-1].data <= 0.5
    assert rig.incarnation(MotorController) == 1
    assert said(rig, "motor_controller")[2:] == ["Max velocity changed to: 2.5", "Max velocity changed to: 0.5"]


@pytest.mark.parametrize(("value", "allowed"), [(0.0, True), (10.0, True), (-0.1, False), (10.1, False), (nan, False)])
async def test_the_limits_of_the_velocity(rig: Rig, value: float, allowed: bool) -> None:
    await rig.start(MotorController)
    result = await put(rig, "max_velocity", value)
    assert (result.successful, result.reason) == (
        allowed,
        "" if allowed else "max_velocity must be between 0.0 and 10.0",
    )
    assert rig.node(MotorController).max_velocity == (value if allowed else 1.0)


@pytest.mark.parametrize("gains", [[1.0, 2.0], [1.0, 2.0, 3.0, 4.0]])
async def test_there_are_three_gains(rig: Rig, gains: list[float]) -> None:
    await rig.start(MotorController)
    assert (await put(rig, "pid_gains", gains)).reason == "pid_gains must have 3 elements"
    assert (await put(rig, "pid_gains", [1.5, 0.2, 0.02])).successful
    assert rig.node(MotorController).pid_gains == (1.5, 0.2, 0.02)
    assert (await put(rig, "pid_gains", [nan, 0.2, 0.02])).reason == "pid_gains must be finite"


async def test_all_or_nothing_with_every_reason_and_no_side_effect(rig: Rig) -> None:
    await rig.start(MotorController)
    node = rig.node(MotorController)
    wanted = [to_parameter(Parameter("max_velocity", 5.0)), to_parameter(Parameter("pid_gains", [1.0, 2.0]))]
    result = (await rig.call(SET_ALL, SetParametersAtomically.Request(parameters=wanted))).result
    assert (result.successful, result.reason) == (False, "pid_gains must have 3 elements")
    assert (node.max_velocity, node.pid_gains) == (1.0, (1.0, 0.1, 0.01))
    both = node.set_parameters({"max_velocity": -1.0, "pid_gains": [1.0]})
    assert both.reason == "max_velocity must be between 0.0 and 10.0; pid_gains must have 3 elements"
    assert len(said(rig, "motor_controller")) == 2  # nothing was said to have changed
    assert node.set_parameters({"max_velocity": 5.0, "pid_gains": [1.0, 2.0, 3.0]}).successful
    assert said(rig, "motor_controller")[2:] == [
        "Max velocity changed to: 5.0",
        "PID gains changed to: [1.0, 2.0, 3.0]",
    ]


async def test_a_word_is_no_velocity(rig: Rig) -> None:
    await rig.start(MotorController)
    result = await put(rig, "max_velocity", "fast")
    assert not result.successful
    assert "max_velocity" in result.reason
    assert "type" in result.reason or "double" in result.reason
    assert rig.incarnation(MotorController) == 1


async def test_a_controller_is_not_started_with_a_velocity_that_may_not_be_set(rig: Rig) -> None:
    rig.expect_failure()
    with pytest.raises(StartFailed, match="max_velocity must be between"):
        await rig.start(Child(MotorController, parameters={"max_velocity": -1.0}))


async def test_a_whole_number_is_no_double_as_in_ROS_2(rig: Rig) -> None:
    await rig.start(MotorController)  # a command line makes 2.0 of it; the service takes values as they are
    result = await put(rig, "max_velocity", 2)
    assert not result.successful
    assert "expected DOUBLE got INTEGER" in result.reason


# -- the exercise of the missed messages ------------------------------------------------------------------------------------


async def test_a_ten_messages_a_second_are_lost_once_the_queue_is_full(rig: Rig) -> None:
    await rig.start(FastSensor, SlowProcessor)
    await rig.advance(5.0)
    queue = rig.node(SlowProcessor).subscription(READINGS)
    before = queue.dropped
    await rig.advance(10.0)
    assert queue.dropped - before == pytest.approx(100, abs=2)
    assert len(queue.messages) == 5


async def test_b_H_05_the_diagnosis_names_losses_queue_callback_and_profiles(rig: Rig) -> None:
    await rig.start(FastSensor, SlowProcessor)
    await rig.advance(30.0)
    text = diagnosis(rig.node(SlowProcessor))
    queue = rig.node(SlowProcessor).subscription(READINGS)
    assert text.startswith(f"/readings: {queue.dropped} of 900 messages lost; 5 of 5 wait; ")
    assert "SlowProcessor.take takes 0.050 s" in text
    assert "it requests QoS(keep_last 5, reliable" in text
    assert "/fast_sensor offers QoS(keep_last 5, reliable" in text
    assert len(warnings(rig, "slow_processor")) >= 5  # its ticks, too, wait their turn


class BestEffortSensor(FastSensor):
    """The sensor as the exercise would have it: best effort."""

    readings = publishes(READINGS, qos=SENSOR_DATA)


class BestEffortProcessor(SlowProcessor):
    """As slow, with best effort asked for."""

    @READINGS.on(qos=SENSOR_DATA)
    async def take(self, message: Int32) -> None:
        await self.clock.sleep(slow_processor.WORK)
        self.done.append(message.data)


async def test_c_best_effort_recovers_nothing_and_may_not_fit(rig: Rig) -> None:
    await rig.start(BestEffortSensor, SlowProcessor, BestEffortProcessor)
    await rig.advance(30.0)
    lossy = rig.node(BestEffortProcessor)
    assert lossy.subscription(READINGS).dropped == pytest.approx(300, abs=6)  # as many as before
    reliable = rig.state("slow_processor").running
    assert reliable is not None and isinstance(reliable.node, SlowProcessor)
    assert reliable.node.done == []  # it stayed reliable: now it hears nothing
    assert any("incompatible QoS" in line for line in warnings(rig, "slow_processor"))


async def test_d_work_beside_the_inbox_and_a_deep_queue_lose_nothing(rig: Rig) -> None:
    await rig.start(FastSensor, MendedProcessor)
    await rig.advance(30.0)
    await rig.advance(1.0)
    mended = rig.node(MendedProcessor)
    assert mended.subscription(READINGS).dropped == 0
    assert sorted(mended.done)[:900] == list(range(900))


async def test_all_of_it_runs_side_by_side(rig: Rig) -> None:
    await rig.start(slow_processor.tree())
    await rig.advance(5.5)
    (slow,), (mended,) = warnings(rig, "slow_processor"), said(rig, "mended_processor")
    assert " 0 of 150 messages lost" in mended and " 0 of 1" not in slow


# -- two hundred nodes ------------------------------------------------------------------------------------------------------


async def test_a_token_goes_round_two_hundred_nodes(rig: Rig) -> None:
    system = await rig.start(tree())
    assert sum(isinstance(state.node, Link) for state in system.nodes.values() if state.running is not None) == 200
    await rig.advance(1.0)
    assert said(rig, "starter") == ["The token came round: 200 hops"]
    assert not system.running
    await system.stop()
    assert all(state.state == "stopped" for state in system.nodes.values() if "link" in state.identity.name)
    assert not any(
        topic.publishers or topic.subscriptions for topic in system.snapshot().topics if "/ring" in topic.name
    )


@pytest.mark.realtime
def test_on_the_real_clock_two_hundred_nodes_start_and_stop_within_five_seconds_each() -> None:
    async def round_trip() -> tuple[float, float]:
        begun = time.monotonic()
        async with run(tree(), sinks=(), signals=False) as system:
            started = time.monotonic()
            await system.wait()
        return started - begun, time.monotonic() - started

    started, ended = execute(round_trip)
    assert started < 5.0
    assert ended < 5.0


async def test_and_a_ring_of_one(rig: Rig) -> None:
    await rig.start(ring(1))
    await rig.advance(1.0)
    assert said(rig, "starter") == ["The token came round: 1 hops"]


# -- a job with progress ----------------------------------------------------------------------------------------------------


async def test_a_map_of_ten_by_ten_is_swept_from_0_to_100_percent(rig: Rig) -> None:
    await rig.start(SweepServer)
    goal = await rig.send_goal(SWEEP, Sweep.Goal())
    told = [feedback async for feedback in goal]
    result = await goal
    assert [feedback.percent_complete for feedback in told] == pytest.approx(range(1, 101))
    assert increasing(feedback.percent_complete for feedback in told)
    assert len({(feedback.x, feedback.y) for feedback in told}) == 100
    for before, after in pairwise(told):
        assert abs(after.x - before.x) + abs(after.y - before.y) == 1  # from each cell to a neighbour
    assert (result.success, result.cells, result.message) == (True, 100, "All 100 cells swept")
    assert rig.now == pytest.approx(10.0)


async def test_a_sweep_can_be_canceled(rig: Rig) -> None:
    await rig.start(SweepServer)
    goal = await rig.send_goal(SWEEP, Sweep.Goal())
    await rig.advance(4.25)
    assert await goal.cancel()
    with pytest.raises(GoalCanceled) as caught:
        await goal
    assert caught.value.result == Sweep.Result(cells=42, message="Canceled after 42 of 100 cells")


async def test_one_map_at_a_time_and_none_without_cells(rig: Rig) -> None:
    await rig.start(SweepServer, Node)
    with pytest.raises(GoalRejected, match="nothing to sweep"):
        await rig.send_goal(SWEEP, Sweep.Goal(width=0))
    await rig.send_goal(SWEEP, Sweep.Goal())
    with pytest.raises(GoalRejected, match="another goal is running"):
        await rig.send_goal(SWEEP, Sweep.Goal())


async def test_the_client_tells_of_every_tenth_part_and_ends(rig: Rig) -> None:
    system = await rig.start(map_sweep.tree())
    await rig.advance(11.0)
    assert said(rig, "sweep_client") == [*(f"{n}% complete" for n in range(10, 101, 10)), "All 100 cells swept"]
    assert not system.running


async def test_a_client_whose_map_is_refused_says_so(rig: Rig) -> None:
    await rig.start(SweepServer, alone(SweepClient, width=0))
    await rig.advance(1.0)
    assert said(rig, "sweep_client")[0].startswith("Map not swept: a map of 0 x 10 cells")
