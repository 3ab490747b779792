"""`view_frames`: listens to transforms for some seconds, and writes the tree of frames as a graph."""

from __future__ import annotations

import argparse
import asyncio
import shutil
import subprocess
import time
from pathlib import Path

from cli.command import CommandFailed, Exit
from cli.output import print_json
from cli.parsing import Parser, add_graph_options, add_json, complain, positive_float
from cli.verb import Verb


def _arguments(parser: Parser) -> None:
    parser.add_argument(
        "-t", "--wait-time", type=positive_float, default=5.0, metavar="S", help="how long to listen (5)"
    )
    parser.add_argument("-o", "--output", metavar="NAME", help="of the files (frames_DATE_TIME)")
    parser.add_argument("--tf_topic", default="/tf", metavar="TOPIC", help="of the transforms that change (/tf)")
    parser.add_argument("--tf_static_topic", default="/tf_static", metavar="TOPIC", help="of the others (/tf_static)")
    add_json(parser)
    add_graph_options(parser)


async def _view(options: argparse.Namespace) -> Exit:
    from actors.tf2 import Buffer, TransformListener
    from actors.tf2.description import as_dot
    from cli.graph.seen import seen

    async with seen(options, "view_frames") as graph:
        buffer = Buffer()
        TransformListener(buffer, graph.node, tf_topic=options.tf_topic, tf_static_topic=options.tf_static_topic)
        complain(f"Listening to tf data for {options.wait_time:g} seconds...")
        await asyncio.sleep(options.wait_time)
        frames, now = buffer.frames(), graph.node.clock.wall()
    if options.json:
        print_json({name: {**frame._asdict(), "rate": frame.rate} for name, frame in frames.items()})
    elif frames:
        print(buffer.all_frames_as_yaml(), end="")
    if not frames:
        raise CommandFailed(
            f"no transforms on {options.tf_topic} and {options.tf_static_topic} within {options.wait_time:g} s; "
            "is a publisher there? See: robactor topic info /tf"
        )
    _write(Path(options.output or time.strftime("frames_%Y-%m-%d_%H.%M.%S")), as_dot(frames, now))
    return Exit.DONE


def _write(name: Path, dot: str) -> None:
    """Write NAME.gv, and NAME.pdf if graphviz is there."""
    graph, picture = Path(f"{name}.gv"), Path(f"{name}.pdf")
    try:
        graph.write_text(dot, encoding="utf-8")
    except OSError as error:
        raise CommandFailed(f"{graph} cannot be written: {error.strerror}") from None
    complain(f"written: {graph}")
    program = shutil.which("dot")
    if program is None:
        complain(f"for a picture, install graphviz: dot -Tpdf {graph} -o {picture}")
        return
    done = subprocess.run(
        [program, "-Tpdf", str(graph), "-o", str(picture)], capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise CommandFailed(f"graphviz: {done.stderr.strip()}")
    complain(f"written: {picture}")


COMMAND = Verb(
    "view_frames",
    "the tree of frames, as a graph",
    _arguments,
    _view,
    description="Listen to transforms, and write the tree of frames as NAME.gv, and with graphviz as NAME.pdf.",
)
