"""The names of types: their grammar, the two spellings of a type, and what a Python class is called in ROS."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Final, Literal, TypeAlias

from actors.interfaces.errors import BadDeclaration, UnknownInterface
from actors.suggest import did_you_mean

Kind: TypeAlias = Literal["msg", "srv", "action"]
"""The kinds of interfaces, by the folders in which a package keeps their definitions."""
KINDS: Final[tuple[Kind, ...]] = ("msg", "srv", "action")

_LONGEST: Final = 255
"""Characters of one part of a name at most: a definition lies in a file and a folder of these names."""

# Each matches in time that grows with the length of the text alone: where an underscore stands, one way leads on.
_LOWER = re.compile(r"[a-z][a-z0-9]*(?:_[a-z0-9]+)*")
_CAMEL = re.compile(r"[A-Z][A-Za-z0-9]*")
_UPPER = re.compile(r"[A-Z][A-Z0-9]*(?:_[A-Z0-9]+)*")

PART_KINDS: Final[dict[str, Kind]] = {
    "Request": "srv",
    "Response": "srv",
    "Event": "srv",
    "Goal": "action",
    "Result": "action",
    "Feedback": "action",
}
"""Suffix of the generated parts of a service or action, and the kind of interface it belongs to."""


def is_package_name(text: str) -> bool:
    """Lower case, digits and single inner underscores, a letter first; at most 255 characters, as each part of a name."""
    return _is(_LOWER, text)


def is_field_name(text: str) -> bool:
    """The same rule as for packages."""
    return _is(_LOWER, text)


def is_interface_name(text: str) -> bool:
    """A message, service or action: letters and digits, an upper-case letter first, no underscore."""
    return _is(_CAMEL, text)


def is_constant_name(text: str) -> bool:
    """Upper case, digits and single inner underscores, a letter first."""
    return _is(_UPPER, text)


def _is(pattern: re.Pattern[str], text: str) -> bool:
    return len(text) <= _LONGEST and pattern.fullmatch(text) is not None


def full_name(name: str, kind: Kind = "msg") -> str:
    """`std_msgs/Header` and `std_msgs/msg/Header` as `std_msgs/msg/Header`; `kind` is what the short spelling means.

    Raises:
        UnknownInterface: the text is neither `package/Name` nor `package/kind/Name`.
    """
    parts = name.split("/")
    if len(parts) == 2:
        parts.insert(1, kind)
    if len(parts) != 3 or parts[1] not in KINDS or not all(0 < len(part) <= _LONGEST for part in parts):
        raise UnknownInterface(
            f"{name!r:.300} is not the name of a type; write package/{kind}/Name, as in std_msgs/msg/String"
        )
    return "/".join(parts)


def own_type_name(module: str, name: str) -> str:
    """The ROS name of a class declared in Python.

    Module `...pkg.msg` (or `.srv`, `.action`), as in a ROS package, gives `pkg/msg/Name`. Any other module gives its
    first part as the package: class Pose2D in `robot.navigation.types` is `robot/msg/Pose2D`, in a script
    `main/msg/Pose2D`. A class `Plan_Request` is a part of a service (`.../srv/Plan_Request`), `Move_Goal` of an action.
    """
    stem, _, part = name.partition("_")
    if not is_interface_name(stem) or (part and part not in PART_KINDS):
        raise BadDeclaration(
            f"class {name}: not a name for a ROS type (letters and digits, an upper-case letter first). "
            f"Rename it, or state the ROS name: __ros_type__ = 'package/msg/{name.replace('_', '').capitalize()}'"
        )
    kind: str = PART_KINDS.get(part, "msg")
    parents = module.split(".")
    if len(parents) > 1 and parents[-1] in KINDS and is_package_name(parents[-2]):
        return f"{parents[-2]}/{parents[-1]}/{name}"
    package = re.sub(r"[^a-z0-9]+", "_", parents[0].lower()).strip("_")
    return f"{package if is_package_name(package) else 'main'}/{kind}/{name}"


def closest(name: str, known: Iterable[str]) -> str:
    """` Did you mean 'x' or 'y'?`, or nothing where nothing is close. To be put at the end of an error."""
    return did_you_mean(name, known, " Did", most=3)
