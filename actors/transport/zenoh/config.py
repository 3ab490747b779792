"""Where a Zenoh session listens and connects, and its other settings: ours, those of a file, and those of ROS 2's environment variables."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal, NamedTuple

from actors.suggest import did_you_mean
from actors.transport.protocol import WireUnavailable
from actors.transport.security import Security
from actors.transport.zenoh.access import access_control
from actors.transport.zenoh.library import import_zenoh, one_line

LEASE: Final = 60_000
"""After so many milliseconds of silence on a link its two ends give it up. This side announces it, the other side applies it.

As in ROS 2, because nobody opens a link again that one of two running processes has given up: a process that has stood still finds all its leases
run out, or none. Processes of this library notice sooner that one of them is lost (`Heartbeat`).
"""
_BEATS: Final = 120
"""So often a link that is not used is kept alive within a lease. A process that has stood still for almost a lease has heard all others just before."""
_CLIENT_WAITS: Final = 2000
"""Milliseconds for which a client looks for its router."""

_PROTOCOLS: Final = ("tcp", "tls", "udp", "quic", "ws", "unixsock-stream", "unixpipe", "serial", "vsock")

_GOSSIP_PORT: Final = 7446
_ROUTER: Final = "127.0.0.1:7447#retry_period_init_ms=500;retry_period_max_ms=1000"
"""Where a router of this host listens, and how often it is looked for. It is tried for ever, and mostly nobody is there."""

_PORT_VARIABLE: Final = "ROBACTOR_GOSSIP_PORT"
_MOST_MEMORY: Final = 65536
_MEMORY_VARIABLE: Final = "ROBACTOR_SHARED_MEMORY"
_THIN_VARIABLE: Final = "ROBACTOR_THIN_LINKS"
_FILE_VARIABLE: Final = "ZENOH_SESSION_CONFIG_URI"
_OVERRIDE_VARIABLE: Final = "ZENOH_CONFIG_OVERRIDE"


@dataclass(frozen=True, slots=True, kw_only=True)
class ZenohConfig:
    """Where to listen and to connect. The default reaches the processes of this host, and a router on this host if one runs.

    An endpoint is written as Zenoh does: ``tcp/192.168.1.5:7448``.
    """

    listen: tuple[str, ...] = ()
    """The endpoints that others connect to; empty: a free port on the loopback interface."""

    connect: tuple[str, ...] = ()
    """The endpoints to connect to, besides the gossip point; they are tried again for as long as they do not answer."""

    mode: Literal["peer", "client"] = "peer"
    """A peer is linked directly with all others. A client has one link, to a router in `connect`, and cannot be opened without it."""

    gossip_port: int = _GOSSIP_PORT
    """The loopback port where processes of this host find each other; 0: nobody is looked for. With the default, a router of this host at
    port 7447 is looked for as well, ROS 2's or ours. With any other number, those processes meet that have the same one, and nobody else."""

    shared_memory: int = 0
    """MiB of shared memory, in which payloads of 64 KiB and more reach those processes of this host that have some as well; 0: none. While it is
    full, and to all others, they go by the network. A process keeps the shared memory of those that it has heard until it ends itself."""

    thin_links: bool = False
    """Make the best of links that are slower than what is published, as over radio. What is sent to processes that say the same is compressed.
    Images and other large messages wait until a link takes all of them, where they are otherwise dropped half-way, so that the slowest link
    sets their pace; their queue drops the oldest. The kernel holds little of them, so that all other messages overtake them."""

    file: str = ""
    """A configuration file of Zenoh. It stands in place of all settings of ours; `listen` and `connect` still add to it if given."""

    overrides: str = ""
    """``path/of/key=json5;...``, applied after everything else but `security`."""

    security: Security | None = None
    """Who is let in, and to what (see `actors.transport.security.load_security`); None: everybody who can reach an endpoint, to everything."""

    def __post_init__(self) -> None:
        """Raises SecurityError for a peer that could let nobody in, and WireUnavailable for an endpoint that is none."""
        for texts, what in ((self.listen, "listen"), (self.connect, "connect")):
            _check_endpoints(texts, what, self.security)
        if self.security is not None and self.mode == "peer":
            self.security.check_listening()

    @classmethod
    def from_environment(
        cls,
        environment: Mapping[str, str],
        *,
        listen: tuple[str, ...] = (),
        connect: tuple[str, ...] = (),
        mode: Literal["peer", "client"] = "peer",
        security: Security | None = None,
    ) -> ZenohConfig:
        """Read ZENOH_SESSION_CONFIG_URI and ZENOH_CONFIG_OVERRIDE as ROS 2 does, and the variables ROBACTOR_GOSSIP_PORT,
        ROBACTOR_SHARED_MEMORY and ROBACTOR_THIN_LINKS.

        Raises WireUnavailable.
        """
        port = _number(environment, _PORT_VARIABLE, _GOSSIP_PORT, 65535, "a port number")
        memory = _number(environment, _MEMORY_VARIABLE, 0, _MOST_MEMORY, f"a number of MiB up to {_MOST_MEMORY}")
        thin = environment.get(_THIN_VARIABLE, "").strip() or "0"
        if thin not in ("0", "1"):
            raise WireUnavailable(f"{_THIN_VARIABLE} is {thin!r}; it must be 1, or 0 or empty")
        return cls(
            thin_links=thin == "1",
            listen=listen,
            connect=connect,
            mode=mode,
            gossip_port=port,
            shared_memory=memory,
            file=environment.get(_FILE_VARIABLE, ""),
            overrides=environment.get(_OVERRIDE_VARIABLE, ""),
            security=security,
        )

    @property
    def gossip_point(self) -> str:
        """The endpoint of the gossip point; empty if there is none: without a port, for a client, and with a file of the user's own."""
        offered = self.gossip_port and self.mode == "peer" and not self.file
        return f"{_protocol(self.security)}/127.0.0.1:{self.gossip_port}" if offered else ""

    @property
    def meeting_points(self) -> tuple[str, ...]:
        """The endpoints of this host that are tried again and again: the gossip point, and the port of a router beside it."""
        router = (f"{_protocol(self.security)}/{_ROUTER}",) if self.gossip_port == _GOSSIP_PORT else ()
        return (self.gossip_point, *router) if self.gossip_point else ()


