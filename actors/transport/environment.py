"""The transport and the domain that the environment variables of ROS 2 ask for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

from actors.suggest import did_you_mean
from actors.transport.domain_id import domain_from_environment
from actors.transport.protocol import Transport, WireUnavailable

if TYPE_CHECKING:
    from actors.transport.security import Security

VARIABLE: Final = "RMW_IMPLEMENTATION"
ZENOH: Final = "rmw_zenoh_cpp"
CYCLONE: Final = "rmw_cyclonedds_cpp"
FAST_DDS: Final = "rmw_fastrtps_cpp"
IN_PROCESS: Final = "in_process"

SECURITY: Final = "ROBACTOR_SECURITY"
"""The variable that names a security file."""


def transport_from_environment(
    environment: Mapping[str, str],
    *,
    listen: tuple[str, ...] = (),
    connect: tuple[str, ...] = (),
    security: str | None = None,
) -> Transport | None:
    """What RMW_IMPLEMENTATION asks for: Zenoh for ``rmw_zenoh_cpp`` or if it is not set, Cyclone DDS for ``rmw_cyclonedds_cpp`` and for
    ``rmw_fastrtps_cpp``, with whose processes topics and the graph are shared, but no services; None for ``in_process``: no other process is then reached.

    `listen` and `connect` are endpoints such as ``tcp/192.168.1.5:7447``, besides those of the variables that `ZenohConfig` reads. `security`
    is the path of a security file; without it, ROBACTOR_SECURITY names one, if it is set. Raises `WireUnavailable` for another
    RMW_IMPLEMENTATION, for a ROS_DOMAIN_ID that is none, for endpoints and security files with DDS or without a transport, and for a security
    file that cannot be used.
    """
    wanted = environment.get(VARIABLE, "") or ZENOH
    if wanted == IN_PROCESS:
        if listen or connect or security:
            raise WireUnavailable(f"{VARIABLE} is {IN_PROCESS}, which neither listens nor connects: unset it")
        return None
    if wanted in (CYCLONE, FAST_DDS):
        return _dds(environment, wanted, bool(listen or connect), security)
    if wanted != ZENOH:
        hint = did_you_mean(wanted, (ZENOH, CYCLONE, FAST_DDS, IN_PROCESS))
        raise WireUnavailable(
            f"{VARIABLE} is {wanted}: this library speaks {ZENOH}, the default, {CYCLONE} and {FAST_DDS}, or stays {IN_PROCESS}{hint}"
        )
    try:
        domain_from_environment(environment)
    except ValueError as error:
        raise WireUnavailable(str(error)) from None
    from actors.transport.zenoh import ZenohConfig, ZenohTransport

    secured = security_from_environment(environment, security)
    config = ZenohConfig.from_environment(environment, listen=listen, connect=connect, security=secured)
    return ZenohTransport(config)


def _dds(environment: Mapping[str, str], wanted: str, endpoints: bool, security: str | None) -> Transport:
    if endpoints:
        raise WireUnavailable(
            f"{VARIABLE} is {wanted}, which neither listens nor connects at endpoints: name other hosts in ROS_STATIC_PEERS"
        )
    if security or environment.get(SECURITY, ""):
        raise WireUnavailable(
            f"{VARIABLE} is {wanted}, for which this library has no security: use {ZENOH}, or no security file"
        )
    from actors.transport.dds import DdsConfig, DdsTransport

    return DdsTransport(DdsConfig.from_environment(environment))


def security_from_environment(environment: Mapping[str, str], file: str | None = None) -> Security | None:
    """The security file `file`, or that of ROBACTOR_SECURITY; None without either. Raises `SecurityError`."""
    from actors.transport.security import load_security

    named = file if file is not None else environment.get(SECURITY, "")
    return load_security(named) if named else None
