"""A process whose Zenoh session is set as `rmw_zenoh` sets it: ``python -m tests.actors.transport.zenoh.like_ros2 ROUTER KEY TOKEN [LEASE]``.

It shows TOKEN, publishes on KEY/theirs twenty times a second, and writes a line for each sample that comes on KEY/ours. With a LEASE in milliseconds
it publishes only as it is told, by lines with the last part of a key.
"""

from __future__ import annotations

import itertools
import json
import os
import sys
import time
from typing import Any

SETTINGS: dict[str, object] = {
    "mode": "peer",
    "connect/timeout_ms": {"router": -1, "peer": -1, "client": 0},
    "connect/exit_on_failure": {"router": False, "peer": False, "client": True},
    "connect/retry": {"period_init_ms": 1000, "period_max_ms": 4000, "period_increase_factor": 2},
    "listen/endpoints": ["tcp/127.0.0.1:0"],
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": True,
    "scouting/gossip/target": {"router": ["router", "peer"], "peer": ["router"]},
    "scouting/gossip/autoconnect": {"router": [], "peer": ["router", "peer"]},
    "scouting/gossip/autoconnect_strategy": {"peer": {"to_router": "always", "to_peer": "greater-zid"}},
    "timestamping/enabled": {"router": True, "peer": True, "client": True},
    "queries_default_timeout": 600_000,
    "routing/router/peers_failover_brokering": True,
    "transport/unicast/open_timeout": 60_000,
    "transport/unicast/accept_timeout": 60_000,
    "transport/link/tx/lease": 60_000,
    "transport/link/tx/keep_alive": 2,
    "transport/link/tx/queue/congestion_control/block/wait_before_close": 60_000_000,
    "transport/shared_memory/enabled": False,
    "adminspace": {"enabled": True, "permissions": {"read": True, "write": False}},
}
"""What differs from Zenoh's defaults in the DEFAULT_RMW_ZENOH_SESSION_CONFIG.json5 of Humble to Rolling."""


def main(router: str, key: str, token: str, lease: str = "") -> None:
    import zenoh  # pyright: ignore[reportMissingTypeStubs]

    config: Any = zenoh.Config()
    settings = SETTINGS | ({"transport/link/tx/lease": int(lease)} if lease else {})
    for path, value in {**settings, "connect/endpoints": [router]}.items():
        config.insert_json5(path, json.dumps(value))
    session: Any = zenoh.open(config)
    heard = session.declare_subscriber(f"{key}/ours", lambda _: os.write(1, b"heard\n"))
    shown = session.liveliness().declare_token(token)
    for line in sys.stdin if lease else ():
        session.put(f"{key}/{line.strip()}", b"0")
    for number in itertools.count():
        session.put(f"{key}/theirs", str(number).encode())
        time.sleep(0.05)
    del heard, shown


if __name__ == "__main__":
    main(*sys.argv[1:])
