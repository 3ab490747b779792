"""Values and their bytes, on which two other encoders agree. The definitions are those of Jazzy."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import cache, partial
from pathlib import Path
from typing import Any

from actors.interfaces import Message, decode, encode, get_message
from tests.conformance.checks.common import Case, Vector, same
from tests.conformance.checks.definitions import build, jazzy


def cases(path: Path) -> Iterator[Case]:
    vectors = json.loads(path.read_text(encoding="utf-8"))["vectors"]
    for index, vector in enumerate(vectors):
        yield f"cdr_vectors/{vector['type']}#{index}", "core", partial(check, path, vector)


@cache
def classes(path: Path) -> dict[str, type[Message]]:
    names: set[str] = {vector["type"] for vector in json.loads(path.read_text(encoding="utf-8"))["vectors"]}
    with jazzy(path):
        return {name: get_message(name) for name in names}


def check(path: Path, vector: Vector) -> None:
    cls: Any = classes(path)[vector["type"]]
    message = build(cls, vector["value"])
    same("bytes", encode(message).hex(), vector["cdr_hex"])
    decoded = decode(cls, bytes.fromhex(vector["cdr_hex"]))
    same("message", decoded, message)
