"""The robot as URDF, for viewers and for ROS 2's robot_state_publisher: written from its MuJoCo model, so that the two cannot differ.

A body becomes a link, a hinge a revolute joint, and a site below the trunk a frame of its own, such as `fl_foot`. Shapes are those that
MuJoCo lets collide; URDF has no capsules, so those become cylinders. No MuJoCo is needed.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import atan2, dist, hypot
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from robot.geometry.planar import Pose2
from robot.geometry.vectors import Triple
from robot.model.arm import JOINTS
from robot.model.robot import SPOT, RobotModel
from robot.scenes.scene import Scene
from robot.sim.arm_mjcf import TORQUES
from robot.sim.ground import Ground
from robot.sim.mjcf import write_model

ROOT = "base_link"
"""The trunk, named as REP-105 names it; all other links are named like the model's bodies."""
FASTEST = 30.0
"""rad/s. URDF wants a limit of speed for every joint; the model has none, and its joints stay below this."""
LINK_RADIUS = 0.045
"""m, of the rod that stands for a link without a shape of its own."""
FACE, OUTSIDE = 0.03, 0.006
"""m: how thick the plate at the front is, and how far it stands out."""
SHARE = 0.7
"""of the trunk's width and height that it covers."""
COLORS = {"shell": "0.96 0.73 0.16 1", "limb": "0.16 0.18 0.22 1"}
_ARM: dict[str, float] = dict(zip(JOINTS, TORQUES, strict=True))


def write_urdf(*, arm: bool = False, model: RobotModel = SPOT) -> str:
    """The robot's description: links with masses, inertias and shapes, joints with limits; `arm` adds the arm."""
    nowhere = Scene("robot", (-1.0, -1.0, 1.0, 1.0), (), Pose2(0.0, 0.0), Pose2(0.0, 0.0))
    mjcf = ElementTree.fromstring(write_model(nowhere, Ground(), 0.0025, arm=arm, model=model))
    robot = Element("robot", name=model.name)
    for name, color in COLORS.items():
        SubElement(SubElement(robot, "material", name=name), "color", rgba=color)
    trunk = _found(mjcf, "worldbody/body[@name='body']")
    _link(robot, trunk, ROOT, "shell").insert(2, _face(model))
    for child in trunk.findall("body"):
        _branch(robot, child, ROOT, model)
    ElementTree.indent(robot)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(robot, encoding="unicode") + "\n"


def _branch(robot: Element, body: Element, parent: str, model: RobotModel) -> None:
    """The link of a body, the joint that carries it, its sites, and all that hangs from it."""
    name = body.get("name", "")
    _link(robot, body, name, "limb")
    hinge = _found(body, "joint")
    joint = hinge.get("name", "")
    knee = max(torque for _, torque in model.knee_torque)
    effort = knee if joint.endswith("_knee") else _ARM.get(joint, model.torque_limit)
    _joint(robot, joint, "revolute", (parent, name), _triple(body.get("pos", "0 0 0")), hinge, effort)
    for site in body.findall("site"):
        frame = site.get("name", "")
        SubElement(robot, "link", name=frame)
        _joint(robot, f"{frame}_fixed", "fixed", (name, frame), _triple(site.get("pos", "0 0 0")))
    for child in body.findall("body"):
        _branch(robot, child, name, model)


def _joint(
    robot: Element,
    name: str,
    kind: str,
    links: tuple[str, str],
    place: Triple,
    hinge: Element | None = None,
    effort: float = 0.0,
) -> None:
    joint = SubElement(robot, "joint", name=name, type=kind)
    SubElement(joint, "parent", link=links[0])
    SubElement(joint, "child", link=links[1])
    SubElement(joint, "origin", xyz=_text(place), rpy="0 0 0")
    if hinge is not None:
        low, high = hinge.get("range", "").split()
        SubElement(joint, "axis", xyz=hinge.get("axis", ""))
        SubElement(joint, "limit", lower=low, upper=high, effort=f"{effort:g}", velocity=f"{FASTEST:g}")


