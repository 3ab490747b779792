"""Flight records of failed tests: where they go, and what the report of the test says of them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from actors.errors import NotStarted, described

if TYPE_CHECKING:
    import pytest

    from actors.bag import FlightRecorder

__all__ = ["OPTION", "flight_path", "save_flight"]

OPTION = "flight_records"
"""The ini option, and ``--flight-records`` on the command line."""
LONGEST_NAME = 150


def flight_path(config: pytest.Config, temporary: pytest.TempPathFactory, test: str) -> Path:
    """Where the flight record of a test (its node id) belongs: the folder that the options name, else pytest's own temporary folder.

    The folder is made. A folder of the command line is relative to where pytest was started, one of the ini file to that file.
    """
    given, ini = config.getoption(OPTION), config.getini(OPTION)
    if given:
        folder = config.invocation_params.dir / str(given)
    elif ini:
        folder = Path(ini[0])
    else:
        folder = temporary.getbasetemp() / "flight-records"
    folder.mkdir(parents=True, exist_ok=True)
    name = re.sub(r"[^\w.-]+", "-", test).strip("-")
    return folder / f"{name[-LONGEST_NAME:]}.mcap"


def save_flight(
    recorder: FlightRecorder, config: pytest.Config, temporary: pytest.TempPathFactory, test: str
) -> str | None:
    """Write what a recorder holds; the path, or why there is none. None when nothing has been recorded.

    Never raises: a record that cannot be written must not hide why the test failed.
    """
    try:
        record = recorder.freeze()
    except NotStarted:  # the test failed before it had a system
        return None
    try:
        return str(record.write(flight_path(config, temporary, test), notes={"test": test}))
    except Exception as error:
        return f"could not be written: {described(error)}"
