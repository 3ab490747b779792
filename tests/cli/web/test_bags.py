"""Bags of the page: recorded by name into one folder, listed, and given out piece by piece; nothing outside of it is reached."""

from __future__ import annotations

import asyncio
import struct
from pathlib import Path
from typing import Any

import pytest

from actors.bag import BagReader
from actors.interfaces.std_msgs.msg import String
from cli.web.recordings import bags as module
from cli.web.server.settings import WebSettings
from tests.cli.web.stage import Foxglove, Stage, serving
from tests.cli.web.test_playback import recorded


def keeping(folder: Path) -> WebSettings:
    return WebSettings(port=0, bags=folder)


async def ask(client: Foxglove, op: str, **fields: Any) -> Any:
    """The value that answers a word of the page; an answer that says why not raises `LookupError`."""
    await client.say(op, id=op, **fields)
    done = await client.find("robactor.done", id=op)
    if done["error"] is not None:
        raise LookupError(done["error"])
    return done["value"]


async def fetch(client: Foxglove, name: str, file: str, offset: int = 0) -> bytes:
    """A piece of a file; `LookupError` with the reason if there is none."""
    await client.say("robactor.readBag", id=7, name=name, file=file, offset=offset)
    frame = await client.binary()
    op, id, failed, length = struct.unpack_from("<BIBI", frame)
    assert (op, id) == (4, 7)
    if failed:
        raise LookupError(frame[10 : 10 + length].decode())
    return frame[10:]


async def said(stage: Stage, client: Foxglove, words: list[str]) -> None:
    """Publish these words, once the recorder listens, and wait until it has them."""
    while not stage.system.graph.topics["/chatter"].subscriptions:
        await asyncio.sleep(0.01)
    before = (await ask(client, "robactor.bags"))["recording"]["messages"]
    for word in words:
        stage.talker.chatter(String(data=word))
    while (await ask(client, "robactor.bags"))["recording"]["messages"] < before + len(words):
        await asyncio.sleep(0.01)


