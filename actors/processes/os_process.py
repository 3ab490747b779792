"""`OsProcess`: a process of the system, an interpreter of its own or the fork of a zygote; this process watches it and its event loop."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import Any, Final, NamedTuple

from actors.errors import ProcessDied, ProcessHung
from actors.logs import WARN
from actors.processes.channel import Channel, framed
from actors.processes.forked import UNKNOWN, Forked, Zygote, here
from actors.processes.messages import BEAT, Event, Line, Opaque, Order, Request, beat_seconds, next_beat
from actors.processes.pickling import unpack
from actors.processes.preparation import environment, preparation
from actors.processes.signals import PARENT, held_back
from actors.processes.zygote import PROGRAM
from actors.time.processor import Processor, is_runnable

NAMED_SECONDS: Final = 0.3
"""An event loop that has not turned for so many seconds is logged, with what it is doing;"""
LATEST_SECONDS: Final = 0.5
"""if that is not known, because no thread of the process can tell, after so many seconds."""
DRAINED_SECONDS: Final = 0.1
"""How long the channel of a process that has exited may stay open, because a process that it forked holds it; seconds."""
CLOSED_SECONDS: Final = 1.0
"""How long a process may go on after it has closed its channel; then it is killed. Seconds."""
_MOST_TOLD: Final = 65536
"""As many bytes as a pipe holds."""
EXIT_POLL: Final = 0.02
"""Seconds between two looks for the end of a process, where the system has no process descriptors."""


class Started(NamedTuple):
    """A process that waits for its preparation and its order at the other end of `channel`; `notes` is our end of its pipe for beats and
    notes."""

    popen: subprocess.Popen[bytes] | Forked
    channel: socket.socket
    notes: int


async def spawn(order: Order, take: Callable[[Event], None], waiting: Started | None = None) -> OsProcess:
    """Give `order` to a process, which is launched unless one is `waiting` with its preparation; `take` gets what it tells. Raises
    OSError if the system cannot start it."""
    frames = framed(order)
    if waiting is None:
        frames = framed(preparation(main=b"__main__" in frames)) + frames
        waiting = start("/".join(order.path), fenced=order.placement.away)
    return await employ(waiting, order.path, order.spec.hang, frames, take)


def start(name: str, *, fenced: bool) -> Started:
    """Start an interpreter, which `ps` shows with this name. `fenced`: it is killed with this process, where otherwise its nodes have time to
    end. Raises OSError."""
    with _ends() as (ours, theirs, notes, noting), held_back():
        popen = subprocess.Popen(  # in this thread, with whose end the system ends the process
            [
                *(sys.executable, "-m", PROGRAM, str(theirs.fileno()), str(noting), name),
                *(("fenced",) if fenced else ()),
            ],
            pass_fds=(theirs.fileno(), noting),
            stdin=subprocess.DEVNULL,
            env=environment(),
        )
        return Started(popen, ours, notes)


def fork(zygote: Zygote, name: str) -> Started:
    """Have a zygote fork a process, which waits as an interpreter does that `start` has started. Raises OSError if the zygote has ended."""
    with _ends() as (ours, theirs, notes, noting):
        return Started(zygote.fork(name, theirs.fileno(), noting), ours, notes)


@contextmanager
def _ends() -> Generator[tuple[socket.socket, socket.socket, int, int]]:
    """Both ends of the channel and of the pipe for notes. The process's are closed here at the end of the block, ours if it fails."""
    ours, theirs = socket.socketpair()
    notes, noting = os.pipe()
    try:
        yield ours, theirs, notes, noting
    except BaseException:
        ours.close()
        os.close(notes)
        raise
    finally:
        theirs.close()
        os.close(noting)


def prepared(name: str, frame: bytes, *, fenced: bool, zygote: Zygote | None = None) -> Started:
    """Start an interpreter, as `start` does, or have a zygote fork one, and send it its preparation, a frame. Raises OSError."""
    started = start(name, fenced=fenced) if zygote is None else fork(zygote, name)
    try:
        started.channel.sendall(frame)
    except OSError:
        discard(started)
        raise
    return started


