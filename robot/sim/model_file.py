"""A robot's figures from its MJCF or URDF file: the names, order, signs and zero angles of its joints are the file's.

MuJoCo reads the file; meshes are left out, as no figure comes from them. What is found is brought into this package's convention: angles zero with
the leg straight down, hip about +x, shoulder and knee about +y, and the body's origin in the plane of the hips.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from math import atan2, hypot, pi
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree

import numpy as np

from actors.suggest import did_you_mean
from robot.geometry.angles import wrap
from robot.geometry.vectors import Triple, Vector
from robot.model.bodies import BODIES
from robot.model.robot import SPOT, ModelError, Pair, RobotModel

MOST_BYTES: Final = 4_000_000
"""Of a file; descriptions of robots without their meshes are a hundredth of that."""
ALIKE: Final = 0.01
"""Legs differ by no more than this, m, in a robot whose legs are alike."""
ALONG: Final = 0.98
"""Cosine of the angle by which a joint's axis may be off its direction."""
FOLDED: Final = 0.02
"""How far from the knee's limit the sitting pose stays, rad."""
JOINTS: Final = ("hip", "shoulder", "knee")


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
    torque: tuple[float, float, float]
    links: tuple[tuple[float, Vector, Triple], ...]
    """Of hip, thigh and calf: mass, centre, and inertia about it along the body's axes."""
    dof: int


def read_model(path: str | Path) -> RobotModel:
    """The robot that an MJCF or URDF file describes. Needs MuJoCo.

    Raises `ModelError`, which names the file and the element, for a file that cannot be read, or whose robot does not have four legs alike with
    hip, shoulder and knee each, knees that bend backwards, and a limit of the torque of every joint.
    """
    file = Path(path)
    mujoco: Any = import_module("mujoco")
    try:
        model = mujoco.MjModel.from_xml_string(_without_meshes(file))
    except ValueError as error:
        raise (
            error if isinstance(error, ModelError) else ModelError(f"{file}: {' '.join(str(error).split())}")
        ) from None
    try:
        return _Reader(mujoco, model, file.stem).robot()
    except ModelError as error:
        raise ModelError(f"{file}: {error}") from None


def find_model(text: str) -> RobotModel:
    """A robot that comes with the package, by its name, or the one of a file. Raises `ModelError` for what is neither, and as `read_model` does."""
    if text in BODIES:
        return BODIES[text]
    if Path(text).suffix.lower() in (".xml", ".urdf", ".mjcf"):
        return read_model(text)
    hint = did_you_mean(text, BODIES, quoted=False) or f"; there are: {', '.join(BODIES)}"
    raise ModelError(f"no robot is called {text!r}{hint}, or give a file (.xml or .urdf)")


def _without_meshes(file: Path) -> str:
    """The file's text without what is only for the eye, and with the options that keep all links of a URDF."""
    try:
        if file.stat().st_size > MOST_BYTES:
            raise ModelError(
                f"{file}: larger than {MOST_BYTES} bytes: a description of a robot without its meshes is smaller"
            )
        text = file.read_text(encoding="utf-8")
        if "<!DOCTYPE" in text or "<!ENTITY" in text:
            raise ModelError(f"{file}: a description of a robot has no <!DOCTYPE>: take it out")
        root = ElementTree.fromstring(text)
    except (OSError, UnicodeDecodeError) as error:
        raise ModelError(f"{file}: {getattr(error, 'strerror', None) or 'it is not text'}") from None
    except ElementTree.ParseError as error:
        raise ModelError(f"{file}: it is no XML: {error}") from None
    if root.tag == "robot":
        for link in root.iter("link"):
            for part in [
                *link.findall("visual"),
                *(one for one in link.findall("collision") if one.find(".//mesh") is not None),
            ]:
                link.remove(part)
        for old in root.findall("mujoco"):
            root.remove(old)
        options = ElementTree.SubElement(root, "mujoco")
        ElementTree.SubElement(options, "compiler", fusestatic="false", discardvisual="true")
    elif root.tag == "mujoco":
        _drop_meshes(root)
    else:
        raise ModelError(f"{file}: its first element is <{root.tag}>: give an MJCF (<mujoco>) or a URDF (<robot>)")
    return ElementTree.tostring(root, encoding="unicode")


def _drop_meshes(element: ElementTree.Element) -> None:
    for child in list(element):
        mesh = child.get("mesh") is not None or (child.tag == "geom" and child.get("class") == "visual")
        if child.tag in ("mesh", "hfield", "texture", "keyframe", "include") or (child.tag == "geom" and mesh):
            element.remove(child)
        else:
            _drop_meshes(child)


