"""A recording on the page's port: viewers pause, seek and set the rate of it, and see what was to be seen at each time."""

from __future__ import annotations

import asyncio
import struct
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidStatus

from actors import Child, Node, qos, run
from actors.bag import BagWriter, topic_of
from actors.interfaces import decode, encode
from actors.interfaces.std_msgs.msg import Int32, String
from cli.command import CommandFailed
from cli.verbs.web import COMMAND
from cli.web.server.server import WebServer
from cli.web.server.settings import WebSettings
from cli.web.verb import serve
from tests.cli.web.stage import Bridge, Foxglove, serving

BEGIN = 1_700_000_000_000_000_000
S = 10**9
PLAY, PAUSE = 0, 1
PLAYING, PAUSED, ENDED = 0, 1, 3
MAP = topic_of("/map", String, [qos.LATCHED])
COUNT = topic_of("/count", Int32, [qos.DEFAULT])


def recorded(path: Path, seconds: int = 100) -> Path:
    """A map at the start and after 50 s, and a count each second."""
    with BagWriter(path) as bag:
        for at in range(seconds):
            ns = BEGIN + at * S
            if at in (0, 50):
                bag.write(MAP, encode(String(data=f"map {at}")), received_ns=ns, published_ns=ns)
            bag.write(COUNT, encode(Int32(data=at)), received_ns=ns, published_ns=ns)
    return path


@dataclass
class State:
    """How the recording is played, as a viewer is told."""

    status: int
    at_ns: int
    rate: float
    sought: bool
    request: str


class Viewer(Foxglove):
    """A viewer that controls what it sees."""

    async def ask(self, command: int, *, rate: float = 1.0, seek_ns: int | None = None, id: str = "me") -> State:
        """Ask the server to play, and wait for its answer."""
        head = struct.pack("<BBfBQI", 3, command, rate, seek_ns is not None, seek_ns or 0, len(id))
        await self.socket.send(head + id.encode())
        while (state := await self.state()).request != id:
            pass
        return state

    async def state(self) -> State:
        """The next state that the server tells."""
        frame = await self.kind(5)
        _, status, at_ns, rate, sought, length = struct.unpack_from("<BBQfBI", frame)
        assert len(frame) == 19 + length
        return State(status, at_ns, rate, bool(sought), frame[19:].decode())

    async def message(self) -> tuple[int, int, bytes]:
        """The next message: subscription, time, CDR."""
        frame = await self.kind(1)
        _, id, at_ns = struct.unpack_from("<BIQ", frame)
        return id, at_ns, frame[13:]

    async def kind(self, op: int) -> bytes:
        """The first binary frame of this kind."""
        for index, frame in enumerate(self.frames):
            if isinstance(frame, bytes) and frame[0] == op:
                return self.frames.pop(index)  # type: ignore[no-any-return]
        while not (isinstance(frame := await self.next(), bytes) and frame[0] == op):
            self.frames.append(frame)
        return frame

    async def follow(self, topic: str, id: int) -> None:
        channel = await self.channel(topic)
        await self.say("subscribe", subscriptions=[{"id": id, "channelId": channel["id"]}])


@asynccontextmanager
async def showing(recording: Path | None, bags: Path | None = None) -> AsyncIterator[str]:
    """A server that shows a recording; its address."""
    settings = WebSettings(port=0, recording=recording, bags=bags)
    async with run(Child(Node, name="alone"), signals=False, sinks=()) as system:
        server = (await system.join(Child(WebServer, name="_web", args=(settings,)))).node
        assert isinstance(server, WebServer)
        yield server.url.replace("http", "ws", 1)


@asynccontextmanager
async def viewing(url: str) -> AsyncIterator[Viewer]:
    """A viewer that has paused the recording."""
    async with connect(url, subprotocols=["foxglove.sdk.v1"], max_size=None) as socket:  # type: ignore[list-item]
        viewer = Viewer(socket)
        await viewer.ask(PAUSE, id="first")
        yield viewer


# -- playing ------------------------------------------------------------------------------------------------------------------------


