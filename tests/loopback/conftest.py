"""The `rig` of this folder: its system is one in which every endpoint is remote to every other."""

from __future__ import annotations

from collections.abc import AsyncIterator
from functools import partial

import pytest_asyncio

from actors.checks import create
from actors.runtime.runtime import Runtime
from actors.system import System
from actors.testing import Rig
from tests.loopback.graph import LoopbackGraph


@pytest_asyncio.fixture
async def rig() -> AsyncIterator[Rig]:
    rig = Rig(make_system=partial(create, System, make_runtime=partial(Runtime, make_graph=LoopbackGraph)))
    yield rig
    await rig.close()
