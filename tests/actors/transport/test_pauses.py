"""A process that stands still, as in a debugger or on a machine that sleeps, and goes on: topics, calls and goals are heard again, both ways."""

from __future__ import annotations

import pytest

from tests.tools.pauses import main


def test_on_a_simulated_network_all_is_heard_again_within_two_seconds() -> None:
    assert main(["--wire", "simulated", "--seconds", "0.5", "1", "3", "10", "60"]) == 0


@pytest.mark.realtime
@pytest.mark.parametrize(("wire", "seconds"), [("zenoh", "3"), ("router", "3"), ("dds", "12")])
def test_on_each_wire_all_is_heard_again_within_two_seconds(wire: str, seconds: str) -> None:
    """Longer than silence counts as the end: by the heartbeat over Zenoh, by the lease of 10 s over DDS."""
    if wire == "dds":
        pytest.importorskip("cyclonedds")
    assert main(["--wire", wire, "--seconds", seconds]) == 0
