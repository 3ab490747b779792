"""`plot /imu/data/angular_velocity/z`: a field of a topic over time, in the terminal, as PNG and as CSV."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING

from cli.command import Exit
from cli.parsing import add_common, positive_float
from cli.quality import add_qos_options

if TYPE_CHECKING:
    from cli.parsing import Verb

__all__ = ["main"]


def main(argv: Sequence[str]) -> int | Exit:
    """Plot until Ctrl-C, or as long as the options say."""
    parser = argparse.ArgumentParser(
        prog="python -m robot plot",
        usage="python -m robot plot [options] TOPIC/FIELD ...",
        description="Fields of topics over time, such as /imu/data/angular_velocity/z or /joint_states/position[0].",
    )
    parser.add_argument("fields", nargs="+", metavar="TOPIC/FIELD", help="one or more, of any topics")
    parser.add_argument("--window", type=positive_float, default=10.0, metavar="S", help="the last S seconds (10)")
    parser.add_argument("--duration", type=positive_float, metavar="S", help="end after S seconds")
    parser.add_argument("--csv", metavar="FILE", help="write time, field and value of every sample; - is the output")
    parser.add_argument("--png", metavar="FILE", help="draw all of it there at the end, by matplotlib")
    add_qos_options(parser, "subscription", "what fits the publishers")
    add_common(parser)
    options = parser.parse_args(list(argv))
    import asyncio

    from cli.parsing import until_signal
    from cli.plotting import plot

    verb: Verb = plot
    running = verb(options)
    assert not isinstance(running, (int, Exit))
    return asyncio.run(until_signal(running))
