"""`looking`: while a launch file is only looked at, what would change something outside of this process is refused."""

from __future__ import annotations

import os
import sys
import tempfile
import threading
from collections.abc import Generator
from contextlib import contextmanager
from functools import lru_cache
from typing import Final, cast

from actors.launch.errors import LaunchError

_WRITES: Final = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
_ACTING: Final = frozenset({
    "_thread.start_new_thread",
    "os.chmod", "os.chown", "os.exec", "os.fork", "os.forkpty", "os.kill", "os.killpg", "os.link", "os.mkdir", "os.posix_spawn",
    "os.remove", "os.removexattr", "os.rename", "os.rmdir", "os.setxattr", "os.spawn", "os.startfile", "os.symlink", "os.system",
    "os.truncate", "os.utime",
    "pty.spawn",
    "shutil.chown", "shutil.copyfile", "shutil.copymode", "shutil.copystat", "shutil.copytree", "shutil.make_archive", "shutil.move",
    "shutil.rmtree", "shutil.unpack_archive",
    "signal.pthread_kill",
    "socket.connect", "socket.sendmsg", "socket.sendto",
    "sqlite3.connect",
    "subprocess.Popen",
    "tempfile.mkdtemp", "tempfile.mkstemp",
})  # fmt: skip
"""The audit events of Python for what is refused, beside a file that is opened for writing."""


class NotDone(LaunchError, PermissionError):
    """Something is not done, as the launch file is only looked at; what would follow of it is not known."""


class _Here(threading.local):
    on = False


_here = _Here()


@contextmanager
def looking(on: bool = True) -> Generator[None]:
    """Refuse, in this thread, what acts: it raises `NotDone`, also in the code of a launch file. With `on` false it is allowed again.

    It holds off accidents, not attacks: native code is not seen.
    """
    if on:
        tempfile.gettempdir()  # which finds it by writing, the first time
        _watch()
    before, writes = _here.on, sys.dont_write_bytecode
    _here.on, sys.dont_write_bytecode = on, writes or on
    try:
        yield
    finally:
        _here.on, sys.dont_write_bytecode = before, writes


@lru_cache(maxsize=1)
def _watch() -> None:
    sys.addaudithook(_audit)  # it stays for the life of the process


def _audit(event: str, arguments: tuple[object, ...]) -> None:
    if not _here.on or (event not in _ACTING and not (event == "open" and _is_written(*arguments))):
        return
    about = arguments[1 if event == "subprocess.Popen" else 0] if arguments else ""
    raise NotDone(f"{event}({about!r:.80}) is not done while the launch file is only looked at")


_audit.__cantrace__ = True  # type: ignore[attr-defined]  # else debuggers and coverage do not see what is called here


def _is_written(path: object, mode: object, flags: object) -> bool:
    if isinstance(path, int) or path == os.devnull or not isinstance(flags, int):
        return False
    return bool(flags & _WRITES) and not os.path.isdir(cast("str", path))  # a folder: a file that has no name in it
