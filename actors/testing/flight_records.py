"""Flight records of failed tests: where they are written and how the test report mentions them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from actors.errors import NotStarted, described

if TYPE_CHECKING:
    import pytest

    from actors.bag import FlightRecorder

OPTION = "flight_records"
"""The name of the ini option; on the command line it is ``--flight-records``."""
LONGEST_NAME = 150


def flight_path(config: pytest.Config, temporary: pytest.TempPathFactory, test: str) -> Path:
    """Return the path for the flight record of a test (its node id): in the folder set by the options, or in pytest's temporary folder.

    The folder is created if needed. A folder given on the command line is relative to the directory where pytest was started, one in the
    ini file to that file.
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
    """Write the contents of a recorder. Returns the path, or why it could not be written; None if nothing has been recorded.

    Never raises, because the failure of the test must not be hidden by that of its record.
    """
    try:
        record = recorder.freeze()
    except NotStarted:  # the test failed before its system was started
        return None
    try:
        return str(record.write(flight_path(config, temporary, test), notes={"test": test}))
    except Exception as error:
        return f"could not be written: {described(error)}"
