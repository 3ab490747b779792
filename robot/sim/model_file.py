"""A robot's figures from its MJCF or URDF file: the names, order, signs and zero angles of its joints are the file's.

MuJoCo reads the file; meshes are left out, as no figure comes from them. What is found is brought into this package's convention: angles zero with
the leg straight down, hip about +x, shoulder and knee about +y, and the body's origin in the plane of the hips. What a file does not tell is that
of the reference body, scaled. Joints that are not the legs', as those of an arm, are held where they are, and belong to the trunk.
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from math import atan2, cos, hypot, inf, pi, sqrt, tau
from pathlib import Path
from typing import Any, Final

import numpy as np

from actors.suggest import did_you_mean
from robot.control.command import CommandLimits
from robot.control.gaits import gaits_of
from robot.control.walk_config import WalkConfig
from robot.geometry.vectors import Triple, Vector
from robot.model.bodies import BODIES
from robot.model.parameters import GRAVITY
from robot.model.robot import SPOT, ModelError, Pair, RobotModel
from robot.sim.model_text import LEAST_MASS, NOTHING, model_text

ALIKE: Final = 0.01
"""Legs differ by no more than this, m, in a robot whose legs are alike."""
ALONG: Final = 0.98
"""Cosine of the angle by which a joint's axis may be off its direction."""
FOLDED: Final = 0.02
"""How far from the knee's limit the sitting pose stays, rad."""
STRAIGHT: Final = 3.0
"""A knee bends no farther than this, rad, whatever its file says: the calf would lie in the thigh."""
FAT: Final = 0.5
"""A shape that is rounder than this share of the calf's length is no foot."""
TALLEST: Final = 1.5
"""So many times as tall as the reference body's, for its legs, a trunk is at most: it must fit between the legs of a robot that sits."""
KNEE: Final = 0.045
"""Radius of the reference body's knee with some room, m."""
SAME: Final = 0.01
"""Limits that differ by less, rad, are the same."""
JOINTS: Final = ("hip", "shoulder", "knee")
SHORT: Final = 0.5
"""A foot is at least this share of the thigh's length away from the knee."""
STRENGTHS: Final = (0.05, 2.0)
"""Torque limits below and above these shares of the robot's weight times its leg are placeholders; those of robots are at 0.2 to 0.8."""
LIGHTEST: Final = 0.01
"""Of the links of a leg, kg: one without any mass cannot be moved."""
UNTOLD: Final = 1e-3
"""Radius of gyration, m, below which an inertia is a placeholder, as it is beyond the size of what it is of."""

_Chain = tuple[int, int, int]
"""The joints of one leg: hip, shoulder and knee."""


class NoFoot(ModelError):
    """A leg has nothing at its end."""


@dataclass(frozen=True)
class _Leg:
    """One leg as the file has it, at the pose in which ours is straight down; places in the trunk's frame."""

    name: str
    hip: Vector
    shoulder: Vector
    knee: Vector
    foot: Vector
    radius: float
    limits: tuple[Pair, Pair, Pair]
    torque: tuple[float | None, float | None, float | None]
    """None where the file has none."""
    links: tuple[tuple[float, Vector, Triple], ...]
    """Of hip, thigh and calf: mass, centre, and inertia about it along the body's axes."""
    dof: int

    @property
    def thigh(self) -> float:
        """Shoulder to knee in the leg's plane, m."""
        return float(self.shoulder[2] - self.knee[2])

    @property
    def calf(self) -> float:
        """Knee to foot in the leg's plane, m."""
        return float(self.knee[2] - self.foot[2])


def read_model(path: str | Path) -> RobotModel:
    """The robot that an MJCF or URDF file describes. Needs MuJoCo.

    Raises `ModelError`, which names the file and the element, for a file that cannot be read, or whose robot does not have four legs alike with
    hip, shoulder and knee each.
    """
    file = Path(path)
    mujoco: Any = import_module("mujoco")
    try:
        return _read(mujoco, file, meshes=False)
    except NoFoot:  # perhaps its feet are nothing but meshes
        return _read(mujoco, file, meshes=True)


