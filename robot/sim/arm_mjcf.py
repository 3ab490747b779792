"""The arm, and the things it may take, as MuJoCo's model text.

Lengths and limits are those of `robot.model.arm`. Masses are our choice, 6.2 kg in all, in the range of arms that quadrupeds of this
size carry; links collide with the world like the rest of the robot. Things collide with the world but not with the robot: what the gripper
has is welded to the hand.
"""

from __future__ import annotations

from robot.model.arm import FORE, JOINTS, LIMITS, MOUNT, TOOL, UPPER
from robot.scenes.scene import Box, Scene, Thing

TURRET_MASS, UPPER_MASS, FORE_MASS, HAND_MASS = 2.0, 2.0, 1.4, 0.8
"""kg."""
THING_MASS = 0.3
"""Of each thing, kg: a full cup."""
TORQUES = (90.0, 180.0, 90.0, 30.0)
"""Limits of the joint drives, N m."""
HAND, TOOL_SITE = "arm_hand", "arm_tool"


def thing_name(index: int) -> str:
    """The body of the scene's thing of this index."""
    return f"thing_{index}"


def arm_body() -> str:
    """The arm, to stand inside the robot's body."""
    x, y, z = MOUNT
    return f"""
      <body name="arm_turret" pos="{x} {y} {z}">
        {_joint(0, "0 0 1")}
        {_inertial(TURRET_MASS, 0.0, 0.05, 0.05)}
        <body name="arm_upper">
          {_joint(1, "0 1 0")}
          {_inertial(UPPER_MASS, UPPER / 2, 0.04, UPPER)}
          <geom type="capsule" size="0.04" fromto="0.04 0 0 {UPPER} 0 0"/>
          <body name="arm_fore" pos="{UPPER} 0 0">
            {_joint(2, "0 1 0")}
            {_inertial(FORE_MASS, 0.45 * FORE, 0.035, FORE)}
            <geom type="capsule" size="0.035" fromto="0 0 0 {FORE} 0 0"/>
            <body name="{HAND}" pos="{FORE} 0 0">
              {_joint(3, "0 1 0")}
              {_inertial(HAND_MASS, 0.08, 0.04, 0.16)}
              <geom type="capsule" size="0.03" fromto="0 0 0 {TOOL - 0.08} 0 0"/>
              <site name="{TOOL_SITE}" pos="{TOOL} 0 0"/>
            </body>
          </body>
        </body>
      </body>"""


def drives() -> str:
    """One actuator for each joint."""
    return "".join(
        f'<general class="drive" name="{joint}" joint="{joint}" forcerange="{-torque} {torque}"/>'
        for joint, torque in zip(JOINTS, TORQUES, strict=True)
    )


def thing_bodies(scene: Scene) -> str:
    """The scene's things, free to move."""
    return "".join(
        f'<body name="{thing_name(index)}" pos="{thing.shape.x} {thing.shape.y} {thing.z + thing.shape.height / 2}">'
        f'<freejoint/><geom name="{thing_name(index)}" contype="1" conaffinity="2" group="3" {_shape(thing)}/></body>'
        for index, thing in enumerate(scene.things)
    )


def welds(scene: Scene) -> str:
    """One weld between the hand and each thing, off until the gripper has it."""
    return "".join(
        f'<weld name="{thing_name(index)}" body1="{HAND}" body2="{thing_name(index)}" active="false" solref="0.01 1"/>'
        for index in range(len(scene.things))
    )


def _shape(thing: Thing) -> str:
    shape = thing.shape
    if isinstance(shape, Box):
        size, kind = f"{shape.length / 2} {shape.width / 2} {shape.height / 2}", "box"
    else:
        size, kind = f"{shape.radius} {shape.height / 2}", "cylinder"
    return f'type="{kind}" size="{size}" mass="{THING_MASS}"'


def _joint(number: int, axis: str) -> str:
    low, high = LIMITS[number]
    return f'<joint name="{JOINTS[number]}" axis="{axis}" range="{low} {high}" damping="1" armature="0.1"/>'


def _inertial(mass: float, along: float, radius: float, length: float) -> str:
    """A rod along x."""
    thin, long = mass * radius**2 / 2, mass * (length**2 / 12 + radius**2 / 4)
    return f'<inertial mass="{mass}" pos="{along} 0 0" diaginertia="{thin:.6g} {long:.6g} {long:.6g}"/>'
