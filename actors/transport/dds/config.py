"""Which domain, and whom to look for there, as ROS 2's environment variables say it to `rmw_cyclonedds`."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias, cast, get_args
from xml.sax.saxutils import quoteattr

from actors.suggest import did_you_mean
from actors.transport.domain_id import domain_from_environment
from actors.transport.protocol import WireUnavailable

Range: TypeAlias = Literal["OFF", "LOCALHOST", "SUBNET", "SYSTEM_DEFAULT"]

_RANGE: Final = "ROS_AUTOMATIC_DISCOVERY_RANGE"
_PEERS: Final = "ROS_STATIC_PEERS"
_LOCALHOST: Final = "ROS_LOCALHOST_ONLY"
_SECURITY: Final = "ROS_SECURITY_ENABLE"
_URI: Final = "CYCLONEDDS_URI"
_LONGEST_PEER: Final = 255
_ANNOUNCED: Final = "<SPDPInterval>1500ms</SPDPInterval>"
"""How often a participant says that it is there: two of which one has given up the other, as that stood still, find each other by it. The default
of Cyclone DDS is 30 s, that of Fast DDS 3 s."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DdsConfig:
    """The domain, and whom to look for. The default finds all participants of the subnet in domain 0."""

    domain: int = 0

    discovery_range: Literal["OFF", "LOCALHOST", "SUBNET", "SYSTEM_DEFAULT"] = "SUBNET"
    """LOCALHOST: this host, without multicast; OFF: nobody; SYSTEM_DEFAULT: as Cyclone DDS is configured, without `static_peers`."""

    static_peers: tuple[str, ...] = ()
    """Hosts to look for besides, by unicast: names or addresses."""

    uri: str = ""
    """CYCLONEDDS_URI: files or XML of Cyclone DDS, separated by commas. They stand above everything else here."""

    enclave: str = "/"

    @classmethod
    def from_environment(cls, environment: Mapping[str, str]) -> DdsConfig:
        """Read ROS_DOMAIN_ID, ROS_AUTOMATIC_DISCOVERY_RANGE, ROS_STATIC_PEERS, ROS_LOCALHOST_ONLY and CYCLONEDDS_URI as ROS 2 does.

        Raises WireUnavailable for values that are none, and for ROS_SECURITY_ENABLE.
        """
        if environment.get(_SECURITY, "").strip().lower() == "true":
            raise WireUnavailable(
                f"{_SECURITY} is set: this library has no DDS security; unset it, or use RMW_IMPLEMENTATION=rmw_zenoh_cpp with ROBACTOR_SECURITY"
            )
        try:
            domain = domain_from_environment(environment)
        except ValueError as error:
            raise WireUnavailable(str(error)) from None
        discovery_range, peers = environment.get(_RANGE, "") or "SUBNET", environment.get(_PEERS, "")
        if environment.get(_LOCALHOST, "") == "1":
            discovery_range, peers = "LOCALHOST", ""
        ranges = get_args(Range)
        if discovery_range not in ranges:
            hint = did_you_mean(discovery_range, ranges)
            raise WireUnavailable(f"{_RANGE} is {discovery_range!r}; it must be one of {', '.join(ranges)}{hint}")
        addresses = tuple(peer.strip() for peer in peers.split(";") if peer.strip())
        if too_long := [peer for peer in addresses if len(peer) > _LONGEST_PEER]:
            raise WireUnavailable(
                f"{_PEERS} names a host with {len(too_long[0])} characters; {_LONGEST_PEER} are the most"
            )
        return cls(
            domain=domain,
            discovery_range=cast(Range, discovery_range),
            static_peers=addresses,
            uri=environment.get(_URI, ""),
        )


def domain_settings(config: DdsConfig) -> str:
    """The configuration of the domain, as `rmw_cyclonedds` makes it: ours, then CYCLONEDDS_URI, of which each part overrules those before it."""
    off = config.discovery_range == "OFF"
    multicast = config.discovery_range in ("SUBNET", "SYSTEM_DEFAULT")
    if config.discovery_range == "SYSTEM_DEFAULT":
        return config.uri
    peers = () if off else config.static_peers
    if config.discovery_range == "LOCALHOST":
        peers = ("localhost", *peers)
    discovery = (
        f"<ParticipantIndex>none</ParticipantIndex><Tag>ros_discovery_off_{os.getpid()}</Tag>"
        if off
        else "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>"
    )
    if peers:
        discovery += "<Peers>" + "".join(f"<Peer address={quoteattr(peer)}/>" for peer in peers) + "</Peers>"
    discovery += _ANNOUNCED
    general = "" if multicast else "<General><AllowMulticast>false</AllowMulticast></General>"
    return f"<CycloneDDS><Domain>{general}<Discovery>{discovery}</Discovery></Domain></CycloneDDS>,{config.uri}"
