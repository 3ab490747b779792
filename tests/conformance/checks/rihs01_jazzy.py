"""Type hashes of ROS 2 Jazzy. All types are loaded from text here, so this checks run-time loading as well."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import cache, partial
from pathlib import Path

from actors.interfaces import type_hash
from tests.conformance.checks.common import Case, same
from tests.conformance.checks.definitions import jazzy


def cases(path: Path) -> Iterator[Case]:
    for name, wanted in json.loads(path.read_text(encoding="utf-8"))["hashes"].items():
        yield f"{path.stem}/{name}", "core", partial(check, path, name, wanted)


@cache
def hashes(path: Path) -> dict[str, str]:
    """The hashes of all types in the file, by our reckoning; once, because it loads every type anew."""
    with jazzy(path):
        return {name: type_hash(name) for name in json.loads(path.read_text(encoding="utf-8"))["hashes"]}


def check(path: Path, name: str, wanted: str) -> None:
    same(name, hashes(path)[name], wanted)