def _read(mujoco: Any, file: Path, *, meshes: bool) -> RobotModel:
    try:
        text, numbers = model_text(file, meshes=meshes)
        model = mujoco.MjModel.from_xml_string(text)
    except ModelError:
        raise
    except ValueError as error:
        raise ModelError(f"{file}: {' '.join(str(error).split())}") from None
    try:
        return _tuned(_Reader(mujoco, model, file.stem).robot(), numbers)
    except ModelError as error:
        raise type(error)(f"{file}: {error}") from None


def _tuned(robot: RobotModel, numbers: Mapping[str, tuple[float, ...]]) -> RobotModel:
    """The robot with the numbers that its file sets. Raises `ModelError`, which names an unknown one."""
    for name, values in numbers.items():
        value = values[0] if len(values) == 1 else values
        figure = name.removeprefix("robot.")
        changes: dict[str, Any] = {figure: value}
        try:
            if figure != name:
                if not isinstance(getattr(robot, figure, None), float):
                    raise TypeError(figure)
                robot = replace(robot, **changes)
            else:
                robot = replace(robot, tuning=(*robot.tuning, (name, value)))
                _ = WalkConfig.of(robot), CommandLimits.usual(robot), gaits_of(robot)  # each refuses what it cannot use
        except (TypeError, ValueError) as error:
            why = str(error) if isinstance(error, ModelError) else "there is no such number, or it cannot be this"
            raise ModelError(f"numeric {name!r}: {why}") from None
    return robot


def find_model(text: str) -> RobotModel:
    """A robot that comes with the package, by its name, or the one of a file. Raises `ModelError` for what is neither, and as `read_model` does."""
    if text in BODIES:
        return BODIES[text]
    if Path(text).suffix.lower() in (".xml", ".urdf", ".mjcf", ".xacro"):
        return read_model(text)
    hint = did_you_mean(text, BODIES, quoted=False) or f"; there are {', '.join(BODIES)}."
    raise ModelError(f"no robot is called {text!r}{hint} Or give a file (.xml or .urdf)")


