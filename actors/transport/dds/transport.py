"""The transport over DDS, on Cyclone DDS."""

from __future__ import annotations

import os
import secrets
import socket
from collections.abc import Callable
from dataclasses import replace
from functools import partial

from actors.transport import protocol
from actors.transport.dds.config import DdsConfig
from actors.transport.dds.domain import Domain
from actors.transport.dds.format.user_data import Process, write_participant_data, write_process
from actors.transport.dds.participant import Participant
from actors.transport.format.names import new_session
from actors.transport.protocol import Events, Link


class DdsTransport:
    """A `Transport` by Cyclone DDS, in the format of ROS 2's ``rmw_cyclonedds_cpp``.

    Invariant: it is opened at most once.
    """

    def __init__(self, config: DdsConfig | None = None) -> None:
        self._config = config or DdsConfig()
        self._session = new_session(secrets.SystemRandom())
        self._opened = False
        self._domain: Domain | None = None

    @property
    def session(self) -> str:
        """The identity of this process on the network."""
        return self._session

    async def join(self, domain_id: int, events: Events, *, beyond: bool = False) -> protocol.Participant:
        """See `actors.transport.protocol.Transport.join`. DDS shows no other domains. Raises WireUnavailable."""
        if self._opened:
            raise RuntimeError("a transport is opened once")
        self._opened = True
        config = replace(self._config, domain=domain_id)
        process = Process(self._session, os.getpid(), socket.gethostname())
        engine = Participant(config, write_participant_data(config.enclave) + write_process(process))
        domain = Domain(engine, self._session, domain_id, events)
        await engine.open(domain)
        domain.begin()
        self._domain = domain
        return domain

    async def close(self) -> None:
        """Withdraw everything and disconnect. Never raises; harmless if it is not open."""
        self._opened = True
        domain, self._domain = self._domain, None
        if domain is not None:
            domain.end()
            await domain.engine.close()

    def report(self) -> tuple[Link, ...]:
        """What has been exchanged with each process that is there now; nothing if it is not open.

        `dropped` counts what this process has dropped; Cyclone DDS does not tell whose messages the network has lost.
        """
        return () if self._domain is None else tuple(self._domain.links())

    def sibling(self) -> Callable[[], DdsTransport]:
        """What makes a transport of another process of this machine, which joins the same domain."""
        return partial(DdsTransport, self._config)
