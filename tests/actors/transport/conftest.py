"""What the tests of transports share."""

from __future__ import annotations

from collections.abc import Iterator

import pytest


@pytest.fixture(autouse=True)
def no_error_in_a_callback(caplog: pytest.LogCaptureFixture) -> Iterator[None]:
    """An error in a callback of the loop goes to its log; here it fails the test."""
    yield
    assert [one.getMessage() for one in caplog.get_records("call") if one.name == "asyncio"] == []
