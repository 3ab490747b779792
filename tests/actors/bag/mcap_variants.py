"""The 416 files of the conformance tests of the MCAP format, written here by its specification (https://mcap.dev/spec).

Each holds one of six contents, and has or lacks each optional part: chunks, message indexes, statistics, repeated schemas and channels,
indexes of attachments, metadata and chunks, summary offsets, and bytes of a later version at the ends of records.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import Any

MAGIC = b"\x89MCAP0\r\n"
PADDED = (1, 3, 4, 7, 8, 9, 10, 11, 12, 13, 14)
"""The records that a later version of the format may have made longer."""

FEATURES = ("ch", "mx", "st", "rsh", "rch", "ax", "mdx", "chx", "sum", "pad")

SCHEMA = ("schema", 1, "Example", "c", b"\4\5\6")
CHANNEL = ("channel", 1, 1, "example", "a", {"foo": "bar"})
TIMES = (0, 2, 1, 3, 3, 5, 4, 7, 8, 9)

CONTENTS: dict[str, list[tuple[Any, ...]]] = {
    "NoData": [],
    "OneSchemalessMessage": [("channel", 1, 0, "example", "text", {}), ("message", 1, 10, 2, 1, b"\1\2\3")],
    "OneMessage": [SCHEMA, CHANNEL, ("message", 1, 10, 2, 1, b"\1\2\3")],
    "OneAttachment": [("attachment", 2, 1, "myFile", "application/octet-stream", b"\1\2\3")],
    "OneMetadata": [("metadata", "myMetadata", {"foo": "bar"})],
    "TenMessages": [SCHEMA, CHANNEL, *(("message", 1, number, at, at, b"\1\2\3") for number, at in enumerate(TIMES))],
}


def variants(contents: dict[str, list[tuple[Any, ...]]] | None = None) -> Iterator[tuple[str, str, bytes]]:
    """The name of a content, that of the file, and its bytes, of each."""
    for name, records in (CONTENTS if contents is None else contents).items():
        kinds = {record[0] for record in records}
        for count in range(len(FEATURES) + 1):
            for chosen in combinations(FEATURES, count):
                if _sensible(set(chosen), kinds):
                    yield name, "-".join([name, *sorted(chosen)]), _file(records, set(chosen))


def _sensible(features: set[str], kinds: set[str]) -> bool:
    wanted = {"ax": "attachment", "mdx": "metadata", "rsh": "schema", "rch": "channel"}
    return (
        all(kind in kinds for feature, kind in wanted.items() if feature in features)
        and (not features & {"ch", "chx", "mx"} or bool(kinds & {"message", "channel", "schema"}))
        and ("sum" not in features or bool(features & {"chx", "rsh", "rch", "mdx", "ax", "st"}))
        and (not features & {"chx", "mx"} or "ch" in features)
    )


def _text(value: str | bytes) -> bytes:
    data = value.encode() if isinstance(value, str) else value
    return struct.pack("<I", len(data)) + data


def _texts(values: dict[str, str]) -> bytes:
    return _text(b"".join(_text(key) + _text(value) for key, value in values.items()))


def _record(opcode: int, data: bytes, pad: bool) -> bytes:
    data += b"\1\xff\xff" if pad and opcode in PADDED else b""
    return struct.pack("<BQ", opcode, len(data)) + data


def _encoded(record: tuple[Any, ...], pad: bool) -> bytes:
    kind, *values = record
    if kind == "schema":
        number, name, encoding, data = values
        return _record(3, struct.pack("<H", number) + _text(name) + _text(encoding) + _text(data), pad)
    if kind == "channel":
        number, schema, topic, encoding, metadata = values
        head = struct.pack("<HH", number, schema)
        return _record(4, head + _text(topic) + _text(encoding) + _texts(metadata), pad)
    if kind == "message":
        return _record(5, struct.pack("<HIQQ", *values[:4]) + values[4], pad)
    if kind == "attachment":
        logged, created, name, media, data = values
        whole = struct.pack("<QQ", logged, created) + _text(name) + _text(media) + struct.pack("<Q", len(data)) + data
        return _record(9, whole + struct.pack("<I", zlib.crc32(whole)), pad)
    name, metadata = values
    return _record(12, _text(name) + _texts(metadata), pad)


def _file(records: Sequence[tuple[Any, ...]], features: set[str]) -> bytes:
    pad = "pad" in features
    out = MAGIC + _record(1, _text("") + _text(""), pad)
    inside, indexes = b"", dict[str, bytes]()
    messages: list[tuple[int, int]] = []
    for record in records:
        if "ch" in features and record[0] in ("schema", "channel", "message"):
            if record[0] == "message":
                messages.append((record[3], len(inside)))
            inside += _encoded(record, False)
            continue
        data = _encoded(record, pad)
        if record[0] == "attachment" and "ax" in features:
            _, logged, created, name, media, body = record
            head = struct.pack("<QQQQQ", len(out), len(data), logged, created, len(body))
            indexes["ax"] = _record(10, head + _text(name) + _text(media), pad)
        if record[0] == "metadata" and "mdx" in features:
            indexes["mdx"] = _record(13, struct.pack("<QQ", len(out), len(data)) + _text(record[1]), pad)
        out += data
    times = [record[3] for record in records if record[0] == "message"]
    first, last = min(times, default=0), max(times, default=0)
    if "ch" in features:
        at = len(out)
        head = struct.pack("<QQQI", first, last, len(inside), zlib.crc32(inside)) + _text("")
        out += (chunk := _record(6, head + struct.pack("<Q", len(inside)) + inside, pad))
        begin, offsets = len(out), b""
        if "mx" in features and messages:
            offsets = struct.pack("<HQ", 1, begin)
            entries = b"".join(struct.pack("<QQ", *entry) for entry in messages)
            out += _record(7, struct.pack("<H", 1) + _text(entries), pad)
        if "chx" in features:
            head = struct.pack("<QQQQ", first, last, at, len(chunk)) + _text(offsets)
            tail = struct.pack("<Q", len(out) - begin) + _text("") + struct.pack("<QQ", len(inside), len(inside))
            indexes["chx"] = _record(8, head + tail, pad)
    out += _record(15, struct.pack("<I", zlib.crc32(out)), pad)
    return out + _ending(records, features, indexes, (first, last), len(out))


def _ending(
    records: Sequence[tuple[Any, ...]],
    features: set[str],
    indexes: dict[str, bytes],
    times: tuple[int, int],
    start: int,
) -> bytes:
    """The summary, the footer and the last bytes of a file that is `start` bytes long so far."""
    pad = "pad" in features
    numbers = {
        kind: sum(record[0] == kind for record in records)
        for kind in ("message", "schema", "channel", "attachment", "metadata")
    }
    count, schemas, channels, attachments, metadata = numbers.values()
    counts = struct.pack("<HQ", 1, count) if count else b""
    told = struct.pack("<QHIIIIQQ", count, schemas, channels, attachments, metadata, "ch" in features, *times) + _text(
        counts
    )
    groups = [
        (3, b"".join(_encoded(one, pad) for one in records if one[0] == "schema") if "rsh" in features else b""),
        (4, b"".join(_encoded(one, pad) for one in records if one[0] == "channel") if "rch" in features else b""),
        (11, _record(11, told, pad) if "st" in features else b""),
        (13, indexes.get("mdx", b"")),
        (10, indexes.get("ax", b"")),
        (8, indexes.get("chx", b"")),
    ]
    summary, offsets = b"", b""
    for opcode, data in groups:
        if data:
            offsets += _record(14, struct.pack("<BQQ", opcode, start + len(summary), len(data)), pad)
        summary += data
    at = start + len(summary) if "sum" in features else 0
    whole = summary + (offsets if "sum" in features else b"")
    footer = struct.pack("<BQQQ", 2, 20, start if summary else 0, at)
    return whole + footer + struct.pack("<I", zlib.crc32(whole + footer)) + MAGIC
