"""Stand-ins for Zenoh's objects, where a test needs a moment that the real ones pass too quickly."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any


@dataclass
class FakeText:
    text: bytes

    def to_bytes(self) -> bytes:
        return self.text

    def __len__(self) -> int:
        return len(self.text)


@dataclass
class SourceId:
    zid: str
    eid: int


@dataclass
class SourceInfo:
    source_id: SourceId
    source_sn: int


@dataclass
class Timestamp:
    session: str

    def get_id(self) -> str:
        return self.session


@dataclass
class FakeSample:
    payload: FakeText
    attachment: FakeText | None = None
    source_info: SourceInfo | None = None
    timestamp: Timestamp | None = None
    key_expr: str = "7/chatter/T/H"
    kind: object = None


@dataclass
class FakeReply:
    ok: FakeSample | None
    err: object = None


def sample(payload: bytes, *, attachment: bytes | None = None, sender: str = "") -> FakeSample:
    """A sample without a number."""
    attached = None if attachment is None else FakeText(attachment)
    return FakeSample(FakeText(payload), attached, timestamp=Timestamp(sender) if sender else None)


def numbered(number: int, *, publisher: int = 1) -> FakeSample:
    """A sample of an advanced publisher."""
    return FakeSample(FakeText(b"%d" % number), source_info=SourceInfo(SourceId("a1", publisher), number))


@dataclass
class FakePublisher:
    """A publisher that listens to itself being used."""

    matching: bool = True
    payloads: list[bytes] = field(default_factory=list[bytes])
    undeclared: int = 0
    handler: Any = None
    refusal: Exception | None = None

    @property
    def matching_status(self) -> FakePublisher:
        return self

    def declare_matching_listener(self, handler: Any) -> FakePublisher:
        self.handler = handler
        return FakePublisher()

    def put(self, payload: bytes, *, attachment: bytes | None = None) -> None:
        if self.refusal is not None:
            raise self.refusal
        self.payloads.append(payload)

    def undeclare(self) -> None:
        self.undeclared += 1

    __hash__ = object.__hash__


@dataclass
class FakeQuery:
    dropped: int = 0

    def drop(self) -> None:
        self.dropped += 1


class FakeSession:
    """A session that remembers the handler of its queryable, or of its last question."""

    handler: Any = None

    def get(self, key: str, handler: Any, **settings: Any) -> None:
        self.handler = handler

    def declare_queryable(self, key: str, handler: Any, **settings: Any) -> FakePublisher:
        self.handler = handler
        return FakePublisher()
