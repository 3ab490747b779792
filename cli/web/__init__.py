"""`python -m robot web`: the page, and the protocols of viewers and browsers, for any running graph or a recording."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from cli.command import Exit
from cli.parsing import add_graph_options, until_signal

__all__ = ["main"]


def main(argv: Sequence[str]) -> int | Exit:
    """Serve until Ctrl-C."""
    options = parser().parse_args(list(argv))
    import asyncio  # late, so that no help waits for it

    from cli.web.verb import serve

    return asyncio.run(until_signal(serve(options)))


def parser() -> argparse.ArgumentParser:
    """The options."""
    made = argparse.ArgumentParser(
        prog="python -m robot web",
        description="Serve the web page, Foxglove, rosbridge and /metrics on one port: for the graph of ROS_DOMAIN_ID, or for a recording.",
    )
    made.add_argument(
        "recording",
        type=Path,
        nargs="?",
        metavar="BAG",
        help="show this bag, file or flight record instead of the graph",
    )
    made.add_argument("--port", type=int, metavar="N", help="listen on this port, or the next that is free (8765)")
    made.add_argument(
        "--host", default="127.0.0.1", metavar="H", help="listen on this address; needs ROBACTOR_WEB_TOKEN"
    )
    made.add_argument(
        "--origin",
        action="append",
        default=[],
        metavar="URL",
        help="pages of this origin may connect, such as https://host",
    )
    made.add_argument("--bags", type=Path, metavar="DIR", help="record bags into this folder, and show those in it")
    add_graph_options(made)
    return made
