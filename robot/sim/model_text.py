"""The text of a robot's MJCF or URDF file as MuJoCo takes it: includes put in, and everything out that is only for the eye or for a simulation."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from math import isfinite
from pathlib import Path
from typing import Final
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from robot.model.robot import ModelError

MOST_BYTES: Final = 4_000_000
"""Of a file with all that it includes; descriptions of robots without their meshes are a hundredth of that."""
DEEPEST: Final = 200
"""Elements within each other; the links of an arm on a robot's back are some 20."""
NOTHING: Final = 1e-5
"""A link of less than this, kg, is a placeholder for one without mass."""
MOST_MESHES: Final = 100_000_000
"""Bytes of all meshes that are read."""
LEAST_MASS: Final = 1e-9
"""Of a body, kg."""
LEAST_INERTIA: Final = 1e-12
"""Of a body, kg m2."""

_KEPT: Final = ("compiler", "default", "worldbody", "actuator", "size")
"""Sections of an MJCF that have figures; the others are pictures, or refer to what is taken out."""
_SET: Final = re.compile(r"(robot|walk|limits|trot|crawl|pace|bound|pronk)\.\w+$")
"""Names of numbers that a file sets for this package."""
_UNSEEN: Final = ("camera", "light", "plugin", "composite", "flexcomp")
_SHAPELESS: Final = ("mesh", "hfield", "sdf")


def model_text(file: Path, *, meshes: bool = False) -> tuple[str, dict[str, tuple[float, ...]]]:
    """The description of the robot in a MJCF or URDF file, without meshes, and the numbers that it sets by <numeric name="walk.height" data="0.4"/>
    (docs/howto/your-robot.md). With `meshes` an MJCF keeps those whose files are there. Raises `ModelError` for a file that has none.
    """
    root = _read(file, [MOST_BYTES])
    numbers = dict(_numeric(one, file) for one in root.iter("numeric") if _SET.match(one.get("name", "")))
    if root.tag == "robot":
        _clean_urdf(root)
    elif root.tag == "mujoco":
        _clean_mjcf(root, _meshes(root, file.parent) if meshes else {})
    else:
        raise ModelError(f"{file}: its first element is <{root.tag}>: give an MJCF (<mujoco>) or a URDF (<robot>)")
    return ElementTree.tostring(root, encoding="unicode"), numbers


def _numeric(element: Element, file: Path) -> tuple[str, tuple[float, ...]]:
    name = element.get("name", "")
    try:
        values = tuple(float(one) for one in element.get("data", "").split())
    except ValueError:
        values = ()
    if not values or not all(isfinite(one) for one in values):
        raise ModelError(f"{file}: numeric {name!r}: its data is no number")
    return name, values


def _read(file: Path, left: list[int]) -> Element:
    """The file's first element, with what it includes; `left` are the bytes that may still be read."""
    try:
        left[0] -= file.stat().st_size
        if left[0] < 0:
            raise ModelError(
                f"{file}: larger than {MOST_BYTES} bytes: a description of a robot without its meshes is smaller"
            )
        text = file.read_text(encoding="utf-8-sig")
        if "<!DOCTYPE" in text or "<!ENTITY" in text:
            raise ModelError(f"{file}: a description of a robot has no <!DOCTYPE>: take it out")
        root = ElementTree.fromstring(text)
    except (OSError, UnicodeDecodeError) as error:
        raise ModelError(f"{file}: {getattr(error, 'strerror', None) or 'it is not text'}") from None
    except ElementTree.ParseError as error:
        raise ModelError(f"{file}: it is no XML: {error}") from None
    if any("xacro}" in str(one.tag) for one in _walk(root, file, 0)):
        raise ModelError(f"{file}: it is a xacro: make a URDF of it first, by xacro {file.name} > robot.urdf")
    if root.tag in ("mujoco", "mujocoinclude"):
        _include(root, file, left)
    return root


def _walk(element: Element, file: Path, depth: int) -> Iterator[Element]:
    if depth > DEEPEST:
        raise ModelError(f"{file}: its elements lie more than {DEEPEST} deep within each other")
    yield element
    for child in element:
        yield from _walk(child, file, depth + 1)


def _include(element: Element, file: Path, left: list[int]) -> None:
    """Put in the place of each <include> what its file has."""
    for place, child in reversed(list(enumerate(element))):
        if child.tag != "include":
            _include(child, file, left)
            continue
        named = child.get("file") or ""
        if len(left) > DEEPEST:
            raise ModelError(f"{file}: <include file={named!r}>: more than {DEEPEST} files include each other")
        left.append(0)
        element[place : place + 1] = list(_read(file.parent / named, left))


