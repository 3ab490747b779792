"""The joints of a robot as its URDF describes them: where each link is in the one that carries it, for given joint positions."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, hypot, sin
from xml.etree import ElementTree

from robot.geometry.errors import DescriptionError
from robot.geometry.transform import Transform
from robot.geometry.vectors import Triple

__all__ = ["Joint", "joints_of"]

_TURNING = ("revolute", "continuous")


@dataclass(frozen=True, slots=True)
class Joint:
    """One joint of a URDF: `child` stands at `origin` in `parent`, and turns about `axis` there; a fixed joint has none."""

    name: str
    parent: str
    child: str
    origin: Transform
    axis: Triple | None

    def at(self, position: float) -> Transform:
        """The child in the parent when the joint is at `position`, rad; a fixed joint does not mind."""
        if self.axis is None:
            return self.origin
        x, y, z = self.axis
        sine = sin(position / 2)
        return self.origin @ Transform(rotation=(cos(position / 2), x * sine, y * sine, z * sine))


def joints_of(urdf: str) -> tuple[Joint, ...]:
    """Every joint of a URDF, in its order. Raises `DescriptionError` for what is no URDF, or has joints other than fixed and turning ones."""
    try:
        robot = ElementTree.fromstring(urdf)
    except ElementTree.ParseError as error:
        raise DescriptionError(f"the robot's description is no XML: {error}") from None
    return tuple(_joint(element) for element in robot.findall("joint"))


def _joint(element: ElementTree.Element) -> Joint:
    name, kind = element.get("name", ""), element.get("type", "")
    parent, child = element.find("parent"), element.find("child")
    if parent is None or child is None:
        raise DescriptionError(f"the joint {name!r} of the robot's description lacks its parent or its child")
    if kind not in (*_TURNING, "fixed"):
        raise DescriptionError(f"the joint {name!r} is {kind!r}: only fixed, revolute and continuous joints are known")
    place, turn = _triple(element, "origin", "xyz", "0 0 0"), _triple(element, "origin", "rpy", "0 0 0")
    axis = _unit(_triple(element, "axis", "xyz", "1 0 0")) if kind in _TURNING else None
    return Joint(name, parent.get("link", ""), child.get("link", ""), Transform(place, _quaternion(turn)), axis)


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


def _quaternion(rpy: Triple) -> tuple[float, float, float, float]:
    """Roll about x, then pitch about y, then yaw about z, all about the fixed axes of the parent: URDF's way."""
    (cr, sr), (cp, sp), (cy, sy) = ((cos(angle / 2), sin(angle / 2)) for angle in rpy)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )
