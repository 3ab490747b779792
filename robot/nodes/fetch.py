"""Fetch an object, and carry it elsewhere: navigate_and_grab and fetch_and_carry.

    calibrate the gripper -> confirm the object with the camera -> navigate to where the arm reaches it -> grab and stow
    [-> carry it to where it shall stand -> release it there]

An object that is not confirmed moves nothing: not the robot, not the arm. When the tool does not get within 2 cm of the object, or the gripper
closes on nothing, the robot looks again, stands elsewhere and tries again. A cancel stops walking and arm; until the object is lifted
the gripper lets go of it, later it keeps what it has, and the result says so.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Mapping, Sequence
from contextlib import aclosing, suppress
from math import dist, hypot
from typing import Any

from actors import Aborted, Done, Node, Reject, Steps, parameter
from actors.interfaces.geometry_msgs.msg import PoseStamped
from robot.contracts import FETCH_AND_CARRY, GAIT_STATUS, GRIPPER_STATE, NAVIGATE_AND_GRAB, POSE
from robot.geometry.messages import from_pose, is_pose, pose_stamped
from robot.geometry.planar import Pose2
from robot.interfaces.robactor_msgs.action import (
    FetchAndCarry,
    FetchAndCarry_Feedback,
    FetchAndCarry_Goal,
    FetchAndCarry_Result,
)
from robot.interfaces.robactor_msgs.msg import GaitStatus, GripperState
from robot.interfaces.tutorials.proposed_interfaces.action import (
    NavigateAndGrab,
    NavigateAndGrab_Feedback,
    NavigateAndGrab_Goal,
    NavigateAndGrab_Result,
)
from robot.model.arm import MOUNT, OutOfReach, forward
from robot.nodes.skills import Skills, TaskFailed
from robot.nodes.task_feedback import CANCELED, TaskFeedback, Told
from robot.planning.grasp import Spot, approach, stands
from robot.planning.reach import GRASP_DISTANCE
from robot.scenes.objects import Look

GRAB = (("calibrate", 0.0), ("confirm", 5.0), ("navigate", 10.0), ("grab", 70.0))
CARRY = (("calibrate", 0.0), ("confirm", 3.0), ("navigate", 6.0), ("grab", 40.0), ("carry", 60.0), ("release", 90.0))


class Missed(Exception):
    """The gripper did not get the object."""


class Fetch(Node):
    """Serves navigate_and_grab and fetch_and_carry for the objects it knows, one at a time; a second goal is rejected while one runs.

    Parameters: tolerance, tries.
    """

    tolerance = parameter(
        1.0, unit="m", ge=0.1, le=10.0, description="Most distance of an object from where the goal expects it."
    )
    tries = parameter(3, ge=1, le=10, description="How often to stand and reach for an object.")

    def __init__(self, looks: Mapping[str, Look]) -> None:
        self._looks = looks

    async def on_start(self) -> None:
        self._skills = Skills(self)
        self._busy = ""
        self._lifted = False

    # -- inputs -------------------------------------------------------------------------------------------------------

    @POSE.on(qos=1)
    def pose(self, message: PoseStamped) -> None:
        if not is_pose(message.pose):
            return
        self._skills.pose = from_pose(message.pose)

    @GAIT_STATUS.on()
    def gait(self, message: GaitStatus) -> None:
        self._skills.gait, self._skills.height = message.mode, message.height

    @GRIPPER_STATE.on()
    def gripper(self, message: GripperState) -> None:
        self._skills.gripping = message.gripping

    # -- navigate_and_grab ---------------------------------------------------------------------------------------------------

    @NAVIGATE_AND_GRAB.accepts
    def check_grab(self, goal: NavigateAndGrab_Goal) -> None:
        self._check(goal.object_name, goal.target_pose)

    @NAVIGATE_AND_GRAB.serve()
    async def grab(self, goal: NavigateAndGrab_Goal) -> Steps[NavigateAndGrab_Feedback, NavigateAndGrab_Result]:
        target = from_pose(goal.target_pose.pose)
        story = TaskFeedback(GRAB, hypot(target.x - self._skills.here.x, target.y - self._skills.here.y))
        name = goal.object_name
        parts = (self._take(name, target, story),)
        async with aclosing(self._work("navigate_and_grab", NavigateAndGrab, name, parts, f"{name} grabbed")) as steps:
            async for step in steps:
                yield step

    # -- fetch_and_carry -----------------------------------------------------------------------------------------------------

    @FETCH_AND_CARRY.accepts
    def check_carry(self, goal: FetchAndCarry_Goal) -> None:
        self._check(goal.object_name, goal.target_pose)
        self._check(goal.object_name, goal.place_pose)

    @FETCH_AND_CARRY.serve()
    async def carry(self, goal: FetchAndCarry_Goal) -> Steps[FetchAndCarry_Feedback, FetchAndCarry_Result]:
        target, place = from_pose(goal.target_pose.pose), goal.place_pose.pose.position
        story = TaskFeedback(
            CARRY,
            hypot(target.x - self._skills.here.x, target.y - self._skills.here.y)
            + hypot(place.x - target.x, place.y - target.y),
        )

        name, spot = goal.object_name, Spot(place.x, place.y, place.z)
        parts = (self._take(name, target, story, spot), self._put(name, spot, story))
        done = f"{name} carried to ({place.x:.2f}, {place.y:.2f})"
        async with aclosing(self._work("fetch_and_carry", FetchAndCarry, name, parts, done)) as steps:
            async for step in steps:
                yield step

    async def _work(
        self, task: str, action: Any, name: str, parts: Sequence[AsyncGenerator[Told, None]], done: str
    ) -> AsyncGenerator[Any, None]:
        """Yield the parts as feedback of the action and then its result, which says `done` if all of them were."""

        def result(success: bool, message: str) -> Any:
            return action.Result(
                success=success, held_object=self._held(name), final_pose=self._final(), message=message
            )

        self._busy, self._lifted = task, False
        try:
            for part in parts:
                async with aclosing(part):
                    async for told in part:
                        yield action.Feedback(
                            stage=told.stage, distance_remaining=told.distance, progress_percent=told.percent
                        )
            yield Done(result(True, done))
        except TaskFailed as failure:
            await self._tidy()
            yield Aborted(result(False, str(failure)), str(failure))
        except asyncio.CancelledError:
            await self._let_go()
            yield Done(result(False, CANCELED))
        finally:
            self._busy = ""

    # -- the parts -----------------------------------------------------------------------------------------------------------

    async def _take(
        self, name: str, expected: Pose2, story: TaskFeedback, onward: Spot | None = None
    ) -> AsyncGenerator[Told, None]:
        """Until the object is in the gripper and the arm is stowed. With `onward`, the distance told includes the way from there to that place."""
        yield story.tell("calibrate")
        await self._skills.calibrate()
        yield story.tell("confirm")
        seen, said = await self._skills.look(name)
        if seen is None:
            raise TaskFailed("confirm", said)
        spot = self._skills.on_map(seen)
        off = hypot(spot.x - expected.x, spot.y - expected.y)
        if off > self.tolerance:
            raise TaskFailed("confirm", f"{name} was seen {off:.1f} m from where it was expected")
        failure, failed = TaskFailed("grab", "it was not tried"), list[Pose2]()
        for _ in range(self.tries):
            base, length = await self._base("navigate", spot, failed)
            more = 0.0 if onward is None else hypot(onward.x - base.x, onward.y - base.y)
            try:
                async with aclosing(self._skills.walk(base)) as steps:
                    async for left in steps:
                        yield story.tell("navigate", 1.0 - left / max(length, 0.1), left + more)
            except TaskFailed as error:
                failure = error
                failed.append(base)
                continue
            yield story.tell("grab", 0.0, more)
            try:
                await self._grasp(name, spot)
            except (OutOfReach, Missed) as error:
                failure = TaskFailed("grab", str(error))
                self.log.warning("standing elsewhere", why=str(error))
                await self._skills.stow()
                seen, _ = await self._skills.look(name)
                spot = spot if seen is None else self._skills.on_map(seen)
                continue
            yield story.tell("grab", 1.0, more)
            return
        raise failure

    async def _grasp(self, name: str, spot: Spot) -> None:
        """Take the object that is about at `spot` on the map. Raises `OutOfReach` or `Missed`, with the gripper open."""
        self._lifted = False
        await self._skills.grip(False)
        await self._skills.move(approach(await self._see(name, spot)).above)
        there = await self._see(name, spot)  # once more: the outstretched arm has tilted the body
        way = approach(there)
        x, y, z, _ = forward(await self._skills.move(way.at))
        off = dist((x + MOUNT[0], y + MOUNT[1], z + MOUNT[2]), there)
        if off > GRASP_DISTANCE:
            raise Missed(f"the tool stopped {100 * off:.1f} cm from {name}")
        if not await self._skills.grip(True):
            await self._skills.grip(False)
            await self._skills.move(way.above)
            raise Missed(f"the gripper closed on nothing where {name} was seen")
        self._lifted = True
        await self._skills.move(way.above)
        await self._skills.stow()
        if not self._skills.gripping:
            raise Missed(f"{name} was lost on the way")

    async def _put(self, name: str, place: Spot, story: TaskFeedback) -> AsyncGenerator[Told, None]:
        """Carry what is held to where it shall stand, and put it down."""
        middle = Spot(place.x, place.y, place.z + self._looks[name].height / 2)
        base, length = await self._base("carry", middle, [])
        async with aclosing(self._skills.walk(base)) as steps:
            async for left in steps:
                yield story.tell("carry", 1.0 - left / max(length, 0.1), left)
        if not self._skills.gripping:
            raise TaskFailed("carry", f"{name} was lost on the way")
        yield story.tell("release", 0.0, 0.0)
        try:
            await self._skills.move(approach(self._skills.in_base(middle)).above)
            way = approach(self._skills.in_base(middle))
            await self._skills.move(way.at)
        except OutOfReach as error:
            raise TaskFailed("release", str(error)) from error
        await self._skills.grip(False)
        self._lifted = False
        await self._skills.move(way.above)
        await self._skills.stow()
        yield story.tell("release", 1.0, 0.0)

    async def _see(self, name: str, spot: Spot) -> Spot:
        """Where the object is in base_link: as the camera sees it, or as it was seen from farther off."""
        seen, _ = await self._skills.look(name)
        return self._skills.in_base(spot) if seen is None else seen

    async def _base(self, stage: str, spot: Spot, failed: list[Pose2]) -> tuple[Pose2, float]:
        """Where to stand to reach a point on the map, and how far that is to walk, m."""
        for place in stands(spot, self._skills.here):
            if any(hypot(place.x - other.x, place.y - other.y) < 0.2 for other in failed):
                continue
            length = await self._skills.path_length(self._skills.here, place)
            if length is not None:
                return place, length
        raise TaskFailed(
            stage, f"there is no place to stand from which ({spot.x:.2f}, {spot.y:.2f}, {spot.z:.2f}) can be reached"
        )

    # -- beginning and end ---------------------------------------------------------------------------------------------------

    def _check(self, name: str, pose: PoseStamped) -> None:
        if name not in self._looks:
            raise Reject(f"there is no object called {name!r}; known are: {', '.join(self._looks) or 'none'}")
        if pose.header.frame_id not in ("map", ""):
            raise Reject(f"unknown frame {pose.header.frame_id!r}: give poses in frame 'map'")
        if self._busy:
            raise Reject(f"busy with {self._busy}")
        if self._skills.pose is None:
            raise Reject("the robot does not know where it is yet: try again when /pose is published")

    def _held(self, name: str) -> str:
        return name if self._skills.gripping else ""

    def _final(self) -> PoseStamped:
        return pose_stamped(self._skills.pose or Pose2(0.0, 0.0), self.clock.stamp())

    async def _tidy(self) -> None:
        """After a failure: nothing in the gripper but what has been lifted, and the arm out of the way."""
        await self._let_go()
        with suppress(TaskFailed):
            await self._skills.stow()

    async def _let_go(self) -> None:
        """After a failure or a cancel: open the gripper, unless that would drop what has been lifted."""
        if not self._lifted:
            with suppress(TaskFailed):
                await self._skills.grip(False)
