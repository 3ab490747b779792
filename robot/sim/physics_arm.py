"""The arm in MuJoCo: four joint drives that chase a motion with torques, and a gripper that welds what it really has to the hand.

The drives know the arm's own weight (MuJoCo's bias force at its joints, as a drive with a model of its arm would compute it), not the
weight of what it holds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from robot.control.arm import Arm
from robot.geometry.vectors import Vector
from robot.hardware.arm import ArmState, GripperState
from robot.model.arm import JOINTS, STOWED
from robot.scenes.scene import Scene, Thing
from robot.sim.arm_mjcf import HAND, TOOL_SITE, TORQUES, thing_name
from robot.sim.gripper import Gripper
from robot.sim.simulation import SimulationArm
from robot.sim.things import Things

STIFFNESS = np.array([800.0, 1200.0, 600.0, 200.0])
"""N m/rad."""
DAMPING = np.array([50.0, 60.0, 24.0, 6.0])
"""N m s/rad."""


class PhysicsArm(SimulationArm):
    """In a model that was written with an arm. `now` is the body's time, s."""

    def __init__(self, mujoco: Any, model: Any, data: Any, scene: Scene, now: Callable[[], float]) -> None:
        self._mujoco, self._model, self._data, self._scene, self._now = mujoco, model, data, scene, now
        joint, first = model.joint(JOINTS[0]), model.actuator(JOINTS[0]).id
        at, dof = int(joint.qposadr[0]), int(joint.dofadr[0])
        self._position: Vector = data.qpos[at : at + 4]
        self._velocity: Vector = data.qvel[dof : dof + 4]
        self._weight: Vector = data.qfrc_bias[dof : dof + 4]
        self._control: Vector = data.ctrl[first : first + 4]
        self._torque: Vector = data.actuator_force[first : first + 4]
        model.actuator_biasprm[first : first + 4, 1] = -STIFFNESS
        model.actuator_biasprm[first : first + 4, 2] = -DAMPING
        model.actuator_forcerange[first : first + 4] = np.column_stack((-np.array(TORQUES), TORQUES))
        self._tip: Vector = data.site_xpos[model.site(TOOL_SITE).id]
        self._hand = int(model.body(HAND).id)
        count = len(scene.things)
        self._bodies = [int(model.body(thing_name(index)).id) for index in range(count)]
        self._welds = [int(model.equality(thing_name(index)).id) for index in range(count)]
        self.geoms = frozenset(int(model.geom(thing_name(index)).id) for index in range(count))
        """The things' geometries, which are no part of the robot."""
        self._arm, self._gripper = Arm(), Gripper()
        self._held: int | None = None

    def __repr__(self) -> str:
        angles = ", ".join(f"{angle:.2f}" for angle in self._position)
        return f"<PhysicsArm at ({angles}) rad, holding {self.held}>"

    def move(self, target: Sequence[float]) -> float:
        """Begin a motion; the drives chase it."""
        return self._arm.move(target, self._now())

    def stop(self) -> float:
        """Brake within limits."""
        return self._arm.cancel(self._now())

    def state(self) -> ArmState:
        """The true joints; whether a motion lasts and how far it is, are the reference's."""
        return replace(self._arm.at(self._now()), position=self._position.copy(), velocity=self._velocity.copy())

    def grip(self, closing: bool) -> None:
        """Close or open the gripper."""
        self._gripper.tell(closing)
        if self._held is not None and not self._gripper.gripping:
            self._data.eq_active[self._welds[self._held]] = 0
            self._held = None

    @property
    def gripper(self) -> GripperState:
        return self._gripper.state

    @property
    def held(self) -> str | None:
        return None if self._held is None else self._scene.things[self._held].name

    @property
    def power(self) -> float:
        """Mechanical power of the joint drives that does work, W."""
        return float(np.maximum(self._torque * self._velocity, 0.0).sum())

    def things(self) -> tuple[Thing, ...]:
        """The scene's things, where they are now; a tilt is not told."""
        return self._places().all

    def drive(self) -> None:
        """Torques for the physics step that follows: those that hold the arm's weight, and a stiff spring to where it should be."""
        wanted = self._arm.at(self._now())
        self._control[:] = self._weight + STIFFNESS * wanted.position + DAMPING * wanted.velocity

    def step(self, seconds: float) -> None:
        """After a physics step: the gripper, which gets a thing only if the tool's tip is really there."""
        if not self._gripper.moving:
            return
        places = self._places()
        index = places.near(self._tip) if self._gripper.state.closing else None
        self._gripper.step(seconds, None if index is None else places[index].thickness)
        if index is not None and self._gripper.gripping:
            self._weld(index)

    def reset(self) -> None:
        """Stowed and empty. The caller has put all things back."""
        self._arm, self._gripper, self._held = Arm(), Gripper(), None
        self._position[:] = STOWED
        self._control[:] = STIFFNESS * self._position

    def _places(self) -> Things:
        places = Things(self._scene)
        for index, body in enumerate(self._bodies):
            places.put(index, self._data.xpos[body])
        return places

    def _weld(self, index: int) -> None:
        """Fix a thing to the hand just as it is now."""
        data, body, weld = self._data, self._bodies[index], self._welds[index]
        back, turn, offset = np.zeros(4), np.zeros(4), np.zeros(3)
        self._mujoco.mju_negQuat(back, data.xquat[self._hand])
        self._mujoco.mju_mulQuat(turn, back, data.xquat[body])
        self._mujoco.mju_rotVecQuat(offset, data.xpos[body] - data.xpos[self._hand], back)
        row = self._model.eq_data[weld]
        row[:3], row[3:6], row[6:10] = 0.0, offset, turn
        data.eq_active[weld] = 1
        self._held = index
