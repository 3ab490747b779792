"""Where the server listens, and which clients it admits: checked before anything is opened."""

from __future__ import annotations

import ipaddress
import ssl
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from actors.transport.security import Security

DEFAULT_PORT = 8765
TOKEN_VARIABLE = "ROBACTOR_WEB_TOKEN"
SHORTEST_TOKEN = 16


class WebUnavailable(Exception):
    """The server cannot be started as it was asked for; the text says why and what to do."""


@dataclass(frozen=True, kw_only=True)
class WebSettings:
    """Where to listen and whom to admit."""

    host: str = "127.0.0.1"
    port: int = DEFAULT_PORT
    """0 is any free port."""
    tries: int = 10
    """How many ports are tried, beginning with `port`."""
    token: str = ""
    """What clients have to show; empty if everyone may come, which is possible on the loopback interface only."""
    origins: tuple[str, ...] = ()
    """Pages of other places that may connect, such as ``https://lichtblick.example``; ``*`` for all."""
    security: Security | None = None
    """Gives the certificate for TLS."""
    bags: Path | None = None
    """The folder in which bags are recorded, and whose bags are shown; None: nobody records."""
    recording: Path | None = None
    """The bag or file that is shown instead of the graph; None: the graph is."""

    @property
    def local(self) -> bool:
        """Whether only this machine can connect."""
        return is_loopback(self.host)

    def tls(self) -> ssl.SSLContext | None:
        """What encrypts connections; None where the security file has no certificates. Raises `WebUnavailable`."""
        if self.security is None:
            return None
        files = self.security.tls
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.minimum_version = ssl.TLSVersion.TLSv1_2
        try:
            context.load_cert_chain(files.certificate, files.key)
        except (OSError, ssl.SSLError) as error:
            raise WebUnavailable(f"the certificate of the security file cannot be used: {error}") from None
        return context


def make_settings(
    environment: Mapping[str, str],
    *,
    host: str = "127.0.0.1",
    port: int | None = None,
    origins: tuple[str, ...] = (),
    security: Security | None = None,
    bags: Path | None = None,
    recording: Path | None = None,
) -> WebSettings:
    """The settings; the token is that of ROBACTOR_WEB_TOKEN. Raises `WebUnavailable` for an open door: another interface, or a
    system with a security file, without a token.
    """
    token = environment.get(TOKEN_VARIABLE, "")
    if token and len(token) < SHORTEST_TOKEN:
        raise WebUnavailable(f"{TOKEN_VARIABLE} has {len(token)} characters: use at least {SHORTEST_TOKEN}, at random")
    if not is_loopback(host) and not token:
        raise WebUnavailable(
            f"the web server would listen on {host}, where everyone could drive the robot: set {TOKEN_VARIABLE} to a "
            f"secret of at least {SHORTEST_TOKEN} characters, or stay on 127.0.0.1"
        )
    if security is not None and not token:
        raise WebUnavailable(
            f"the security file says who may take part, and the web server would let everyone: set {TOKEN_VARIABLE} to a "
            f"secret of at least {SHORTEST_TOKEN} characters"
        )
    return WebSettings(
        host=host, port=DEFAULT_PORT if port is None else port, token=token, origins=origins, security=security, bags=bags,
        recording=recording,
    )  # fmt: skip


def is_loopback(host: str) -> bool:
    """Whether a name or address is that of the loopback interface."""
    if host.rstrip(".").lower() == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False
