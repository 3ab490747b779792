"""What tests need that run over both wires. ``from tests.wires import wire`` in a file runs those of its tests over both that ask where they meet."""

from __future__ import annotations

import pytest

BOTH = pytest.mark.parametrize("wire", ["zenoh", "dds"])
"""For one test."""


@pytest.fixture(params=["zenoh", "dds"])
def wire(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def meeting_place(wire: str, port: int) -> dict[str, str]:
    """The variables by which processes meet each other and nobody else."""
    if wire == "zenoh":
        return {"ROBACTOR_GOSSIP_PORT": str(port), "RMW_IMPLEMENTATION": ""}
    pytest.importorskip("cyclonedds")
    tag = f"<CycloneDDS><Domain><Discovery><Tag>{port}</Tag></Discovery></Domain></CycloneDDS>"
    return {
        "RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp",
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "CYCLONEDDS_URI": tag,
    }
