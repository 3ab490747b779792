"""The first node of each process of the robot: it asks for the processor time that its concern needs, and makes the faults that were ordered."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Literal, NoReturn

from actors import Node, NotStarted, background, system_of
from robot.link.priority import favour, step_aside

__all__ = ["Fault", "ProcessCare"]


@dataclass(frozen=True, slots=True)
class Fault:
    """One failure on request: a node that crashes, or the event loop of its process that hangs."""

    kind: Literal["crash", "hang"]
    node: str
    at: float
    """When, on the clock that all processes of a machine share (`time.monotonic`), so that a process that was restarted does not fail again."""


class ProcessCare(Node):
    """Runs before all others of its process, which is that of `concern`: ``control`` goes before everybody else, others step aside for it."""

    def __init__(self, concern: str, *faults: Fault) -> None:
        self._concern = concern
        self._faults = faults

    async def on_start(self) -> None:
        told = favour("control") if self._concern == "control" else f"{self._concern}: {step_aside()}"
        self.log.info(f"process of {told}")

    @background
    async def fail(self) -> None:
        """Make the faults whose time is still to come."""
        for fault in sorted(self._faults, key=lambda fault: fault.at):
            wait = fault.at - time.monotonic()
            if wait <= 0.0:
                continue
            await self.clock.sleep(wait)
            if fault.kind == "hang":
                self.log.warning("hanging on request (--hang)", node_name=fault.node)
                await self.clock.sleep(0.0)  # let the line go
                stand_still()
            try:
                system_of(self).crash(fault.node, RuntimeError("crashed on request (--crash)"))
            except (LookupError, NotStarted):
                self.log.error("there is no such node to crash", asked=fault.node)


def stand_still() -> NoReturn:
    """Never return, nor let any other code of this thread run, as an endless loop does; but leave the processor to others."""
    while True:
        time.sleep(1.0)
