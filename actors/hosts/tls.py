"""Wires between real machines: TCP with mutual TLS, by the certificates of the security file."""

from __future__ import annotations

import asyncio
import signal
import ssl
import time
from collections.abc import AsyncGenerator, Callable, Mapping, Sequence
from contextlib import asynccontextmanager, closing
from pathlib import Path
from typing import Any, Final, cast

from actors.checks import is_number
from actors.errors import DeclarationError
from actors.hosts.agent import Agent, Session
from actors.hosts.launcher import Launcher
from actors.hosts.lease import LEASE_SECONDS
from actors.hosts.messages import ToAgent, Wire, for_agent, from_agent, written
from actors.hosts.run_counter import count_run
from actors.processes.channel import Channel
from actors.transport.security import Security, SecurityError

PORT: Final = 7450
"""Where an agent is found unless said otherwise."""
MOST_BYTES: Final = 1 << 28
"""The longest message: an order, or what a node leaves for its next life."""
ALARM_SECONDS: Final = 0.1
"""So long after the end of a lease the kernel ends an agent that has not acted on it; its processes go with it."""


class TlsHosts:
    """The machines that a tree may give its parts to: ``TlsHosts({"base": "192.168.1.6:7450"}, security=load_security(FILE))``.

    The certificate of the agent at an address must be that of the host's name, before anything that it sends is read, and a connection ends with
    it. Nothing that an agent sends is executed (see `actors.hosts.events`). A host whose agent is silent for `lease` seconds is lost.
    Each run of the tree is counted in the file `runs`, by default the one of that name beside the security file, so that what a machine
    still does for an earlier run is known as older (`Node.fencing_token`); without that file the count starts at zero.

    Raises `DeclarationError` for an address that is none and for a lease that is not above 0, `SecurityError` for a file without mutual TLS.
    """

    def __init__(
        self,
        addresses: Mapping[str, str],
        *,
        security: Security,
        lease: float = LEASE_SECONDS,
        runs: str | Path | None = None,
    ) -> None:
        if not is_number(lease) or not 0.0 < lease < float("inf"):
            raise DeclarationError(f"TlsHosts(lease={lease!r}): the lease must be seconds, more than 0")
        self._addresses = {name: address_of(address) for name, address in addresses.items()}
        self._context = _context(ssl.PROTOCOL_TLS_CLIENT, security)
        self.names = tuple(self._addresses)
        self.lease = lease
        self._runs = Path(security.file).with_name("runs") if runs is None else Path(runs)

    async def dial(self, host: str, take: Callable[[Any], None], lost: Callable[[], None]) -> Wire:
        """Open a connection with the agent of a host. Raises OSError."""
        address, port = self._addresses[host]
        names: list[str] = []
        ends: list[asyncio.TimerHandle] = []

        def made(transport: asyncio.Transport) -> bool:
            names.append(_peer(transport))
            ends.append(_end_with_certificate(transport))
            return names == [host]

        def gone() -> None:
            for timer in ends:
                timer.cancel()
            lost()

        channel = Channel(take, gone, from_agent, made, written, MOST_BYTES)
        await asyncio.get_running_loop().create_connection(lambda: channel, address, port, ssl=self._context)
        if names != [host]:
            raise ConnectionError(f"at {address}:{port} is {''.join(names)!r}, not {host!r}, by its certificate")
        return channel

    def count_run(self) -> int:
        """The number of a run of the tree that begins, once it is on the disk. Raises `DeclarationError` if it cannot be written there."""
        return count_run(self._runs)


def address_of(text: str) -> tuple[str, int]:
    """The address and the port in ``ADDRESS`` or ``ADDRESS:PORT``. Raises `DeclarationError`."""
    address, _, port = text.rpartition(":") if ":" in text else (text, "", str(PORT))
    if not address or not (port.isascii() and port.isdigit() and int(port) <= 65535):
        raise DeclarationError(f"{text!r} is no address: write ADDRESS:PORT, for instance 192.168.1.6:{PORT}")
    return address, int(port)


