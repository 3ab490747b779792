"""The `rig` of this folder."""

from __future__ import annotations

from collections.abc import AsyncIterator

import pytest_asyncio

from actors.testing import Rig
from tests.wired.rig import WiredRig


@pytest_asyncio.fixture
async def rig() -> AsyncIterator[Rig]:
    rig = WiredRig()
    yield rig
    await rig.close()