def _clean_urdf(root: Element) -> None:
    for link in root.iter("link"):
        for part in list(link):
            if part.tag == "visual" or (part.tag == "collision" and part.find(".//mesh") is not None):
                link.remove(part)
            part.attrib.pop("name", None)
        _weigh(link)
    for joint in root.iter("joint"):
        if joint.get("type") in ("floating", "planar"):  # it says that the robot is not fixed to the world
            joint.set("type", "fixed")
    for part in list(root):
        if part.tag not in ("link", "joint"):
            root.remove(part)
    options = ElementTree.SubElement(root, "mujoco")
    ElementTree.SubElement(options, "compiler", _options(fusestatic="false", discardvisual="true"))


def _weigh(link: Element) -> None:
    """Give a link without mass next to none, and one whose inertia cannot be next to no inertia: MuJoCo takes no zeros, and the reader mends it."""
    inertial = link.find("inertial")
    mass = None if inertial is None else inertial.find("mass")
    if inertial is None or mass is None or abs(_number(mass, "value")) < NOTHING:
        for old in link.findall("inertial"):
            link.remove(old)
        inertial = ElementTree.SubElement(link, "inertial")
        ElementTree.SubElement(inertial, "mass", value=str(LEAST_MASS))
    inertia = inertial.find("inertia")
    if inertia is None:
        inertia = ElementTree.SubElement(inertial, "inertia")
    xx, xy, xz, yy, yz, zz = (_number(inertia, f"i{axes}") for axes in ("xx", "xy", "xz", "yy", "yz", "zz"))
    if np.linalg.eigvalsh(np.array(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))))[0] <= 0.0:
        for axes in ("xx", "xy", "xz", "yy", "yz", "zz"):
            inertia.set(f"i{axes}", str(LEAST_INERTIA if axes[0] == axes[1] else 0.0))


def _number(element: Element, word: str) -> float:
    """What is no number is left for MuJoCo to name."""
    try:
        return float(element.get(word, "0"))
    except ValueError:
        return 1.0


def _meshes(root: Element, folder: Path) -> dict[str, Element]:
    """The meshes whose files are there and not too large, by name, with the whole paths of their files."""
    for compiler in root.iter("compiler"):
        folder /= compiler.get("meshdir") or compiler.get("assetdir") or ""
    found: dict[str, Element] = {}
    left = MOST_MESHES
    for mesh in (one for assets in root.findall("asset") for one in assets.findall("mesh")):
        path = (folder / mesh.get("file", "")).resolve()
        if path.is_file() and (left := left - path.stat().st_size) >= 0:
            mesh.set("file", str(path))
            found[mesh.get("name", path.stem)] = mesh
    return found


def _clean_mjcf(root: Element, meshes: Mapping[str, Element]) -> None:
    for section in list(root):
        if section.tag not in _KEPT:
            root.remove(section)
    for drives in root.iter("actuator"):
        for drive in list(drives):
            if drive.get("joint") is None and drive.get("jointinparent") is None:
                drives.remove(drive)
    shapeless: dict[str, bool] = {}
    for default in root.findall("default"):
        _shapeless_classes(default, False, shapeless)
        shapeless[""] = shapeless.get("", False) or shapeless[default.get("class") or ""]
    _drop(root, shapeless, meshes)
    ElementTree.SubElement(root, "asset").extend(meshes.values())
    ElementTree.SubElement(root, "compiler", _options(fusestatic="false"))


def _shapeless_classes(element: Element, inherited: bool, found: dict[str, bool]) -> None:
    """Whether geoms of each default class are meshes unless they say otherwise; the shape is taken out of the class."""
    for child in element.findall("geom"):
        inherited = _is_shapeless(child, inherited)
        if inherited:
            for word in ("mesh", "hfield", "type"):
                child.attrib.pop(word, None)
    found[element.get("class") or ""] = inherited
    for child in element.findall("default"):
        _shapeless_classes(child, inherited, found)


def _is_shapeless(geom: Element, otherwise: bool) -> bool:
    if geom.get("mesh") is not None or geom.get("hfield") is not None:
        return True
    return otherwise if geom.get("type") is None else geom.get("type") in _SHAPELESS


def _drop(element: Element, shapeless: Mapping[str, bool], meshes: Mapping[str, Element], own: str = "") -> None:
    """Take out what has no shape, but those of `meshes`, or is not looked at; `own` is the class of what does not name one."""
    own = element.get("childclass", own)
    for child in list(element):
        asset = element.tag == "default" and child.tag in ("mesh", "material")
        mesh = child.tag == "geom" and element.tag != "default"
        mesh = mesh and _is_shapeless(child, shapeless.get(child.get("class", own), False))
        if mesh and child.get("mesh") in meshes:
            child.set("type", "mesh")
        elif asset or child.tag in _UNSEEN or mesh:
            element.remove(child)
            continue
        child.attrib.pop("material", None)
        _drop(child, shapeless, meshes, own)


def _options(**more: str) -> dict[str, str]:
    """Inertias that no body can have are mended, and what must not be zero is nearly so."""
    return {"balanceinertia": "true", "boundmass": str(LEAST_MASS), "boundinertia": str(LEAST_INERTIA)} | more
