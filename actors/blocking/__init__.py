"""Nodes with blocking methods, for scripts, notebooks and threads, which have no event loop in which to await.

::

    from actors import blocking

    with blocking.open_node("script", tree=tree()) as node:
        print(node.call(BATTERY, GetBatteryStatus.Request(robot_id="robot_01")))
        node.publish(CMD_VEL, Twist())
        scan = node.next(SCAN, timeout=2.0)
        with node.send_goal(MOVE, MoveToPosition.Goal(target_x=3.0)) as goal:
            for feedback in goal:
                print(feedback)
            result = goal.result()

The node runs in the event loop of a background thread, or in that of a system which runs in another thread. In a thread whose event loop
runs nodes, everything here raises `InsideEventLoop` at once, because a blocking call there would stop them. The event loop of a notebook's
kernel runs none, so a cell may block.

A method means the same as the method of `Node` with its name. A program that ends, by its last line, an exception, Ctrl-C or SIGTERM, stops
its nodes in order, also if a block was entered by hand and never left.
"""

from __future__ import annotations

from actors.blocking.handles import BlockingGoal, BlockingStream
from actors.blocking.node import BlockingNode, InsideEventLoop, OpenBlockingNode, open_node

__all__ = [
    "BlockingGoal",
    "BlockingNode",
    "BlockingStream",
    "InsideEventLoop",
    "OpenBlockingNode",
    "open_node",
]