async def test_a_recording_tells_that_it_can_be_played_and_from_when_to_when(tmp_path: Path) -> None:
    async with showing(recorded(tmp_path / "walk")) as url, viewing(url) as viewer:
        hello = await viewer.find("serverInfo")
        assert {"playbackControl", "time"} <= set(hello["capabilities"])
        assert hello["dataStartTime"] == {"sec": 1_700_000_000, "nsec": 0}
        assert hello["dataEndTime"] == {"sec": 1_700_000_099, "nsec": 0}
        assert (await viewer.channel("/count"))["schemaName"] == "std_msgs/msg/Int32"


async def test_a_viewer_learns_at_once_how_a_recording_is_played_and_need_not_begin_again(tmp_path: Path) -> None:
    async with showing(recorded(tmp_path / "walk")) as url:
        async with connect(url, subprotocols=["foxglove.sdk.v1"], max_size=None) as socket:  # type: ignore[list-item]
            state = await Viewer(socket).state()
            assert (state.request, state.sought) == ("", False)


async def test_a_doctor_finds_nothing_wrong_with_the_graph_of_a_recording(tmp_path: Path) -> None:
    async with showing(recorded(tmp_path / "walk")) as url, viewing(url) as viewer:
        await viewer.channel("/count")
        await viewer.say("robactor.subscribeFindings")
        for _ in range(2):
            assert (await viewer.find("robactor.findings"))["findings"] == []


async def test_a_graph_that_runs_cannot_be_played() -> None:
    async with serving() as stage, stage.foxglove() as client:
        assert "playbackControl" not in (await client.find("serverInfo"))["capabilities"]
        await client.socket.send(struct.pack("<BBfBQI", 3, 0, 1.0, 0, 0, 1) + b"x")
        assert "no recording" in (await client.find("status"))["message"]


async def test_after_a_seek_every_topic_shows_what_it_showed_then_in_the_times_of_the_recording(tmp_path: Path) -> None:
    async with showing(recorded(tmp_path / "walk")) as url, viewing(url) as viewer:
        await viewer.follow("/map", 1)
        await viewer.follow("/count", 2)
        for at, shown in ((70, "map 50"), (20, "map 0")):  # backwards, too
            viewer.frames = [one for one in viewer.frames if isinstance(one, dict)]
            state = await viewer.ask(PAUSE, seek_ns=BEGIN + at * S + 1)
            assert state == State(PAUSED, BEGIN + at * S + 1, 1.0, True, "me")
            seen: dict[int, tuple[int, bytes]] = {}
            while seen.get(2, (0,))[0] != BEGIN + at * S:
                id, at_ns, cdr = await viewer.message()
                seen[id] = (at_ns, cdr)
            assert decode(Int32, seen[2][1]).data == at
            assert decode(String, seen[1][1]).data == shown
            assert seen[1][0] == BEGIN + int(shown.removeprefix("map ")) * S


async def test_who_subscribes_while_it_stands_still_sees_what_is_shown(tmp_path: Path) -> None:
    async with showing(recorded(tmp_path / "walk")) as url, viewing(url) as first, viewing(url) as second:
        await first.follow("/count", 1)
        await first.ask(PAUSE, seek_ns=BEGIN + 33 * S + 1)
        while (await first.message())[1] != BEGIN + 33 * S:
            pass
        await second.follow("/count", 9)
        await second.follow("/map", 8)
        assert await second.message() == (9, BEGIN + 33 * S, encode(Int32(data=33)))
        assert await second.message() == (8, BEGIN, encode(String(data="map 0")))


async def test_all_who_look_at_it_look_at_the_same_time_and_one_is_answered(tmp_path: Path) -> None:
    async with showing(recorded(tmp_path / "walk")) as url, viewing(url) as first, viewing(url) as second:
        assert (await first.ask(PAUSE, seek_ns=BEGIN + 10 * S, rate=4.0, id="mine")).rate == 4.0
        while not (state := await second.state()).sought:
            pass
        assert state == State(PAUSED, BEGIN + 10 * S, 4.0, True, "")


