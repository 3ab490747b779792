"""Tests for robots: the virtual clock, and `Rig`, the system seen from a test. The pytest plugin brings both."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from actors.testing.loop import Deadlock, Livelock, Stalled, VirtualLoop
    from actors.testing.rig import Leak, Probe, Rig

__all__ = ["Deadlock", "Leak", "Livelock", "Probe", "Rig", "Stalled", "VirtualLoop"]


def __getattr__(name: str) -> Any:
    if name in ("Deadlock", "Livelock", "Stalled", "VirtualLoop"):
        from actors.testing import loop

        return getattr(loop, name)
    if name in ("Leak", "Probe", "Rig"):
        from actors.testing import rig

        return getattr(rig, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
