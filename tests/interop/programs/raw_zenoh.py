"""A process of plain eclipse-zenoh, which plays back what it is given and writes down what it sees: ``python raw_zenoh.py PORT SESSION``."""

import json
import sys
from typing import Any

import zenoh
import zenoh.ext
from lines import obey, say

config = zenoh.Config()
for path, value in {
    "id": sys.argv[2],
    "mode": "peer",
    "scouting/multicast/enabled": False,
    "listen/endpoints": ["tcp/127.0.0.1:0"],
    "connect/endpoints": [f"tcp/127.0.0.1:{sys.argv[1]}"],
    "connect/timeout_ms": -1,
    "connect/exit_on_failure": False,
    "scouting/gossip/target": {"router": ["router", "peer"], "peer": ["router"]},
    "timestamping/enabled": {"router": True, "peer": True, "client": True},
}.items():
    config.insert_json5(path, json.dumps(value))
session = zenoh.open(config)
declared: dict[str, Any] = {}
open_queries: list[Any] = []


def hexed(data: Any) -> str | None:
    return None if data is None else data.to_bytes().hex()


def seen(sample: Any) -> dict[str, Any]:
    return {
        "key": str(sample.key_expr),
        "payload": hexed(sample.payload),
        "attachment": hexed(sample.attachment),
        "congestion_control": str(sample.congestion_control).split(".")[-1],
        "priority": str(sample.priority).split(".")[-1],
        "express": sample.express,
    }


def watch(keys: str) -> None:
    """Write down tokens that come and go."""

    def told(sample: Any) -> None:
        say("appeared" if sample.kind == zenoh.SampleKind.PUT else "vanished", token=str(sample.key_expr))

    declared[f"watch {keys}"] = session.liveliness().declare_subscriber(keys, told, history=True)


def announce(token: str) -> None:
    declared[token] = session.liveliness().declare_token(token)


def withdraw(token: str) -> None:
    declared.pop(token).undeclare()


def put(key: str, payload: str, attachment: str | None) -> None:
    more = {} if attachment is None else {"attachment": bytes.fromhex(attachment)}
    session.put(key, bytes.fromhex(payload), encoding=zenoh.Encoding.APPLICATION_CDR, **more)


def record(keys: str) -> None:
    """Write down samples."""
    declared[f"record {keys}"] = session.declare_subscriber(keys, lambda sample: say("sample", **seen(sample)))


def ask(key: str, payload: str, attachment: str | None, timeout: float) -> Any:
    """Ask as a client of ROS 2 does; the answers."""
    more = {} if attachment is None else {"attachment": bytes.fromhex(attachment)}
    querier = session.declare_querier(
        key, target=zenoh.QueryTarget.ALL_COMPLETE, consolidation=zenoh.ConsolidationMode.NONE, timeout=timeout
    )
    replies = list(querier.get(payload=bytes.fromhex(payload), **more))
    querier.undeclare()
    return [seen(reply.ok) if reply.ok is not None else {"error": hexed(reply.err.payload)} for reply in replies]


def serve(key: str, payload: str | None, time: str, complete: bool) -> None:
    """Answer with a payload, the number and GID of the request and a time; write down only, without a payload."""

    def asked(query: Any) -> None:
        attachment = b"" if query.attachment is None else query.attachment.to_bytes()
        say("asked", selector=str(query.selector), payload=hexed(query.payload), attachment=attachment.hex())
        if payload is not None:
            said = attachment[:8] + bytes.fromhex(time) + attachment[16:33]
            query.reply(key, bytes.fromhex(payload), attachment=said)
        query.drop()

    declared[f"serve {key}"] = session.declare_queryable(key, asked, complete=complete)


def keep(key: str, depth: int, reliable: bool) -> None:
    """A publisher that keeps samples, declared as `rmw_zenoh` does."""
    misses = zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=0.5) if reliable else None
    declared[f"keep {key}"] = zenoh.ext.declare_advanced_publisher(
        session,
        key,
        cache=zenoh.ext.CacheConfig(max_samples=depth),
        publisher_detection=True,
        sample_miss_detection=misses,
        reliability=zenoh.Reliability.RELIABLE if reliable else zenoh.Reliability.BEST_EFFORT,
    )


def put_kept(key: str, payload: str, attachment: str) -> None:
    declared[f"keep {key}"].put(bytes.fromhex(payload), attachment=bytes.fromhex(attachment))


def catch_up(key: str, depth: int, reliable: bool) -> None:
    """A subscription that asks for what is kept, declared as `rmw_zenoh` does."""
    declared[f"catch up {key}"] = zenoh.ext.declare_advanced_subscriber(
        session,
        key,
        lambda sample: say("sample", **seen(sample)),
        history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=depth),
        recovery=zenoh.ext.RecoveryConfig(heartbeat=True) if reliable else None,
        subscriber_detection=True,
    )


commands = (watch, announce, withdraw, put, record, ask, serve, keep, put_kept, catch_up)
obey({one.__name__: one for one in commands})
session.close()