async def test_it_plays_at_its_rate_to_its_end_tells_the_time_and_begins_anew(tmp_path: Path) -> None:
    async with showing(recorded(tmp_path / "walk")) as url, viewing(url) as viewer:
        await viewer.follow("/count", 1)
        assert (await viewer.ask(PLAY, rate=1000.0, seek_ns=BEGIN + S)).status == PLAYING
        while (state := await viewer.state()).status != ENDED:
            pass
        assert (state.at_ns, state.request) == (BEGIN + 99 * S, "")
        while (await viewer.message())[1] != BEGIN + 99 * S:
            pass
        again = await viewer.ask(PLAY, rate=1.0, id="again")
        assert (again.status, again.sought) == (PLAYING, True) and again.at_ns < BEGIN + 50 * S
        op, at_ns = struct.unpack("<BQ", await viewer.kind(2))
        assert op == 2 and BEGIN <= at_ns <= BEGIN + 99 * S


async def test_a_time_beyond_the_recording_is_that_of_its_end_and_no_rate_is_refused(tmp_path: Path) -> None:
    async with showing(recorded(tmp_path / "walk")) as url, viewing(url) as viewer:
        assert (await viewer.ask(PAUSE, seek_ns=2 * BEGIN)).at_ns == BEGIN + 99 * S
        assert (await viewer.ask(PAUSE, seek_ns=5, id="early")).at_ns == BEGIN
        await viewer.socket.send(struct.pack("<BBfBQI", 3, 0, 0.0, 0, 0, 1) + b"x")
        assert "must be above 0" in (await viewer.find("status"))["message"]


@pytest.mark.parametrize(
    "frame",
    [b"\x03", struct.pack("<BBfBQI", 3, 2, 1.0, 0, 0, 0), struct.pack("<BBfBQI", 3, 0, 1.0, 0, 0, 9) + b"x"],
    ids=["short", "command", "length"],
)
async def test_a_request_that_is_none_is_refused(tmp_path: Path, frame: bytes) -> None:
    async with showing(recorded(tmp_path / "walk")) as url, viewing(url) as viewer:
        await viewer.socket.send(frame)
        assert "playback request" in (told := (await viewer.find("status"))["message"]) or "binary frame" in told


