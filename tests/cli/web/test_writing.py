"""Frames that are written together are those that the WebSocket library would write one by one."""

from __future__ import annotations

import pytest
from websockets.frames import Frame, Opcode

from cli.web.clients.outbox import Spliced
from cli.web.clients.writing import written

LENGTHS = (0, 1, 125, 126, 127, 65_535, 65_536, 70_000)
"""Around those at which the size takes more bytes."""


def library(opcode: Opcode, data: bytes) -> bytes:
    return Frame(opcode, data).serialize(mask=False)


@pytest.mark.parametrize("length", LENGTHS)
def test_a_frame_of_any_length_is_written_as_the_library_writes_it(length: int) -> None:
    data = bytes(number % 251 for number in range(length))
    assert written([data]) == library(Opcode.BINARY, data)
    assert written(["x" * length]) == library(Opcode.TEXT, b"x" * length)
    for cut in {0, length // 3, length}:
        assert written([Spliced(data[:cut], data[cut:])]) == library(Opcode.BINARY, data)


def test_the_size_of_a_text_is_that_of_its_bytes() -> None:
    text = "\N{SNOWMAN}" * 50  # 150 bytes, but fewer characters than fit into the short form
    assert written([text]) == library(Opcode.TEXT, text.encode())


def test_many_frames_are_one_piece_in_their_order() -> None:
    frames = ["a", b"b", Spliced(b"c", b"d"), "e"]
    parts = [(Opcode.TEXT, b"a"), (Opcode.BINARY, b"b"), (Opcode.BINARY, b"cd"), (Opcode.TEXT, b"e")]
    assert written(frames) == b"".join(library(*part) for part in parts)
    assert written([]) == b""
