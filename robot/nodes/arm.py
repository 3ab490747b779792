"""The arm driver: one action that moves the arm, one service that tells where it is, and the gripper.

A goal is checked when it comes: four finite angles within the joints' limits, and no stop in force. A newer goal preempts: the arm brakes
within its limits first, and the next motion begins where that ended. When the robot is stopped (`/safety/state`), or its safety monitor is
no longer heard, the arm brakes and the goal is aborted; the gripper keeps what it has.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from actors import Aborted, Done, ExitReason, Node, Reject, Steps, every, publishes
from actors.interfaces.sensor_msgs.msg import JointState
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.std_srvs.srv import (
    SetBool,
    SetBool_Request,
    SetBool_Response,
    Trigger,
    Trigger_Request,
    Trigger_Response,
)
from robot.contracts import (
    ARM_JOINT_STATES,
    CALIBRATE_ARM,
    CALIBRATE_GRIPPER,
    GET_CURRENT_POSITION,
    GRIPPER,
    GRIPPER_STATE,
    MOVE_ARM,
    SAFETY_STATE,
)
from robot.interfaces.robactor_msgs.msg import GripperState, SafetyState
from robot.interfaces.tutorials.robot_arm_control.action import MoveArm, MoveArm_Feedback, MoveArm_Goal, MoveArm_Result
from robot.interfaces.tutorials.robot_arm_control.srv import GetPosition, GetPosition_Request, GetPosition_Response
from robot.interfaces.tutorials.your_package.srv import (
    SensorCalibration,
    SensorCalibration_Request,
    SensorCalibration_Response,
)
from robot.model.arm import JOINTS, check_angles

if TYPE_CHECKING:
    from robot.hardware.arm import ArmDevice, ArmState

TICK = 0.001
"""A body's time may be this much behind the clock's, s: its instants are whole ticks."""
SETTLED = 1e-3
"""A drive this near to its target has arrived, rad."""
SETTLING = 0.5
"""How long drives may take for the last of the way after their motion's end, s."""
SILENCE = 0.5
"""A safety monitor that has not been heard for this long counts as a stop, s."""
GRIPPER_TIMEOUT = 2.0
CALIBRATED = ("arm", "gripper")
STEADY = 5e-3
"""A joint that turns by no more than this during its calibration rests, rad."""


