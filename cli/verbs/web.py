"""`web`: the page, and the protocols of viewers and browsers, for any running graph or a recording."""

from __future__ import annotations

from pathlib import Path

from cli.parsing import Parser, add_graph_options, port
from cli.verb import Verb


def _arguments(parser: Parser) -> None:
    parser.add_argument(
        "recording",
        type=Path,
        nargs="?",
        metavar="BAG",
        help="show this bag, file or flight record instead of the graph",
    )
    parser.add_argument("--port", type=port, metavar="N", help="listen on this port, or the next that is free (8765)")
    parser.add_argument(
        "--host", default="127.0.0.1", metavar="H", help="listen on this address; needs ROBACTOR_WEB_TOKEN"
    )
    parser.add_argument(
        "--origin",
        action="append",
        default=[],
        metavar="URL",
        help="pages of this origin may connect, such as https://host",
    )
    parser.add_argument("--bags", type=Path, metavar="DIR", help="record bags into this folder, and show those in it")
    add_graph_options(parser)


COMMAND = Verb(
    "web",
    "the web page, Foxglove, rosbridge",
    _arguments,
    "cli.web.verb:serve",
    description="Serve the web page, Foxglove, rosbridge and /metrics on one port: for the graph of ROS_DOMAIN_ID, or for a recording.",
)
