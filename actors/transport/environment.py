"""The transport that the environment variables of ROS 2 ask for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

from actors.suggest import did_you_mean
from actors.transport.protocol import WireUnavailable

if TYPE_CHECKING:
    from actors.transport.protocol import Transport

__all__ = ["transport_from_environment"]

VARIABLE: Final = "RMW_IMPLEMENTATION"
ZENOH: Final = "rmw_zenoh_cpp"
IN_PROCESS: Final = "in_process"


def transport_from_environment(
    environment: Mapping[str, str], *, listen: tuple[str, ...] = (), connect: tuple[str, ...] = ()
) -> Transport | None:
    """Zenoh, in the format of ``rmw_zenoh_cpp``; None if RMW_IMPLEMENTATION is ``in_process``: no other process is then reached.

    `listen` and `connect` are endpoints such as ``tcp/192.168.1.5:7447``, besides those of the variables that `ZenohConfig` reads. Raises
    `WireUnavailable` for another RMW_IMPLEMENTATION, and for endpoints of a transport that is not wanted.
    """
    wanted = environment.get(VARIABLE, "") or ZENOH
    if wanted == IN_PROCESS:
        if listen or connect:
            raise WireUnavailable(f"{VARIABLE} is {IN_PROCESS}, which neither listens nor connects: unset it")
        return None
    if wanted != ZENOH:
        hint = did_you_mean(wanted, (ZENOH, IN_PROCESS))
        raise WireUnavailable(
            f"{VARIABLE} is {wanted}: this library speaks {ZENOH}, the default, or stays {IN_PROCESS}{hint}"
        )
    from actors.transport.zenoh import ZenohConfig, ZenohTransport

    return ZenohTransport(ZenohConfig.from_environment(environment, listen=listen, connect=connect))
