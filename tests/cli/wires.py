"""``from tests.cli.wires import wire`` in a file runs its tests over both wires."""

from __future__ import annotations

import pytest

__all__ = ["wire"]


@pytest.fixture(params=["zenoh", "dds"])
def wire(request: pytest.FixtureRequest) -> str:
    return str(request.param)
