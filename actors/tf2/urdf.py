"""The joints of a robot as its URDF describes them: where each link is in the one that carries it, for given joint positions."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, hypot, sin
from typing import Literal, NamedTuple, TypeAlias, cast, get_args
from xml.etree import ElementTree

from actors.tf2.errors import DescriptionError
from actors.tf2.quaternions import Triple
from actors.tf2.transform import Transform

__all__ = ["Joint", "JointKind", "Mimic", "joints_of"]

JointKind: TypeAlias = Literal["fixed", "revolute", "continuous", "prismatic", "floating", "planar"]
"""The kinds of joints of a URDF. The last two have more than one position: whoever knows it publishes their transform."""

MOVING = ("revolute", "continuous", "prismatic")


class Mimic(NamedTuple):
    """A joint follows another one: its position is ``multiplier * position + offset``."""

    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True, slots=True)
class Joint:
    """One joint of a URDF: `child` stands at `origin` in `parent`, and turns about `axis` there, or slides along it."""

    name: str
    parent: str
    child: str
    origin: Transform
    axis: Triple | None
    """Of length 1; None for a joint without a single position."""
    kind: JointKind = "revolute"
    mimic: Mimic | None = None

    def at(self, position: float) -> Transform:
        """The child in the parent when the joint is at `position`, rad or m; without an axis, the origin."""
        if self.axis is None:
            return self.origin
        x, y, z = self.axis
        if self.kind == "prismatic":
            return self.origin @ Transform((x * position, y * position, z * position))
        sine = sin(position / 2)
        return self.origin @ Transform(rotation=(cos(position / 2), x * sine, y * sine, z * sine))


def joints_of(urdf: str) -> tuple[Joint, ...]:
    """Every joint of a URDF, in its order. Raises `DescriptionError` for what is no URDF, and for xacro, which has to be expanded first."""
    try:
        robot = ElementTree.fromstring(urdf)
    except ElementTree.ParseError as error:
        raise DescriptionError(f"the robot's description is no XML: {error}") from None
    if any("xacro" in element.tag.partition("}")[0] for element in robot.iter()) or "${" in urdf:
        raise DescriptionError(
            "the robot's description is xacro, and has to be expanded first: run `xacro robot.urdf.xacro > robot.urdf` of ROS 2, "
            "and give the URDF that it writes"
        )
    if robot.tag != "robot":
        raise DescriptionError(f"the robot's description is a <{robot.tag}>, and no URDF, which is a <robot>")
    return tuple(_joint(element) for element in robot.findall("joint"))


def _joint(element: ElementTree.Element) -> Joint:
    name, kind = element.get("name", ""), element.get("type", "")
    parent, child = element.find("parent"), element.find("child")
    if parent is None or child is None:
        raise DescriptionError(f"the joint {name!r} of the robot's description lacks its parent or its child")
    if kind not in get_args(JointKind):
        raise DescriptionError(f"the joint {name!r} is {kind!r}; a joint is {', '.join(get_args(JointKind))}")
    place, turn = _triple(element, "origin", "xyz", "0 0 0"), _triple(element, "origin", "rpy", "0 0 0")
    axis = _unit(_triple(element, "axis", "xyz", "1 0 0")) if kind in MOVING else None
    origin = Transform.from_rpy(place, *turn)
    links = parent.get("link", ""), child.get("link", "")
    return Joint(name, *links, origin, axis, cast("JointKind", kind), _mimic(element))


def _mimic(element: ElementTree.Element) -> Mimic | None:
    found = element.find("mimic")
    if found is None:
        return None
    try:
        return Mimic(found.get("joint", ""), float(found.get("multiplier", "1")), float(found.get("offset", "0")))
    except ValueError:
        raise DescriptionError(f"multiplier and offset of the mimic of {element.get('name')!r} are numbers") from None


def _triple(element: ElementTree.Element, tag: str, attribute: str, default: str) -> Triple:
    found = element.find(tag)
    text = default if found is None else found.get(attribute, default)
    try:
        x, y, z = (float(number) for number in text.split())
    except ValueError:
        raise DescriptionError(f"{tag} {attribute}={text!r} of {element.get('name')!r} is not three numbers") from None
    return (x, y, z)


def _unit(axis: Triple) -> Triple:
    length = hypot(*axis)
    if length == 0.0:
        raise DescriptionError("a joint of the robot's description turns about an axis of length 0")
    return (axis[0] / length, axis[1] / length, axis[2] / length)