def call(name: str, function: Callable[[], object]) -> subprocess.Popen[bytes] | Forked:
    """Call a function, which `pickle` can copy, in a process of its own, which ends with it. Nobody watches that process, and it ends no sooner
    when this one does. Raises OSError."""
    started = prepared(name, framed(preparation(main=False)) + framed(function), fenced=False, zygote=here())
    started.channel.close()
    os.close(started.notes)
    return started.popen


def still_waiting(started: Started | None) -> Started | None:
    """A process that has its preparation and no order; None, and it is done away with, if it has died while it waited."""
    if started is not None and started.popen.poll() is not None:
        discard(started)
        return None
    return started


def discard(started: Started) -> None:
    """End a process that has no order. One that a zygote forks ends by itself then, or with the zygote."""
    started.channel.close()
    os.close(started.notes)
    if isinstance(started.popen, Forked):
        started.popen.abandon()
    else:
        started.popen.kill()
        started.popen.wait()


async def employ(
    started: Started,
    path: tuple[str, ...],
    hang: float,
    frames: bytes,
    take: Callable[[Any], None],
    read: Callable[[bytes], object] = unpack,
) -> OsProcess:
    """Send a process what it waits for; `take` gets what it tells, as `read` makes it. `path` and `hang` are those of its child."""
    process = OsProcess(started.popen, path, hang, take, started.notes, read)
    await process.connect(started.channel, frames)
    return process


