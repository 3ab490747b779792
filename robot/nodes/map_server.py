"""The map server: publishes the occupancy grid and answers where named places are."""

from __future__ import annotations

from collections.abc import Mapping

from actors import Node, publishes
from actors.interfaces.geometry_msgs.msg import Pose
from actors.interfaces.nav_msgs.msg import MapMetaData, OccupancyGrid
from actors.interfaces.std_msgs.msg import Header
from actors.suggest import did_you_mean
from robot.contracts import GET_PLACE, MAP
from robot.geometry.messages import pose_stamped
from robot.geometry.planar import Pose2
from robot.interfaces.robactor_msgs.srv import GetPlace, GetPlace_Request, GetPlace_Response
from robot.planning.grid import Grid


class MapServer(Node):
    """Publishes the map once, latched; serves get_place: a name such as ``shelf_3`` -> the pose to stand at, frame `map`."""

    map = publishes(MAP)

    def __init__(self, grid: Grid, places: Mapping[str, Pose2]) -> None:
        self._grid = grid
        self._places = places

    async def on_start(self) -> None:
        grid, stamp = self._grid, self.clock.stamp()
        origin = Pose(position=pose_stamped(Pose2(grid.origin_x, grid.origin_y), stamp).pose.position)
        info = MapMetaData(
            map_load_time=stamp, resolution=grid.resolution, width=grid.width, height=grid.height, origin=origin
        )
        self.map(OccupancyGrid(header=Header(stamp=stamp, frame_id="map"), info=info, data=grid.to_occupancy()))

    @GET_PLACE.serve()
    async def get_place(self, request: GetPlace_Request) -> GetPlace_Response:
        """The place of that name. An unknown name is answered with success False and the names that come closest, or all."""
        place = self._places.get(request.name)
        if place is None:
            return GetPlace.Response(success=False, message=self._unknown(request.name))
        words = f"{request.name} is at ({place.x:.2f}, {place.y:.2f}), heading {place.yaw:.2f} rad"
        return GetPlace.Response(success=True, pose=pose_stamped(place, self.clock.stamp()), message=words)

    def _unknown(self, name: str) -> str:
        if not self._places:
            return f"the map has no place called {name!r}: it has no named places at all"
        near = did_you_mean(name, self._places, "did", most=3, cutoff=0.5, quoted=False)
        hint = near or f"there are: {', '.join(self._places)}"
        return f"the map has no place called {name!r}; {hint}"