class _Reader:
    """Takes the figures out of a compiled model."""

    def __init__(self, mujoco: Any, model: Any, name: str) -> None:
        self._mujoco, self._model, self._name = mujoco, model, name
        self._data = mujoco.MjData(model)
        self._hinge = int(mujoco.mjtJoint.mjJNT_HINGE)

    def robot(self) -> RobotModel:
        """The whole robot."""
        chains = self._chains()
        self._trunk = self._common([self._body(hip) for hip, _, _ in chains])
        self._straighten(chains)
        found = [self._leg(chain) for chain in chains]
        middle = np.mean([leg.hip for leg in found], axis=0)
        corners = [np.sign((leg.hip[0] - middle[0], leg.foot[1] - middle[1])) for leg in found]
        order = sorted(range(4), key=lambda leg: (-corners[leg][0], -corners[leg][1]))
        legs, signs = [found[leg] for leg in order], [tuple(corners[leg].tolist()) for leg in order]
        if signs != [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]:
            raise ModelError(
                f"legs {', '.join(leg.name for leg in legs)}: they do not stand one at each corner of the body"
            )
        return self._figures(legs, {self._body(hip) for hip, _, _ in chains})

    def _chains(self) -> list[_Chain]:
        """The joints of each leg, from hip to knee."""
        model = self._model
        hinges = [joint for joint in range(model.njnt) if model.jnt_type[joint] == self._hinge]
        last: dict[int, int] = {}
        above: dict[int, int] = {}
        for joint in hinges:
            body = self._body(joint)
            while body and body not in last:
                body = int(model.body_parentid[body])
            if body:
                above[joint] = last[body]
            last[self._body(joint)] = joint
        legs: list[_Chain] = []
        others: list[int] = []
        for knee in sorted(set(hinges) - set(above.values())):
            shoulder = above.get(knee)
            hip = above.get(shoulder) if shoulder is not None else None
            if shoulder is None or hip is None or hip in above or list(above.values()).count(hip) > 1:
                others.append(knee)
            else:
                legs.append((hip, shoulder, knee))
        if len(legs) != 4:
            if others:
                raise ModelError(
                    f"joint {self._joint(others[0])!r}: it does not end a leg of three joints, hip, shoulder and knee"
                )
            raise ModelError(f"it has {len(legs)} legs and {len(hinges)} joints that turn: a quadruped has 4 and 12")
        return legs

    def _common(self, hips: Sequence[int]) -> int:
        """The body that all legs hang on."""
        lines: list[list[int]] = []
        for body in hips:
            line: list[int] = []
            while body:
                body = int(self._model.body_parentid[body])
                line.append(body)
            lines.append(line[::-1])
        return max(int(same[0]) for same in zip(*lines, strict=False) if len(set(same)) == 1)

    def _straighten(self, chains: Sequence[_Chain]) -> None:
        """Turn the trunk level, and each leg straight down: there all of our angles are zero."""
        self._data.qpos[:] = self._model.qpos0  # not zero: where a file has `ref`, that is a pose that it does not draw
        self._mujoco.mj_forward(self._model, self._data)
        self._turn(chains)
        for chain in chains:
            hip, shoulder, knee = chain
            self._check_axis(hip, 0)
            _, y, z = self._data.xaxis[shoulder]
            if hypot(y, z) > 1.0 - ALONG:  # the leg's plane is upright
                self._bend(hip, (atan2(z, y) + pi / 2) % pi - pi / 2, 0)
            self._check_axis(shoulder, 1)
            self._check_axis(knee, 1)
            for joint, end in ((shoulder, self._anchor(knee)), (knee, None)):
                x, _, z = (end if end is not None else self._foot(chain)[0]) - self._anchor(joint)
                self._bend(joint, atan2(-x, -z), 1)  # the angle about y by which the link hangs ahead of straight down

    def _turn(self, chains: Sequence[_Chain]) -> None:
        """Turn the whole robot so that its hips turn about x, its shoulders about y, and its legs are below: a file may have other axes."""
        model, data = self._model, self._data
        trunk = data.xmat[self._trunk].reshape(3, 3)
        axes = [np.abs(trunk.T @ data.xaxis[[chain[joint] for chain in chains]].T).sum(axis=1) for joint in (0, 1)]
        ahead = int(np.argmax(axes[0]))
        aside = int(np.argmax([0.0 if axis == ahead else share for axis, share in enumerate(axes[1])]))
        up = np.zeros(3)
        up[3 - ahead - aside] = 1.0
        down = trunk.T @ sum((self._foot(chain)[0] - self._anchor(chain[1]) for chain in chains), np.zeros(3))
        if up @ down > ALIKE:
            up = -up
        forward = np.eye(3)[ahead]
        level = np.array((forward, np.cross(up, forward), up))
        top = int(model.body_rootid[self._trunk])
        turned = level @ trunk.T @ data.xmat[top].reshape(3, 3)
        quaternion = np.zeros(4)
        self._mujoco.mju_mat2Quat(quaternion, turned.flatten())
        free = int(model.body_jntadr[top])
        if free >= 0 and model.jnt_type[free] == self._mujoco.mjtJoint.mjJNT_FREE:
            start = int(model.jnt_qposadr[free]) + 3
            data.qpos[start : start + 4] = quaternion
        else:
            model.body_quat[top] = quaternion
        self._mujoco.mj_forward(model, data)

    def _bend(self, joint: int, angle: float, axis: int) -> None:
        """Take so much from an angle about x or y."""
        self._data.qpos[self._model.jnt_qposadr[joint]] -= angle * self._sign(joint, axis)
        self._mujoco.mj_forward(self._model, self._data)

    def _check_axis(self, joint: int, axis: int) -> None:
        if abs(self._data.xaxis[joint][axis]) < ALONG:
            raise ModelError(f"joint {self._joint(joint)!r}: it does not turn about {'xy'[axis]}")

    def _leg(self, chain: _Chain) -> _Leg:
        foot, radius = self._foot(chain)
        trunk = self._data.xpos[self._trunk]
        hip, shoulder, knee = (self._anchor(joint) - trunk for joint in chain)
        side = float(np.sign((foot - trunk)[1]))
        hip_low, hip_high = self._limits(chain[0], 0) or SPOT.hip_limits
        bodies = [self._body(joint) for joint in chain]
        ends = [{bodies[1]}, {bodies[2]}, set[int]()]
        return _Leg(
            name=self._joint(chain[0]),
            hip=hip,
            shoulder=shoulder,
            knee=knee,
            foot=foot - trunk,
            radius=radius,
            limits=(
                (hip_low, hip_high) if side > 0.0 else (-hip_high, -hip_low),
                self._limits(chain[1], 1) or SPOT.shoulder_limits,
                _bent(self._limits(chain[2], 1) or SPOT.knee_limits),
            ),
            torque=(self._torque(chain[0]), self._torque(chain[1]), self._torque(chain[2])),
            links=tuple(self._link(body, end) for body, end in zip(bodies, ends, strict=True)),
            dof=int(self._model.jnt_dofadr[chain[0]]),
        )

    def _figures(self, legs: Sequence[_Leg], hips: set[int]) -> RobotModel:
        _check_alike(legs)
        front = legs[0]
        thigh, calf = front.thigh, front.calf
        middle = np.mean([(leg.shoulder[0], leg.hip[1], leg.shoulder[2]) for leg in legs], axis=0)
        places = [(float(leg.shoulder[0] - middle[0]), float(leg.hip[1] - middle[1])) for leg in legs]
        mass, centre, inertia = self._trunk_mass(hips)
        links = [self._alike(legs, index) for index in range(3)]
        length = (thigh + calf) / SPOT.leg
        whole = mass + 4 * sum(link[0] for link in links)
        force = whole / SPOT.mass
        damping, armature, friction = (
            float(told[front.dof])
            for told in (self._model.dof_damping, self._model.dof_armature, self._model.dof_frictionloss)
        )
        shoulders, rear_shoulders = _front_and_rear(legs, 1)
        knees, rear_knees = _front_and_rear(legs, 2)
        weak, strong, known = _strength(legs, whole)
        trunk = self._box(hips, legs, length)
        hip_inertia, thigh_inertia, calf_inertia = _inertias(links, thigh + calf)
        return RobotModel(
            name=self._name,
            thigh=thigh,
            calf=calf,
            abduction=float(np.mean([abs(leg.foot[1] - leg.hip[1]) for leg in legs])),
            foot_radius=front.radius or SPOT.foot_radius * length,
            hips=(places[0], places[1], places[2], places[3]),
            stand_height=SPOT.stand_height * length,
            sit_height=max(
                SPOT.sit_height * length,
                *(_folded(thigh, calf, pair) for pair in (knees, rear_knees or knees)),
                _kneeling(thigh, calf, KNEE * length - (front.radius or SPOT.foot_radius * length)),
            ),
            hip_limits=_within(legs, 0),
            shoulder_limits=shoulders,
            shoulder_rear_limits=rear_shoulders,
            knee_limits=knees,
            knee_rear_limits=rear_knees,
            mass=whole,
            hip_mass=links[0][0],
            thigh_mass=links[1][0],
            calf_mass=links[2][0],
            hip_com=links[0][1],
            thigh_com=links[1][1],
            calf_com=links[2][1],
            body_com=_triple(centre - middle),
            body_inertia=inertia
            if _can_be(inertia, mass, places[0][0] - places[2][0] + thigh)
            else _of_box(mass, trunk),
            hip_inertia=hip_inertia,
            thigh_inertia=thigh_inertia,
            calf_inertia=calf_inertia,
            trunk=trunk,
            torque_limit=weak,
            knee_torque=((-max(abs(end) for end in knees), strong), (-min(abs(end) for end in knees), strong)),
            damping=damping or SPOT.damping * force * length**1.5,
            armature=armature or SPOT.armature * force * length**2,
            friction=friction or SPOT.friction * force * length,
            assumed=() if known else ("torque limits",),
        )

    def _trunk_mass(self, hips: set[int]) -> tuple[float, Vector, Triple]:
        """Of all that is not the legs'."""
        top = int(self._model.body_rootid[self._trunk])
        if not top:
            raise ModelError("its legs hang on the world: give it a trunk, a body that can move")
        mass, centre, inertia = self._link(top, hips)
        if mass <= NOTHING:
            raise ModelError(f"body {self._model.body(top).name!r}: it has no mass (<inertial>)")
        return mass, centre, inertia

    def _alike(self, legs: Sequence[_Leg], index: int) -> tuple[float, Triple, Triple]:
        """Mass, centre and inertia of one link of a leg, the mean of all four mirrored to the front left."""
        masses: list[float] = []
        centres: list[Vector] = []
        inertias: list[Triple] = []
        for leg in legs:
            mass, centre, inertia = leg.links[index]
            plane = leg.foot[1]
            origin = np.array(
                (
                    (leg.shoulder[0], leg.hip[1], leg.hip[2]),
                    (leg.shoulder[0], plane, leg.shoulder[2]),
                    (leg.knee[0], plane, leg.knee[2]),
                )[index]
            )
            mirror = np.array((np.sign(leg.hip[0]) if index == 0 else 1.0, np.sign(leg.foot[1]), 1.0))
            masses.append(mass)
            centres.append((centre - origin) * mirror)
            inertias.append(inertia)
        return (
            max(LIGHTEST, float(np.mean(masses))),
            _triple(np.mean(centres, axis=0)),
            _triple(np.mean(inertias, axis=0)),
        )

    def _members(self, body: int, ends: Container[int] = ()) -> list[int]:
        """A body with all that hangs on it, but not the `ends`."""
        members = [body]
        for other in range(body + 1, self._model.nbody):
            if int(self._model.body_parentid[other]) in members and other not in ends:
                members.append(other)
        return members

    def _link(self, body: int, ends: set[int]) -> tuple[float, Vector, Triple]:
        """Mass, centre from the trunk's origin, and inertia about it of a body with all that is fixed to it, but not the `ends`."""
        model, data = self._model, self._data
        members = self._members(body, ends)
        mass = max(LEAST_MASS, float(sum(model.body_mass[one] for one in members)))
        middle = sum((model.body_mass[one] * data.xipos[one] for one in members), np.zeros(3)) / mass
        whole = np.zeros((3, 3))
        for one in members:
            turn, arm = data.ximat[one].reshape(3, 3), data.xipos[one] - middle
            whole += turn @ np.diag(model.body_inertia[one]) @ turn.T
            whole += model.body_mass[one] * (arm.dot(arm) * np.eye(3) - np.outer(arm, arm))
        return mass, middle - data.xpos[self._trunk], _triple(np.diag(whole))

    def _foot(self, chain: _Chain) -> tuple[Vector, float]:
        """Centre and radius of the foot: the ball at the end of a leg, the round end of another shape, or the last body or site on the calf, whose
        radius is not known, and 0.
        """
        model, data, knee = self._model, self._data, self._anchor(chain[2])
        calf = self._members(self._body(chain[2]))
        kinds = self._mujoco.mjtGeom
        shapes = [geom for geom in range(model.ngeom) if model.geom_bodyid[geom] in calf]
        solid = [geom for geom in shapes if model.geom_contype[geom] or model.geom_conaffinity[geom]] or shapes
        ends: list[tuple[float, Vector, float]] = []
        marks = [data.site_xpos[site] for site in range(model.nsite) if model.site_bodyid[site] in calf]
        balls = [geom for geom in solid if model.geom_type[geom] == kinds.mjGEOM_SPHERE]
        for geom in balls or solid:
            size, turn = model.geom_size[geom], data.geom_xmat[geom].reshape(3, 3)
            radius, half = float(size[0]), 0.0
            if model.geom_type[geom] == kinds.mjGEOM_CAPSULE:
                half = float(size[1])
            elif model.geom_type[geom] == kinds.mjGEOM_CYLINDER:
                half = max(0.0, float(size[1]) - radius)
            elif model.geom_type[geom] in (kinds.mjGEOM_BOX, kinds.mjGEOM_ELLIPSOID):
                radius = float(size.min())
                turn = turn[:, [0, 1, int(np.argmax(size))]]
                half = float(size.max()) - radius
            elif model.geom_type[geom] == kinds.mjGEOM_MESH:
                marks.append(self._tip(geom, knee))
                continue
            elif not balls and model.geom_type[geom] != kinds.mjGEOM_SPHERE:
                continue
            for way in (-1.0, 1.0):
                place = data.geom_xpos[geom] + way * half * turn[:, 2]
                ends.append((float(np.linalg.norm(place - knee)) + radius, place, radius))
        last = max([*marks, *data.xpos[calf]], key=lambda place: float(np.linalg.norm(place - knee)))
        away, place, radius = max(ends, key=lambda end: end[0], default=(0.0, last, 0.0))
        slim = radius < FAT * float(np.linalg.norm(place - knee))
        if balls or (slim and away > float(np.linalg.norm(last - knee))):
            return place.copy(), radius
        if np.linalg.norm(last - knee) < SHORT * np.linalg.norm(knee - self._anchor(chain[1])):
            raise NoFoot(
                f"body {model.body(calf[0]).name!r}: nothing at its end is its foot: no ball (a sphere for collisions), no other body and no site"
            )
        return last.copy(), 0.0

    def _tip(self, geom: int, knee: Vector) -> Vector:
        """The middle of a ball as large as the reference body's foot at the point of a mesh that is farthest from the knee."""
        model, mesh = self._model, int(self._model.geom_dataid[geom])
        start, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        points = model.mesh_vert[start : start + count] @ self._data.geom_xmat[geom].reshape(3, 3).T
        arms = points + self._data.geom_xpos[geom] - knee
        lengths = np.linalg.norm(arms, axis=1)
        farthest = int(np.argmax(lengths))
        share = SPOT.foot_radius / (SPOT.calf + SPOT.foot_radius)
        return np.asarray(knee + (1.0 - share) * arms[farthest], dtype=np.float64)

    def _limits(self, joint: int, axis: int) -> Pair | None:
        """Lowest and highest of our angle; None if the joint turns freely."""
        model = self._model
        low, high = (float(end) for end in model.jnt_range[joint])
        if not model.jnt_limited[joint] or high - low >= tau:
            return None
        zero, sign = float(self._data.qpos[model.jnt_qposadr[joint]]), self._sign(joint, axis)
        low, high = sorted(sign * (end - zero) for end in (low, high))
        away = tau * round((low + high) / 2 / tau)  # a zero that is a turn away
        return low - away, high - away

    def _torque(self, joint: int) -> float | None:
        """The largest torque of a joint's motor, N m; None if it is not told."""
        model = self._model
        if model.jnt_actfrclimited[joint]:
            return float(model.jnt_actfrcrange[joint][1]) or None
        for motor in range(model.nu):
            if int(model.actuator_trnid[motor][0]) == joint:
                gear = abs(float(model.actuator_gear[motor][0]))
                if model.actuator_forcelimited[motor]:
                    return gear * float(model.actuator_forcerange[motor][1]) or None
                torque = model.actuator_biastype[motor] == self._mujoco.mjtBias.mjBIAS_NONE
                if model.actuator_ctrllimited[motor] and torque:  # what a servo is told is an angle
                    return gear * float(model.actuator_gainprm[motor][0] * model.actuator_ctrlrange[motor][1]) or None
        return None

    def _box(self, hips: set[int], legs: Sequence[_Leg], length: float) -> Triple:
        """The trunk's largest box; without one, what lies between the hips."""
        model = self._model
        box = int(self._mujoco.mjtGeom.mjGEOM_BOX)
        members = self._members(int(model.body_rootid[self._trunk]), hips)
        sizes: list[Vector] = [
            np.abs(self._data.geom_xmat[geom].reshape(3, 3)) @ model.geom_size[geom]
            for geom in range(model.ngeom)
            if model.geom_bodyid[geom] in members and model.geom_type[geom] == box
        ]
        apart, across = (float(np.ptp([leg.hip[axis] for leg in legs])) for axis in (0, 1))
        largest = max(sizes, key=lambda size: float(size.prod()), default=np.zeros(3))
        if 4.0 * largest[0] > apart:
            deep, wide, high = _triple(2 * largest)
        else:
            deep, wide, high = apart, across, SPOT.trunk[2] * hypot(apart, across) / hypot(*SPOT.trunk[:2])
        return deep, wide, min(high, SPOT.trunk[2] * TALLEST * length)

    def _body(self, joint: int) -> int:
        return int(self._model.jnt_bodyid[joint])

    def _anchor(self, joint: int) -> Vector:
        return np.array(self._data.xanchor[joint])

    def _sign(self, joint: int, axis: int) -> float:
        return float(np.sign(self._data.xaxis[joint][axis]))

    def _joint(self, joint: int) -> str:
        return str(self._model.joint(joint).name)