def _link(robot: Element, body: Element, name: str, material: str) -> Element:
    link = SubElement(robot, "link", name=name)
    mass = _found(body, "inertial")
    inertial = SubElement(link, "inertial")
    SubElement(inertial, "origin", xyz=mass.get("pos", ""), rpy="0 0 0")
    SubElement(inertial, "mass", value=mass.get("mass", ""))
    xx, yy, zz = mass.get("diaginertia", "").split()
    SubElement(inertial, "inertia", ixx=xx, iyy=yy, izz=zz, ixy="0", ixz="0", iyz="0")
    for shape in body.findall("geom"):
        if shape.get("name") != "skid":  # felt when the robot lies, not seen
            _shape(link, "visual", shape).append(Element("material", name=material))
        _shape(link, "collision", shape)
    if body.find("geom") is None:
        for rod in _rods(body):
            _shape(link, "visual", rod).append(Element("material", name=material))
    return link


def _face(model: RobotModel) -> Element:
    """A dark plate on the trunk, so that one sees where ahead is."""
    length, width, height = model.trunk
    half = (FACE / 2, SHARE * width / 2, SHARE * height / 2)
    place = ((length - FACE) / 2 + OUTSIDE, 0.0, 0.0)
    plate = Element("geom", type="box", size=_text(half), pos=_text(place))
    face = _shape(Element("link"), "visual", plate)
    face.append(Element("material", name="limb"))
    return face


def _rods(body: Element) -> Iterator[Element]:
    """What shows a body without shapes: a rod to each body that it carries."""
    for child in body.findall("body"):
        end = _triple(child.get("pos", "0 0 0"))
        if any(end):
            yield Element("geom", type="capsule", size=f"{LINK_RADIUS}", fromto=f"0 0 0 {_text(end)}")


def _shape(link: Element, purpose: str, geom: Element) -> Element:
    """The element `purpose` (visual or collision) with the shape of a geom, where that is."""
    shown = SubElement(link, purpose)
    sizes = [float(size) for size in geom.get("size", "").split()]
    place, turn = _triple(geom.get("pos", "0 0 0")), (0.0, 0.0, 0.0)
    kind = geom.get("type", "")
    if kind == "capsule":
        ends = [float(number) for number in geom.get("fromto", "").split()]
        first, last = (ends[0], ends[1], ends[2]), (ends[3], ends[4], ends[5])
        place, turn = _middle(first, last), _along(first, last)
        shape = Element("cylinder", radius=f"{sizes[0]:g}", length=f"{dist(first, last):.9g}")
    elif kind == "box":
        shape = Element("box", size=_text((2 * sizes[0], 2 * sizes[1], 2 * sizes[2])))
    else:
        shape = Element("sphere", radius=f"{sizes[0]:g}")
    SubElement(shown, "origin", xyz=_text(place), rpy=_text(turn))
    SubElement(shown, "geometry").append(shape)
    return shown


def _middle(first: Triple, last: Triple) -> Triple:
    return ((first[0] + last[0]) / 2, (first[1] + last[1]) / 2, (first[2] + last[2]) / 2)


def _along(first: Triple, last: Triple) -> Triple:
    """Roll, pitch and yaw that turn the z axis, along which a cylinder lies, into the line from `first` to `last`."""
    x, y, z = last[0] - first[0], last[1] - first[1], last[2] - first[2]
    return (0.0, atan2(hypot(x, y), z), atan2(y, x))


def _found(element: Element, path: str) -> Element:
    found = element.find(path)
    if found is None:
        raise LookupError(f"the model has no {path} in {element.get('name', element.tag)}")
    return found


def _triple(text: str) -> Triple:
    x, y, z = (float(number) for number in text.split())
    return (x, y, z)


def _text(values: Triple) -> str:
    return " ".join(f"{value:.9g}" for value in values)