class OsProcess:
    """A process that `employ` has given an order (`life.Process`).

    Invariants:

    - `ended` is done once the process has exited and its channel is closed, so everything that it told has been taken before.
    - `_silent` is how long no beat has come, counted by the ticks of this loop: a loop of the parent that stands still blames nobody. Nor does
      time count for which the process had no processor.
      Beats and notes wait in their pipe for the next tick, so that they do not wake this loop.
    """

    def __init__(
        self,
        popen: subprocess.Popen[bytes] | Forked,
        path: tuple[str, ...],
        hang: float,
        take: Callable[[Any], None],
        notes: int,
        read: Callable[[bytes], object] = unpack,
    ) -> None:
        self._popen = popen
        self._path = path
        self._hang = hang
        self._take = take
        self._notes = notes
        self._where = ""
        """What the process was doing when its loop stood still, as it noted itself."""
        self._loop = loop = asyncio.get_running_loop()
        self.ended: asyncio.Future[Exception] = loop.create_future()
        self._channel = Channel(take, self._lost, read)
        self._silent = 0.0
        self._named = False
        """Whether it has been logged that the loop stands still."""
        self._hung = False
        self._gone = self._closed = False
        """Whether the process has exited, and whether its channel is closed."""
        self._timer: asyncio.TimerHandle | None = None
        self._period = beat_seconds(self._hang)
        self._processor = Processor(str(popen.pid))
        self._share = self._processor.share()
        os.set_blocking(notes, False)
        self._watch_exit()

    def __repr__(self) -> str:
        return f"<process {self.id} of {'/'.join(self._path)}>"

    async def connect(self, ours: socket.socket, first: bytes) -> None:
        """Open the channel over our end of the socket pair, and send what the process needs first."""
        transport, _ = await self._loop.create_connection(lambda: self._channel, sock=ours)
        transport.write(first)

    @property
    def id(self) -> int:
        return self._popen.pid

    def send(self, request: Request | Opaque) -> None:
        """Send a request; it is lost if the process has ended."""
        self._channel.send(request)

    def terminate(self) -> None:
        """Send `PARENT`, unless the process has ended."""
        self._popen.send_signal(PARENT)

    def kill(self) -> None:
        """Send SIGKILL, unless the process has ended."""
        self._popen.send_signal(signal.SIGKILL)

    # -- its event loop -----------------------------------------------------------------------------------------------------

    def watch(self) -> None:
        """From now on, log it when the event loop of the process hangs, and kill the process when that lasts."""
        self._silent = 0.0
        self._timer = self._loop.call_at(next_beat(self._loop.time(), self._period), self._tick)

    def unwatch(self) -> None:
        """Let its event loop stand still from now on: the process ends."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _tick(self) -> None:
        self._timer = self._loop.call_at(next_beat(self._loop.time(), self._period), self._tick)
        self._listen()
        self._silent += self._period - self._starved()
        if self._silent >= self._hang and not self._hung:
            self._hung = True
            self.kill()
        elif not self._named and self._silent >= (NAMED_SECONDS if self._where else LATEST_SECONDS):
            self._named = True
            self._say(
                f"event loop does not turn for {self._silent:.2g} s",
                killed_after=self._hang,
                doing=self._where or "not known",
            )

    def _starved(self) -> float:
        """For how much of the last period the process had no processor, although it could have run, in seconds."""
        before, self._share = self._share, self._processor.share()
        if self._share == before and is_runnable(self.id):
            return self._period
        return min(self._period, self._share.waited - before.waited)

    def _listen(self) -> None:
        """Take what the process has written to its pipe since the last tick."""
        try:
            told = os.read(self._notes, _MOST_TOLD)
        except BlockingIOError:
            return
        _, beaten, note = told.rpartition(BEAT)
        if beaten:
            self._beaten()
        if note:  # since its last beat
            self._where = note.decode("utf-8", "replace").rstrip("\n").rpartition("\n")[2]

    def _beaten(self) -> None:
        if self._named:
            self._say("event loop turns again", after=round(self._silent, 3))
        self._silent, self._where, self._named = 0.0, "", False

    def _say(self, event: str, **fields: object) -> None:
        self._take(Line(self._loop.time(), WARN, "/".join(self._path), 1, event, fields))

    # -- its end ------------------------------------------------------------------------------------------------------------

    def _watch_exit(self) -> None:
        try:
            popen = self._popen
            descriptor = popen.exit_descriptor() if isinstance(popen, Forked) else os.pidfd_open(self.id)
        except (AttributeError, OSError):  # an older system
            self._loop.call_later(EXIT_POLL, self._poll)
        else:
            self._loop.add_reader(descriptor, self._exited, descriptor)

    def _poll(self) -> None:
        if self._popen.poll() is None:
            self._loop.call_later(EXIT_POLL, self._poll)
        else:
            self._exited(None)

    def _exited(self, descriptor: int | None) -> None:
        if descriptor is not None:
            self._loop.remove_reader(descriptor)
            os.close(descriptor)
        if self._popen.poll() is None:  # its zygote has ended, not it
            return self._watch_exit()
        self._gone = True
        if self._closed:
            self._finish()
        else:
            self._loop.call_later(DRAINED_SECONDS, self._channel.close)

    def _lost(self) -> None:
        self._closed = True
        if self._gone:
            self._finish()
        else:
            self._loop.call_later(CLOSED_SECONDS, self.kill)

    def _finish(self) -> None:
        self.unwatch()
        os.close(self._notes)
        self._processor.close()
        self.ended.set_result(self._end())

    def _end(self) -> Exception:
        if self._hung:
            return ProcessHung(self.id, self._hang, self._where)
        code = self._popen.returncode
        assert code is not None
        if code == UNKNOWN:
            return ProcessDied(self.id, "an exit code that is not known: the zygote that forked it had ended")
        if code >= 0:
            return ProcessDied(self.id, f"exit code {code}")
        name = signal.Signals(-code).name if -code in set(signal.Signals) else str(-code)
        hint = ", which the system sends when memory runs out" if -code == signal.SIGKILL else ""
        return ProcessDied(self.id, f"signal {name}{hint}")
