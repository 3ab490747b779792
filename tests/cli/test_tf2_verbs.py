"""`tf2_echo`, `view_frames` and `static_transform_publisher`: transforms of other processes, in the terminal."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path

import pytest

from cli.command import CommandFailed
from cli.verbs.view_frames import _write
from tests.cli.conftest import Command, Start

LAMP = ("--x", "1.5", "--yaw", "1.5707963267948966", "--frame-id", "map", "--child-frame-id", "lamp")

ECHOED = """\
At time 0.000000000
- Translation: [1.50, 0.00, 0.00]
- Rotation: in Quaternion (xyzw) [0.00, 0.00, 0.71, 0.71]
- Rotation: in RPY (radian) [0.00, 0.00, 1.57]
- Rotation: in RPY (degree) [0.00, 0.00, 90.00]
- Matrix:
   0.00  -1.00   0.00   1.50
   1.00   0.00   0.00   0.00
   0.00   0.00   1.00   0.00
   0.00   0.00   0.00   1.00
"""


@pytest.fixture
async def lamp(start: Start) -> None:
    """Somebody who tells where the lamp is, in another process."""
    words = ("run", "tf2_ros", "static_transform_publisher", *LAMP, "--ros-args", "-r", "__node:=lamp_mount")
    process = await start(*words)
    while b"Spinning until stopped" not in (line := await process.stdout.readline()):
        assert line


async def test_tf2_echo_prints_the_transform_in_the_form_of_tf2_ros(lamp: None, robot: Command) -> None:
    echoed = await robot("tf2_echo", "map", "lamp", "--once", "--precision", "2", "--timeout", "20")
    assert (echoed.out, echoed.code) == (ECHOED, 0)
    same = await robot("run", "tf2_ros", "tf2_echo", "map", "lamp", "--once", "-p", "2", "--timeout", "20")
    assert same.out == ECHOED


async def test_without_a_transform_tf2_echo_says_why_in_the_time_that_view_frames_takes_to_write_the_graph(
    lamp: None, robot: Command, tmp_path: Path
) -> None:
    waiting, viewed = await asyncio.gather(
        robot("tf2_echo", "map", "lmap", "--timeout", "3"),
        robot("view_frames", "--wait-time", "3", "--output", str(tmp_path / "tree"), "--json"),
    )
    assert waiting.code == 1
    assert "no transform map -> lmap: there is no frame 'lmap'; did you mean" in waiting.err
    assert viewed.code == 0, viewed.err
    frame = json.loads(viewed.out)["lamp"]
    assert (frame["parent"], frame["static"]) == ("map", True)
    graph = (tmp_path / "tree.gv").read_text()
    assert graph.startswith('digraph G {\n"map" -> "lamp"[label=" Broadcaster: default_authority')


@pytest.mark.parametrize(("code", "said"), [(0, "written: tree.pdf"), (1, "graphviz: no such font")])
def test_a_picture_of_the_frames_is_that_of_graphviz_or_its_error(
    code: int, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    program = tmp_path / "dot"
    program.write_text(f"#!/bin/sh\necho no such font >&2\nexit {code}\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    monkeypatch.chdir(tmp_path)
    try:
        _write(Path("tree"), "digraph {}")
        told = capsys.readouterr().err.splitlines()[-1]
    except CommandFailed as error:
        told = str(error)
    assert (told, (tmp_path / "tree.gv").read_text()) == (said, "digraph {}")


async def test_view_frames_without_transforms_says_where_to_look(robot: Command) -> None:
    viewed = await robot("view_frames", "--wait-time", "0.1")
    assert (viewed.code, viewed.out) == (1, "")
    assert "no transforms on /tf and /tf_static within 0.1 s" in viewed.err


async def test_words_that_are_none_are_refused(robot: Command) -> None:
    positional = await robot("static_transform_publisher", "0", "0", "1", "map", "lamp")
    assert positional.code == 1
    assert "unrecognized arguments: 0 0 1 map lamp; it takes --x --y --z, --roll" in positional.err
    missing = await robot("static_transform_publisher", "--frame-id", "map")
    assert missing.code == 1 and "needs two frames: --frame-id PARENT" in missing.err
    helped = await robot("static_transform_publisher", "--help")
    same = await robot("run", "tf2_ros", "static_transform_publisher", "--help")
    assert (same.code, same.out) == (0, helped.out)
    assert helped.code == 0 and "--child-frame-id CHILD" in helped.out
