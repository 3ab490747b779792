"""What may be wrong with services and nodes: nobody serves, another name, another type, two of one name, a client that polls."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Final

from actors.suggest import did_you_mean, nearest
from cli.graph.view import CLIENT, SERVER
from cli.parsing import count
from cli.verbs.doctor.observation import Finding, Observation
from cli.verbs.doctor.topics import different_types

ALMOST: Final = 0.7
"""A service whose name resembles the missing one so much was probably meant."""

POLLING_HZ: Final = 5.0
"""A client that asks more often should subscribe to a topic."""


def serving(seen: Observation) -> Iterator[Finding]:
    """Each service that is asked for or used and that nobody serves: because no such server runs, or because its name is another one."""
    asked = seen.asked[1] if seen.asked is not None and seen.asked[0] == "service" else None
    for name in [asked] if asked is not None else seen.names(CLIENT):
        if seen.of(SERVER, name):
            continue
        clients = seen.of(CLIENT, name)
        users = f" ({', '.join(dict.fromkeys(end.node for end in clients))})" if clients else ""
        served = seen.all_names(SERVER)
        measured = f"0 servers, {count(len(clients), 'client')}{users}; {count(len(served), 'service')} served"
        last = name.rpartition("/")[2]
        similar = nearest(name, served, cutoff=ALMOST) or [each for each in served if each.rpartition("/")[2] == last]
        if similar:
            yield Finding(
                name,
                f"no node serves this name; similar services: {', '.join(similar)}",
                measured,
                f"use that name, for instance with --ros-args -r {name}:={similar[0]}",
            )
        else:
            help = "start the node that serves it"
            yield Finding(name, "its server is not running", measured, help, "note" if asked is None else "problem")


def service_types(seen: Observation) -> Iterator[Finding]:
    """Each service whose servers and clients, or what is asked for, have more than one type."""
    for name in seen.names(SERVER, CLIENT):
        ends = [*seen.of(SERVER, name), *seen.of(CLIENT, name)]
        yield from different_types(name, ends, seen.wanted if seen.asks_for("service", name) else "")


def polling(seen: Observation) -> Iterator[Finding]:
    """Each service that a client calls more often than a service is meant for, as far as servers tell how often they are called.

    They do not tell how often by whom. One of n clients calls at least the n-th part.
    """
    for told, before, last in seen.figures():
        calls = {one.service: one.calls for one in before.services}
        for one in last.services:
            clients = sorted({*one.clients, *(end.node for end in seen.of(CLIENT, one.service))})
            if one.service not in calls or not clients or told.seconds <= 0:
                continue
            rate = (one.calls - calls[one.service]) / told.seconds
            if rate / len(clients) > POLLING_HZ:
                nodes = ", ".join(clients)
                yield Finding(
                    one.service,
                    f"{nodes if len(clients) == 1 else f'one of {nodes}'} polls it: a service is not for continuous data",
                    f"{rate:.1f} calls a second by {count(len(clients), 'client')}, more than {POLLING_HZ:g} by one",
                    f"let {last.name} publish it as a topic",
                )


def twins(seen: Observation) -> Iterator[Finding]:
    """Each name that several nodes have."""
    counted = Counter(node.fqn for node in seen.here())
    for name, number in sorted(counted.items()):
        if number > 1 and (seen.asked is None or seen.asks_for("node", name)):
            processes = {node.session for node in seen.here() if node.fqn == name}
            yield Finding(
                name,
                "several nodes have this name: parameters and services of it reach any of them",
                f"{number} nodes in {len(processes)} process{'' if len(processes) == 1 else 'es'}",
                "end one of them, or start it with --ros-args -r __node:=OTHER_NAME",
            )


def node_is_there(seen: Observation) -> Iterator[Finding]:
    """That the node that was asked for is there."""
    if seen.asked is None or seen.asked[0] != "node":
        return
    name = seen.asked[1]
    known = sorted({node.fqn for node in seen.here()})
    if name not in known and not any(node.fqn == name for node in seen.nodes if node.domain_id == seen.domain):
        elsewhere = sorted({node.domain_id for node in seen.nodes if node.fqn == name})
        hint = f"; it is in domain {elsewhere[0]}" if elsewhere else did_you_mean(name, known)
        remedy = (
            f"export ROS_DOMAIN_ID={elsewhere[0]}" if elsewhere else "start it; robactor log shows whether it has ended"
        )
        yield Finding(
            name, f"there is no such node{hint}", f"{count(len(known), 'node')} in domain {seen.domain}", remedy
        )
