"""Type hashes of ROS 2 Lyrical, whose definitions we ship."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from actors.interfaces import type_hash
from tests.conformance.checks.common import Case, same
from tests.conformance.checks.definitions import load_definitions


def cases(path: Path) -> Iterator[Case]:
    load_definitions(path)
    for name, wanted in json.loads(path.read_text(encoding="utf-8"))["hashes"].items():
        yield f"{path.stem}/{name}", "core", partial(check, name, wanted)


def check(name: str, wanted: str) -> None:
    same(name, type_hash(name), wanted)
