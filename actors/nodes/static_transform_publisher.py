"""`StaticTransformPublisher`: one transform that never changes, from parameters or from the words of a command line."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from typing import NoReturn

from actors.parameters.declare import parameter
from actors.runtime.node import Node
from actors.tf2.broadcasters import StaticTransformBroadcaster
from actors.tf2.errors import InvalidArgumentException
from actors.tf2.quaternions import of_rpy
from actors.tf2.transform import Transform, stamped

QUATERNION = ("qx", "qy", "qz", "qw")
ANGLES = ("roll", "pitch", "yaw")


class StaticTransformPublisher(Node):
    """Publishes where ``child_frame_id`` is in ``frame_id`` on `/tf_static` once, latched; its parameters are those of tf2_ros' node.

    As a program, and in launch files, it takes the words of tf2_ros' program: ``--x 0.1 --yaw 1.5 --frame-id base --child-frame-id lidar``.
    A start without both frames, or with a rotation that is none, fails with `InvalidArgumentException`.
    """

    node_name = "static_transform_publisher"
    x = parameter(0.0, name="translation.x", unit="m", read_only=True)
    y = parameter(0.0, name="translation.y", unit="m", read_only=True)
    z = parameter(0.0, name="translation.z", unit="m", read_only=True)
    qx = parameter(0.0, name="rotation.x", read_only=True)
    qy = parameter(0.0, name="rotation.y", read_only=True)
    qz = parameter(0.0, name="rotation.z", read_only=True)
    qw = parameter(1.0, name="rotation.w", read_only=True)
    frame_id = parameter("", read_only=True, description="The parent frame.")
    child_frame_id = parameter("", read_only=True, description="The child frame.")

    @classmethod
    def arguments_as_parameters(cls, words: Sequence[str]) -> dict[str, object]:
        """The parameters that the words of a command line stand for. Raises ``ValueError``."""
        _refuse_old(words)
        given = vars(arguments_parser().parse_args(words))
        turned = [name for name in ANGLES if given[name] is not None]
        if turned and any(given[name] is not None for name in QUATERNION):
            raise ValueError("static_transform_publisher: give the rotation by angles or as a quaternion, not both")
        if turned:
            angles = [given[name] or 0.0 for name in ANGLES]
            if not all(map(math.isfinite, angles)):
                raise ValueError(f"static_transform_publisher: roll, pitch and yaw must be finite, not {angles}")
            rotation = of_rpy(*angles)
            given.update(zip(("qw", "qx", "qy", "qz"), rotation, strict=True))
        names = {name: f"translation.{name}" for name in "xyz"} | {name: f"rotation.{name[1]}" for name in QUATERNION}
        names |= {name: name for name in ("frame_id", "child_frame_id")}
        return {names[name]: value for name, value in given.items() if name in names and value is not None}

    async def on_start(self) -> None:
        if not self.frame_id or not self.child_frame_id:
            raise InvalidArgumentException(
                f"{self.fqn} needs two frames: --frame-id PARENT --child-frame-id CHILD, or the parameters frame_id and child_frame_id"
            )
        place = Transform((self.x, self.y, self.z), (self.qw, self.qx, self.qy, self.qz))
        Transform.from_msg(place.to_msg())  # refuses what is no rotation
        StaticTransformBroadcaster(self).send_transform(
            stamped(self.frame_id, self.child_frame_id, place, self.clock.stamp())
        )
        self.log.info(
            f"Spinning until stopped - publishing transform from {self.frame_id!r} to {self.child_frame_id!r}"
        )


def _refuse_old(words: Sequence[str]) -> None:
    """Refuse what ROS 2 took up to Kilted: x y z, yaw pitch roll or qx qy qz qw, parent, child; with the words that say the same now."""
    turn = {8: ANGLES[::-1], 9: QUATERNION}.get(len(words))
    if turn is None or any(word.startswith("--") for word in words):
        return
    names = ("x", "y", "z", *turn, "frame-id", "child-frame-id")
    new = " ".join(f"--{name} {word}" for name, word in zip(names, words, strict=True))
    raise ValueError(f"static_transform_publisher: words without names are no longer taken by ROS 2; write {new}")


class _Parser(argparse.ArgumentParser):
    """Raises ``ValueError`` instead of ending the program, which may be a launch file with many nodes."""

    def error(self, message: str) -> NoReturn:
        raise ValueError(
            f"{self.prog}: {message}; it takes --x --y --z, --roll --pitch --yaw or --qx --qy --qz --qw, --frame-id and --child-frame-id"
        )


def arguments_parser() -> argparse.ArgumentParser:
    """What reads the words of the program."""
    parser = _Parser(prog="static_transform_publisher", allow_abbrev=False, add_help=False)
    for name in ("x", "y", "z"):
        parser.add_argument(f"--{name}", type=float, metavar="M", help=f"{name} of the translation, m (0)")
    for name in QUATERNION:
        parser.add_argument(f"--{name}", type=float, metavar="Q", help=f"{name[1]} of the rotation as a quaternion")
    for name in ANGLES:
        parser.add_argument(f"--{name}", type=float, metavar="RAD", help=f"{name} of the rotation, rad")
    parser.add_argument("--frame-id", default="", metavar="PARENT", help="the parent frame; required")
    parser.add_argument("--child-frame-id", default="", metavar="CHILD", help="the child frame; required")
    return parser