def _number(environment: Mapping[str, str], variable: str, otherwise: int, most: int, what: str) -> int:
    text = environment.get(variable, "").strip() or str(otherwise)
    if not text.isascii() or not text.isdigit() or int(text) > most:
        raise WireUnavailable(f"{variable} is {text!r}; it must be {what}, or 0 for none")
    return int(text)


class _Setting(NamedTuple):
    path: str
    value: str
    """In JSON5."""
    source: str
    """What the user wrote it in."""


_Settings = dict[str, object]

_COMMON: Final[_Settings] = {
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": True,
    "scouting/gossip/target": {"router": ["router", "peer"], "peer": ["router"]},
    "scouting/delay": 0,  # otherwise opening waits for half a second
    "open/return_conditions": {"connect_scouted": False, "declares": False},
    "timestamping/enabled": {"router": True, "peer": True, "client": True},  # kept samples are told apart by it
    "transport/link/tx/lease": LEASE,
    "transport/link/tx/keep_alive": _BEATS,
    "transport/link/tx/queue/size/data": 16,  # room for 1 MB (from 2): a Python receiver stops reading for some milliseconds now and then
    "transport/link/tx/queue/size/data_low": 16,
    "transport/unicast/accept_pending": 10_000,
    "transport/unicast/max_sessions": 10_000,
    "transport/shared_memory/enabled": False,
}
_THIN: Final = 16 * 1024
"""Bytes that the kernel takes from Zenoh before they can be sent; it doubles the number. What is in its queue can be overtaken by nothing."""
_OPENING: Final = 2000
"""Milliseconds in which a process of this host answers the opening of a link, which is then tried again. To close a session takes as long as what it
is just opening: a program that holds the gossip port and says nothing would hold up every end for 10 s."""
_RETRY: Final = {"period_init_ms": 100, "period_max_ms": 200, "period_increase_factor": 1.3}


def session_settings(config: ZenohConfig, session: str) -> Iterator[_Setting]:
    """The settings of the session with the identity `session`, later ones over earlier ones."""
    client = config.mode == "client"
    listen, connect = list(config.listen), list(config.connect)
    if not config.file:
        yield from _ours(_COMMON)
        yield from _ours(
            {
                "mode": config.mode,
                "transport/unicast/compression/enabled": config.thin_links,
                **({} if connect or listen or client else {"transport/unicast/open_timeout": _OPENING}),
                **({f"transport/link/{link}/so_sndbuf": _THIN for link in ("tcp", "tls")} if config.thin_links else {}),
                "listen/endpoints": listen or ([] if client else [f"{_protocol(config.security)}/127.0.0.1:0"]),
                "connect/endpoints": [*config.meeting_points, *connect],
                "connect/timeout_ms": _CLIENT_WAITS if client else -1,
                "connect/exit_on_failure": client,
                "connect/retry": _RETRY,
                "scouting/gossip/autoconnect": {"router": [], "peer": ["router", "peer"]},
                "scouting/gossip/autoconnect_strategy": {"peer": {"to_router": "always", "to_peer": "greater-zid"}},
            }
        )
        if config.shared_memory:
            yield from _ours(
                {
                    "transport/shared_memory/enabled": True,
                    "transport/shared_memory/transport_optimization/enabled": False,  # see `memory.SharedMemory`
                }
            )
    else:
        yield from _ours({"listen/endpoints": listen} if listen else {})
        yield from _ours({"connect/endpoints": connect} if connect else {})
    yield from _overrides(config.overrides)
    yield from _secured(config.security)
    yield from _ours({"id": session})


