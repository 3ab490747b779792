"""Figures for monitoring: `/metrics` in the text format of Prometheus, and `/healthz`. They are read when somebody asks."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any, Final

import msgspec

if TYPE_CHECKING:
    from cli.web.hub import Hub

METRICS_TYPE: Final = "text/plain; version=0.0.4; charset=utf-8"

Sample = tuple[dict[str, Any], float]


def health(hub: Hub) -> bytes:
    """Whether the system runs, as JSON."""
    states = [node.state for node in hub.overview.snapshot().nodes if node.path]
    return msgspec.json.encode(
        {
            "status": "ok", "nodes": len(states), "running": states.count("running"), "clients": len(hub.clients),
            "uptime": round(hub.system.clock.now(), 3),
        }
    )  # fmt: skip


def metrics(hub: Hub, refused: int) -> bytes:
    """All figures."""
    lines: list[str] = []
    for name, kind, help, samples in (*_graph(hub), *_web(hub, refused)):
        lines += [f"# HELP {name} {help}", f"# TYPE {name} {kind}"]
        lines += [f"{name}{_labels(labels)} {value:.15g}" for labels, value in samples]
    return "".join(f"{line}\n" for line in lines).encode()


Family = tuple[str, str, str, Iterable[Sample]]


def _graph(hub: Hub) -> Iterator[Family]:
    snapshot = hub.overview.snapshot()
    topics, nodes = snapshot.topics, snapshot.nodes
    yield (
        "robactor_messages_total",
        "counter",
        "Messages published on a topic.",
        [({"topic": t.name}, t.messages) for t in topics],
    )
    yield (
        "robactor_dropped_total", "counter", "Messages that subscriptions of a topic have lost.",
        [({"topic": t.name, "node": edge.node}, edge.dropped) for t in topics for edge in t.subscriptions],
    )  # fmt: skip
    yield (
        "robactor_mismatches", "gauge", "Pairs of endpoints of a topic that do not match.",
        [({"topic": t.name}, len(t.mismatches)) for t in topics],
    )  # fmt: skip
    here = [node for node in nodes if node.path]
    yield (
        "robactor_node_up",
        "gauge",
        "1 for a node that runs.",
        [({"node": node.name, "state": node.state}, float(node.state in ("running", "elsewhere"))) for node in nodes],
    )
    yield (
        "robactor_handled_total",
        "counter",
        "Items that a node has handled.",
        [({"node": n.name}, n.handled) for n in here],
    )
    yield "robactor_inbox", "gauge", "Items in a node's inbox.", [({"node": n.name}, n.waiting) for n in here]
    yield (
        "robactor_inbox_age_seconds",
        "gauge",
        "How long the oldest item has waited.",
        [({"node": n.name}, n.inbox_age) for n in here],
    )
    yield (
        "robactor_restarts_total",
        "counter",
        "Restarts of a node.",
        [({"node": node}, times) for node, times in hub.overview.restarts().items()],
    )
    yield (
        "robactor_calls_total",
        "counter",
        "Calls of a service, or goals of an action.",
        [({"name": service.name, "kind": service.kind}, service.calls) for service in snapshot.services],
    )


def _web(hub: Hub, refused: int) -> Iterator[Family]:
    clients = [({"protocol": one.protocol, "client": one.address}, one) for one in hub.clients.values()]
    yield (
        "robactor_web_clients",
        "gauge",
        "Clients of the web server.",
        [({"protocol": name}, sum(one.protocol == name for _, one in clients)) for name in ("foxglove", "rosbridge")],
    )
    yield "robactor_web_refused_total", "counter", "Connections that were refused.", [({}, refused)]
    yield (
        "robactor_web_sent_total",
        "counter",
        "Frames sent to a client.",
        [(to, one.outbox.sent) for to, one in clients],
    )
    yield (
        "robactor_web_sent_bytes_total",
        "counter",
        "Bytes sent to a client.",
        [(to, one.outbox.sent_bytes) for to, one in clients],
    )
    yield (
        "robactor_web_dropped_total",
        "counter",
        "Messages a client was too slow for.",
        [(to, one.outbox.dropped) for to, one in clients],
    )
    yield (
        "robactor_web_waiting",
        "gauge",
        "Frames that wait for a client.",
        [(to, one.outbox.waiting) for to, one in clients],
    )
    yield "robactor_web_received_total", "counter", "Frames of a client.", [(to, one.received) for to, one in clients]


def _labels(labels: dict[str, Any]) -> str:
    if not labels:
        return ""
    return "{" + ",".join(f'{name}="{_escaped(str(value))}"' for name, value in labels.items()) + "}"


def _escaped(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