class _Reader:
    """Takes the figures out of a compiled model."""

    def __init__(self, mujoco: Any, model: Any, name: str) -> None:
        self._mujoco, self._model, self._name = mujoco, model, name
        self._data = mujoco.MjData(model)
        self._hinge = int(mujoco.mjtJoint.mjJNT_HINGE)

    def robot(self) -> RobotModel:
        """The whole robot."""
        chains = self._chains()
        self._straighten(chains)
        legs = sorted(
            (self._leg(chain) for chain in chains), key=lambda leg: (-np.sign(leg.hip[0]), -np.sign(leg.foot[1]))
        )
        signs = [(float(np.sign(leg.hip[0])), float(np.sign(leg.foot[1]))) for leg in legs]
        if signs != [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]:
            raise ModelError(
                f"legs {', '.join(leg.name for leg in legs)}: they do not stand one at each corner of the body"
            )
        return self._figures(legs)

    def _chains(self) -> list[tuple[int, int, int]]:
        """The joints of each leg, from hip to knee."""
        model = self._model
        hinges = [joint for joint in range(model.njnt) if model.jnt_type[joint] == self._hinge]
        bodies = {int(model.jnt_bodyid[joint]): joint for joint in hinges}
        above: dict[int, int] = {}
        for joint in hinges:
            body = int(model.body_parentid[model.jnt_bodyid[joint]])
            while body and body not in bodies:
                body = int(model.body_parentid[body])
            if body:
                above[joint] = bodies[body]
        chains: list[tuple[int, int, int]] = []
        for knee in sorted(set(hinges) - set(above.values())):
            shoulder = above.get(knee)
            hip = above.get(shoulder) if shoulder is not None else None
            if shoulder is None or hip is None or hip in above:
                raise ModelError(
                    f"joint {self._joint(knee)!r}: it does not end a leg of three joints, hip, shoulder and knee"
                )
            chains.append((hip, shoulder, knee))
        if len(chains) != 4 or len(hinges) != 12:
            raise ModelError(f"it has {len(chains)} legs and {len(hinges)} joints that turn: a quadruped has 4 and 12")
        return chains

    def _straighten(self, chains: Sequence[tuple[int, int, int]]) -> None:
        """Turn each leg straight down: there all of our angles are zero."""
        self._data.qpos[:] = self._model.qpos0
        for chain in chains:
            for joint in chain:
                self._data.qpos[self._model.jnt_qposadr[joint]] = 0.0
        self._mujoco.mj_forward(self._model, self._data)
        for chain in chains:
            self._axes(chain)
            for joint, end in ((chain[1], self._anchor(chain[2])), (chain[2], None)):
                x, _, z = (end if end is not None else self._foot(chain)[0]) - self._anchor(joint)
                down = atan2(-x, -z)  # the angle about y by which the link hangs ahead of straight down
                self._data.qpos[self._model.jnt_qposadr[joint]] -= down * self._sign(joint, 1)
                self._mujoco.mj_forward(self._model, self._data)

    def _axes(self, chain: tuple[int, int, int]) -> None:
        for joint, axis, name in zip(chain, (0, 1, 1), "xyy", strict=True):
            if abs(self._data.xaxis[joint][axis]) < ALONG:
                raise ModelError(f"joint {self._joint(joint)!r}: it does not turn about {name}")

    def _leg(self, chain: tuple[int, int, int]) -> _Leg:
        foot, radius = self._foot(chain)
        trunk = self._data.xpos[self._trunk(chain)]
        hip, shoulder, knee = (self._anchor(joint) - trunk for joint in chain)
        axes = (0, 1, 1)
        limits = [self._limits(joint, axis) for joint, axis in zip(chain, axes, strict=True)]
        if limits[2][0] + limits[2][1] > 0.0:
            raise ModelError(
                f"joint {self._joint(chain[2])!r}: the knee bends forwards; knees that bend backwards are supported"
            )
        bodies = [int(self._model.jnt_bodyid[joint]) for joint in chain]
        ends = [{bodies[1]}, {bodies[2]}, set[int]()]
        return _Leg(
            name=self._joint(chain[0]),
            hip=hip,
            shoulder=shoulder,
            knee=knee,
            foot=foot - trunk,
            radius=radius,
            limits=(limits[0], limits[1], limits[2]),
            torque=(self._torque(chain[0]), self._torque(chain[1]), self._torque(chain[2])),
            links=tuple(self._link(body, end, trunk) for body, end in zip(bodies, ends, strict=True)),
            dof=int(self._model.jnt_dofadr[chain[0]]),
        )

    def _figures(self, legs: Sequence[_Leg]) -> RobotModel:
        front, first = legs[0], legs[0]
        for leg in legs[1:]:
            for what, mine, theirs in (
                ("thigh", abs(leg.knee - leg.shoulder), abs(first.knee - first.shoulder)),
                ("calf", abs(leg.foot - leg.knee), abs(first.foot - first.knee)),
                ("hip", abs(leg.shoulder - leg.hip), abs(first.shoulder - first.hip)),
                ("hip's height", leg.hip[2:], first.hip[2:]),
            ):
                if np.abs(mine - theirs).max() > ALIKE:
                    raise ModelError(f"legs of {first.name!r} and {leg.name!r}: the {what} differs; legs must be alike")
        thigh, calf = (float(np.linalg.norm(part)) for part in (front.knee - front.shoulder, front.foot - front.knee))
        up = np.array((0.0, 0.0, front.hip[2]))
        trunk = int(self._model.body_parentid[self._model.dof_bodyid[front.dof]])
        mass, centre, inertia = self._link(
            trunk, {int(self._model.dof_bodyid[leg.dof]) for leg in legs}, self._data.xpos[trunk]
        )
        links = [self._alike(legs, index) for index in range(3)]
        length = (thigh + calf) / SPOT.leg
        whole = mass + 4 * sum(link[0] for link in links)
        force = whole / SPOT.mass
        damping, armature, friction = (  # what a file does not tell is that of the reference body, scaled
            float(told[front.dof])
            for told in (self._model.dof_damping, self._model.dof_armature, self._model.dof_frictionloss)
        )
        return RobotModel(
            name=self._name,
            thigh=thigh,
            calf=calf,
            abduction=float(np.mean([abs(leg.foot[1] - leg.hip[1]) for leg in legs])),
            foot_radius=front.radius,
            hips=tuple((float(leg.shoulder[0]), float(leg.hip[1])) for leg in legs),  # type: ignore[arg-type]
            stand_height=SPOT.stand_height * length,
            sit_height=_sitting(thigh, calf, SPOT.sit_height * length, front.limits[2]),
            hip_limits=front.limits[0],
            shoulder_limits=front.limits[1],
            shoulder_rear_limits=None if legs[2].limits[1] == front.limits[1] else legs[2].limits[1],
            knee_limits=front.limits[2],
            mass=whole,
            hip_mass=links[0][0],
            thigh_mass=links[1][0],
            calf_mass=links[2][0],
            hip_com=links[0][1],
            thigh_com=links[1][1],
            calf_com=links[2][1],
            body_com=_triple(centre - up),
            body_inertia=inertia,
            hip_inertia=links[0][2],
            thigh_inertia=links[1][2],
            calf_inertia=links[2][2],
            trunk=self._box(trunk, legs),
            torque_limit=min(front.torque[:2]),
            knee_torque=((front.limits[2][0], front.torque[2]), (front.limits[2][1], front.torque[2])),
            damping=damping or SPOT.damping * force * length**1.5,
            armature=armature or SPOT.armature * force * length**2,
            friction=friction or SPOT.friction * force * length,
        )

    def _alike(self, legs: Sequence[_Leg], index: int) -> tuple[float, Triple, Triple]:
        """Mass, centre and inertia of one link of a leg, the mean of all four mirrored to the front left."""
        masses: list[float] = []
        centres: list[Vector] = []
        inertias: list[Triple] = []
        for leg in legs:
            mass, centre, inertia = leg.links[index]
            origin = (np.array((leg.shoulder[0], leg.hip[1], leg.hip[2])), leg.shoulder, leg.knee)[index]
            mirror = np.array((np.sign(leg.hip[0]) if index == 0 else 1.0, np.sign(leg.foot[1]), 1.0))
            masses.append(mass)
            centres.append((centre - origin) * mirror)
            inertias.append(inertia)
        return float(np.mean(masses)), _triple(np.mean(centres, axis=0)), _triple(np.mean(inertias, axis=0))

    def _link(self, body: int, ends: set[int], trunk: Vector) -> tuple[float, Vector, Triple]:
        """Mass, centre from the trunk's origin, and inertia about it of a body with all that is fixed to it, but not the `ends`."""
        model, data = self._model, self._data
        members = [body]
        for other in range(body + 1, model.nbody):
            if int(model.body_parentid[other]) in members and other not in ends:
                members.append(other)
        mass = float(sum(model.body_mass[one] for one in members))
        if mass <= 0.0:
            raise ModelError(f"body {model.body(body).name!r}: it has no mass")
        middle = sum((model.body_mass[one] * data.xipos[one] for one in members), np.zeros(3)) / mass
        whole = np.zeros((3, 3))
        for one in members:
            turn, arm = data.ximat[one].reshape(3, 3), data.xipos[one] - middle
            whole += turn @ np.diag(model.body_inertia[one]) @ turn.T
            whole += model.body_mass[one] * (arm.dot(arm) * np.eye(3) - np.outer(arm, arm))
        return mass, middle - trunk, _triple(np.diag(whole))

    def _foot(self, chain: tuple[int, int, int]) -> tuple[Vector, float]:
        """The ball at the end of a leg: its centre and its radius."""
        model, data, knee = self._model, self._data, self._anchor(chain[2])
        calf = [int(model.jnt_bodyid[chain[2]])]
        for other in range(calf[0] + 1, model.nbody):
            if int(model.body_parentid[other]) in calf:
                calf.append(other)
        sphere = int(self._mujoco.mjtGeom.mjGEOM_SPHERE)
        balls = [
            geom for geom in range(model.ngeom) if model.geom_bodyid[geom] in calf and model.geom_type[geom] == sphere
        ]
        if not balls:
            raise ModelError(
                f"body {model.body(calf[0]).name!r}: no ball (a sphere for collisions) at its end is its foot"
            )
        foot = max(balls, key=lambda geom: float(np.linalg.norm(data.geom_xpos[geom] - knee)))
        return data.geom_xpos[foot].copy(), float(model.geom_size[foot][0])

    def _limits(self, joint: int, axis: int) -> Pair:
        """Lowest and highest of our angle."""
        model = self._model
        if not model.jnt_limited[joint]:
            raise ModelError(
                f"joint {self._joint(joint)!r}: it has no limits of its angle (range, or <limit lower upper>)"
            )
        zero, sign = float(self._data.qpos[model.jnt_qposadr[joint]]), self._sign(joint, axis)
        low, high = sorted(sign * (float(end) - zero) for end in model.jnt_range[joint])
        if axis == 1 and low > pi / 2:  # a knee whose zero is a turn away
            low, high = wrap(low), wrap(high)
        return low, high

    def _torque(self, joint: int) -> float:
        """The largest torque of a joint's motor, N m."""
        model = self._model
        if model.jnt_actfrclimited[joint]:
            return float(model.jnt_actfrcrange[joint][1])
        for motor in range(model.nu):
            if int(model.actuator_trnid[motor][0]) == joint:
                gear = abs(float(model.actuator_gear[motor][0]))
                if model.actuator_forcelimited[motor]:
                    return gear * float(model.actuator_forcerange[motor][1])
                if model.actuator_ctrllimited[motor]:
                    return gear * float(model.actuator_gainprm[motor][0]) * float(model.actuator_ctrlrange[motor][1])
        raise ModelError(
            f"joint {self._joint(joint)!r}: no motor with a limit of its torque drives it (forcerange, or <limit effort>)"
        )

    def _box(self, trunk: int, legs: Sequence[_Leg]) -> Triple:
        """The trunk's largest box; without one, what lies between the hips."""
        model = self._model
        box = int(self._mujoco.mjtGeom.mjGEOM_BOX)
        sizes: list[Vector] = [
            model.geom_size[geom]
            for geom in range(model.ngeom)
            if model.geom_bodyid[geom] == trunk and model.geom_type[geom] == box
        ]
        if sizes:
            return _triple(2 * max(sizes, key=lambda size: float(size.prod())))
        length, width = (float(np.ptp([leg.hip[axis] for leg in legs])) for axis in (0, 1))
        return length, width, SPOT.trunk[2] * hypot(length, width) / hypot(*SPOT.trunk[:2])

    def _trunk(self, chain: tuple[int, int, int]) -> int:
        return int(self._model.body_parentid[self._model.jnt_bodyid[chain[0]]])

    def _anchor(self, joint: int) -> Vector:
        return np.array(self._data.xanchor[joint])

    def _sign(self, joint: int, axis: int) -> float:
        return float(np.sign(self._data.xaxis[joint][axis]))

    def _joint(self, joint: int) -> str:
        return str(self._model.joint(joint).name)


def _sitting(thigh: float, calf: float, height: float, knee: Pair) -> float:
    """The height at which the robot sits: `height`, or higher if the knee does not bend so far."""
    folded = knee[0] + FOLDED
    return max(height, float(np.sqrt(thigh * thigh + calf * calf + 2.0 * thigh * calf * np.cos(folded))))


def _triple(values: Vector) -> Triple:
    x, y, z = (float(value) for value in values)
    return (x, y, z)