def point_settings(config: ZenohConfig) -> Iterator[_Setting]:
    """The settings of the second session, which holds the gossip point: a router, because Zenoh's peers tell routers where they listen.

    It carries nothing: a router beside it may do that, and then everything would come twice.
    """
    yield from _ours(_COMMON)
    yield from _ours(
        {
            "mode": "router",
            "listen/endpoints": [config.gossip_point],
            "connect/endpoints": [],
            "scouting/gossip/autoconnect": {"router": [], "peer": []},
            "routing/router/peers_failover_brokering": False,
        }
    )
    yield from _secured(config.security)


def router_settings(
    listen: tuple[str, ...], connect: tuple[str, ...], security: Security | None = None
) -> Iterator[_Setting]:
    """The settings of a router, as ROS 2's is. Raises WireUnavailable for an endpoint."""
    _check_endpoints(listen, "listen", security)
    _check_endpoints(connect, "connect", security)
    if security is not None:
        security.check_listening()
    yield from _ours(_COMMON)
    yield from _ours(
        {
            "mode": "router",
            "listen/endpoints": list(listen),
            "connect/endpoints": list(connect),
            "connect/timeout_ms": -1,
            "connect/exit_on_failure": False,
            "connect/retry": _RETRY,
            "scouting/gossip/autoconnect": {"router": [], "peer": []},
            "routing/router/peers_failover_brokering": True,  # it carries what two peers cannot exchange themselves
        }
    )
    yield from _secured(security)


def _protocol(security: Security | None) -> str:
    return "tcp" if security is None else "tls"


def _secured(security: Security | None) -> Iterator[_Setting]:
    if security is not None:
        yield from _ours(secured_settings(security))


def _ours(settings: _Settings) -> Iterator[_Setting]:
    return (_Setting(path, json.dumps(value), path) for path, value in settings.items())


def _overrides(text: str) -> Iterator[_Setting]:
    for pair in filter(str.strip, text.split(";")):
        path, equals, value = pair.partition("=")
        if not equals or not path.strip() or not value.strip():
            raise WireUnavailable(
                f"{_OVERRIDE_VARIABLE} contains {pair.strip()!r}; write path/of/key=value;other/key=value"
            )
        yield _Setting(path.strip(), value.strip(), f"{_OVERRIDE_VARIABLE}, {pair.strip()}")


def _check_endpoints(texts: tuple[str, ...], what: str, security: Security | None) -> None:
    for text in texts:
        protocol, slash, address = text.partition("/")
        if not slash or not address:
            raise WireUnavailable(
                f"cannot {what} at {text!r}: write protocol/address, for instance tcp/192.168.1.5:7448"
            )
        if protocol not in _PROTOCOLS:
            hint = did_you_mean(protocol, _PROTOCOLS)
            raise WireUnavailable(f"cannot {what} at {text!r}: {protocol!r} is no protocol of Zenoh{hint}")
        if security is not None and protocol != "tls":
            raise WireUnavailable(f"cannot {what} at {text!r}: {security.file} wants TLS; write tls/{address}")
        port = re.search(r":(\d*)(?=[?#]|$)", address)
        if protocol in ("tcp", "tls", "udp", "quic") and not (port and port[1] and int(port[1]) <= 65535):
            raise WireUnavailable(
                f"cannot {what} at {text!r}: it needs a port up to 65535, for instance {protocol}/192.168.1.5:7448"
            )


def write_config(file: str, settings: Iterator[_Setting]) -> Any:
    """Zenoh's own form of the settings, over those of `file` if it is given. Raises WireUnavailable, naming what is wrong."""
    library = import_zenoh()
    try:
        config = library.Config.from_file(file) if file else library.Config()
    except library.ZError as error:
        raise WireUnavailable(f"{_FILE_VARIABLE}={file}: {one_line(error)}") from error
    for setting in settings:
        try:
            config.insert_json5(setting.path, setting.value)
        except library.ZError as error:
            raise WireUnavailable(f"{setting.source}: {one_line(error)}") from error
    return config


def secured_settings(security: Security) -> dict[str, object]:
    """By their paths. They are to count more than all others, so that nothing else opens a link without TLS."""
    tls, user, password = security.tls, security.user, security.password
    link: dict[str, object] = {
        "root_ca_certificate": tls.authority,
        "listen_certificate": tls.certificate,
        "listen_private_key": tls.key,
        "connect_certificate": tls.certificate if tls.mutual else None,
        "connect_private_key": tls.key if tls.mutual else None,
        "enable_mtls": tls.mutual,
        "verify_name_on_connect": False,  # gossip tells addresses; a process is known by the name in its certificate
        "close_link_on_expiration": True,
    }
    settings: dict[str, object] = {
        "transport/link/protocols": ["tls"],
        **{f"transport/link/tls/{name}": value for name, value in link.items()},
        "scouting/multicast/enabled": False,
        "adminspace/enabled": False,
    }
    if user is not None and password is not None:
        known = {"dictionary_file": user.users} if user.users else {}
        settings["transport/auth/usrpwd"] = {"user": user.name, "password": password.reveal(), **known}
    if security.access is not None:
        settings["access_control"] = access_control(security.access)
    return settings
