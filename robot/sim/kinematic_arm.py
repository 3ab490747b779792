"""The arm of the body without forces: its joints are exactly where their motion says, and what it grips moves with the tool's tip."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from robot.control.arm import Arm
from robot.geometry.vectors import Vector
from robot.hardware.arm import ArmState, GripperState
from robot.scenes.scene import Scene, Thing
from robot.sim.gripper import Gripper
from robot.sim.simulation import SimulationArm
from robot.sim.things import Things, centre, tool_point


class KinematicArm(SimulationArm):
    """`now` is the body's time, s; `pose` its position and quaternion in the world."""

    def __init__(self, scene: Scene, now: Callable[[], float], pose: Callable[[], tuple[Vector, Vector]]) -> None:
        self._scene, self._now, self._pose = scene, now, pose
        self._arm, self._gripper, self._things = Arm(), Gripper(), Things(scene)
        self._held: int | None = None
        self._offset: Vector = np.zeros(3)

    def __repr__(self) -> str:
        angles = ", ".join(f"{angle:.2f}" for angle in self.state().position)
        return f"<KinematicArm at ({angles}) rad, holding {self.held}>"

    def move(self, target: Sequence[float]) -> float:
        """Begin a motion."""
        return self._arm.move(target, self._now())

    def stop(self) -> float:
        """Brake within limits."""
        return self._arm.cancel(self._now())

    def state(self) -> ArmState:
        """Exact."""
        return self._arm.at(self._now())

    def grip(self, closing: bool) -> None:
        """Close or open the gripper. What is let go falls upright onto what is below it."""
        self._gripper.tell(closing)
        if self._held is not None and not self._gripper.gripping:
            self._things.put(self._held, self._tip() - self._offset)
            self._things.drop(self._held)
            self._held = None

    @property
    def gripper(self) -> GripperState:
        return self._gripper.state

    @property
    def held(self) -> str | None:
        return None if self._held is None else self._things[self._held].name

    def things(self) -> tuple[Thing, ...]:
        """The scene's things, where they are now."""
        if self._held is not None:
            self._things.put(self._held, self._tip() - self._offset)
        return self._things.all

    def step(self, seconds: float) -> None:
        """Let time pass for the gripper; the joints need none."""
        if not self._gripper.moving:
            return
        index = self._things.near(self._tip()) if self._gripper.state.closing else None
        self._gripper.step(seconds, None if index is None else self._things[index].thickness)
        if index is not None and self._gripper.gripping:
            self._held, self._offset = index, self._tip() - centre(self._things[index])

    def reset(self) -> None:
        """Stowed, empty, and all things back in their places."""
        self._arm, self._gripper, self._things = Arm(), Gripper(), Things(self._scene)
        self._held = None

    def _tip(self) -> Vector:
        position, quaternion = self._pose()
        return tool_point(position, quaternion, self.state().position)
