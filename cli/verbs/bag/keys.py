"""The keys of `bag play` in a terminal: space pauses, the right arrow plays one message, up and down change the rate."""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import Generator
from contextlib import contextmanager

from actors.bag import Player

SPACE, RIGHT, UP, DOWN = b" ", b"\x1b[C", b"\x1b[A", b"\x1b[B"
STEP = 1.1
"""By how much a key changes the rate."""


@contextmanager
def keys(player: Player, *, wanted: bool) -> Generator[None]:
    """Let keys control the player, if the input is a terminal."""
    if not wanted or not sys.stdin.isatty():
        yield
        return
    import termios
    import tty

    loop, terminal = asyncio.get_running_loop(), sys.stdin.fileno()
    before = termios.tcgetattr(terminal)
    tasks: set[asyncio.Task[None]] = set()

    def ready() -> None:
        task = loop.create_task(press(player, os.read(terminal, 8)))
        tasks.add(task)
        task.add_done_callback(tasks.discard)

    tty.setcbreak(terminal)
    loop.add_reader(terminal, ready)
    try:
        yield
    finally:
        loop.remove_reader(terminal)
        termios.tcsetattr(terminal, termios.TCSADRAIN, before)


async def press(player: Player, key: bytes) -> None:
    """Do what a key stands for."""
    if key == SPACE:
        if player.paused:
            player.unpause()
        else:
            player.pause()
    elif key == RIGHT:
        await player.play_next()
    elif key == UP:
        player.rate *= STEP
    elif key == DOWN:
        player.rate /= STEP
