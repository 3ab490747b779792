"""Quality of service: matching, resolution, profiles, construction, and what matching does to messages.

`event_sequence` is asked of a real publisher and a real subscription on the virtual clock.
"""

from __future__ import annotations

import asyncio
import math
import re
import warnings
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import msgspec

from actors import Node, QoS, Topic, qos
from actors.endpoint import EventStream
from actors.graph import Graph
from actors.interfaces.std_msgs.msg import String
from actors.logs import LogRecord
from actors.qos_events import DeadlineMissed, LivelinessChanged, LivelinessLost, Matched
from actors.stream import Subscription
from actors.testing import Rig, VirtualLoop
from actors.timed import publisher_for
from tests.conformance.checks.common import Case, Skip, Vector, by_kind, expected, raises, same

_POLICIES: dict[str, type[qos.Policy]] = {
    "history": qos.History,
    "reliability": qos.Reliability,
    "durability": qos.Durability,
    "liveliness": qos.Liveliness,
}
_ERRORS: dict[str, type[Exception]] = {
    "invalid_qos_profile": qos.InvalidQoS,
    "value_error": ValueError,
    "type_error": TypeError,
    "any": Exception,
}
_PROFILES = {
    "clock_subscription": qos.CLOCK,
    "action_feedback": qos.ACTION_FEEDBACK,
    "lifecycle_transition_event": qos.TRANSITION_EVENT,
}


def duration(given: Any) -> float | None:
    words = {"default": None, "infinite": math.inf, "best_available": qos.BEST_AVAILABLE_DURATION}
    return words[given] if isinstance(given, str) else float(given)


def endpoint(given: Vector) -> QoS:
    """The QoS of an endpoint as the vectors describe it."""
    arguments: Vector = {"depth": 10}
    for key, value in given.items():
        if key in _POLICIES:
            arguments[key] = _POLICIES[key].from_key(value)
        elif key.endswith("_sec"):
            name = {"liveliness_lease_sec": "liveliness_lease"}.get(key, key.removesuffix("_sec"))
            arguments[name] = duration(value)
        elif key == "depth":
            arguments[key] = value
    return QoS(**arguments)


def described(value: QoS) -> Vector:
    """A QoS in the words of the vectors."""

    def seconds(given: float | None) -> object:
        if given == qos.BEST_AVAILABLE_DURATION:
            return "best_available"
        return "infinite" if given == math.inf else "default" if given is None else given

    return {
        "history": str(value.history),
        "depth": value.given_depth,
        "reliability": str(value.reliability),
        "durability": str(value.durability),
        "liveliness": str(value.liveliness),
        "deadline_sec": seconds(value.deadline),
        "lifespan_sec": seconds(value.lifespan),
        "liveliness_lease_sec": seconds(value.liveliness_lease),
    }


def check_compatible(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]
    verdict = qos.compatible(endpoint(given["publisher"]), endpoint(given["subscription"]))
    expected(expect, compatibility=verdict.level)
    if "policies" in expect:
        same("policies", set(verdict.policies), set(expect["policies"]))
        for policy in expect["policies"]:
            assert policy in verdict.reason, f"the reason does not name {policy}: {verdict.reason}"


def best_available_subscription(vector: Vector) -> None:
    remote = [endpoint(one) for one in vector["input"]["remote_endpoints"]]
    expected(vector["expect"], **described(qos.resolve_subscription(qos.BEST_AVAILABLE, remote)))


def best_available_publisher(vector: Vector) -> None:
    remote = [endpoint(one) for one in vector["input"]["remote_endpoints"]]
    expected(vector["expect"], **described(qos.resolve_publisher(qos.BEST_AVAILABLE, remote)))


def profile(vector: Vector) -> None:
    name = vector["input"]["name"]
    expected(vector["expect"], **described(_PROFILES.get(name) or qos.profile(name)))


def built(expect: Vector, build: Callable[[], QoS]) -> None:
    """Compare the QoS that is built, and whether a warning was given, with the expectation."""
    if not expect["ok"]:
        raises(_ERRORS[expect["error"]], build)
        return
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        made = build()
    expected(expect, warns=bool(told), **described(made))


def construct(vector: Vector) -> None:
    given: Vector = {}
    for key, value in vector["input"]["args"].items():
        given[key] = _POLICIES[key].from_key(value) if key in _POLICIES else value
    built(vector["expect"], lambda: QoS(**given))


def qos_or_depth(vector: Vector) -> None:
    built(vector["expect"], lambda: qos.of(vector["input"]["value"]))


def short_keys(vector: Vector) -> None:
    expected(vector["expect"], keys=[str(key) for key in _POLICIES[vector["input"]["policy"]]])


def from_short_key(vector: Vector) -> None:
    expected(vector["expect"], value=str(_POLICIES[vector["input"]["policy"]].from_key(vector["input"]["key"])))


OLD, NEW = String(data="old"), String(data="new")
CHATTER = Topic(String, "/chatter")


async def meet(offered: QoS, requested: QoS) -> tuple[list[str], list[LogRecord]]:
    """What a subscription receives that comes between an old and a new message, and what both nodes say about it."""
    nodes: dict[str, Node] = {}

    class Talker(Node):
        async def on_start(self) -> None:
            nodes["talker"] = self

    class Listener(Node):
        async def on_start(self) -> None:
            nodes["listener"] = self

    rig = Rig()
    await rig.start(Talker, Listener)
    publisher = nodes["talker"].publisher(CHATTER, qos=offered)
    publisher.publish(OLD)
    stream = nodes["listener"].subscribe(CHATTER, qos=requested)
    publisher.publish(NEW)
    received = [(await stream.next(timeout=1.0)).data for _ in range(stream.received)]
    said = list(rig.logs)
    await rig.close()
    return received, said