def _check_alike(legs: Sequence[_Leg]) -> None:
    front = legs[0]
    for leg in legs[1:]:
        for what, mine, theirs in (
            ("thigh", leg.thigh, front.thigh),
            ("calf", leg.calf, front.calf),
            ("hip", abs(leg.foot[1] - leg.hip[1]), abs(front.foot[1] - front.hip[1])),
            ("hip's height", leg.hip[2], front.hip[2]),
        ):
            if abs(mine - theirs) > ALIKE:
                raise ModelError(f"legs of {front.name!r} and {leg.name!r}: the {what} differs; legs must be alike")


def _strength(legs: Sequence[_Leg], mass: float) -> tuple[float, float, bool]:
    """The torque limits of hip and shoulder and of the knee, N m, and whether the file tells them."""
    leg = legs[0].thigh + legs[0].calf
    torque = [min((one.torque[joint] or inf) for one in legs) for joint in range(3)]
    least, most = (share * mass * GRAVITY * leg for share in STRENGTHS)
    if all(least < one < most for one in torque):
        return min(torque[:2]), torque[2], True
    scale = mass / SPOT.mass * leg / SPOT.leg
    return SPOT.torque_limit * scale, max(one for _, one in SPOT.knee_torque) * scale, False


def _inertias(links: Sequence[tuple[float, Triple, Triple]], leg: float) -> tuple[Triple, Triple, Triple]:
    """Of hip, thigh and calf; instead of what cannot be, the reference body's for such a mass and leg."""
    usual = (
        (SPOT.hip_mass, SPOT.hip_inertia),
        (SPOT.thigh_mass, SPOT.thigh_inertia),
        (SPOT.calf_mass, SPOT.calf_inertia),
    )
    hip, thigh, calf = (
        told if _can_be(told, mass, leg) else _scaled(inertia, mass / own * (leg / SPOT.leg) ** 2)
        for (mass, _, told), (own, inertia) in zip(links, usual, strict=True)
    )
    return hip, thigh, calf


