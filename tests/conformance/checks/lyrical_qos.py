"""Compatibility of endpoint pairs as a real ROS 2 judged it."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from tests.conformance.checks.common import Case, by_kind
from tests.conformance.checks.qos_compatibility import check_compatible


def cases(path: Path) -> Iterable[Case]:
    return by_kind(path, {"check_compatible": check_compatible})
