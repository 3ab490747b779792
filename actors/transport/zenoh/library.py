"""The `zenoh` package: its late import, its threads, and its errors as single lines."""

from __future__ import annotations

import ctypes
import os
import threading
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, Final

from actors.transport.protocol import WireUnavailable

_RUNTIME: Final = "ZENOH_RUNTIME"
_FEW_THREADS: Final = "(rx: (worker_threads: 1), tx: (worker_threads: 1), net: (handover: app), acc: (handover: app))"
"""As few threads as a robot's process can do with. Receiving keeps its own thread, because a full KEEP_ALL queue makes it wait. So does
sending: a new link begins with everything that is declared, and the thread that puts it into the link's queue waits while that is full."""

_CAUSES: Final = {
    "Address already in use": "another process listens there; choose another port",
    "Cannot assign requested address": "no network interface of this machine has that address",
    "Address family not supported": "this machine has no IPv6; listen at 0.0.0.0 instead of [::]",
    "failed to lookup address": "the name of the host is not known",
    "Network is unreachable": "no network leads there",
}


class _Thread(threading.local):
    kept = False
    """Whether its Python state is kept."""


_thread = _Thread()


@cache  # it is asked for by every call
def import_zenoh() -> Any:
    """Import the package `zenoh`. Its threads are limited by the variable ZENOH_RUNTIME, unless the user has set it.

    Raises WireUnavailable if it is not installed.
    """
    os.environ.setdefault(_RUNTIME, _FEW_THREADS)  # read once, when the first session is opened
    try:
        import zenoh
    except ImportError as error:
        raise WireUnavailable(f"the package eclipse-zenoh cannot be imported ({error}); install it with pip") from error
    return zenoh


def import_ext() -> Any:
    """Import the advanced publishers and subscribers of `zenoh`, which keep samples."""
    import zenoh.ext

    return zenoh.ext


def direct(call: Callable[[Any], None], end: Callable[[], None] | None = None) -> Any:
    """A handler that calls `call` on Zenoh's own thread, and `end` when nothing more can come. Neither may wait.

    Zenoh's usual handlers start a thread each. Without one, every call would make and destroy the Python state of Zenoh's thread, which
    takes five times as long as the rest of it; therefore the state is kept, for as long as the thread lives.
    """

    def called(item: object) -> None:
        keep_thread_state()
        call(item)

    def ended() -> None:
        keep_thread_state()
        if end is not None:
            end()

    return bare(called, ended)


def bare(call: Callable[[Any], None], end: Callable[[], None] | None = None) -> Any:
    """A `direct` handler whose `call` must call `keep_thread_state` itself: one that is called often need not do it each time."""
    return import_zenoh().handlers.Callback(call, end, indirect=False)


def keep_thread_state() -> None:
    """Let this thread of Zenoh have its Python state for as long as it lives."""
    if not _thread.kept:
        _thread.kept = True
        ctypes.pythonapi.PyGILState_Ensure()  # never released


def cannot_listen(endpoints: Sequence[str], error: BaseException) -> WireUnavailable:
    """What to raise if Zenoh could not open a session that was to listen at `endpoints`."""
    text = one_line(error)
    causes = (cause for sign, cause in _CAUSES.items() if sign in text)
    where = f" at {', '.join(endpoints)}" if endpoints else ""
    return WireUnavailable(f"cannot listen{where}: {next(causes, text)}")


def one_line(error: BaseException) -> str:
    """The text of an error of Zenoh, without the places in its source and without the quotations of its parser."""
    import re

    text = str(error)
    said = re.search(r'(?:msg: |^Str\()"((?:[^"\\]|\\.)*)"', text)
    text = said.group(1).replace("\\n", "\n") if said else text
    text = text.split(" at /")[0]
    lines = [line.strip() for line in text.splitlines() if not re.match(r"\s*(-->|\d*\s*\||=?\s*$)", line)]
    return " ".join(line.removeprefix("= ") for line in lines).rstrip(" .!")
