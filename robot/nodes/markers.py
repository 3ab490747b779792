"""What the robot is about, for viewers: which feet stand, the path that it follows, and the goal at its end."""

from __future__ import annotations

from typing import Final

from actors import Node, background, publishes
from actors.interfaces.geometry_msgs.msg import Point, Vector3
from actors.interfaces.nav_msgs.msg import Path
from actors.interfaces.std_msgs.msg import ColorRGBA, Header
from actors.interfaces.visualization_msgs.msg import Marker, MarkerArray
from robot.contracts import CONTACTS, MARKERS, PATH
from robot.hardware.body import LEGS
from robot.interfaces.robactor_msgs.msg import FootContacts
from robot.nodes.on_demand import while_heard

STANDING: Final = ColorRGBA(r=0.2, g=0.8, b=0.4, a=1.0)
LIFTED: Final = ColorRGBA(r=0.5, g=0.5, b=0.5, a=0.4)
PLANNED: Final = ColorRGBA(r=0.2, g=0.5, b=1.0, a=1.0)
BALL: Final = Vector3(x=0.09, y=0.09, z=0.09)
ARROW: Final = Vector3(x=0.5, y=0.08, z=0.08)
LINE: Final = Vector3(x=0.04)

RATE: Final = 5.0


class Markers(Node):
    """Publishes markers at 5 Hz while somebody listens: the feet (frames `fl_foot` and so on), path and goal (frame `map`).

    Takes foot_contacts and plan.
    """

    out = publishes(MARKERS)

    async def on_start(self) -> None:
        self._path = Path()

    @PATH.on()
    def path(self, message: Path) -> None:
        self._path = message

    @background
    async def show(self) -> None:
        newest = CONTACTS.qos.replace(depth=1)
        async for contacts in while_heard(self, self.out, CONTACTS, newest, lambda: RATE):
            self.out(MarkerArray(markers=(*_feet(contacts), *self._way())))

    def _way(self) -> list[Marker]:
        """The path as a line, and its end as an arrow; without a path those that were shown are taken away."""
        header = Header(frame_id="map", stamp=self._path.header.stamp)
        poses = self._path.poses
        if not poses:
            return [Marker(header=header, ns=name, action=Marker.DELETE) for name in ("path", "goal")]
        points = tuple(Point(x=pose.pose.position.x, y=pose.pose.position.y) for pose in poses)
        return [
            Marker(header=header, ns="path", type=Marker.LINE_STRIP, scale=LINE, color=PLANNED, points=points),
            Marker(header=header, ns="goal", type=Marker.ARROW, pose=poses[-1].pose, scale=ARROW, color=PLANNED),
        ]


def _feet(contacts: FootContacts) -> list[Marker]:
    """A ball at each foot, locked to its frame."""
    return [
        Marker(
            header=Header(frame_id=f"{leg}_foot"),
            ns="feet",
            id=number,
            type=Marker.SPHERE,
            scale=BALL,
            color=STANDING if stands else LIFTED,
            frame_locked=True,
        )
        for number, (leg, stands) in enumerate(zip(LEGS, contacts.contact.tolist(), strict=True))
    ]
