"""Reading ahead, also when the reader is sent elsewhere in the meantime."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from actors.bag import BagReader
from actors.bag.read_ahead import ReadAhead
from actors.interfaces import decode
from actors.interfaces.std_msgs.msg import String
from tests.actors.bag.bags import BEGIN, MS, write


async def test_what_is_still_being_read_when_the_place_changes_is_discarded(tmp_path: Path) -> None:
    gate = asyncio.Event()

    async def slowly(function: Callable[[], Any]) -> Any:
        await gate.wait()
        return function()

    with BagReader(write(tmp_path / "walk", [f"{number}" for number in range(100)])) as bag:
        ahead = ReadAhead(bag, ["/words"], 5, slowly)
        ahead.rewind(0)
        peeking = asyncio.ensure_future(ahead.peek())
        await asyncio.sleep(0)
        ahead.rewind(BEGIN + 500 * MS)
        gate.set()
        assert await peeking is not None
        found = []
        while await ahead.peek() is not None:
            found.append(decode(String, ahead.advance().data).data)
        await ahead.close()
        await ahead.close()
    assert found == [f"{number}" for number in range(50, 100)]


async def test_two_that_wait_for_the_same_message_do_not_double_it(tmp_path: Path) -> None:
    async def at_once(function: Callable[[], Any]) -> Any:
        await asyncio.sleep(0)
        return function()

    with BagReader(write(tmp_path / "walk", [f"{number}" for number in range(20)])) as bag:
        ahead = ReadAhead(bag, ["/words"], 3, at_once)
        ahead.rewind(0)
        found: list[str] = []

        async def take() -> None:
            while await ahead.peek() is not None:
                found.append(decode(String, ahead.advance().data).data)

        await asyncio.gather(take(), take())
        await ahead.close()
    assert found == [f"{number}" for number in range(20)]


def opened() -> list[str]:
    return [os.path.realpath(each) for each in Path("/proc/self/fd").iterdir()]


@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="open files are looked for in /proc")
async def test_a_bag_that_is_closed_in_the_middle_leaves_no_file_open(tmp_path: Path) -> None:
    async def at_once(function: Callable[[], Any]) -> Any:
        return function()

    path = write(tmp_path / "walk", [f"{number}" for number in range(20)])
    with BagReader(path) as bag:
        ahead = ReadAhead(bag, ["/words"], 3, at_once)
        ahead.rewind(0)
        assert await ahead.peek() is not None
        await ahead.close()
        assert not any(str(path) in each for each in opened())
