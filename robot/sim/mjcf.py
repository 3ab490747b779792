"""The robot and its scene as MuJoCo's model text (MJCF), written from the robot's figures. No MuJoCo is needed to write it.

Link inertias are those of uniform boxes and rods of the same mass. Collision shapes: a box for the trunk with a landing skid
under it, capsules for thighs and calves, balls for the feet. Robot parts collide with the world, not with each other.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise
from math import cos, sin

from robot.geometry.vectors import Triple
from robot.hardware.body import JOINT_NAMES, LEGS
from robot.model.parameters import GRAVITY
from robot.model.robot import SPOT, RobotModel
from robot.scenes.scene import Box, Obstacle, Scene
from robot.scenes.terrain import Ramp
from robot.sim.arm_mjcf import arm_body, drives, thing_bodies, welds
from robot.sim.ground import Ground

SKID_GAP = 0.016
"""So much lower than it sits, m, the reference body rests on its landing skid when it has no power."""
FLOOR_GROUP, ROBOT_GROUP, OBSTACLE_GROUP = 0, 1, 2
"""Geometry groups: the floor, the robot's own parts, and the scene's obstacles and terrain, which the lidar sees."""


def obstacle_names(scene: Scene) -> tuple[str, ...]:
    """The name of every obstacle, in scene order: its kind and its index, such as ``box_0`` and ``cylinder_3``."""
    return tuple(f"{type(obstacle).__name__.lower()}_{index}" for index, obstacle in enumerate(scene.obstacles))


def walker_names(scene: Scene) -> tuple[str, ...]:
    """The name of every walker, such as ``walker_0``."""
    return tuple(f"walker_{index}" for index in range(len(scene.walkers)))


def terrain_names(scene: Scene) -> tuple[str, ...]:
    """The name of each piece of terrain, such as ``terrain_0``."""
    return tuple(f"terrain_{index}" for index in range(len(scene.terrain)))


def write_model(scene: Scene, ground: Ground, timestep: float, *, arm: bool = False, model: RobotModel = SPOT) -> str:
    """The MJCF text of the robot in `scene`, stepped at `timestep` seconds. With `arm`, the arm and the scene's things too, last of all."""
    length = model.length
    skid = _numbers((0.22 * length, 0.10 * length, 0.04 * length))
    return f"""<mujoco model="{scene.name}">
  <compiler angle="radian" autolimits="true"/>
  <option timestep="{timestep}" integrator="implicitfast" gravity="0 0 {-GRAVITY}" cone="elliptic" impratio="10">
    <flag eulerdamp="disable"/>
  </option>
  <default>
    <geom solref="0.005 1" condim="3" friction="{ground.friction} 0.005 0.0001"/>
    <joint damping="{model.damping}" armature="{model.armature}" frictionloss="{model.friction}"/>
    <default class="robot"><geom contype="1" conaffinity="2" group="{ROBOT_GROUP}" mass="0"/></default>
    <default class="scene"><geom contype="2" conaffinity="1"/></default>
    <default class="drive"><general gainprm="1" biastype="affine" biasprm="0 0 0" forcerange="-45 45"/></default>
  </default>
  <worldbody>
    {_floor(scene, ground)}
    {_obstacles(scene)}{_walkers(scene)}{_terrain(scene)}
    <body name="body" pos="0 0 0.486" childclass="robot">
      <freejoint name="body"/>
      {_inertial(model.body_mass, model.body_com, model.body_inertia)}
      <geom name="trunk" type="box" size="{_numbers(side / 2 for side in model.trunk)}"/>
      <geom name="skid" type="box" size="{skid}" pos="0 0 {(0.04 + SKID_GAP) * length - model.sit_height - model.foot_radius}"/>
      {_payload(ground)}
      <site name="imu"/>
      {"".join(_leg(leg, model) for leg in range(4))}{arm_body() if arm else ""}
    </body>{thing_bodies(scene) if arm else ""}
  </worldbody>
  <actuator>
    {"".join(f'<general class="drive" name="{name}" joint="{name}"/>' for name in JOINT_NAMES)}{drives() if arm else ""}
  </actuator>{f"<equality>{welds(scene)}</equality>" if arm else ""}
  <sensor>
    <accelerometer name="accelerometer" site="imu"/>
    {"".join(f'<touch name="{leg}_contact" site="{leg}_foot"/>' for leg in LEGS)}
  </sensor>
</mujoco>
"""


def _payload(ground: Ground) -> str:
    mass, (x, y) = ground.payload, ground.payload_at
    if mass <= 0.0:
        return ""
    size = (0.4, 0.2, 0.1)
    return f'<body name="payload" pos="{_numbers((x, y, 0.14))}">{_inertial(mass, (0.0, 0.0, 0.0), _box_inertia(mass, size))}</body>'


def _floor(scene: Scene, ground: Ground) -> str:
    x0, y0, x1, y1 = scene.bounds
    half = max(x1 - x0, y1 - y0) / 2 + 1.0
    if scene.pits:
        return _slabs(scene)
    normal = (-ground.slope[0], -ground.slope[1], 1.0)
    return f'<geom name="floor" class="scene" type="plane" size="{half} {half} 1" zaxis="{_numbers(normal)}"/>'


