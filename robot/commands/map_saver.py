"""`map_saver_cli -f NAME`: save the map of the graph as NAME.yaml and a picture, in the words of nav2_map_server's program."""

from __future__ import annotations

import argparse
import asyncio
import time
from typing import TYPE_CHECKING

from cli.command import CommandFailed, Exit
from cli.parsing import Parser, add_graph_options, positive_float
from cli.verb import Verb

if TYPE_CHECKING:
    from actors.interfaces.nav_msgs.msg import OccupancyGrid
    from robot.nodes.map_files import Occupancy

WAIT = 2.0
"""Seconds to wait for a map, unless told otherwise: the parameter save_map_timeout of nav2's program."""


def _arguments(parser: Parser) -> None:
    parser.add_argument("-f", dest="name", metavar="NAME", help="of the files, without an ending (map_SECONDS)")
    parser.add_argument("-t", dest="topic", metavar="TOPIC", default="map", help="where the map is (map)")
    parser.add_argument("--occ", type=float, metavar="P", help="occupied from this share on (0.65)")
    parser.add_argument("--free", type=float, metavar="P", help="free up to this share (0.196)")
    parser.add_argument("--fmt", choices=("pgm", "png"), help="of the picture (pgm; in mode scale png)")
    modes = ("trinary", "scale", "raw")
    parser.add_argument("--mode", choices=modes, default=modes[0], metavar="MODE", help=f"{', '.join(modes)} (trinary)")
    parser.add_argument("--timeout", type=positive_float, default=WAIT, metavar="S", help="wait so long for it (2)")
    add_graph_options(parser)


async def _save(options: argparse.Namespace) -> Exit:
    from robot.nodes.map_files import FREE_BELOW, OCCUPIED_ABOVE, write_map

    heard = await _heard(options)
    try:
        file = write_map(
            _occupancy(heard), options.name or f"map_{int(time.time())}", mode=options.mode, image_format=options.fmt,
            occupied=OCCUPIED_ABOVE if options.occ is None else options.occ,
            free=FREE_BELOW if options.free is None else options.free,
        )  # fmt: skip
    except (ValueError, ImportError, OSError) as error:
        raise CommandFailed(f"the map is not saved: {error}") from None
    print(f"Map of {heard.info.width} X {heard.info.height} @ {heard.info.resolution:.3g} m/cell saved to {file}")
    return Exit.DONE


async def _heard(options: argparse.Namespace) -> OccupancyGrid:
    """The first map that comes."""
    from actors import Topic, qos
    from actors.interfaces.nav_msgs.msg import OccupancyGrid
    from cli.graph.seen import seen
    from cli.graph.view import absolute

    topic = absolute(options.topic)
    async with (
        seen(options, "map_saver") as graph,
        graph.node.subscribe(Topic(OccupancyGrid, topic, qos.STATE)) as maps,
    ):
        try:
            async with asyncio.timeout(options.timeout):
                return await anext(aiter(maps))
        except TimeoutError:
            raise CommandFailed(f"no map on {topic} for {options.timeout:g} s") from None


def _occupancy(message: OccupancyGrid) -> Occupancy:
    """As it is written. Raises `ValueError` for a turned map."""
    import numpy as np

    from robot.nodes.map_files import Occupancy

    info, turn = message.info, message.info.origin.orientation
    if (turn.x, turn.y, turn.z) != (0.0, 0.0, 0.0):
        raise ValueError("it is turned, and a map with a yaw is not written")
    data = np.asarray(message.data, dtype=np.int8).reshape(info.height, info.width)
    return Occupancy(data, info.resolution, info.origin.position.x, info.origin.position.y)


COMMAND = Verb(
    "map_saver_cli",
    "the map, as a file for map_server",
    _arguments,
    _save,
    description="Save the occupancy grid of a topic as map_server reads it.",
)
