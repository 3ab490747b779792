"""The joints of a robot as its URDF describes them: where each link is in the one that carries it, for given joint positions."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from math import cos, hypot, sin
from typing import Literal, NamedTuple, TypeAlias, cast, get_args
from xml.etree import ElementTree
from xml.parsers import expat

from actors.tf2.errors import DescriptionError
from actors.tf2.quaternions import Triple
from actors.tf2.transform import Transform

JointKind: TypeAlias = Literal["fixed", "revolute", "continuous", "prismatic", "floating", "planar"]
"""The kinds of joints of a URDF. The last two have more than one position: another node publishes their transform."""

SECOND = expat.errors.codes[expat.errors.XML_ERROR_JUNK_AFTER_DOC_ELEMENT]

XACRO = frozenset(("arg", "if", "include", "insert_block", "macro", "property", "unless"))
"""The elements of xacro that are expanded whatever macros there are."""

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
    """Every joint of a URDF, in its order. XML namespaces mean nothing, as in ROS 2: a prefix is a part of a name.

    Raises `DescriptionError` for what is no URDF, for xacro, which has to be expanded first, and for links that are no single tree.
    """
    robot = _tree(urdf)
    if _is_xacro(robot):
        raise DescriptionError(
            "the robot's description is xacro, and has to be expanded first: run `xacro robot.urdf.xacro > robot.urdf` of ROS 2, "
            "and give the URDF that it writes"
        )
    if robot.tag != "robot":
        raise DescriptionError(f"the robot's description is a <{robot.tag}>, and no URDF, which is a <robot>")
    joints = tuple(_joint(element) for element in robot.findall("joint"))
    _check_links([link.get("name", "") for link in robot.findall("link")], joints)
    return joints


def _tree(urdf: str) -> ElementTree.Element:
    """The elements of a text, read without namespaces. Comments are no part of it."""
    builder = ElementTree.TreeBuilder()
    parser = expat.ParserCreate()
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.data
    try:
        parser.Parse(urdf.lstrip(), True)
    except expat.ExpatError as error:
        if error.code == SECOND:
            return builder.close()  # the first one counts
        raise DescriptionError(f"the robot's description is no XML: {error}") from None
    return builder.close()


def _is_xacro(robot: ElementTree.Element) -> bool:
    """Whether a text has to be expanded: it defines what is expanded, or its links or joints hold expressions.

    What xacro has left over in a finished description, such as a call of a macro that it did not know, means nothing to ROS 2 either.
    """
    prefixes = {"xacro"}
    for element in robot.iter():
        prefixes.update(
            name.removeprefix("xmlns:")
            for name, value in element.items()
            if name.startswith("xmlns:") and value.rstrip("/").endswith("xacro")
        )
    names = [element.tag.partition(":") for element in robot.iter()]
    called = {name for prefix, colon, name in names if colon and prefix in prefixes}
    return bool(called & XACRO or (called and robot.find("link") is None)) or any(
        "${" in text
        for element in (*robot.findall("link"), *robot.findall("joint"))
        for part in element.iter()
        for text in part.attrib.values()
    )


def _check_links(links: list[str], joints: tuple[Joint, ...]) -> None:
    """Refuse what urdfdom refuses: the links are one tree, and each name is there once."""
    if not links:
        raise DescriptionError("the robot's description has no link")
    for what, names in (("link", links), ("joint", [joint.name for joint in joints])):
        if twice := [name for name, number in Counter(names).items() if number > 1]:
            raise DescriptionError(f"the robot's description has more than one {what} {twice[0]!r}")
    for joint in joints:
        if absent := [name for name in (joint.parent, joint.child) if name not in links]:
            raise DescriptionError(
                f"the joint {joint.name!r} is at the link {absent[0]!r}, which the robot's description lacks"
            )
    carried = Counter(joint.child for joint in joints)
    if twice := [name for name, number in carried.items() if number > 1]:
        raise DescriptionError(f"the link {twice[0]!r} of the robot's description is the child of more than one joint")
    roots = [name for name in links if name not in carried]
    if len(roots) != 1:
        found = f"{', '.join(roots)}: join them by fixed joints" if roots else "none, as each is the child of a joint"
        raise DescriptionError(
            f"the robot's description needs one root, a link that is no joint's child; it has {found}"
        )


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
