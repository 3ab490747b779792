"""The program of a process of a tree: ``python -m actors.processes.main CHANNEL NOTES NAME [fenced]``, started by `os_process.start`."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import sys
import threading
from collections.abc import Sequence
from contextlib import suppress
from math import inf
from typing import Final

from msgspec import structs

from actors.logs import WARN
from actors.places import line_of
from actors.processes.channel import Channel, framed, read_frame
from actors.processes.child_processes import ChildProcesses
from actors.processes.child_tree import ChildTree
from actors.processes.messages import (
    BEAT,
    MOST_BEAT_SECONDS,
    Event,
    Line,
    Order,
    Over,
    Request,
    beat_seconds,
    next_beat,
)
from actors.processes.preparation import prepare
from actors.processes.signals import PARENT, end_with_parent, leave_to_parent
from actors.processes.watchdog import ORPHAN_SECONDS, Watchdog
from actors.runtime.stall import work_of
from actors.supervision.reasons import Failed
from actors.time.real_loop import new_event_loop

MOST_UNSENT: Final = 1_000_000
"""While the parent leaves so many bytes unread, log lines are counted instead of sent."""
ORPHANED: Final = "its parent process is gone"


def main(arguments: Sequence[str]) -> int:
    """The program: runs the order that comes by the channel."""
    leave_to_parent()
    fenced = len(arguments) > 3
    end_with_parent(signal.SIGKILL if fenced else PARENT)
    return live(int(arguments[0]), int(arguments[1]), fenced=fenced)


def live(channel_descriptor: int, notes: int, *, fenced: bool = False, parent: int | None = None) -> int:
    """Read the order from the channel, and run it to its end; returns the exit code. In place of an order a function may come, which is called.

    `parent` is the process descriptor of the parent, if this process was forked by a zygote: the system then kills it with the zygote only as
    long as it has no order.
    """
    with socket.socket(fileno=channel_descriptor) as channel:
        try:
            prepare(read_frame(channel))
            order = read_frame(channel)
        except EOFError:
            return 1
        except Exception as error:  # what the order names cannot be imported here
            channel.sendall(framed(Over(Failed(error))))
            return 1
        if parent is not None or not isinstance(order, Order):
            end_with_parent(0)
        if not isinstance(order, Order):
            order()
            return 0
        with asyncio.Runner(loop_factory=new_event_loop) as runner:
            runner.run(serve(order, channel, notes, fenced=fenced, parent=parent))
    return 0


class Served:
    """One order, served over a channel. Made in the event loop that runs it.

    Invariants: a log line is either sent or counted in `_lost`, and the count is sent as soon as the parent reads again. A timer for the next
    beat is running while `run` does.
    """

    def __init__(
        self, order: Order, channel: socket.socket, notes: int, *, fenced: bool = False, parent: int | None = None
    ) -> None:
        self._socket = channel
        self._notes = notes
        self._path = order.path
        self._period = beat_seconds(order.spec.hang)
        self._loop = asyncio.get_running_loop()
        self._thread = threading.get_ident()
        self._started_by = os.getppid()
        self._parent = parent
        self._lost = 0
        self._told = -inf
        """When the parent was last told of changes that nothing else tells of."""
        self._closed = asyncio.Event()
        self._channel = Channel(self._asked, self._left)
        transport = order.transport()
        self._hosted = ChildTree(
            order, transport, self.tell, lambda runtime: ChildProcesses(runtime, transport, order.recorders)
        )
        self._watchdog = Watchdog(
            channel.fileno(), notes, self.where, orphan_seconds=0.0 if fenced else ORPHAN_SECONDS, parent=parent
        )

    async def run(self) -> None:
        """Run the order to its end, and return when the parent has been told of it."""
        loop = self._loop
        await loop.create_connection(lambda: self._channel, sock=self._socket)
        loop.add_signal_handler(PARENT, self._signaled)
        if self._parent is not None:
            loop.add_reader(self._parent, self._orphaned, self._parent)
        self._watchdog.start()
        os.set_blocking(self._notes, False)
        self._beat()
        try:
            await self._hosted.run()
        finally:
            self._beating.cancel()
            self._channel.close()
            await self._closed.wait()
            self._watchdog.stop()

    def tell(self, event: Event) -> None:
        """Send an event to the parent. Never waits: log lines that the parent does not read in time are lost, and counted."""
        if not isinstance(event, Line):
            self._channel.send(event)
        elif self._channel.unsent > MOST_UNSENT:
            self._lost += 1
        else:
            self._tell_lost()
            self._send_line(event)

    def _tell_lost(self) -> None:
        """Tell how many log lines were lost, once there is room for more."""
        if self._lost and self._channel.unsent <= MOST_UNSENT:
            lost, self._lost = self._lost, 0
            fields: dict[str, object] = {
                "lines": lost,
                "because": "they came faster than the parent process reads them",
            }
            self._send_line(Line(self._loop.time(), WARN, "/".join(self._path), 1, "log lines were lost", fields))

    def _send_line(self, line: Line) -> None:
        try:
            self._channel.send(line)
        except Exception:  # a field cannot be copied
            self._channel.send(structs.replace(line, fields={key: repr(value) for key, value in line.fields.items()}))

    def _beat(self) -> None:
        now = self._loop.time()
        self._beating = self._loop.call_at(next_beat(now, self._period), self._beat)
        self._watchdog.turned()
        with suppress(OSError):  # the parent has not looked for very long, or is gone
            os.write(self._notes, BEAT)
        # One that must not hang for long beats more often than it tells this.
        if now - self._told >= MOST_BEAT_SECONDS - 0.5 * self._period:
            self._told = now
            self._hosted.tell_nodes()
            self._tell_lost()

    def _asked(self, request: Request) -> None:
        self._hosted.take(request)

    def _signaled(self) -> None:
        """The parent has asked for the end, or has ended."""
        if self._parent is not None or os.getppid() == self._started_by:
            self._hosted.terminate()
        else:
            self._hosted.stop(ORPHANED)

    def _orphaned(self, parent: int) -> None:
        """The parent has ended."""
        self._loop.remove_reader(parent)
        self._hosted.stop(ORPHANED)

    def _left(self) -> None:
        """The channel is closed: by this process at its end, or because the parent is gone."""
        self._closed.set()
        self._hosted.stop(ORPHANED)

    def where(self) -> str:
        """What the event loop is doing, as far as it can be told from another thread: node, handler and line."""
        task = asyncio.current_task(self._loop)
        record = None if task is None else self._hosted.system.runtime.directory.owner_of(task)
        doing = "" if task is None else work_of(None if record is None else record.inbox, task)
        return " ".join(
            filter(None, ("" if record is None else record.identity.fqn, doing, f"at {line_of(self._thread)}"))
        )


async def serve(
    order: Order, channel: socket.socket, notes: int, *, fenced: bool = False, parent: int | None = None
) -> None:
    """Run an order to its end; `fenced`: or until the parent is gone. `parent` is as for `live`."""
    await Served(order, channel, notes, fenced=fenced, parent=parent).run()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
