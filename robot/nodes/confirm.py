"""The confirmation of an object: collects the camera's detections of it until enough of them agree."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from math import hypot, isfinite
from statistics import median

from actors import Node, parameter
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import Point, PointStamped
from actors.interfaces.std_msgs.msg import Header
from actors.tf2 import Buffer, Transform, TransformException, TransformListener
from robot.contracts import CONFIRM_OBJECT, DETECTIONS
from robot.geometry.vectors import Triple
from robot.interfaces.robactor_msgs.msg import Detection
from robot.interfaces.robactor_msgs.srv import ConfirmObject, ConfirmObject_Request, ConfirmObject_Response
from robot.scenes.objects import Look

FRAME = "base_link"
AGREED = 0.05
"""Detections that are all this near to their middle are of one object that stands still, m."""
VISIBLE_DEPTH = 0.8
"""How far the middle of an object's visible side is in front of its own middle, in shares of half its thickness: a round one's mean is pi/4."""


class ObjectConfirmation(Node):
    """Serves confirm_object_detection for the objects it knows the looks of; listens to camera/detections only while it is asked.

    An object is confirmed when `images` detections of its color within `patience` seconds agree on a place. The answer's position is the
    object's middle in base_link, at the latest of them. Parameters: images, patience.
    """

    images = parameter(3, ge=1, le=100, description="Detections that must agree.")
    patience = parameter(1.5, unit="s", ge=0.1, le=60.0, description="How long to look.")

    def __init__(self, looks: Mapping[str, Look]) -> None:
        self._looks = looks

    async def on_start(self) -> None:
        self._frames = Buffer()
        TransformListener(self._frames, self)

    @CONFIRM_OBJECT.serve(concurrent=2)
    async def confirm(self, request: ConfirmObject_Request) -> ConfirmObject_Response:
        name = request.object_name
        look = self._looks.get(name)
        if look is None:
            known = ", ".join(self._looks) or "none"
            return ConfirmObject.Response(message=f"there is no object called {name!r}; known are: {known}")
        seen: list[Triple] = []
        problem = ""
        try:
            async with asyncio.timeout(self.patience):
                async with self.subscribe(DETECTIONS) as detections:
                    async for detection in detections:
                        place = detection.position
                        if detection.label != look.label or not isfinite(place.x + place.y + place.z):
                            continue
                        try:
                            seen.append(await self._in_base(detection, look))
                        except TransformException as error:
                            problem = f": {error}"
                        if len(seen) >= self.images and (middle := _agreed(seen[-self.images :])) is not None:
                            return _found(name, middle, detection.header.stamp)
        except TimeoutError:
            pass
        if seen:
            return ConfirmObject.Response(
                message=f"{name} was seen {len(seen)} times, but not {self.images} times in one place"
            )
        return ConfirmObject.Response(message=f"{name} is not in sight{problem}")

    async def _in_base(self, detection: Detection, look: Look) -> Triple:
        """The object's middle in base_link. Raises `TransformException`."""
        frame, stamp = detection.header.frame_id, detection.header.stamp
        place = detection.position
        point, eye = (place.x, place.y, place.z), (0.0, 0.0, 0.0)
        if frame != FRAME:
            transform = Transform.from_msg(await self._frames.lookup_transform_async(FRAME, frame, stamp, timeout=0.3))
            point, eye = transform.point(point), transform.translation
        x, y, z = point
        away = hypot(x - eye[0], y - eye[1])
        further = 1.0 + VISIBLE_DEPTH * look.thickness / 2 / away if away > 0.0 else 1.0
        return (eye[0] + (x - eye[0]) * further, eye[1] + (y - eye[1]) * further, z)


def _found(name: str, place: Triple, seen: Time) -> ConfirmObject_Response:
    """A reply with the place in base_link at the stamp of the last picture."""
    x, y, z = place
    position = PointStamped(header=Header(stamp=seen, frame_id=FRAME), point=Point(x=x, y=y, z=z))
    return ConfirmObject.Response(success=True, message=f"{name} confirmed", position=position)


def _agreed(places: list[Triple]) -> Triple | None:
    """The middle of places that are all near to it."""
    x, y, z = (median(axis) for axis in zip(*places, strict=True))
    near = all(hypot(px - x, py - y, pz - z) <= AGREED for px, py, pz in places)
    return (x, y, z) if near else None
