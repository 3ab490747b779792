"""The trace of a run: one hash over everything that happened, equal for two runs that were the same, and for no others."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Mapping, Set
from hashlib import sha256
from typing import TYPE_CHECKING, Any, Final, cast

from actors.interfaces.cdr import encode
from actors.interfaces.errors import CdrError

if TYPE_CHECKING:
    from typing import Self

    from actors.interfaces.message import Message
    from actors.logs import LogRecord
    from actors.supervision.report import Report
    from actors.system import System
    from actors.topics.peers import PublisherPeer

__all__ = ["Trace"]

ADDRESS: Final = re.compile(r" at 0x[0-9a-fA-F]+")
"""The address in the default `repr` of an object, which differs from run to run."""


class Trace:
    """SHA-256 over every message (time in ns, topic, type, CDR), every log line and every event of a supervisor, in order.

    On the virtual clock the trace of a system is the same for the same seed: in every process, whatever PYTHONHASHSEED says; across machines as
    far as their floating-point libraries agree (BLAS threads 1). It covers what happened from `attach` on, and the log lines that
    the system's level lets pass. In log lines the addresses of objects are left out, and sets are sorted; whatever else they tell of the
    world outside (the time of day, the folder of a file) makes a difference.
    """

    def __init__(self) -> None:
        self._hash = sha256()
        self._now_ns: Callable[[], int] | None = None
        self.messages = 0
        self.lines = 0
        self.events = 0

    def __repr__(self) -> str:
        counts = f"{self.messages} messages, {self.lines} log lines, {self.events} events"
        return f"<trace {self.hexdigest()[:16]} of {counts}>"

    def attach(self, system: System) -> Self:
        """Begin with `system`; before its tree starts, if nothing is to be missed."""
        if self._now_ns is not None:
            raise RuntimeError("this trace follows a system already: make another one")
        self._now_ns = system.clock.now_ns
        system.graph.tap(self._tap)
        system.observe(lines=self._log, reports=self._report)
        return self

    def hexdigest(self) -> str:
        """The hash of all that happened so far, 64 hexadecimal digits."""
        return self._hash.hexdigest()

    def _tap(self, publisher: PublisherPeer) -> Callable[[Any], None]:
        where = _framed(publisher.entry.name, publisher.type.__ros_type__)

        def deliver(message: Message) -> None:
            self.messages += 1
            try:
                data = encode(message)
            except CdrError:  # a text that no wire can carry; within a process it has been published all the same
                data = ascii(message).encode()
            self._add(b"m", where + data)

        return deliver

    def _log(self, record: LogRecord) -> None:
        self.lines += 1
        who = (str(int(record.level)), record.node, str(record.incarnation))
        self._add(b"l", _framed(*who, str(record.event), canonical(record.fields)))

    def _report(self, report: Report) -> None:
        self.events += 1
        who = (report.context, "/".join(report.supervisor), str(report.child), report.restart)
        self._add(b"e", _framed(*who, canonical(str(report.reason)), report.note))

    def _add(self, kind: bytes, data: bytes) -> None:
        assert self._now_ns is not None
        self._hash.update(kind + struct.pack("<qQ", self._now_ns(), len(data)) + data)


def canonical(value: object) -> str:
    """A value in words that depend on nothing but the value: sets sorted, addresses left out."""
    if isinstance(value, Mapping):
        items = cast("Mapping[object, object]", value).items()
        return "{" + ", ".join(f"{canonical(key)}: {canonical(item)}" for key, item in items) + "}"
    if isinstance(value, Set):
        return "{" + ", ".join(sorted(canonical(item) for item in cast("Set[object]", value))) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(canonical(item) for item in cast("list[object]", value)) + "]"
    return ADDRESS.sub("", repr(value))


def _framed(*parts: str) -> bytes:
    """The parts, each after its length, so that no two lists of parts look alike."""
    whole = b""
    for part in parts:
        data = part.encode("utf-8", "backslashreplace")
        whole += struct.pack("<I", len(data)) + data
    return whole
