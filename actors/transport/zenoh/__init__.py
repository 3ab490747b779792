"""The transport over Eclipse Zenoh, in the format of ROS 2's `rmw_zenoh`, so that nodes of ROS 2 are peers like any other.

* `transport`: `ZenohTransport`, which opens, joins and closes everything else,
* `connection`: what the transport offers while it is open; `outlets`, `subscriptions`, `outgoing_queries`, `queryables`, `history`: its parts,
* `presence`: which tokens and processes are there; `heartbeat`: which processes still run their loops; `traffic`: what was exchanged,
* `actors.transport.wakeup`: from Zenoh's threads to the loop; `actors.transport.worker`: from the loop to a thread that may wait,
* `config`: where to listen and connect; `gossip_point`: how processes of one host find each other without a daemon,
* `library`: the import of the `zenoh` package, which is late because it takes long.

Zenoh has threads of its own, 5 or 6 for a process, which last until the process ends, also when all its sessions are closed.
"""

from actors.transport.zenoh.config import ZenohConfig
from actors.transport.zenoh.transport import ZenohTransport

__all__ = ["ZenohConfig", "ZenohTransport"]
