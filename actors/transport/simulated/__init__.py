"""A transport for several systems on one event loop, virtual or real: machines that are joined by a simulated network."""

from actors.transport.simulated.conditions import LAN, LOOPBACK, Conditions
from actors.transport.simulated.link import Link
from actors.transport.simulated.network import Network
from actors.transport.simulated.session import SimulatedTransport
from actors.transport.simulated.topology import Host, Mode

__all__ = ["LAN", "LOOPBACK", "Conditions", "Host", "Link", "Mode", "Network", "SimulatedTransport"]
