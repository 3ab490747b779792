"""`Zygote`: the process that forks those of a tree, as its parent sees it; `Forked`: one that it has forked."""

from __future__ import annotations

import asyncio
import os
import select
import signal
import socket
import subprocess
import sys
from collections.abc import Generator, Iterable
from contextlib import contextmanager, suppress
from typing import Final

from actors.processes.channel import HEAD, framed
from actors.processes.preparation import Preparation, environment, import_all
from actors.processes.signals import held_back
from actors.processes.zygote import NUMBER, PROGRAM, become, may_fork
from actors.runtime.preload import preload

UNKNOWN: Final = 256
"""The return code of a process whose zygote has ended before it: nobody has told."""
END_SECONDS: Final = 1.0
"""How long a zygote may take to end; then it is killed."""
MODULES: Final = (
    "actors.interfaces.type_description_interfaces.srv",
    "actors.transport.bridge",
    "actors.transport.format.attachments",
    "actors.transport.keyed.participant",
    "actors.transport.zenoh.transport",
    "zenoh",
    "zenoh.ext",
)
"""What every process of a tree needs."""
_ROOM: Final = 200
"""Bytes for the name of a process in the command line of its zygote, over which it is written."""


def can_fork() -> bool:
    """Whether this system has zygotes: forks that are safe, and process descriptors."""
    return sys.platform == "linux" and hasattr(os, "pidfd_open")


class Zygote:
    """A process that forks others when it is asked to. It ends with `close`, or by itself when this process is gone.

    `process` is it, and `control` our end of its channel. `started` and `forked` make one.
    """

    def __init__(self, process: subprocess.Popen[bytes] | _Fork, control: socket.socket) -> None:
        self._process = process
        self._control = control
        control.setblocking(False)

    @property
    def pid(self) -> int:
        """Of this process."""
        return self._process.pid

    def fork(self, name: str, channel: int, notes: int) -> Forked:
        """Have it fork a process with this name and these descriptors. Raises OSError if it has ended."""
        status, theirs = os.pipe()
        try:
            data = name.encode()
            socket.send_fds(self._control, [HEAD.pack(len(data)) + data], [channel, notes, theirs])
        except BaseException:
            os.close(status)
            raise
        finally:
            os.close(theirs)
        return Forked(status)

    def close(self) -> None:
        """End it, with what it has forked and is still there, and wait for that."""
        with suppress(OSError):  # it has ended
            self._control.send(HEAD.pack(0))
            descriptor = os.pidfd_open(self.pid)
            select.select([descriptor], [], [], END_SECONDS)
            os.close(descriptor)
        self._process.kill()
        self._process.wait()
        self._control.close()


class _Fork:
    """A fork of this process, as far as `subprocess.Popen` would be needed."""

    def __init__(self, pid: int) -> None:
        self.pid = pid

    def kill(self) -> None:
        os.kill(self.pid, signal.SIGKILL)  # it has not been waited for, so the id is its own

    def wait(self) -> None:
        os.waitpid(self.pid, 0)


def started(name: str, preparation: Preparation) -> Zygote:
    """A zygote for the tree of this name: an interpreter of its own, which makes itself ready as `preparation` says. Raises OSError."""
    with _channel() as (ours, theirs, parent):
        popen = subprocess.Popen(
            [
                *(sys.executable, "-m", "actors.processes.zygote", str(theirs.fileno()), str(parent)),
                f"zygote of {name}".ljust(_ROOM),
            ],
            pass_fds=(theirs.fileno(), parent),
            stdin=subprocess.DEVNULL,
            env=environment(),
        )
        try:
            ours.sendall(framed(preparation))
        except OSError:  # it has ended at once
            popen.kill()
            popen.wait()
            raise
        return Zygote(popen, ours)


@contextmanager
def forked(name: str, modules: Iterable[str] = ()) -> Generator[Zygote | None]:
    """A zygote that is a fork of this process, for all processes that are started in the block; None where that is not safe.

    It has what this process has imported until now; `modules` are imported before, those that can be. To be called by a program before it has
    an event loop, threads or anything else that must not be there twice.
    """
    preload(structlog=False)
    import_all((PROGRAM, *MODULES, *modules))
    global _here
    if not can_fork() or not may_fork():
        yield None
        return
    with _channel() as (ours, theirs, parent):
        if not (process := os.fork()):
            ours.close()
            become(theirs, parent, f"zygote of {name}")
        _here = zygote = Zygote(_Fork(process), ours)
    try:
        yield zygote
    finally:
        _here = None
        zygote.close()


