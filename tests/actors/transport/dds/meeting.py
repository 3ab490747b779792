"""Transports over DDS that meet nobody else: each meeting has a domain of its own on the loopback interface."""

from __future__ import annotations

from itertools import count
from typing import Any, Final

from actors.transport.dds import DdsConfig, DdsTransport
from actors.transport.protocol import Participant

HERE: Final = DdsConfig(discovery_range="LOCALHOST")
_domains = count(20)


def free_domain() -> int:
    """A domain in which nobody of this process has been."""
    return 20 + next(_domains) % 200


class MeetingTransport(DdsTransport):
    """A transport that joins the domain of its meeting, whatever domain it is to join."""

    def __init__(self, domain: int) -> None:
        super().__init__(HERE)
        self._meeting = domain

    async def join(self, domain_id: int, events: Any, *, beyond: bool = False) -> Participant:
        return await super().join(self._meeting, events, beyond=beyond)
