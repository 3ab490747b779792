"""The robot in the kitchen, for the stories of fetching and carrying."""

from __future__ import annotations

from actors import Supervisor
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import Point, Pose, PoseStamped
from actors.interfaces.std_msgs.msg import Header
from actors.testing import Rig
from robot.geometry.messages import pose_stamped
from robot.geometry.planar import Pose2
from robot.hardware.body import Body
from robot.scenes.worlds import get_world
from robot.sim.battery import Pack
from robot.tree import robot_tree

KITCHEN = get_world("kitchen")
CUP = KITCHEN.things[0]
"""At (2, 1), in sight from the start; the box is known too, but behind the robot's back."""
OTHER_TABLE = Point(x=1.9, y=-1.0, z=0.4)


def at(x: float, y: float) -> PoseStamped:
    return pose_stamped(Pose2(x, y), Time())


def upon(point: Point) -> PoseStamped:
    return PoseStamped(header=Header(frame_id="map"), pose=Pose(position=point))


def fetching_tree(body: Body) -> Supervisor:
    """The robot's own tree without a mission: nobody else asks it to walk."""
    return robot_tree(body, Pack(90.0), None)


async def awake(rig: Rig, body: Body) -> Body:
    """Start the robot in the kitchen and let it find out where it is."""
    await rig.start(fetching_tree(body))
    await rig.advance(1.0)
    return body
