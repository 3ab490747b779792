"""A graph as text, for tests that hold it against what was promised."""

from __future__ import annotations

import re

from actors.graph.snapshot import Snapshot

__all__ = ["shown_services", "shown_topics"]

STANDARD = ("get_parameters", "set_parameters", "set_parameters_atomically", "list_parameters", "describe_parameters",
            "get_parameter_types", "get_type_description")  # fmt: skip


def endpoint(node: str, qos: str) -> str:
    """``gait reliable 10``, from what the graph shows."""
    shown = re.fullmatch(r"QoS\(keep_last (\d+), (reliable|best_effort), (volatile|transient_local), automatic\)", qos)
    assert shown, qos
    depth, reliability, durability = shown.groups()
    return " ".join((node[1:], reliability, *(["latched"] if durability == "transient_local" else []), depth))


def shown_topics(snapshot: Snapshot) -> list[str]:
    """A line for each topic with its types, and one for each of its endpoints."""
    lines: list[str] = []
    for topic in snapshot.topics:
        lines.append(f"{topic.name} {' and '.join(topic.types)}")
        for arrow, edges in (("<-", topic.publishers), ("->", topic.subscriptions)):
            lines += sorted(f"    {arrow} {endpoint(edge.node, edge.qos)}" for edge in edges)
    return lines


def shown_services(snapshot: Snapshot) -> list[str]:
    """A line for each service and action with its type and the node that serves it, but for the standard services of nodes."""
    served = [one for one in snapshot.services if not one.name.endswith(STANDARD)]
    return sorted(f"{one.name} {one.type} <- {one.server[1:]}" for one in served)
