"""`plot /imu/data/angular_velocity/z`: a field of a topic over time, in the terminal, as PNG and as CSV."""

from __future__ import annotations

from cli.parsing import Parser, add_common, positive_float
from cli.quality import add_qos_options
from cli.verb import Verb


def _arguments(parser: Parser) -> None:
    parser.add_argument("fields", nargs="+", metavar="TOPIC/FIELD", help="one or more, of any topics")
    parser.add_argument("--window", type=positive_float, default=10.0, metavar="S", help="the last S seconds (10)")
    parser.add_argument("--duration", type=positive_float, metavar="S", help="end after S seconds")
    parser.add_argument("--csv", metavar="FILE", help="write time, field and value of every sample; - is the output")
    parser.add_argument("--png", metavar="FILE", help="draw all of it there at the end, by matplotlib")
    add_qos_options(parser, "subscription", "what fits the publishers, and 1000 messages deep")
    parser.set_defaults(qos_depth=1000)  # every sample counts, and the 5 of sensor data are 50 ms at 100 Hz
    add_common(parser)


COMMAND = Verb(
    "plot",
    "fields of topics over time",
    _arguments,
    "cli.verbs.plot.plotting:plot",
    description="Fields of topics over time, such as /imu/data/angular_velocity/z or /joint_states/position[0].",
)
