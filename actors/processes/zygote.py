"""The zygote of a tree: ``python -m actors.processes.zygote CHANNEL PARENT NAME``, started by `forked.Zygote`, or a fork of the program itself.

It has imported what the processes of the tree need, and forks each of them, so that none of them starts an interpreter and imports for
itself. It has one thread and no event loop, which is what makes a fork safe, and runs nothing of the tree.

A request is a name, with three descriptors: the channel and the pipe for notes of the new process, and a pipe for its status, on which the
zygote writes the id of the process, and at its end the exit code. A name of no length asks for the end of the zygote, which kills what it
has forked and is still there.
"""

from __future__ import annotations

import atexit
import ctypes
import gc
import os
import select
import signal
import socket
import struct
import sys
import traceback
from contextlib import suppress
from importlib import import_module
from typing import Final, NamedTuple, NoReturn

from actors.processes.channel import HEAD, read_exactly, read_frame
from actors.processes.preparation import prepare
from actors.processes.signals import end_with_parent, leave_to_parent
from actors.runtime.preload import preload

PROGRAM: Final = "actors.processes.main"
"""What each process runs, in this interpreter or in one of its own."""
NUMBER: Final = struct.Struct("!i")
"""What is written on a status pipe: an id, then an exit code."""
_DESCRIPTORS: Final = 3
_PR_SET_NAME: Final = 15
_ARGUMENTS: Final = 45
"""The field of ``/proc/self/stat``, after the name, at which the command line begins in memory; the next is its end."""


class Request(NamedTuple):
    """A process that is asked for. The descriptors belong to who has the request."""

    name: str
    channel: int
    notes: int
    status: int

    def close(self) -> None:
        """Close the descriptors."""
        for descriptor in self[1:]:
            os.close(descriptor)


def main(arguments: list[str]) -> int:
    """Serve requests until the parent is gone or asks for the end. In a process that was forked for a request: run its order to its end."""
    leave_to_parent()
    parent = int(arguments[1])
    with socket.socket(fileno=int(arguments[0])) as control:
        try:
            prepare(read_frame(control))
        except Exception:  # each process that needs it says why its main module cannot be run
            return 1
        preload(structlog=False)
        import_module(PROGRAM)
        return run(control, parent) if may_fork() else 1


def become(control: socket.socket, parent: int, name: str) -> NoReturn:
    """Be a zygote from now on, in a fork of a program, of which nothing goes on here."""
    code = 1
    try:
        leave_to_parent()
        nothing = os.open(os.devnull, os.O_RDONLY)
        os.dup2(nothing, 0)
        os.close(nothing)
        call_process(name)
        with control:
            code = run(control, parent)
    except BaseException:  # in a process that the zygote has forked
        traceback.print_exc()
    finally:
        with suppress(OSError):
            sys.stdout.flush()
            sys.stderr.flush()
        atexit._run_exitfuncs()  # pyright: ignore[reportPrivateUsage]
        os._exit(code)


def run(control: socket.socket, parent: int) -> int:
    """Serve requests to the end; the exit code. In a process that was forked for a request: run its order."""
    gc.freeze()  # what all processes share stays shared
    request = Zygote(control, parent).serve()
    return 0 if request is None else _begin(request, parent)


def may_fork() -> bool:
    """Whether this process has one thread, so that a fork is safe.

    A library whose threads end before each fork, and are started again when it needs them, as OpenBLAS', has none left after the first.
    """
    if _threads() > 1:
        if not (process := os.fork()):
            os._exit(0)
        os.waitpid(process, 0)
    return _threads() == 1


def _threads() -> int:
    return len(os.listdir("/proc/self/task"))


class Zygote:
    """Forks processes for the requests that come by `control`, until the parent ends, by its process descriptor `parent`.

    Invariant: `_children` has the status pipe of each process that has been forked and has not been reaped, by its process descriptor.
    """

    def __init__(self, control: socket.socket, parent: int) -> None:
        self._control = control
        self._parent = parent
        self._children: dict[int, int] = {}

    def serve(self) -> Request | None:
        """Returns in the zygote at its end, None, and in each process that it forks, the request for it."""
        poll = select.poll()
        for descriptor in (self._control.fileno(), self._parent):
            poll.register(descriptor, select.POLLIN)
        while True:
            for descriptor, _ in poll.poll():
                if descriptor == self._parent:
                    return None
                if descriptor in self._children:
                    poll.unregister(descriptor)
                    self._reap(descriptor)
                    continue
                try:
                    request = _receive(self._control)
                except (EOFError, OSError):
                    return None
                if request is None:
                    self._end()
                    return None
                process = self._fork(request)
                if process is None:
                    return request
                if process:
                    poll.register(process, select.POLLIN)

    def _fork(self, request: Request) -> int | None:
        """The descriptor of a new process, 0 if the system has not forked any, and in the new process None."""
        try:
            process = os.fork()
        except OSError:  # the parent learns of it by the closed pipe
            request.close()
            return 0
        if not process:
            self._control.close()
            for descriptor in (*self._children, *self._children.values()):
                os.close(descriptor)
            return None
        descriptor = os.pidfd_open(process)
        self._children[descriptor] = os.dup(request.status)
        _tell(request.status, process)
        request.close()
        return descriptor

    def _reap(self, descriptor: int) -> None:
        """Tell how a process has ended, before its id can become that of another."""
        how = os.waitid(os.P_PIDFD, descriptor, os.WEXITED | os.WNOWAIT)
        assert how is not None
        status = self._children.pop(descriptor)
        _tell(status, how.si_status if how.si_code == os.CLD_EXITED else -how.si_status)
        os.close(status)
        os.waitid(os.P_PIDFD, descriptor, os.WEXITED)
        os.close(descriptor)

    def _end(self) -> None:
        """Kill those that are still there."""
        for descriptor in list(self._children):
            signal.pidfd_send_signal(descriptor, signal.SIGKILL)
            self._reap(descriptor)


def _receive(control: socket.socket) -> Request | None:
    """The next request; None for the end. Raises EOFError if the parent is gone."""
    head, descriptors, _, _ = socket.recv_fds(control, HEAD.size, _DESCRIPTORS)
    head += read_exactly(control, HEAD.size - len(head))
    name = read_exactly(control, HEAD.unpack(head)[0]).decode()
    return Request(name, *descriptors) if name else None


def _tell(status: int, number: int) -> None:
    with suppress(OSError):  # nobody wants to know
        os.write(status, NUMBER.pack(number))


def _begin(request: Request, parent: int) -> int:
    """Run the order of a request, in the process that was forked for it."""
    os.close(request.status)
    call_process(request.name)
    end_with_parent(signal.SIGKILL)  # until it has its order
    if "numpy.random" in sys.modules:
        sys.modules["numpy.random"].seed()  # else all processes would draw the same
    code: int = import_module(PROGRAM).live(request.channel, request.notes, parent=parent)
    return code


def call_process(name: str) -> None:
    """Have `ps` and `top` show this process by this name, as they show one that was started by itself."""
    library = ctypes.CDLL(None)
    library.prctl(_PR_SET_NAME, name.rpartition("/")[2].encode(), 0, 0, 0)
    with open("/proc/self/stat", encoding="utf-8", errors="replace") as file:
        begin, end = map(int, file.read().rpartition(")")[2].split()[_ARGUMENTS : _ARGUMENTS + 2])
    line = "\0".join((sys.executable, "-m", PROGRAM, name)).encode()
    line = (line if len(line) < end - begin else name.encode())[: end - begin - 1]
    ctypes.memset(begin, 0, end - begin)
    ctypes.memmove(begin, line, len(line))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