class ArmDriver(Node):
    """Drives `arm`: serves move_arm, get_current_position, gripper, calibrate_gripper, calibrate_arm.

    Publishes arm/joint_states (50 Hz) and gripper/state.
    """

    joints = publishes(ARM_JOINT_STATES)
    gripper_state = publishes(GRIPPER_STATE)

    def __init__(self, arm: ArmDevice) -> None:
        self._arm = arm

    async def on_start(self) -> None:
        self._stops: tuple[str, ...] = ()
        self._safety_heard = -1.0
        self._gripper_told: tuple[bool, bool, bool] | None = None
        self._gripper_busy = False
        self._ticks = 0
        self._state()
        self._arm.stop()  # a motion that outlived the node that began it

    async def on_stop(self, reason: ExitReason) -> None:
        await self._brake()

    # -- what it tells -------------------------------------------------------------------------------------------------------

    @every(hz=50)
    def read(self) -> None:
        """Publish the joints, and the gripper when it does something; brake when nobody watches over the robot."""
        state = self._state()
        self.joints(
            JointState(
                header=Header(stamp=self.clock.stamp(), frame_id="base_link"),
                name=JOINTS,
                position=state.position,
                velocity=state.velocity,
            )
        )
        gripper, self._ticks = self._arm.gripper, self._ticks + 1
        told = (gripper.closing, gripper.moving, gripper.gripping)
        if told != self._gripper_told or (gripper.moving and self._ticks % 5 == 0):
            self._gripper_told = told
            self.gripper_state(
                GripperState(
                    stamp=self.clock.stamp(), opening=gripper.opening,
                    closing=gripper.closing, moving=gripper.moving, gripping=gripper.gripping,
                )
            )  # fmt: skip
        if self._safety_heard >= 0.0 and self.clock.now() - self._safety_heard > SILENCE and not self._stops:
            self._halt(("the safety monitor is silent",))

    @GET_CURRENT_POSITION.serve()
    async def position(self, request: GetPosition_Request) -> GetPosition_Response:
        state = self._state()
        return GetPosition.Response(joint_angles=state.position, arm_status="MOVING" if state.moving else "IDLE")

    # -- stops ---------------------------------------------------------------------------------------------------------------

    @SAFETY_STATE.on()
    def safety(self, message: SafetyState) -> None:
        self._safety_heard = self.clock.now()
        if not message.stopped:
            self._stops = ()
        elif not self._stops:
            self._halt(tuple(message.reasons) or ("the robot is stopped",))

    def _halt(self, reasons: tuple[str, ...]) -> None:
        self._stops = reasons
        if self._state().moving:
            self.log.warning("stopping the arm", why=", ".join(reasons))
            self._arm.stop()

    # -- move_arm ------------------------------------------------------------------------------------------------------------

    @MOVE_ARM.accepts
    def check(self, goal: MoveArm_Goal) -> None:
        try:
            check_angles(goal.target_angles.tolist())
        except ValueError as error:
            raise Reject(str(error)) from None
        if self._stops:
            raise Reject(f"the robot is stopped: {', '.join(self._stops)}")

    @MOVE_ARM.serve(arrivals="preempt")
    async def move(self, goal: MoveArm_Goal) -> Steps[MoveArm_Feedback, MoveArm_Result]:
        target = check_angles(goal.target_angles.tolist())
        try:
            await self._brake()  # what is left of a motion that was stopped
            begun = self.clock.now()
            ends, tick = begun + self._arm.move(target) + TICK, 0
            while True:
                state = self._state()
                percent = 100.0 * state.progress
                yield MoveArm.Feedback(
                    current_angles=state.position,
                    progress_percentage=percent,
                    status=f"Moving... {percent:.1f}% complete",
                )
                if not state.moving:
                    break
                tick += 1
                await self.clock.sleep_until(min(begun + tick / 10.0, ends))
            if self._stops:
                why = ", ".join(self._stops)
                yield Aborted(self._result(False, f"Movement stopped: {why}"), f"the robot is stopped: {why}")
                return
            await self._settle(target)
            yield Done(self._result(True, "Movement completed successfully"))
        except asyncio.CancelledError:
            await self._brake()
            yield Done(self._result(False, "Movement canceled"))

    async def _brake(self) -> None:
        """Stop the arm and wait until it rests."""
        if self._state().moving:
            await self.clock.sleep(self._arm.stop() + TICK)
            self._state()

    async def _settle(self, target: tuple[float, ...]) -> None:
        """Wait until the joints are where they were sent, or for as long as they may take."""
        deadline = self.clock.now() + SETTLING
        while self.clock.now() < deadline:
            here = self._state().position.tolist()
            if max(abs(a - b) for a, b in zip(here, target, strict=True)) < SETTLED:
                return
            await self.clock.sleep(0.02)

    def _result(self, success: bool, message: str) -> MoveArm_Result:
        return MoveArm.Result(success=success, final_angles=self._state().position, message=message)

    # -- the gripper ---------------------------------------------------------------------------------------------------------

    @GRIPPER.serve(concurrent=2)
    async def grip(self, request: SetBool_Request) -> SetBool_Response:
        if self._gripper_busy:
            return SetBool.Response(success=False, message="the gripper is busy: ask again in a second")
        gripping, opening = await self._jaws(request.data)
        millimeters = f"{1000 * opening:.0f} mm"
        if not request.data:
            return SetBool.Response(success=not gripping, message=f"Gripper open: {millimeters}")
        if gripping:
            return SetBool.Response(success=True, message=f"Gripping something: {millimeters}")
        return SetBool.Response(success=False, message="Gripper closed on nothing")

    @CALIBRATE_GRIPPER.serve(concurrent=2)
    async def calibrate_gripper(self, request: Trigger_Request) -> Trigger_Response:
        problem, closed, opened = await self._calibrate()
        if problem:
            return Trigger.Response(success=False, message=problem)
        return Trigger.Response(
            success=True, message=f"Gripper calibrated: {1000 * closed:.0f} to {1000 * opened:.0f} mm"
        )

    @CALIBRATE_ARM.serve(concurrent=2)
    async def calibrate_arm(self, request: SensorCalibration_Request) -> SensorCalibration_Response:
        """What there is to find out: whether the joints rest where they read, and the two ends of the gripper. Nothing is kept, so a reset is no work."""
        if request.sensor_name not in CALIBRATED:
            known = " or ".join(CALIBRATED)
            return _calibrated(False, f"There is no sensor called {request.sensor_name!r} here; ask for {known}")
        if request.reset_only:
            return _calibrated(True, f"Successfully reset calibration of {request.sensor_name}")
        before = self._state()
        problem = "the arm is moving" if before.moving else ""
        if not problem:
            problem, _, _ = await self._calibrate()
        drift = max(abs(a - b) for a, b in zip(self._state().position.tolist(), before.position.tolist(), strict=True))
        if not problem and drift > STEADY:
            problem = f"a joint turned by {drift:.3f} rad meanwhile"
        if problem:
            return _calibrated(False, f"Failed to calibrate {request.sensor_name}: {problem}")
        return _calibrated(True, f"Successfully calibrated {request.sensor_name}")

    async def _calibrate(self) -> tuple[str, float, float]:
        """Close and open the gripper: what was wrong (empty if nothing), and its two ends, m."""
        self._state()
        if self._gripper_busy:
            return "the gripper is busy: ask again in a second", 0.0, 0.0
        if self._arm.gripper.gripping:
            return "the gripper holds something: open it first", 0.0, 0.0
        gripping, closed = await self._jaws(True)
        _, opened = await self._jaws(False)
        return ("something is between the jaws: take it away" if gripping else ""), closed, opened

    async def _jaws(self, closing: bool) -> tuple[bool, float]:
        """Close or open, and wait until that is done: whether it grips something, and the opening (m)."""
        self._gripper_busy = True
        try:
            self._state()
            self._arm.grip(closing)
            deadline = self.clock.now() + GRIPPER_TIMEOUT
            while self._arm.gripper.moving and self.clock.now() < deadline:
                await self.clock.sleep(0.02)
                self._state()
        finally:
            self._gripper_busy = False
        gripper = self._arm.gripper
        return gripper.gripping, gripper.opening

    def _state(self) -> ArmState:
        """The arm now: it is taken to the present first."""
        self._arm.advance(self.clock.now())
        return self._arm.state()


def _calibrated(success: bool, message: str) -> SensorCalibration_Response:
    return SensorCalibration.Response(success=success, message=message)
