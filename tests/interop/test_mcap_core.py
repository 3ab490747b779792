"""Our bags as `@mcap/core` reads them, the library of the browser tools."""

from __future__ import annotations

import base64
import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

from actors.bag import WriterOptions
from tests.actors.bag.bags import BEGIN, MS, text, write
from tests.interop.npm import installed

pytestmark = pytest.mark.interop

PACKAGES = ("@mcap/core@2", "@mcap/nodejs@1", "@mcap/support@1")
PROGRAM = Path(__file__).parent / "programs" / "read_mcap.mjs"


@pytest.fixture(scope="session")
def packages() -> Path:
    return installed(*PACKAGES)


@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
def test_the_library_of_the_browser_tools_reads_what_we_write(packages: Path, tmp_path: Path, compression: str) -> None:
    words = [f"word {number}" for number in range(500)]
    bag = write(tmp_path / "walk", words, WriterOptions(compression=compression))
    late = BEGIN + 4900 * MS
    command = ["node", str(PROGRAM), str(packages), str(bag / "walk_0.mcap"), str(late)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    found: dict[str, Any] = json.loads(done.stdout)
    assert (found["profile"], found["schemas"], found["statistics"]) == (
        "ros2",
        [["std_msgs/msg/String", "ros2msg"]],
        "500",
    )
    assert [(topic, int(at), int(sent), base64.b64decode(data)) for topic, at, sent, data in found["messages"]] == [
        ("/words", BEGIN + 10 * MS * number, BEGIN + 10 * MS * number - 3 * MS, text(word))
        for number, word in enumerate(words)
    ]
    assert [int(at) for at in found["late"]] == [late + 10 * MS * number for number in range(10)]
    assert (found["streamed"], found["done"]) == (500, True)
