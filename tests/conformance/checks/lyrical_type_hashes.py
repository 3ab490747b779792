"""Type hashes measured on ROS 2 Lyrical."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from actors.interfaces import type_hash
from tests.conformance.checks.common import Case, Vector, each, same
from tests.conformance.checks.definitions import load_definitions


def cases(path: Path) -> Iterator[Case]:
    load_definitions(path)
    return each(path, check)


def check(vector: Vector) -> None:
    same("hash", type_hash(vector["input"]["type"]), vector["expect"]["hash"])