async def test_the_services_of_the_player_step_and_seek_and_the_viewers_hear_of_it(tmp_path: Path) -> None:
    async with showing(recorded(tmp_path / "walk")) as url, viewing(url) as viewer, connect(url) as socket:
        bridge = Bridge(socket)
        await viewer.follow("/count", 1)
        at = BEGIN + 40 * S
        seek = {"time": {"sec": at // S, "nanosec": 1}}
        assert (await bridge.call("/rosbag2_player/seek", seek))["values"] == {"success": True}
        while not (state := await viewer.state()).sought:
            pass
        assert state.at_ns == at + 1
        assert (await bridge.call("/rosbag2_player/play_next"))["values"] == {"success": True}
        counts = []
        while not counts or counts[-1] != 41:
            counts.append(decode(Int32, (await viewer.message())[2]).data)
        assert 40 in counts


# -- the command ---------------------------------------------------------------------------------------------------------------------


async def test_the_command_shows_a_recording_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    verb = asyncio.ensure_future(serve(COMMAND.parser().parse_args([str(recorded(tmp_path / "walk")), "--port", "0"])))
    said = ""
    while "web page: " not in said:
        await asyncio.sleep(0.01)
        said += capsys.readouterr().out
        assert not verb.done() or verb.exception() is None
    url = said.split("web page: ")[1].split()[0].replace("http", "ws", 1)
    async with viewing(url) as viewer:
        assert (await viewer.find("serverInfo"))["metadata"]["recording"] == "walk"
        assert await viewer.channel("/count")
    verb.cancel()
    with pytest.raises(asyncio.CancelledError):
        await verb


async def test_the_command_says_at_once_that_there_is_no_bag(tmp_path: Path) -> None:
    with pytest.raises(CommandFailed, match="there is no bag"):
        await serve(COMMAND.parser().parse_args([str(tmp_path / "none"), "--port", "0"]))


# -- which recording ----------------------------------------------------------------------------------------------------------------


async def test_a_bag_of_the_folder_is_shown_by_its_name_beside_the_robot_which_hears_nothing_of_it(
    tmp_path: Path,
) -> None:
    recorded(tmp_path / "bags" / "walk")
    async with serving(WebSettings(port=0, bags=tmp_path / "bags")) as stage:
        async with viewing(f"{stage.url}?bag=walk") as viewer, stage.foxglove() as live:
            assert await viewer.channel("/count")
            await live.channel("/chatter")
            assert "/count" not in stage.system.graph.topics
            assert not any(one["topic"] == "/chatter" for frame in viewer.frames if isinstance(frame, dict)
                           for one in frame.get("channels", []))  # fmt: skip


@pytest.mark.parametrize("name", ["none", "..", ".hidden", "a%2Fb", "walk%00", "x" * 200])
async def test_a_name_that_is_no_bag_is_not_found(tmp_path: Path, name: str) -> None:
    recorded(tmp_path / "bags" / "walk")
    async with showing(recorded(tmp_path / "other"), tmp_path / "bags") as url:
        with pytest.raises(InvalidStatus) as refused:
            await connect(f"{url}?bag={name}")
        assert refused.value.response.status_code == 404


async def test_a_link_out_of_the_folder_is_not_followed(tmp_path: Path) -> None:
    recorded(tmp_path / "secret")
    (tmp_path / "bags").mkdir()
    (tmp_path / "bags" / "link").symlink_to(tmp_path / "secret")
    async with serving(WebSettings(port=0, bags=tmp_path / "bags")) as stage:
        with pytest.raises(InvalidStatus):
            await connect(f"{stage.url}?bag=link")


async def test_what_cannot_be_played_closes_the_connection_with_the_reason(tmp_path: Path) -> None:
    (tmp_path / "broken.mcap").write_bytes(b"no recording")
    async with showing(tmp_path / "broken.mcap") as url, connect(url) as socket:
        with pytest.raises(ConnectionClosed) as closed:
            await socket.recv()
        assert closed.value.rcvd is not None and "broken.mcap cannot be played" in closed.value.rcvd.reason


async def test_who_comes_back_finds_it_where_it_was(tmp_path: Path) -> None:
    async with showing(recorded(tmp_path / "walk")) as url:
        async with viewing(url) as viewer:
            await viewer.ask(PLAY, seek_ns=BEGIN + 70 * S)
        async with viewing(url) as viewer:
            state = await viewer.ask(PAUSE)
            assert BEGIN + 70 * S <= state.at_ns < BEGIN + 90 * S


async def test_only_so_many_recordings_are_open_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from cli.web.server import recordings

    monkeypatch.setattr(recordings, "MOST", 1)
    for name in ("one", "two"):
        recorded(tmp_path / name, 3)
    async with showing(tmp_path / "one", tmp_path) as url, viewing(url), connect(f"{url}?bag=two") as socket:
        with pytest.raises(ConnectionClosed) as closed:
            await socket.recv()
        assert closed.value.rcvd is not None and "1 recordings are open" in closed.value.rcvd.reason


async def test_a_recording_that_nobody_looks_at_is_closed_after_a_while(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from cli.web.server import recordings

    monkeypatch.setattr(recordings, "LINGER", 0.01)
    monkeypatch.setattr(recordings, "MOST", 1)
    for name in ("one", "two"):
        recorded(tmp_path / name, 3)
    async with showing(tmp_path / "one", tmp_path) as url:
        async with viewing(url):
            pass
        while True:  # there is room for another one, once the first is closed
            try:
                async with viewing(f"{url}?bag=two") as viewer:
                    assert await viewer.channel("/count")
                break
            except (ConnectionClosed, AssertionError):
                continue


async def test_a_recording_that_breaks_ends_the_connections_with_the_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from actors.bag import BagReader

    def broken(*_: Any) -> Any:
        raise OSError("the disk is gone")

    async with showing(recorded(tmp_path / "walk")) as url, viewing(url) as viewer:
        monkeypatch.setattr(BagReader, "before", broken)
        await viewer.socket.send(struct.pack("<BBfBQI", 3, 1, 1.0, 1, BEGIN + 5 * S, 1) + b"x")
        with pytest.raises(ConnectionClosed) as closed:
            while True:
                await viewer.next()
        assert closed.value.rcvd is not None and "walk cannot be played" in closed.value.rcvd.reason