_here: Zygote | None = None


def here() -> Zygote | None:
    """That of `forked`; None outside of its block."""
    return _here


@contextmanager
def _channel() -> Generator[tuple[socket.socket, socket.socket, int]]:
    """What a zygote is started with: the two ends of its channel, and the process descriptor of this process. Only our end is left open, unless
    it cannot be started."""
    ours, theirs = socket.socketpair()
    parent = os.pidfd_open(os.getpid())
    try:
        with held_back():
            yield ours, theirs, parent
    except BaseException:
        ours.close()
        raise
    finally:
        theirs.close()
        os.close(parent)


class Forked:
    """A process that a zygote forks: what `subprocess.Popen` is for one that this process has started.

    Invariants: `pid` is 0 until the zygote has told it; `_descriptor`, its process descriptor, is None as long. `_status` is None once the
    exit code has been told, or the zygote has ended.
    """

    def __init__(self, status: int) -> None:
        self.pid = 0
        self.returncode: int | None = None
        self._status: int | None = status
        self._descriptor: int | None = None
        os.set_blocking(status, False)

    async def begun(self) -> bool:
        """Wait until the process has been forked; False if it has not been, or has ended."""
        while self.poll() is None:
            if self.pid:
                return True
            assert self._status is not None
            await _readable(os.dup(self._status))
        return False

    def exit_descriptor(self) -> int:
        """A new descriptor that can be read when `poll` may have something to tell."""
        descriptor = self._descriptor if self._status is None else self._status
        assert descriptor is not None
        return os.dup(descriptor)

    def poll(self) -> int | None:
        """The exit code, negative for a signal; None while the process runs, or is still to be forked."""
        while self._status is not None:
            try:
                told = os.read(self._status, NUMBER.size)
            except BlockingIOError:
                return None
            number = NUMBER.unpack(told)[0] if told else None
            if number is None or self.pid:
                os.close(self._status)
                self._status = None
                if number is not None:
                    self._over(number)
            else:
                self._found(number)
        if self.returncode is None and (self._descriptor is None or _ended(self._descriptor)):
            self._over(UNKNOWN)
        return self.returncode

    def send_signal(self, number: int) -> None:
        """Send a signal, unless the process has ended."""
        if self.poll() is None and self._descriptor is not None:
            with suppress(ProcessLookupError):
                signal.pidfd_send_signal(self._descriptor, number)

    def kill(self) -> None:
        """Send SIGKILL, as soon as the process is there, unless it has ended."""
        while self.poll() is None and not self.pid:
            self._await_news()
        self.send_signal(signal.SIGKILL)

    def wait(self) -> int:
        """Wait for the end of a process that ends: it has been killed."""
        while (code := self.poll()) is None:
            self._await_news()
        return code

    def _await_news(self) -> None:
        """Wait until `poll` may have something to tell."""
        descriptor = self._descriptor if self._status is None else self._status
        assert descriptor is not None
        select.select([descriptor], [], [])

    def abandon(self) -> None:
        """Kill the process if it has been forked, and wait for nothing."""
        self.send_signal(signal.SIGKILL)
        if self._status is not None:
            os.close(self._status)
            self._status = None
        self._over(UNKNOWN)

    def _found(self, pid: int) -> None:
        self.pid = pid
        with suppress(ProcessLookupError):  # it has ended, and its code is there already
            self._descriptor = os.pidfd_open(pid)

    def _over(self, code: int) -> None:
        self.returncode = code
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None


def _ended(descriptor: int) -> bool:
    return bool(select.select([descriptor], [], [], 0)[0])


async def _readable(descriptor: int) -> None:
    """Wait until this descriptor can be read, and close it."""
    loop = asyncio.get_running_loop()
    readable = asyncio.Event()
    loop.add_reader(descriptor, readable.set)
    try:
        await readable.wait()
    finally:
        loop.remove_reader(descriptor)
        os.close(descriptor)