@asynccontextmanager
async def serve(
    address: str,
    port: int,
    *,
    owners: Sequence[str],
    security: Security,
    say: Callable[[str], None],
    modules: Sequence[str] = (),
) -> AsyncGenerator[tuple[str, int]]:
    """Run an agent for the trees of these owners, by the names in their certificates, while the block runs. Yields where it listens.

    `modules` are what its processes are likely to need. At the end of the block all that it runs is stopped. It uses the alarm of this process
    (`signal.setitimer`). Raises `OSError` if it cannot listen there, `SecurityError` for a file without mutual TLS.
    """
    loop = asyncio.get_running_loop()
    context = _context(ssl.PROTOCOL_TLS_SERVER, security)
    with closing(Launcher(modules)) as launcher:
        agent = Agent(launcher.launch, say, lambda at: _set_alarm(None if at is None else at - loop.time()))
        server = await loop.create_server(lambda: _Caller(agent, owners).channel, address, port, ssl=context)
        try:
            yield server.sockets[0].getsockname()[:2]
        finally:
            server.close()
            await agent.stop()


class _Caller:
    """The one that has connected to an agent. Invariant: without a session nothing of what it sends is taken."""

    def __init__(self, agent: Agent, owners: Sequence[str]) -> None:
        self._agent = agent
        self._owners = owners
        self._session: Session | None = None
        self._end: asyncio.TimerHandle | None = None
        self.channel = Channel(self._take, self._lost, for_agent, self._made, written, MOST_BYTES)

    def _made(self, transport: asyncio.Transport) -> bool:
        name = _peer(transport)
        if name in self._owners:
            self._session = self._agent.session(self.channel, name)
            self._end = _end_with_certificate(
                transport, lambda: self._agent.say(f"the certificate of {name} has ended")
            )
        else:
            self._agent.say(f"{name!r} has been refused: it is none of {', '.join(self._owners)}")
        return self._session is not None

    def _take(self, message: ToAgent) -> None:
        assert self._session is not None  # the channel of one that was refused is closed, and reads nothing
        self._session.take(message)

    def _lost(self) -> None:
        if self._end is not None:
            self._end.cancel()
        if self._session is not None:
            self._session.lost()


def _context(side: int, security: Security) -> ssl.SSLContext:
    """TLS that both sides have to show a certificate for. Who that is, the caller looks at."""
    tls = security.tls
    if not tls.mutual:
        raise SecurityError(
            "agents need tls.mutual: who gives work to another machine must be known", file=security.file
        )
    context = ssl.SSLContext(side)
    context.minimum_version = ssl.TLSVersion.TLSv1_3
    context.check_hostname = False  # the name in a certificate is that of a host of the tree, not of its address
    context.verify_mode = ssl.CERT_REQUIRED
    context.load_verify_locations(tls.authority)
    context.load_cert_chain(tls.certificate, tls.key)
    return context


def _end_with_certificate(transport: asyncio.Transport, say: Callable[[], None] = lambda: None) -> asyncio.TimerHandle:
    """Have the connection end when the certificate at the other end does, unless the timer is canceled."""
    certificate = cast("dict[str, Any]", transport.get_extra_info("peercert"))
    left = ssl.cert_time_to_seconds(certificate["notAfter"]) - time.time()

    def end() -> None:
        if not transport.is_closing():
            say()
            transport.abort()

    return asyncio.get_running_loop().call_later(left, end)


def _peer(transport: asyncio.BaseTransport) -> str:
    """The common name in the certificate at the other end."""
    certificate = cast("dict[str, Any]", transport.get_extra_info("peercert"))
    return next((value for part in certificate["subject"] for key, value in part if key == "commonName"), "")


def _set_alarm(seconds: float | None) -> None:
    """Have the kernel end this process so long from now, and `ALARM_SECONDS`, unless this is called before; None: no more."""
    signal.setitimer(signal.ITIMER_REAL, 0.0 if seconds is None else max(0.0, seconds) + ALARM_SECONDS)
