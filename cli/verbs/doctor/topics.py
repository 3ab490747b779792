"""What may be wrong with topics: quality of service, types, names, and whether anything is sent."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import Final

from actors.graph.mismatch import remedy
from actors.qos import compatible
from actors.suggest import nearest
from cli.graph.view import PUBLISHER, SUBSCRIPTION, Endpoint
from cli.parsing import count
from cli.verbs.doctor.observation import Finding, Observation

COMMAND_WORDS: Final = frozenset({"cmd", "command", "commands", "estop", "stop"})
"""A topic with such a word in its last part tells a robot what to do."""

ALMOST: Final = 0.85
"""The names of a topic without a publisher and of one without a subscription that resemble each other so much are probably meant alike."""

STANDARD: Final = ("/rosout", "/parameter_events", "/clock", "/tf", "/tf_static")
"""Topics that each node may publish or subscribe to, whether or not anybody is at the other end."""


def quality(seen: Observation) -> Iterator[Finding]:
    """Each publisher and subscription of one topic and type that do not match, because less is offered than requested."""
    for name in seen.names(PUBLISHER, SUBSCRIPTION):
        for publisher in seen.of(PUBLISHER, name):
            for subscription in seen.of(SUBSCRIPTION, name):
                offered, requested = publisher.about.qos, subscription.about.qos
                verdict = compatible(offered, requested)
                if not verdict:
                    yield Finding(
                        name,
                        f"nothing reaches {subscription.node} from {publisher.node}: {verdict.reason}",
                        f"{publisher.node} offers {offered!r}, {subscription.node} requests {requested!r}",
                        f"{remedy(offered, requested, verdict)}; best, give both the same profile",
                    )


def types(seen: Observation) -> Iterator[Finding]:
    """Each topic whose ends, or what is asked for, have more than one type."""
    for name in seen.names(PUBLISHER, SUBSCRIPTION):
        ends = [*seen.of(PUBLISHER, name), *seen.of(SUBSCRIPTION, name)]
        yield from different_types(name, ends, seen.wanted if seen.asks_for("topic", name) else "")


def different_types(name: str, ends: Iterable[Endpoint], wanted: str) -> Iterator[Finding]:
    """A finding if the ends of a name do not all have one type, and the wanted one if one is wanted."""
    users: dict[tuple[str, str], list[str]] = {}
    for end in ends:
        users.setdefault((end.about.type, end.about.type_hash), []).append(end.node)
    shown = {
        kind: kind[0] if len({other[1] for other in users if other[0] == kind[0]}) == 1 else f"{kind[0]} ({kind[1]})"
        for kind in users
    }
    measured = "; ".join(f"{shown[kind]}: {', '.join(dict.fromkeys(nodes))}" for kind, nodes in users.items())
    if len(users) > 1:
        same = len({kind for kind, _ in users}) == 1
        cause = "its ends have different definitions of one type" if same else "its ends have different types"
        help = "install the same version of the package everywhere" if same else "give one of them another name"
        yield Finding(name, f"{cause}, and do not understand each other", measured, help)
    if wanted and users and wanted not in {kind for kind, _ in users}:
        yield Finding(name, f"it is not of the type {wanted}", measured, "use the type that is there")


def names(seen: Observation) -> Iterator[Finding]:
    """Each topic with ends on one side only, and the names that were probably meant."""
    if seen.asked is not None and seen.asked[0] == "topic":
        yield from _asked(seen, seen.asked[1])
        return
    asked = seen.asked is not None
    for name in seen.names(SUBSCRIPTION):
        if seen.of(PUBLISHER, name) or name in STANDARD:
            continue
        readers = _nodes(seen.of(SUBSCRIPTION, name))
        measured = f"0 publishers, {count(len(seen.of(SUBSCRIPTION, name)), 'subscription')} ({readers})"
        meant = _meant(seen, name)
        if meant:
            writers = _nodes(seen.of(PUBLISHER, meant))
            yield Finding(
                name,
                f"nobody publishes it, and nobody subscribes to {meant}, which is of the same type: one name is probably wrong",
                f"{measured}; {meant} has {count(len(seen.of(PUBLISHER, meant)), 'publisher')} ({writers}), 0 subscriptions",
                f"let both use one name, for instance with --ros-args -r {name}:={meant}",
            )
        else:
            hint = _similar(name, seen.all_names(PUBLISHER))
            cause = f"nobody publishes it{hint}"
            yield Finding(name, cause, measured, "start the node that does", "problem" if asked and hint else "note")


def _asked(seen: Observation, name: str) -> Iterator[Finding]:
    publishers, subscriptions = seen.of(PUBLISHER, name), seen.of(SUBSCRIPTION, name)
    if publishers:
        return
    hint = _similar(name, [each for each in seen.all_names(PUBLISHER) if each != name])
    readers = f" ({_nodes(subscriptions)})" if subscriptions else ""
    cause = "nobody publishes it" if subscriptions else "there is no such topic"
    yield Finding(
        name,
        f"{cause}{hint}",
        f"0 publishers, {count(len(subscriptions), 'subscription')}{readers}; {count(len(seen.all_names(PUBLISHER)), 'topic')} published",
        "start the node that publishes it, or correct the name: names are relative to the namespace of their node",
    )


def _meant(seen: Observation, name: str) -> str:
    """The topic of the same type that is published for nobody, and is named almost like this one; empty if there is none."""
    kinds = {end.about.type for end in seen.of(SUBSCRIPTION, name)}
    unread = [
        each
        for each in seen.all_names(PUBLISHER)
        if not seen.of(SUBSCRIPTION, each) and kinds & {end.about.type for end in seen.of(PUBLISHER, each)}
    ]
    return next(iter(nearest(name, unread, cutoff=ALMOST)), "")


def _similar(name: str, known: Iterable[str]) -> str:
    """The known names that resemble this one, or have its last part, as the end of a sentence."""
    all_known = list(known)
    last = name.rpartition("/")[2]
    found = nearest(name, all_known, most=3) + [each for each in all_known if each.rpartition("/")[2] == last]
    return f"; similar: {', '.join(list(dict.fromkeys(found))[:3])}" if found else ""


def sending(seen: Observation) -> Iterator[Finding]:
    """Each topic that was listened to: whether anything came, and how often."""
    for name, heard in seen.listened.items():
        publishers = seen.of(PUBLISHER, name)
        if not publishers:
            continue
        measured = (
            f"{count(heard.messages, 'message')} in {heard.seconds:.1f} s, {heard.messages / heard.seconds:.1f} Hz"
        )
        if heard.messages:
            yield Finding(name, "it is sent", measured, level="info")
        else:
            yield Finding(
                name,
                f"nothing is sent, although {_nodes(publishers)} publishes it",
                measured,
                f"look at what its publisher waits for: robactor doctor node {publishers[0].node}, robactor log; "
                "a topic that is sent seldom or once is right so",
            )


def best_effort_commands(seen: Observation) -> Iterator[Finding]:
    """Each topic of commands that is sent or received with best effort: a lost command is not repeated."""
    for name in seen.names(PUBLISHER, SUBSCRIPTION):
        if not COMMAND_WORDS & set(re.split(r"[_\d]+", name.rpartition("/")[2].lower())):
            continue
        ends = [*seen.of(PUBLISHER, name), *seen.of(SUBSCRIPTION, name)]
        weak = [end for end in ends if end.about.qos.reliability.value == "best_effort"]
        if weak:
            sides = ", ".join(
                f"{end.node} ({'publisher' if end.about.kind is PUBLISHER else 'subscription'})" for end in weak
            )
            yield Finding(
                name,
                "it carries commands, and is best effort: a lost command is not sent again",
                f"best effort: {sides}, of {count(len(ends), 'end')}",
                "use reliable on both sides, such as QoS(depth=10)",
            )


def _nodes(ends: Iterable[Endpoint]) -> str:
    return ", ".join(dict.fromkeys(end.node for end in ends))
