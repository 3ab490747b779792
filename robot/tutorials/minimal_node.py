"""The smallest node: it says hello, and lives until it is stopped."""

from __future__ import annotations

from actors import Node, Supervisor
from robot.tutorials.program import main, system


class MinimalNode(Node):
    """Says hello. No topics, services or parameters."""

    async def on_start(self) -> None:
        self.log.info("Hello ROS 2!")


def tree() -> Supervisor:
    """One node that says hello."""
    return system("minimal_node", MinimalNode)


if __name__ == "__main__":
    main(tree)
