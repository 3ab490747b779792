"""Admission of clients: the token, the page that a connection comes from, and the name by which it knows this machine."""

from __future__ import annotations

import hmac
from typing import TYPE_CHECKING
from urllib.parse import parse_qs, urlsplit

from cli.web.server.settings import WebSettings, is_loopback

if TYPE_CHECKING:
    from websockets.http11 import Request


def token_refusal(settings: WebSettings, request: Request) -> str | None:
    """Why a request is refused for its token: `?token=` or `Authorization: Bearer`; None if it is not."""
    if not settings.token:
        return None
    try:
        given = parse_qs(urlsplit(request.path).query).get("token", [""])[0]
    except ValueError:
        given = ""
    kind, _, value = (request.headers.get_all("Authorization") or [""])[0].partition(" ")
    if not given and kind.lower() == "bearer":
        given = value.strip()
    if hmac.compare_digest(given.encode(), settings.token.encode()):
        return None
    return (
        "give the token of this server: ?token=... in the address"
        if not given
        else "the token is not that of this server"
    )


def host_refusal(settings: WebSettings, request: Request) -> str | None:
    """Why a request is refused for the name in it; None if it is not.

    A server for this machine alone answers to names of this machine alone: a page elsewhere whose name is made to lead here (DNS
    rebinding) is not served.
    """
    hosts = request.headers.get_all("Host")
    if not settings.local or (len(hosts) == 1 and is_loopback(_name(f"//{hosts[0]}"))):
        return None
    return "this server answers to localhost only"


def origin_refusal(settings: WebSettings, request: Request) -> str | None:
    """Why a connection is refused for the page that it comes from; None if it is not.

    Programs send no origin. Pages may connect if they come from this server, from this machine, or from one of the `origins`.
    """
    origins = request.headers.get_all("Origin")
    if not origins or "*" in settings.origins:
        return None
    origin = origins[0]
    if is_own_page(request):
        return None
    if len(origins) == 1 and (origin in settings.origins or (settings.local and is_loopback(_name(origin)))):
        return None
    return f"pages of {origin[:100]} may not connect: allow it by --web-origin {origin[:100]}"


def is_own_page(request: Request) -> bool:
    """Whether a connection comes from the page of this server, as a browser says."""
    origins, hosts = request.headers.get_all("Origin"), request.headers.get_all("Host")
    return len(origins) == 1 and len(hosts) == 1 and origins[0].partition("://")[2] == hosts[0]


def _name(address: str) -> str:
    try:
        return urlsplit(address).hostname or ""
    except ValueError:
        return ""
