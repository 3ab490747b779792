"""Children on other machines: ``Child(..., host="base")`` and ``Supervisor(..., hosts=["base", "spare"])``.

A child on another machine is a child in a process of its own (`actors.processes`), but that an agent there launches the process and watches it,
where otherwise the tree does it itself. So strategies, intensity, backoff, order, reports, log lines and checkpoints are the same.

* `messages`: what a tree and an agent tell each other, over a `Wire`, which keeps the order and loses nothing while it lasts;
* `run_counter`: the count of the runs of a tree, so that what a machine still does for an earlier one is known as older;
* `lease`: for how long an agent may let run what it was given, and when the tree may give it to somebody else. Read it first;
* `agent`: what runs on the other machine; `remote`: one process there, as its supervisor sees it; `host`: the connection with one agent;
  `placing`: the hosts of one tree, and which of them a child is given to;
* `tls` has the wires between real machines, mutual TLS by the security file, and `simulated` those of a simulated network.
"""

from actors.hosts.host import HostLost
from actors.hosts.lease import LEASE_SECONDS
from actors.hosts.messages import Wire
from actors.hosts.placing import Hosts
from actors.hosts.tls import TlsHosts

__all__ = ["LEASE_SECONDS", "HostLost", "Hosts", "TlsHosts", "Wire"]
