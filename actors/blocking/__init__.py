"""A small blocking face for scripts, notebooks and threads, which have no event loop to await in.

::

    from actors import blocking

    with blocking.open_node("script", tree=tree()) as node:
        print(node.call(BATTERY, GetBatteryStatus.Request(robot_id="robot_01")))
        node.publish(CMD_VEL, Twist())
        scan = node.next(SCAN, timeout=2.0)
        with node.start(MOVE, MoveToPosition.Goal(target_x=3.0)) as goal:
            for feedback in goal:
                print(feedback)
            result = goal.result()

The node lives in the event loop of a background thread, or in that of a system which runs in another thread. Inside an event loop
everything here is refused at once, because blocking there would stop the very loop that has to bring the answer.

What is called as it is on `Node` means the same. A program that ends, by its last line, by an exception, by Ctrl-C or by SIGTERM, stops its
nodes in order, also when a block was entered by hand and never left.
"""

from __future__ import annotations

from actors.blocking.node import (
    BlockingGoal,
    BlockingNode,
    BlockingStream,
    InsideEventLoop,
    OpenBlockingNode,
    open_node,
)

__all__ = [
    "BlockingGoal",
    "BlockingNode",
    "BlockingStream",
    "InsideEventLoop",
    "OpenBlockingNode",
    "open_node",
]
