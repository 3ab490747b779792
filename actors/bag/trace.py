"""Traces: one hash over everything that happens in a run, which is equal for two runs exactly if they were the same."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Mapping, Set
from hashlib import sha256
from typing import Final, Self, cast

from actors.interfaces.cdr import encode
from actors.interfaces.errors import CdrError
from actors.interfaces.message import Message
from actors.logs import LogRecord
from actors.supervision.report import Report
from actors.system import System
from actors.topics.peers import PublisherPeer

ADDRESS: Final = re.compile(r" at 0x[0-9a-fA-F]+")
"""The address in the default `repr` of an object. It differs between runs."""


class Trace:
    """A SHA-256 hash over all messages (time in ns, topic, type, CDR), log lines and supervisor events, in order.

    On the virtual clock, the same seed gives the same trace in every process, for any PYTHONHASHSEED, and on every machine whose
    floating-point libraries agree (with one BLAS thread). The trace covers what happens from `attach` on, and the log lines that the
    system's level allows. In log lines, object addresses are left out and sets are sorted; anything else from outside, such as the time of
    day or the path of a file, makes a difference.
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
        """Trace `system` from now on; attach before its tree starts to miss nothing."""
        if self._now_ns is not None:
            raise RuntimeError("this trace follows a system already: make another one")
        self._now_ns = system.clock.now_ns
        system.graph.tap(self._tap)
        system.observe(lines=self._log, reports=self._report)
        return self

    def hexdigest(self) -> str:
        """The hash of everything so far, as 64 hexadecimal digits."""
        return self._hash.hexdigest()

    def _tap(self, publisher: PublisherPeer) -> Callable[[Message], None]:
        where = _framed(publisher.entry.name, publisher.type.__ros_type__)

        def deliver(message: Message) -> None:
            self.messages += 1
            try:
                data = encode(message)
            except CdrError:  # text that cannot be encoded, but was published within the process
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
    """The value as text that depends only on the value: sets are sorted and addresses left out."""
    if isinstance(value, Mapping):
        items = cast("Mapping[object, object]", value).items()
        return "{" + ", ".join(f"{canonical(key)}: {canonical(item)}" for key, item in items) + "}"
    if isinstance(value, Set):
        return "{" + ", ".join(sorted(canonical(item) for item in cast("Set[object]", value))) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(canonical(item) for item in cast("list[object]", value)) + "]"
    return ADDRESS.sub("", repr(value))


def _framed(*parts: str) -> bytes:
    """The parts, each preceded by its length, so that different lists of parts give different bytes."""
    whole = b""
    for part in parts:
        data = part.encode("utf-8", "backslashreplace")
        whole += struct.pack("<I", len(data)) + data
    return whole
