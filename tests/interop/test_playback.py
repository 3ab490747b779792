"""Playback control as the Foxglove SDK has it: its server understands our requests, and tells its state in the bytes in which we do.

The SDK reads no files and has no client; its server is the other one that there is.
"""

from __future__ import annotations

import asyncio
import json
import struct
from pathlib import Path

import pytest
from websockets.asyncio.client import connect

from cli.web.foxglove.frames import playback_frame, read_frame
from cli.web.recordings.playback import ENDED, PAUSED, PLAYING, PlaybackRequest, PlaybackState
from tests.cli.web.test_playback import recorded, showing
from tests.interop.test_web_clients import PROGRAMS, packages, ran  # noqa: F401  # `packages` is a fixture

pytestmark = pytest.mark.interop

BEGIN, END = 1_700_000_000_000_000_001, 1_700_000_099_000_000_000


async def test_requests_and_states_are_those_of_the_sdk(python: Path, tmp_path: Path) -> None:
    process = await asyncio.create_subprocess_exec(
        str(python),
        str(PROGRAMS / "with_foxglove_sdk.py"),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
    )
    assert process.stdout is not None
    requests = [
        PlaybackRequest(True, 2.0, BEGIN + 5, "ask"), PlaybackRequest(False, 0.25, None, "x"), PlaybackRequest(False, 1.0, 0, "ä"),
    ]  # fmt: skip
    states = [
        playback_frame(PlaybackState(PLAYING, BEGIN, 2.0), sought=True, request="ask"),
        playback_frame(PlaybackState(PAUSED, END, 0.25), sought=False, request="x"),
        playback_frame(PlaybackState(ENDED, END, 1.0), sought=False, request="ä"),
    ]
    try:
        async with asyncio.timeout(60):
            port = json.loads(await process.stdout.readline())["port"]
            async with connect(f"ws://127.0.0.1:{port}", subprotocols=["foxglove.sdk.v1"]) as socket:  # type: ignore[list-item]
                theirs = json.loads(await socket.recv())
                for request, state in zip(requests, states, strict=True):
                    id = request.id.encode()
                    frame = struct.pack(
                        "<BBfBQI",
                        3,
                        not request.play,
                        request.rate,
                        request.seek_ns is not None,
                        request.seek_ns or 0,
                        len(id),
                    )
                    assert read_frame(frame + id) == request
                    await socket.send(frame + id)
                    understood = json.loads(await process.stdout.readline())
                    assert PlaybackRequest(**{"play": understood["play"], "rate": understood["rate"],
                                              "seek_ns": understood["seek"], "id": understood["id"]}) == request  # fmt: skip
                    while not isinstance(answer := await socket.recv(), bytes):
                        pass
                    assert answer == state
    finally:
        process.kill()
        await process.wait()
    async with showing(recorded(tmp_path / "walk")) as url, connect(url, subprotocols=["foxglove.sdk.v1"]) as socket:  # type: ignore[list-item]
        ours = json.loads(await socket.recv())
    assert {key: type(value) for key, value in theirs.items()}.items() <= {
        key: type(value) for key, value in ours.items()
    }.items()
    assert (
        theirs["dataStartTime"] == {"sec": 1_700_000_000, "nsec": 1}
        and ours["dataStartTime"].keys() == theirs["dataStartTime"].keys()
    )
    assert set(theirs["capabilities"]) <= set(ours["capabilities"])


async def test_a_client_of_npm_that_knows_no_playback_reads_a_recording_without_an_error(
    packages: Path,  # noqa: F811
    tmp_path: Path,
) -> None:
    async with showing(recorded(tmp_path / "walk")) as url:
        seen = await ran("node", str(PROGRAMS / "foxglove_reader.mjs"), str(packages), url, "foxglove.websocket.v1")
    assert seen == {"errors": [], "first": 0, "rising": True, "map": "map 0", "playback": False}
