"""The small services of the tutorials: adding (Y-26), planning (Y-18), measuring (Y-27), calibrating (Y-07)."""

from __future__ import annotations

import asyncio
from math import inf, nan

import pytest

from actors import ActorError, Child, Node, Service, ServiceFailed, StartFailed
from actors.interfaces.example_interfaces.srv import AddTwoInts, AddTwoInts_Request, AddTwoInts_Response
from actors.testing import Rig
from robot.interfaces.tutorials.humanoid_control_interfaces.srv import PlanPath
from robot.interfaces.tutorials.my_robot_pkg.srv import CalculateDistance, CalculateDistance_Response
from robot.interfaces.tutorials.your_package.srv import SensorCalibration
from robot.scenes.scene import Cylinder
from robot.tutorials import add_two_ints, calibration, minimal_service, planner_service
from robot.tutorials.add_two_ints import ADD_TWO_INTS, AddClient, AddServer, AsyncAddClient
from robot.tutorials.calibration import CALIBRATE_SENSOR, CalibrationClient, CalibrationService, DriftingSensor
from robot.tutorials.distance_service import CALCULATE_DISTANCE, DistanceService
from robot.tutorials.minimal_service import MinimalClient, MinimalService
from robot.tutorials.planner_service import (
    ADD_TO_PLAN,
    PLAN_PATH,
    MotionPlanner,
    PlannerClient,
    PlannerServer,
    call_safely,
)
from tests.robot.stage import at, said, warnings
from tests.robot.tutorials.kit import alone
from tests.stage import two

# -- adding -----------------------------------------------------------------------------------------------------------------


async def test_the_minimal_service_adds_and_says_what_it_was_asked(rig: Rig) -> None:
    await rig.start(MinimalService)
    assert (await rig.call(minimal_service.ADD_TWO_INTS, two(1, 2))).sum == 3
    assert said(rig, "minimal_service") == ["Incoming request\na: 1 b: 2"]


async def test_the_minimal_client_waits_asks_and_ends(rig: Rig) -> None:
    await rig.start(alone(MinimalClient))
    await rig.advance(1.5)
    await rig.system.join(Child(MinimalService))
    await rig.advance(1.0)
    assert said(rig, "minimal_client") == ["Service not available, waiting again...", "Result of add_two_ints: 3"]
    assert rig.state(MinimalClient).state == "stopped"


async def test_the_server_says_the_sum(rig: Rig) -> None:
    await rig.start(AddServer)
    assert (await rig.call(ADD_TWO_INTS, two(5, 3))).sum == 8
    assert said(rig, "add_server") == ["Service /add_two_ints ready", "5 + 3 = 8"]


async def test_a_sum_that_does_not_fit_is_an_error_of_its_caller(rig: Rig) -> None:
    await rig.start(AddServer)
    with pytest.raises(ServiceFailed, match="sum"):
        await rig.call(ADD_TWO_INTS, two(2**62, 2**62))
    assert (await rig.call(ADD_TWO_INTS, two(2**62, -(2**62)))).sum == 0


async def test_both_clients_say_their_results_and_the_program_ends(rig: Rig) -> None:
    system = await rig.start(add_two_ints.tree())
    await rig.advance(1.0)
    assert said(rig, "add_client") == ["Result: 8"]
    assert said(rig, "async_add_client") == ["Results: [3, 7, 11]"]
    assert not system.running


class Unwilling(Node):
    """Serves /add_two_ints, and always fails."""

    @ADD_TWO_INTS.serve()
    async def add(self, request: AddTwoInts_Request) -> AddTwoInts_Response:
        raise OverflowError("no fingers left")


async def test_a_server_that_raises_gives_none_and_an_error_line(rig: Rig) -> None:
    await rig.start(Unwilling, alone(AddClient))
    await rig.advance(1.0)
    first, last = warnings(rig, "add_client")
    assert first.startswith("Service call failed: ") and "no fingers left" in first
    assert last == "No result"


class Slow(Node):
    """Adds in half a second, three at once."""

    @ADD_TWO_INTS.serve(concurrent=3)
    async def add(self, request: AddTwoInts_Request) -> AddTwoInts_Response:
        await self.clock.sleep(0.5)
        return AddTwoInts.Response(sum=request.a + request.b)


async def test_three_calls_take_as_long_as_one(rig: Rig) -> None:
    await rig.start(Slow, alone(AsyncAddClient))
    await rig.advance(1.0)
    lines = [(record.time, record.event) for record in rig.logs if record.node == "/async_add_client"]
    assert lines == [(0.5, "Results: [3, 7, 11]")]


async def test_a_client_without_a_server_says_that_it_waits(rig: Rig) -> None:
    await rig.start(alone(AddClient, patience=2.0))
    await rig.advance(3.0)
    assert said(rig, "add_client")[:2] == ["Waiting for service..."] * 2


# -- planning ---------------------------------------------------------------------------------------------------------------


