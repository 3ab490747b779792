"""Tools for testing robots: a virtual clock, `Rig` and `Lab` to run one system or several within a test, and `scenario` to run it under many seeds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from actors.hosts.simulated import SimulatedHosts
    from actors.testing.failures import ExpectedFailure, UnexpectedFailure
    from actors.testing.lab import Lab
    from actors.testing.leaks import Leak
    from actors.testing.probe import Probe
    from actors.testing.rig import Rig
    from actors.testing.simulation.decorator import scenario
    from actors.testing.simulation.invariants import Invariant
    from actors.time.deadlock import Deadlock, Livelock, Stalled
    from actors.time.virtual_loop import VirtualLoop
    from actors.transport.simulated.link import Conditions

__all__ = [
    "Conditions",
    "Deadlock",
    "ExpectedFailure",
    "Invariant",
    "Lab",
    "Leak",
    "Livelock",
    "Probe",
    "Rig",
    "SimulatedHosts",
    "Stalled",
    "UnexpectedFailure",
    "VirtualLoop",
    "scenario",
]


def __getattr__(name: str) -> Any:
    if name in ("Deadlock", "Livelock", "Stalled", "VirtualLoop"):
        from actors.time import virtual_loop as loop

        return getattr(loop, name)
    if name in ("ExpectedFailure", "UnexpectedFailure"):
        from actors.testing import failures

        return getattr(failures, name)
    if name in ("Leak", "Probe", "Rig"):
        from actors.testing import rig

        return getattr(rig, name)
    if name == "Conditions":
        from actors.transport.simulated.link import Conditions

        return Conditions
    if name == "SimulatedHosts":
        from actors.hosts.simulated import SimulatedHosts

        return SimulatedHosts
    if name == "Lab":
        from actors.testing.lab import Lab

        return Lab
    if name == "Invariant":
        from actors.testing.simulation.invariants import Invariant

        return Invariant
    if name == "scenario":
        from actors.testing.simulation.decorator import scenario

        return scenario
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