def have_met(offered: QoS, requested: QoS) -> tuple[list[str], list[LogRecord]]:
    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        return runner.run(meet(offered, requested))


def incompatible_event(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]
    offered, requested = endpoint(given["publisher"]), endpoint(given["subscription"])
    received, said = have_met(offered, requested)
    expected(expect, messages_delivered=len(received))
    policy = qos.compatible(offered, requested).event_policy
    for side, node in (("publisher_event", "/talker"), ("subscription_event", "/listener")):
        told = [record for record in said if record.node == node and "incompatible QoS" in record.event]
        expected(expect[side], total_count=len(told), total_count_change=len(told), last_policy_kind=policy)


def late_joiner(vector: Vector) -> None:
    given = vector["input"]
    received, _ = have_met(
        QoS(depth=10, durability=qos.Durability.from_key(given["publisher_durability"])),
        QoS(depth=10, durability=qos.Durability.from_key(given["subscription_durability"])),
    )
    expected(vector["expect"], receives_old="old" in received, receives_new="new" in received)
    same("order", received, sorted(received, reverse=True))


class Script:
    """One publisher and one subscription on the virtual clock, seen through their events."""

    def __init__(self, given: Vector) -> None:
        self.loop = asyncio.get_running_loop()
        self.deadline, self.lease = given.get("deadline_sec", 3600.0), given.get("lease_sec", 3600.0)
        manual = given.get("liveliness", "automatic") == "manual_by_topic"
        self.qos = QoS(
            depth=10,
            deadline=self.deadline,
            liveliness=qos.Liveliness.MANUAL_BY_TOPIC if manual else qos.Liveliness.AUTOMATIC,
            liveliness_lease=self.lease,
        )
        self.entry = Graph(self.loop.time).topic("/chatter")
        self.subscription = Subscription(_Silent(), self.entry, String, self.qos)
        self.publisher = publisher_for(_Silent(), self.entry, String, self.qos)
        self.heard, self.met = self.subscription.events(), self.publisher.events()
        self.entry.add_publisher(self.publisher)
        if given["event"] != "matched":
            self.entry.add_subscription(self.subscription)

    def take(self, event: str) -> Vector:
        """What every side's event of this name says now."""
        if event == "matched":
            return {"matched": self._said(Matched, self.met)}
        if event.startswith("deadline"):
            return {
                side: self._said(DeadlineMissed, at)
                for side, at in (("publisher", self.met), ("subscription", self.heard))
            }
        return {
            "publisher_liveliness_lost": self._said(LivelinessLost, self.met),
            "subscription_liveliness_changed": self._said(LivelinessChanged, self.heard),
        }

    def _said(self, kind: type[Any], events: EventStream[Any]) -> Vector:
        """The event of this kind; where nothing has happened, zeros."""
        found = [event for event in events.take() if isinstance(event, kind)]
        return msgspec.structs.asdict(found[0]) if found else dict.fromkeys(kind.__struct_fields__, 0)


class _Silent:
    """Nobody: it takes part and says nothing."""

    fqn = "/somebody"

    def warn(self, event: str, **fields: object) -> None:
        raise AssertionError(event)


_WAIT = re.compile(r"wait_(one|two|three|four|five|half_a|a)_(period|deadline|lease)s?(_|\Z)")
_NUMBERS = {"half_a": 0.5, "a": 1, "one": 1, "two": 2, "three": 3, "four": 4, "five": 5}


async def play(script: Script, step: str) -> None:
    """One step of a script, by its readable name."""
    if step.endswith("_created"):
        script.entry.add_subscription(script.subscription)
    elif step.endswith("_destroyed"):
        script.subscription.close()
    elif step == "publish_in_time":
        for _ in range(7):
            script.publisher(OLD)
            await asyncio.sleep(script.deadline / 2)
    elif step == "publish":
        script.publisher(OLD)
    elif step in ("assert", "assert_liveliness"):
        script.publisher.assert_liveliness()
    elif found := _WAIT.match(step):
        await asyncio.sleep(_NUMBERS[found[1]] * (script.lease if found[2] == "lease" else script.deadline))
    else:
        raise Skip(f"the step {step!r} is not known")


async def _played(given: Vector) -> list[Vector]:
    script = Script(given)
    taken: list[Vector] = []
    for step in given["steps"]:
        if step == "take_event":
            taken.append(script.take(given["event"]))
        else:
            await play(script, step)
    return taken


def event_sequence(vector: Vector) -> None:
    expect = vector["expect"]
    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        taken = runner.run(_played(vector["input"]))
    if "events" in expect:
        same("events", [next(iter(one.values())) for one in taken], expect["events"])
    for side, wanted in expect.items():
        if side != "events":
            expected(wanted, **taken[-1][side])


def cases(path: Path) -> Iterable[Case]:
    checks = {
        "check_compatible": check_compatible,
        "best_available_subscription": best_available_subscription,
        "best_available_publisher": best_available_publisher,
        "profile": profile,
        "construct": construct,
        "qos_or_depth": qos_or_depth,
        "short_keys": short_keys,
        "from_short_key": from_short_key,
        "incompatible_event": incompatible_event,
        "late_joiner": late_joiner,
        "event_sequence": event_sequence,
    }
    return by_kind(path, checks)
