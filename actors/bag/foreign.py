"""Files that are taken for bags and are none of ours: what they are by their first bytes, and what to do with them."""

from __future__ import annotations

from pathlib import Path
from typing import Final

SQLITE: Final = b"SQLite format 3\0"
ZSTD: Final = b"\x28\xb5\x2f\xfd"
LENGTH: Final = 64

OTHERS: Final = (
    (
        b"#ROSBAG V",
        "is a bag of ROS 1: convert it by `pip install rosbags` and `rosbags-convert --src {path} --dst NEW`",
    ),
    (b"version https://git-lfs", "is a pointer of Git LFS, not the file itself: run `git lfs pull` in its repository"),
    (b"PK\3\4", "is a ZIP archive: unpack it first"),
    (b"\x1f\x8b", "is compressed by gzip: unpack it first by `gunzip {path}`"),
)
"""The first bytes of files of other formats, and the error for each."""


def begin_of(path: Path) -> bytes:
    """The first bytes of a file. Raises `OSError`."""
    with path.open("rb") as stream:
        return stream.read(LENGTH)


def named(path: Path) -> str:
    """What a file is that is no file of a bag, in a sentence that says what to do; empty if that is not known. Raises `OSError`."""
    begin = begin_of(path)
    if not begin:
        return f"{path} is empty"
    return next((f"{path} {said.format(path=path)}" for first, said in OTHERS if begin.startswith(first)), "")
