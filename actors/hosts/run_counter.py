"""Counting the runs of a tree in a file, so that the fencing tokens of each run are larger than those of the runs before."""

from __future__ import annotations

import os
from pathlib import Path
from typing import BinaryIO

from actors.errors import DeclarationError


def count_run(path: Path) -> int:
    """The number of a run that begins now: larger than each before, also if several begin at once, or the machine loses its power meanwhile.

    The file has a line for each run; without it, this run is number 1. No clock is asked. Raises `DeclarationError` if the file cannot be
    written, or has something else in its last line.
    """
    try:
        with path.open("a+b", buffering=0) as file:
            number = _add(file)
        if number == 1:
            _keep_name(path)
    except OSError as error:
        raise DeclarationError(
            f"{path}: the runs of the tree are counted here, which failed: {error.strerror}"
        ) from error
    except ValueError:
        raise DeclarationError(f"{path}: its last line should be the number of the last run of the tree") from None
    return number


def _add(file: BinaryIO) -> int:
    """Add a line, and return its number when the disk has it. Raises ValueError if the last line is none."""
    import fcntl  # which not every system has

    fcntl.flock(file, fcntl.LOCK_EX)  # until it is closed
    file.seek(0)
    *lines, torn = file.read().split(b"\n")
    number = (int(lines[-1]) if lines else 0) + 1
    file.truncate(file.tell() - len(torn))  # of a run that has never begun, as it did not get its number
    file.write(b"%d\n" % number)
    os.fsync(file)
    return number


def _keep_name(path: Path) -> None:
    """Have the disk keep the entry of a new file in its folder, too."""
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)
