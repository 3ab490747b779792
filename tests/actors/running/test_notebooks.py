"""In a thread whose event loop runs already, as in a notebook: what runs a loop of its own says what to do instead."""

from __future__ import annotations

import asyncio

import pytest

from actors import Node, execute, spin


async def answer() -> int:
    return 42


async def test_execute_says_to_await_or_to_take_a_thread_which_works() -> None:
    with pytest.raises(
        RuntimeError,
        match=r"^execute\(\.\.\.\) runs an event loop, and one runs .* await asyncio\.to_thread\(execute, main",
    ):
        execute(answer)
    assert await asyncio.to_thread(execute, answer, clock="virtual") == 42


async def test_spin_says_to_use_run_or_a_blocking_node() -> None:
    with pytest.raises(RuntimeError, match=r"^spin\(\.\.\.\) runs an event loop.* `async with run"):
        spin(Node)