def _front_and_rear(legs: Sequence[_Leg], joint: int) -> tuple[Pair, Pair | None]:
    """Where a joint of the front legs may be, and of the rear ones if that is elsewhere."""
    front, rear = _within(legs[:2], joint), _within(legs[2:], joint)
    return front, None if np.allclose(front, rear, atol=SAME) else rear


def _folded(thigh: float, calf: float, knee: Pair) -> float:
    """The least height at which the robot sits, m: the knee does not bend farther."""
    folded = max(abs(end) for end in knee) - FOLDED
    return sqrt(thigh * thigh + calf * calf + 2.0 * thigh * calf * cos(folded))


def _kneeling(thigh: float, calf: float, thicker: float) -> float:
    """The same of a leg whose thigh is the longer part: lower, its knee, so much `thicker` than the foot, would lie on the floor."""
    square = thicker * thicker + thigh * thigh - calf * calf
    return thicker + sqrt(square) if square > 0.0 else 0.0


def _bent(limits: Pair) -> Pair:
    """A knee that can bend either way bends backwards, unless it bends farther forwards."""
    low, high = max(limits[0], -STRAIGHT), min(limits[1], STRAIGHT)
    return (low, min(high, 0.0)) if -low >= high else (max(low, 0.0), high)


def _within(legs: Sequence[_Leg], joint: int) -> Pair:
    """Where a joint of all these legs may be."""
    low, high = max(leg.limits[joint][0] for leg in legs), min(leg.limits[joint][1] for leg in legs)
    if low >= high:
        names = " and ".join(repr(leg.name) for leg in legs)
        raise ModelError(
            f"legs of {names}: the limits of their {JOINTS[joint]}s have nothing in common; legs must be alike"
        )
    return low, high


def _can_be(inertia: Triple, mass: float, size: float) -> bool:
    """Whether a thing of this mass and size can have this inertia."""
    return UNTOLD**2 * mass < max(inertia) < size**2 * mass


def _of_box(mass: float, sides: Triple) -> Triple:
    a, b, c = (side * side * mass / 12 for side in sides)
    return (b + c, a + c, a + b)


def _scaled(values: Triple, by: float) -> Triple:
    x, y, z = values
    return (x * by, y * by, z * by)


def _triple(values: Vector) -> Triple:
    x, y, z = (float(value) for value in values)
    return (x, y, z)
