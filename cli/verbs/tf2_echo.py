"""`tf2_echo TARGET SOURCE`: the transform between two frames, again and again, in the shape of tf2_ros' program."""

from __future__ import annotations

import argparse
import asyncio
from collections.abc import Sequence
from math import degrees
from typing import TYPE_CHECKING

from cli.command import CommandFailed, Exit
from cli.parsing import Parser, add_graph_options, complain, natural, positive_float
from cli.verb import Verb

if TYPE_CHECKING:
    from actors.interfaces.geometry_msgs.msg import TransformStamped
    from actors.tf2 import Buffer
    from actors.time import Time


def _arguments(parser: Parser) -> None:
    parser.add_argument("target", metavar="TARGET")
    parser.add_argument("source", metavar="SOURCE")
    parser.add_argument("-r", "--rate", type=positive_float, default=1.0, metavar="HZ", help="how often (1)")
    parser.add_argument("-t", "--time", type=positive_float, metavar="S", help="at this time, instead of the latest")
    parser.add_argument("-p", "--precision", type=natural, default=3, metavar="N", help="digits after the point (3)")
    parser.add_argument("--once", action="store_true", help="print one, and end")
    parser.add_argument("--timeout", type=positive_float, metavar="S", help="give up after S seconds without one")
    add_graph_options(parser)


async def _echo(options: argparse.Namespace) -> Exit:
    from actors.tf2 import Buffer, TransformException, TransformListener
    from actors.time import Time
    from cli.graph.seen import seen

    time = None if options.time is None else Time(seconds=options.time)
    async with seen(options, "tf2_echo") as graph:
        buffer = Buffer()
        TransformListener(buffer, graph.node)
        await _wait(buffer, options, time)
        while True:
            try:
                print(shown(buffer.lookup_transform(options.target, options.source, time), options.precision))
            except TransformException as error:
                print(f"Failure at {graph.node.clock.wall():.6f}\nException thrown: {error}")
                print(f"The current list of frames is:\n{buffer.all_frames_as_string()}")
            if options.once:
                return Exit.DONE
            await asyncio.sleep(1.0 / options.rate)


async def _wait(buffer: Buffer, options: argparse.Namespace, time: Time | None) -> None:
    """Wait for the first transform, and say every second why there is none."""
    from actors.tf2 import ExtrapolationException, TransformException

    end = None if options.timeout is None else asyncio.get_running_loop().time() + options.timeout
    while True:
        left = 1.0 if end is None else max(0.0, min(1.0, end - asyncio.get_running_loop().time()))
        try:
            await buffer.lookup_transform_async(options.target, options.source, time, timeout=left)
            return
        except TransformException as error:
            if isinstance(error, ExtrapolationException) and error.past:
                await asyncio.sleep(left)  # it was raised at once: nothing that comes can change it
            if end is not None and asyncio.get_running_loop().time() >= end:
                raise CommandFailed(f"no transform {options.target} -> {options.source}: {error}") from None
            complain(f"Waiting for transform {options.target} -> {options.source}: {error}")


def shown(transform: TransformStamped, precision: int) -> str:
    """The transform as text: translation, rotation in four forms."""
    from actors.tf2 import Transform

    def numbers(values: Sequence[float]) -> str:
        return ", ".join(f"{value + 0.0:.{precision}f}" for value in values)

    there, stamp = Transform.from_msg(transform), transform.header.stamp
    w, x, y, z = there.rotation
    rows = [[*row, shift] for row, shift in zip(there.matrix.tolist(), there.translation, strict=True)]
    return "\n".join(
        [
            f"At time {stamp.sec}.{stamp.nanosec:09d}",
            f"- Translation: [{numbers(there.translation)}]",
            f"- Rotation: in Quaternion (xyzw) [{numbers((x, y, z, w))}]",
            f"- Rotation: in RPY (radian) [{numbers(there.rpy)}]",
            f"- Rotation: in RPY (degree) [{numbers([degrees(angle) for angle in there.rpy])}]",
            "- Matrix:",
            *("".join(f" {value + 0.0:6.{precision}f}" for value in row) for row in [*rows, [0.0, 0.0, 0.0, 1.0]]),
        ]
    )


COMMAND = Verb(
    "tf2_echo",
    "the transform between two frames",
    _arguments,
    _echo,
    description="The transform that takes points of the frame SOURCE to the frame TARGET: the pose of SOURCE in TARGET.",
)
