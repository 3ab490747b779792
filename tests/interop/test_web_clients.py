"""The clients that people use, against our server: roslibpy, npm's roslib and npm's @foxglove/ws-protocol."""

from __future__ import annotations

import asyncio
import json
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from tests.cli.web.stage import serving
from tests.interop.npm import installed

pytestmark = pytest.mark.interop

PACKAGES = (
    "roslib@2.1.0",
    "@foxglove/ws-protocol@0.8.0",
    "@foxglove/rosmsg@5",
    "@foxglove/rosmsg2-serialization@3",
    "ws@8",
)
PROGRAMS = Path(__file__).parent / "programs"


@pytest.fixture(scope="session")
def packages() -> Path:
    return installed(*PACKAGES)


async def ran(*command: str) -> dict[str, Any]:
    """What a program prints at its end, as JSON."""
    process = await asyncio.create_subprocess_exec(
        *command, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.PIPE
    )
    try:
        async with asyncio.timeout(90):
            out, errors = await process.communicate()
    finally:
        if process.returncode is None:
            process.kill()
    assert process.returncode == 0, errors.decode()[-2000:]
    found: dict[str, Any] = json.loads(out.decode().splitlines()[-1])
    return found


async def test_roslib_of_npm_publishes_subscribes_calls_serves_and_sends_goals(packages: Path) -> None:
    async with serving() as stage:
        seen = await ran("node", str(PROGRAMS / "roslib_client.mjs"), str(packages), stage.url)
    assert (seen["none"], seen["cbor"]) == ("hallo", "hallo")
    assert seen["cbor-raw"].endswith("hallo\0")
    assert (seen["sum"], seen["product"]) == (42, 42)
    assert (seen["feedback"][-1], seen["result"]) == ([0, 1, 1, 2, 3], [0, 1, 1, 2, 3])
    assert seen["browserResult"] == [7, 8]
    assert (seen["speed"], seen["changed"]) == (0.5, 1.5)
    assert "out of range" in seen["refused"]
    assert seen["nodes"] == ["/talker", "/worker"] and seen["type"] == "std_msgs/msg/String"


@pytest.mark.parametrize("name", ["foxglove.sdk.v1", "foxglove.websocket.v1"])
async def test_the_client_of_foxglove_publishes_subscribes_calls_and_sets_parameters(packages: Path, name: str) -> None:
    async with serving() as stage:
        seen = await ran("node", str(PROGRAMS / "foxglove_client.mjs"), str(packages), stage.url, name)
    assert (seen["message"], seen["sum"]) == ("round", 42)
    assert seen["speed"] == {"name": "/talker.speed", "value": 0.5, "type": "float64"} and seen["changed"] == 1.5
    assert "out of range" in seen["refused"]
    assert seen["graph"][-1] == "/talker" and seen["asset"] == 1
    assert "connectionGraph" in seen["capabilities"]


async def test_roslibpy_publishes_subscribes_calls_serves_and_sends_goals() -> None:
    pytest.importorskip("roslibpy")
    async with serving() as stage:
        seen = await ran(sys.executable, str(PROGRAMS / "with_roslibpy.py"), str(stage.server.port))
    assert (seen["message"], seen["sum"], seen["product"]) == ("hallo", 42, 42)
    assert seen["result"] == [0, 1, 1, 2, 3] and len(seen["feedback"]) == 3
    assert (seen["speed"], seen["changed"]) == (0.5, 1.5)
    assert seen["nodes"] == ["/talker", "/worker"] and seen["type"] == "std_msgs/msg/String"
    assert abs(seen["time"] - time.time()) < 3600
