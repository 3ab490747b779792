"""`static_transform_publisher --frame-id A --child-frame-id B ...`: publishes one transform that never changes until Ctrl-C."""

from __future__ import annotations

from collections.abc import Sequence

from cli.command import Exit


class StaticTransformPublisher:
    """The node of that name, with the words of tf2_ros' program and the arguments of ROS 2."""

    name = "static_transform_publisher"
    help = "a transform that never changes"

    def main(self, argv: Sequence[str]) -> int | Exit:
        """Run the node, or print its options."""
        if "-h" in argv or "--help" in argv:
            return print_help()
        from cli.verbs.run import COMMAND as RUN  # late: `run` imports this module

        return RUN.main(["tf2_ros", "static_transform_publisher", *argv])


def print_help() -> Exit:
    """Print its options."""
    from actors.nodes.static_transform_publisher import arguments_parser

    print(arguments_parser().format_help(), end="")
    return Exit.DONE


COMMAND = StaticTransformPublisher()