def _slabs(scene: Scene) -> str:
    """A floor of slabs about the pits, over a plane that is called the floor, too, and lies as deep as the deepest of them."""
    x0, y0, x1, y1 = scene.bounds
    deepest = max(pit.depth for pit in scene.pits)
    edges_x = sorted({x0 - 1.0, x1 + 1.0, *(pit.x + side * pit.length / 2 for pit in scene.pits for side in (-1, 1))})
    slabs = [f'<geom name="floor" class="scene" type="plane" size="0 0 1" pos="0 0 {-deepest - 0.5}"/>']
    for left, right in pairwise(edges_x):
        inside = [pit for pit in scene.pits if abs((left + right) / 2 - pit.x) < pit.length / 2]
        edges_y = sorted({y0 - 1.0, y1 + 1.0, *(pit.y + side * pit.width / 2 for pit in inside for side in (-1, 1))})
        for low, high in pairwise(edges_y):
            depth = next((pit.depth for pit in inside if abs((low + high) / 2 - pit.y) < pit.width / 2), 0.0)
            thick = (deepest + 0.5 - depth) / 2
            position = _numbers(((left + right) / 2, (low + high) / 2, -depth - thick))
            size = _numbers(((right - left) / 2, (high - low) / 2, thick))
            slabs.append(f'<geom name="slab_{len(slabs)}" class="scene" type="box" pos="{position}" size="{size}"/>')
    return "\n    ".join(slabs)


def _obstacles(scene: Scene) -> str:
    return "\n    ".join(
        f'<geom name="{name}" class="scene" group="{OBSTACLE_GROUP}" {_shape(obstacle)}/>'
        for name, obstacle in zip(obstacle_names(scene), scene.obstacles, strict=True)
    )


def _walkers(scene: Scene) -> str:
    """Bodies that are put where they are, whatever pushes them; theirs is a place on the floor."""
    return "".join(
        f'<body name="{name}" mocap="true"><geom name="{name}" class="scene" group="{OBSTACLE_GROUP}" '
        f"{_shape(replace(walker.shape, x=0.0, y=0.0))}/></body>"
        for name, walker in zip(walker_names(scene), scene.walkers, strict=True)
    )


def _terrain(scene: Scene) -> str:
    return "".join(
        f'<geom name="{name}" class="scene" group="{OBSTACLE_GROUP}" type="box" {_ground(piece)}/>'
        for name, piece in zip(terrain_names(scene), scene.terrain, strict=True)
    )


def _ground(piece: Ramp) -> str:
    """Turned about z, then about its own y."""
    middle, half = piece.box
    turn, rise = piece.yaw / 2, -piece.rise / 2
    quaternion = (cos(turn) * cos(rise), -sin(turn) * sin(rise), cos(turn) * sin(rise), sin(turn) * cos(rise))
    return f'pos="{_numbers(middle)}" size="{_numbers(half)}" quat="{_numbers(quaternion)}"'


def _shape(obstacle: Obstacle) -> str:
    position = _numbers((obstacle.x, obstacle.y, (obstacle.bottom + obstacle.height) / 2))
    half = (obstacle.height - obstacle.bottom) / 2
    if isinstance(obstacle, Box):
        size = _numbers((obstacle.length / 2, obstacle.width / 2, half))
        turn = _numbers((cos(obstacle.yaw / 2), 0.0, 0.0, sin(obstacle.yaw / 2)))
        return f'type="box" pos="{position}" size="{size}" quat="{turn}"'
    return f'type="cylinder" pos="{position}" size="{_numbers((obstacle.radius, half))}"'


def _leg(leg: int, model: RobotModel) -> str:
    name, side, (hip_x, hip_y), length = LEGS[leg], model.sides[leg], model.hips[leg], model.length
    hip_range, shoulder_range, knee_range = model.joint_limits[3 * leg : 3 * leg + 3]
    hip_com = (model.hip_com[0] if hip_x > 0 else -model.hip_com[0], model.hip_com[1] * side, model.hip_com[2])
    return f"""
      <body name="{name}_hip" pos="{hip_x} {hip_y} 0">
        <joint name="{name}_hip" axis="1 0 0" range="{_numbers(hip_range)}"/>
        {_inertial(model.hip_mass, hip_com, model.hip_inertia)}
        <body name="{name}_thigh" pos="0 {model.abduction * side} 0">
          <joint name="{name}_shoulder" axis="0 1 0" range="{_numbers(shoulder_range)}"/>
          {_inertial(model.thigh_mass, _beside(model.thigh_com, side), model.thigh_inertia)}
          <geom name="{name}_thigh" type="capsule" size="{0.04 * length}" fromto="0 0 0 0 0 {-model.thigh}"/>
          <body name="{name}_calf" pos="0 0 {-model.thigh}">
            <joint name="{name}_knee" axis="0 1 0" range="{_numbers(knee_range)}"/>
            {_inertial(model.calf_mass, _beside(model.calf_com, side), model.calf_inertia)}
            <geom type="capsule" size="{0.02 * length}" fromto="0 0 0 0 0 {0.03 * length - model.calf}"/>
            <geom name="{name}_foot" type="sphere" size="{model.foot_radius}" pos="0 0 {-model.calf}" priority="1"/>
            <site name="{name}_foot" type="sphere" size="{model.foot_radius + 0.01 * length}" pos="0 0 {-model.calf}"/>
          </body>
        </body>
      </body>"""


def _beside(centre: Triple, side: float) -> Triple:
    """The same on this side of the robot."""
    return (centre[0], centre[1] * side, centre[2])


def _inertial(mass: float, centre: tuple[float, float, float], inertia: tuple[float, float, float]) -> str:
    return f'<inertial mass="{mass:.6g}" pos="{_numbers(centre)}" diaginertia="{_numbers(inertia)}"/>'


def _box_inertia(mass: float, sides: tuple[float, float, float]) -> tuple[float, float, float]:
    a, b, c = (side * side * mass / 12 for side in sides)
    return (b + c, a + c, a + b)


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{value:.9g}" for value in values)
