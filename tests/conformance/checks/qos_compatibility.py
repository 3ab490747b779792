"""Quality of service: matching, resolution, profiles, construction, and what matching does to messages.

`event_sequence` is asked of the counters in `actors.qos_events`, driven by the steps of the script.
"""

from __future__ import annotations

import asyncio
import math
import re
import warnings
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from actors import Node, QoS, Topic, qos
from actors.interfaces.std_msgs.msg import String
from actors.logs import LogRecord
from actors.qos_events import DeadlineWatch, LivelinessWatch, LostWatch, MatchedCount
from actors.testing import Rig, VirtualLoop
from tests.conformance.checks.common import Case, Skip, Vector, by_kind, expected, raises, same

SECOND = 1_000_000_000
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
    """One publisher and one subscription on a clock of their own, seen through their event counters."""

    def __init__(self, given: Vector) -> None:
        self.deadline = round(given.get("deadline_sec", 3600) * SECOND)
        self.lease = round(given.get("lease_sec", 3600) * SECOND)
        self.automatic = given.get("liveliness", "automatic") == "automatic"
        self.now = 0
        self.matched = MatchedCount()
        self.offered, self.requested = DeadlineWatch(self.deadline), DeadlineWatch(self.deadline)
        self.offered.start(0)
        self.lost, self.seen = LostWatch(self.lease, 0), LivelinessWatch(self.lease)

    def publish(self) -> None:
        self.offered.message(self.now)
        self.requested.message(self.now)
        self.assert_alive()

    def assert_alive(self) -> None:
        self.lost.assert_alive(self.now)
        self.seen.assert_alive("publisher", self.now)

    def wait(self, nanoseconds: int, *, publishing: bool = False) -> None:
        """Let time pass; a process that runs asserts automatic liveliness all the while."""
        end = self.now + nanoseconds
        while self.now < end:
            self.now = min(end, self.now + min(self.deadline, self.lease) // 2)
            if self.automatic:
                self.assert_alive()
            if publishing:
                self.publish()

    def take(self, event: str) -> Vector:
        """What every side's event of this name says now."""
        if event == "matched":
            return {"matched": self.matched.take()._asdict()}
        if event.startswith("deadline"):
            offered, requested = self.offered.take(self.now), self.requested.take(self.now)
            return {"publisher": offered._asdict(), "subscription": requested._asdict()}
        lost, seen = self.lost.take(self.now), self.seen.take(self.now)
        return {"publisher_liveliness_lost": lost._asdict(), "subscription_liveliness_changed": seen._asdict()}


_WAIT = re.compile(r"wait_(one|two|three|four|five|half_a|a)_(period|deadline|lease)s?(_|\Z)")
_NUMBERS = {"half_a": 0.5, "a": 1, "one": 1, "two": 2, "three": 3, "four": 4, "five": 5}


def play(script: Script, step: str) -> None:
    """One step of a script, by its readable name."""
    if step.endswith("_created"):
        script.matched.joined()
    elif step.endswith("_destroyed"):
        script.matched.left()
    elif step == "publish_in_time":
        script.publish()
        script.wait(3 * script.deadline, publishing=True)
    elif step == "publish":
        script.publish()
    elif step in ("assert", "assert_liveliness"):
        script.assert_alive()
    elif found := _WAIT.match(step):
        span = script.lease if found[2] == "lease" else script.deadline
        script.wait(round(_NUMBERS[found[1]] * span))
    else:
        raise Skip(f"the step {step!r} is not known")


def event_sequence(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]
    script = Script(given)
    taken: list[Vector] = []
    for step in given["steps"]:
        if step == "take_event":
            taken.append(script.take(given["event"]))
        else:
            play(script, step)
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