async def test_the_placeholder_and_its_client(rig: Rig) -> None:
    await rig.start(planner_service.tree())
    await rig.advance(1.0)
    assert said(rig, "planner_server") == ["Planning path: start=1, goal=2"]
    assert said(rig, "planner_client") == ["Result: 3"]


async def test_the_client_waits_for_its_planner(rig: Rig) -> None:
    await rig.start(alone(PlannerClient))
    await rig.advance(2.5)
    assert said(rig, "planner_client") == ["Service not available, waiting..."] * 2


async def test_a_safe_call_without_a_server_takes_five_seconds_and_says_so(rig: Rig) -> None:
    await rig.start(Node)
    assert await call_safely(rig.me, ADD_TO_PLAN, two(1, 2)) is None
    assert rig.now == 5.0
    assert said(rig, "rig") == ["Service unavailable"]


class Moody(Node):
    """Fails the first time."""

    asked = 0

    @ADD_TO_PLAN.serve()
    async def plan(self, request: AddTwoInts_Request) -> AddTwoInts_Response:
        self.asked += 1
        if self.asked == 1:
            raise RuntimeError("no map")
        return AddTwoInts.Response(sum=request.a + request.b)


async def test_a_failed_call_is_logged_and_the_next_one_succeeds(rig: Rig) -> None:
    await rig.start(Moody)
    assert await call_safely(rig.me, ADD_TO_PLAN, two(1, 2)) is None
    (line,) = said(rig, "rig")
    assert line.startswith("Service call failed: ") and "no map" in line
    answer = await call_safely(rig.me, ADD_TO_PLAN, two(1, 2))
    assert answer is not None and answer.sum == 3


class Sleepy(Node):
    """Takes six seconds for its first answer, and none for the others."""

    asked = 0

    @ADD_TO_PLAN.serve(concurrent=2)
    async def plan(self, request: AddTwoInts_Request) -> AddTwoInts_Response:
        self.asked += 1
        if self.asked == 1:
            await self.clock.sleep(6.0)
        return AddTwoInts.Response(sum=request.a + request.b)


async def test_a_late_answer_is_nobodys(rig: Rig) -> None:
    await rig.start(Sleepy)
    assert await call_safely(rig.me, ADD_TO_PLAN, two(1, 2)) is None
    assert rig.now == 5.0
    assert said(rig, "rig") == ["Service call timed out"]
    answer = await call_safely(rig.me, ADD_TO_PLAN, two(3, 4))
    assert answer is not None and answer.sum == 7


async def test_a_limit_of_three_seconds_is_three_lines_and_an_error(rig: Rig) -> None:
    await rig.start(alone(PlannerClient, patience=3.0))
    await rig.advance(10.0)
    lines = said(rig, "planner_client")
    assert lines[:3] == ["Service not available, waiting..."] * 3
    assert lines[3].startswith("nobody serves /plan_path")


async def test_a_path_goes_from_start_to_goal_round_what_is_known(rig: Rig) -> None:
    await rig.start(Child(MotionPlanner, args=((Cylinder(1.0, 0.0, 0.3),),)))
    answer = await rig.call(PLAN_PATH, PlanPath.Request(start=at(0.0, 0.0), goal=at(2.0, 0.0)))
    assert (answer.success, answer.message) == (True, "Path planned successfully")
    poses = answer.path.poses
    assert (poses[0].pose, poses[-1].pose) == (at(0.0, 0.0).pose, at(2.0, 0.0).pose)
    assert len(poses) > 2  # not straight through
    assert {pose.header.frame_id for pose in poses} == {answer.path.header.frame_id} == {"map"}


async def test_what_cannot_be_planned_is_answered_with_the_reason(rig: Rig) -> None:
    await rig.start(Child(MotionPlanner, args=((Cylinder(1.0, 0.0, 0.3),),)))
    for goal, why in ((at(1.0, 0.0), "GoalBlocked"), (at(nan, 0.0), "InvalidPose"), (at(50.0, 0.0), "outside")):
        answer = await rig.call(PLAN_PATH, PlanPath.Request(start=at(0.0, 0.0), goal=goal))
        assert not answer.success and why in answer.message
        assert answer.path.poses == ()


async def test_two_planners_of_different_types_are_refused_with_both_named(rig: Rig) -> None:
    rig.expect_failure()
    with pytest.raises(StartFailed, match="/plan_path") as caught:
        await rig.start(PlannerServer, MotionPlanner)
    assert "planner_server" in str(caught.value)


# -- measuring --------------------------------------------------------------------------------------------------------------


async def measure(rig: Rig, *corners: float) -> CalculateDistance_Response:
    x1, y1, x2, y2 = corners
    return await rig.call(CALCULATE_DISTANCE, CalculateDistance.Request(x1=x1, y1=y1, x2=x2, y2=y2))