async def test_a_bag_is_recorded_listed_and_fetched_byte_by_byte(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "bags"
    async with serving(keeping(folder)) as stage, stage.foxglove() as client:
        assert await ask(client, "robactor.bags") == {"folder": str(folder), "recording": None, "bags": []}
        assert await ask(client, "robactor.recordBag", name="mine", topics=["/chatter"]) == "mine"
        await said(stage, client, ["one", "two"])
        report = await ask(client, "robactor.bags")
        assert report["bags"] == []
        recording = report["recording"]
        assert (recording["name"], recording["messages"], recording["topics"], recording["failure"]) == (
            "mine",
            2,
            1,
            None,
        )
        assert (recording["dropped"], recording["seconds"] >= 0) == (0, True)
        await ask(client, "robactor.stopRecording")
        (bag,) = (await ask(client, "robactor.bags"))["bags"]
        assert (bag["name"], bag["messages"], bag["topics"], bag["cut"]) == ("mine", 2, 1, False)
        (file,) = bag["files"]
        whole = (folder / "mine" / "mine_0.mcap").read_bytes()
        assert file == {"name": "mine_0.mcap", "bytes": len(whole)}
        assert await fetch(client, "mine", "mine_0.mcap") == whole
        assert await fetch(client, "mine", "mine_0.mcap", 100) == whole[100:]
        assert await fetch(client, "mine", "mine_0.mcap", len(whole)) == b""


async def test_a_large_file_comes_in_pieces(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "PIECE", 1000)
    path = recorded(tmp_path / "walk") / "walk_0.mcap"
    async with serving(keeping(tmp_path)) as stage, stage.foxglove() as client:
        pieces: list[bytes] = []
        while piece := await fetch(client, "walk", path.name, sum(map(len, pieces))):
            pieces.append(piece)
    assert b"".join(pieces) == path.read_bytes()
    assert {len(piece) for piece in pieces[:-1]} == {1000}


async def test_all_topics_are_recorded_under_the_time_of_day_if_nothing_else_is_said(tmp_path: Path) -> None:
    async with serving(keeping(tmp_path)) as stage, stage.foxglove() as client:
        name = await ask(client, "robactor.recordBag")
        await said(stage, client, ["one"])
        await ask(client, "robactor.stopRecording")
    assert name.startswith("rosbag2_20")
    with BagReader(tmp_path / name) as bag:
        assert {"/chatter", "/latched"} <= {topic.name for topic in bag.topics}


async def test_one_bag_at_a_time_and_no_name_twice(tmp_path: Path) -> None:
    recorded(tmp_path / "walk", 3)
    async with serving(keeping(tmp_path)) as stage, stage.foxglove() as client:
        with pytest.raises(LookupError, match="there is a bag walk already"):
            await ask(client, "robactor.recordBag", name="walk")
        await ask(client, "robactor.recordBag", name="one")
        with pytest.raises(LookupError, match="one is recorded already"):
            await ask(client, "robactor.recordBag", name="two")
        with pytest.raises(LookupError, match="one is still recorded"):
            await fetch(client, "one", "one_0.mcap")
        await ask(client, "robactor.stopRecording")
        await ask(client, "robactor.stopRecording")  # there is none: that is harmless
        await ask(client, "robactor.recordBag", name="two")


async def test_the_end_of_the_server_ends_the_bag_in_order(tmp_path: Path) -> None:
    async with serving(keeping(tmp_path)) as stage, stage.foxglove() as client:
        await ask(client, "robactor.recordBag", name="mine", topics=["/chatter"])
        await said(stage, client, ["one"])
    with BagReader(tmp_path / "mine") as bag:
        assert (bag.cut, bag.metadata.message_count) == (False, 1)
    assert (tmp_path / "mine" / "metadata.yaml").is_file()


@pytest.mark.parametrize("name", ["../out", "/etc", ".hidden", "a/b", "a\0b", "-", "ä", "x" * 101, "a b"])
async def test_no_name_leads_out_of_the_folder(tmp_path: Path, name: str) -> None:
    recorded(tmp_path / "out", 3)
    async with serving(keeping(tmp_path / "bags")) as stage, stage.foxglove() as client:
        with pytest.raises(LookupError, match="is no name of a bag"):
            await ask(client, "robactor.recordBag", name=name)
        with pytest.raises(LookupError, match="is no name of a bag"):
            await fetch(client, name, "out_0.mcap")
    assert not (tmp_path / "bags").exists()


@pytest.mark.parametrize("file", ["../other/other_0.mcap", "metadata.yaml", "none.mcap", "link.mcap", "", "."])
async def test_only_the_files_of_a_bag_are_given_out(tmp_path: Path, file: str) -> None:
    recorded(tmp_path / "other", 3)
    recorded(tmp_path / "walk", 3)
    (tmp_path / "walk" / "link.mcap").symlink_to(tmp_path / "other" / "other_0.mcap")
    async with serving(keeping(tmp_path)) as stage, stage.foxglove() as client:
        with pytest.raises(LookupError, match=r"is no name|has no file"):
            await fetch(client, "walk", file)
        with pytest.raises(LookupError, match="there is no bag 'none'"):
            await fetch(client, "none", "none_0.mcap")


async def test_files_alone_and_what_is_no_bag_are_told_apart(tmp_path: Path) -> None:
    (recorded(tmp_path / "walk", 3) / "walk_0.mcap").rename(tmp_path / "flight.mcap")
    (tmp_path / "walk" / "metadata.yaml").unlink()
    (tmp_path / "notes.txt").write_text("no bag")
    (tmp_path / "broken.mcap").write_bytes(b"no bag")
    (tmp_path / "link.mcap").symlink_to(tmp_path / "flight.mcap")
    async with serving(keeping(tmp_path)) as stage, stage.foxglove() as client:
        for _ in range(2):  # the second time from memory
            (bag,) = (await ask(client, "robactor.bags"))["bags"]
            assert (bag["name"], bag["seconds"], bag["files"][0]["name"]) == ("flight.mcap", 2.0, "flight.mcap")
        assert await fetch(client, "flight.mcap", "flight.mcap") == (tmp_path / "flight.mcap").read_bytes()


async def test_without_a_folder_nothing_is_kept() -> None:
    async with serving() as stage, stage.foxglove() as client:
        assert await ask(client, "robactor.bags") == {"folder": None, "recording": None, "bags": []}
        with pytest.raises(LookupError, match="--bags DIR"):
            await ask(client, "robactor.recordBag", name="mine")


async def test_a_folder_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    async with serving(keeping(tmp_path / "file" / "bags")) as stage, stage.foxglove() as client:
        with pytest.raises(LookupError, match="mine cannot be recorded"):
            await ask(client, "robactor.recordBag", name="mine")
