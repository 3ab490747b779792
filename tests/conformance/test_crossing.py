"""Conformance over a transport: the families with a client and a server pass with the two in different systems."""

from __future__ import annotations

import asyncio
import io
import os
from pathlib import Path

import pytest

from actors import Service
from actors.interfaces.action_msgs.srv import CancelGoal
from tests.conformance import crossing
from tests.conformance.__main__ import CROSSING
from tests.conformance.apart import ClientProcess, Remote
from tests.conformance.crossing import Wire
from tests.conformance.runner import run_folder

VECTORS = Path(__file__).parent / "vectors"


def crossed(wire: Wire) -> tuple[int, str]:
    out = io.StringIO()
    # Its status has a depth of 1: of two that follow at once, DDS keeps the newest, as in ROS 2, and the cases want all of them.
    families = [one for one in CROSSING if wire != "dds" or one != "action_status"]
    with crossing.over(wire):
        failed = run_folder(VECTORS, out, families)
    return failed, out.getvalue()


def test_all_families_pass_with_client_and_server_on_different_hosts() -> None:
    failed, said = crossed("simulated")
    assert not failed, said
    assert "10 files run" in said
    assert crossing.counts["messages"] >= 150
    assert crossing.counts["calls"] >= 100
    assert crossing.counts["goals"] >= 50


@pytest.mark.slow(reason="a second process for each of some hundred crossings")
@pytest.mark.parametrize("wire", ["zenoh", "dds"])
def test_all_families_pass_over_a_network_with_client_and_server_in_two_processes(wire: Wire) -> None:
    if wire == "dds":
        pytest.importorskip("cyclonedds")
    failed, said = crossed(wire)
    assert not failed, said
    least = (20, 60, 0) if wire == "dds" else (150, 100, 50)  # the goals are those of action_status
    assert all(
        crossing.counts[what] >= count for what, count in zip(("messages", "calls", "goals"), least, strict=True)
    )


@pytest.mark.slow(reason="a second process")
def test_a_client_in_a_process_of_its_own_does_what_it_is_told_there_and_says_what_failed() -> None:
    process = ClientProcess()
    service = Service(CancelGoal, "/nobody")

    async def told() -> None:
        remote = Remote(process, 0)
        await remote.open("rig")
        await remote.wait_for_nodes(())
        with pytest.raises(RuntimeError, match=r"^in the process of the client: ServiceUnavailable: .*/nobody"):
            await remote.call(service, CancelGoal.Request(), 0.1)
        await remote.close()

    asyncio.run(told())
    assert process.process.pid != os.getpid()
    process.close()
    assert process.process.returncode is not None


def test_without_a_transport_nothing_crosses() -> None:
    with crossing.over("simulated"):
        assert crossing.counts.total() == 0
    failed = run_folder(VECTORS, io.StringIO(), ("cancel_goals", "timers"))
    assert not failed
    assert crossing.counts.total() == 0