async def test_distances_are_measured_and_told(rig: Rig) -> None:
    await rig.start(DistanceService)
    answer = await measure(rig, 0.0, 0.0, 3.0, 4.0)
    assert (answer.distance, answer.success) == (5.0, True)
    assert answer.message == "Distance calculated successfully: 5.00"
    assert (await measure(rig, 1.0, 1.0, 1.0, 1.0)).distance == 0.0
    assert said(rig, "distance_service")[:2] == [
        "Distance Service ready",
        "Calculated distance between (0.0, 0.0) and (3.0, 4.0): 5.00",
    ]


@pytest.mark.parametrize("corners", [(nan, 0.0, 0.0, 0.0), (0.0, inf, 0.0, 0.0), (-1.7e308, 0.0, 1.7e308, 0.0)])
async def test_what_has_no_distance_is_told(rig: Rig, corners: tuple[float, ...]) -> None:
    await rig.start(DistanceService)
    answer = await measure(rig, *corners)
    assert not answer.success
    assert answer.message.startswith("There is no finite distance")


async def test_huge_coordinates_do_not_raise(rig: Rig) -> None:
    await rig.start(DistanceService)
    answer = await measure(rig, 0.0, 0.0, 1e200, 1e200)
    assert answer.success
    assert answer.distance == pytest.approx(2**0.5 * 1e200)


# -- calibrating ------------------------------------------------------------------------------------------------------------


class Broken:
    """A sensor that cannot be calibrated: it says so, or it raises."""

    def __init__(self, error: Exception | None = None) -> None:
        self._error = error

    def calibrate(self) -> bool:
        if self._error is not None:
            raise self._error
        return False

    reset = calibrate


async def calibrate(rig: Rig, name: str, *, reset: bool = False) -> tuple[bool, str]:
    answer = await rig.call(CALIBRATE_SENSOR, SensorCalibration.Request(sensor_name=name, reset_only=reset))
    return answer.success, answer.message


async def test_a_sensor_is_calibrated_and_reset(rig: Rig) -> None:
    camera = DriftingSensor(drift=0.3)
    await rig.start(Child(CalibrationService, args=({"camera_1": camera},)))
    assert await calibrate(rig, "camera_1") == (True, "Successfully calibrated camera_1")
    assert camera.read() == pytest.approx(0.0, abs=0.05)
    assert await calibrate(rig, "camera_1", reset=True) == (True, "Successfully reset the calibration of camera_1")
    assert camera.read() == pytest.approx(0.3, abs=0.05)
    assert said(rig, "calibration_service") == [
        "Calibration service ready",
        "Request to calibrate sensor: camera_1, reset only: False",
        "Calibrating camera_1",
        "Request to calibrate sensor: camera_1, reset only: True",
        "Resetting calibration for camera_1",
    ]


async def test_what_fails_is_told_and_unknown_sensors_fail(rig: Rig) -> None:
    sensors = {"camera_1": Broken(), "camera_2": Broken(RuntimeError("boom")), "shaky": DriftingSensor(noise=1.0)}
    await rig.start(Child(CalibrationService, args=(sensors,)))
    assert await calibrate(rig, "camera_1") == (False, "Failed to calibrate camera_1")
    assert await calibrate(rig, "camera_1", reset=True) == (False, "Failed to reset camera_1")
    assert await calibrate(rig, "camera_2") == (False, "Error during calibration: boom")
    assert await calibrate(rig, "shaky") == (False, "Failed to calibrate shaky")
    for name in ("camera_9", ""):
        success, message = await calibrate(rig, name)
        assert not success and message.startswith("Failed to calibrate ")
    assert rig.incarnation(CalibrationService) == 1


async def test_the_client_reports_success_fully_and_reset_only(rig: Rig) -> None:
    system = await rig.start(calibration.tree())
    await rig.advance(1.0)
    assert said(rig, "calibration_client") == ["SUCCESS: Successfully calibrated camera_1"]
    assert not system.running


async def test_the_client_waits_in_slices_and_reports_errors(rig: Rig) -> None:
    await rig.start(alone(CalibrationClient, sensor_name="camera_9"))
    await rig.advance(2.5)
    await rig.system.join(Child(CalibrationService))
    await rig.advance(1.0)
    lines = said(rig, "calibration_client")
    assert lines[:2] == ["Service not available, waiting..."] * 2
    assert lines[2].startswith("ERROR: Failed to calibrate camera_9")


async def test_the_client_resets_too(rig: Rig) -> None:
    await rig.start(CalibrationService, alone(CalibrationClient, reset_only=True))
    await rig.advance(1.0)
    assert said(rig, "calibration_client") == ["SUCCESS: Successfully reset the calibration of camera_1"]


async def test_a_planner_that_is_down_slow_or_raises_never_hangs_its_caller(rig: Rig) -> None:
    await rig.start(Sleepy)
    service: Service[AddTwoInts_Request, AddTwoInts_Response] = ADD_TO_PLAN
    slow = asyncio.create_task(call_safely(rig.me, service, two(1, 2)))
    await rig.advance(1.0)
    rig.crash(Sleepy)
    await rig.settled()
    assert await slow is None
    with pytest.raises(ActorError):
        await rig.call(Service(AddTwoInts, "nobody"), two(1, 2))
