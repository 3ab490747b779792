"""The first node of each process of the robot: it asks for the processor time that its concern needs, and makes it hang when that was ordered."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, NoReturn

from actors import Node, background
from robot.link.priority import favour, step_aside

if TYPE_CHECKING:
    from robot.hardware.body import Hardware


@dataclass(frozen=True, slots=True)
class Hang:
    """A failure on request: the event loop of a node's process stands still."""

    node: str
    at: float
    """When, on the clock that all processes of a machine share (`time.monotonic`), so that a process that was restarted does not fail again."""


class ProcessCare(Node):
    """Runs before all others of its process, which is that of `concern`: ``control`` goes before everybody else, others step aside for it.

    `body` is that of the robot, if it is used in that process: the clock of a process that has it goes with its time (`actors.time.lockstep`).
    """

    def __init__(self, concern: str, body: Hardware | None, *hangs: Hang) -> None:
        self._concern = concern
        self._hangs = hangs

    async def on_start(self) -> None:
        if self._concern == "control":
            self.log.info(f"process of {favour('control')}")
        else:
            self.log.debug(f"process of {self._concern}: {step_aside()}")

    @background
    async def hang(self) -> None:
        """Stand still at the first of the times that is still to come."""
        ahead = [hang for hang in self._hangs if hang.at > time.monotonic()]
        if ahead:
            first = min(ahead, key=lambda hang: hang.at)
            await self.clock.sleep(first.at - time.monotonic())
            self.log.warning("hanging on request (--hang)", node_name=first.node)
            await self.clock.sleep(0.0)  # let the line go
            stand_still()


def stand_still() -> NoReturn:
    """Never return, nor let any other code of this thread run, as an endless loop does; but leave the processor to others."""
    while True:
        time.sleep(1.0)
