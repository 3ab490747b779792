"""Conformance over a transport: the families with a client and a server pass with the two in different systems."""

from __future__ import annotations

import io
from pathlib import Path

import pytest

from tests.conformance import crossing
from tests.conformance.__main__ import CROSSING
from tests.conformance.crossing import Wire
from tests.conformance.runner import run_folder

VECTORS = Path(__file__).parent / "vectors"


def crossed(wire: Wire) -> tuple[int, str]:
    out = io.StringIO()
    with crossing.over(wire):
        failed = run_folder(VECTORS, out, CROSSING)
    return failed, out.getvalue()


def test_all_families_pass_with_client_and_server_on_different_hosts() -> None:
    failed, said = crossed("simulated")
    assert not failed, said
    assert "10 files run" in said
    assert crossing.counts["messages"] >= 150
    assert crossing.counts["calls"] >= 100
    assert crossing.counts["goals"] >= 50


@pytest.mark.slow
def test_all_families_pass_with_client_and_server_in_different_zenoh_sessions() -> None:
    failed, said = crossed("zenoh")
    assert not failed, said
    assert crossing.counts["messages"] >= 150


def test_without_a_transport_nothing_crosses() -> None:
    with crossing.over("simulated"):
        assert crossing.counts.total() == 0
    failed = run_folder(VECTORS, io.StringIO(), ("cancel_goals", "timers"))
    assert not failed
    assert crossing.counts.total() == 0
