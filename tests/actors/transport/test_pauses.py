"""A process that stands still, as in a debugger or on a machine that sleeps, and goes on: topics, calls and goals are heard again, both ways."""

from __future__ import annotations

import pytest

from tests.tools.pauses import main


def test_on_a_simulated_network_all_is_heard_again_within_two_seconds() -> None:
    assert main(["--wire", "simulated", "--seconds", "0.5", "1", "3", "10", "60"]) == 0


@pytest.mark.realtime
@pytest.mark.parametrize("wire", ["zenoh", "router", "dds"])
def test_on_each_wire_all_is_heard_again_within_two_seconds(wire: str) -> None:
    if wire == "dds":
        pytest.importorskip("cyclonedds")
    assert main(["--wire", wire, "--seconds", "3"]) == 0
