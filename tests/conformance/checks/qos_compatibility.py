"""Quality of service: matching, resolution, profiles, construction, and what matching does to messages.

`event_sequence` is in `qos_events`.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterable
from pathlib import Path

from actors import Node, QoS, Topic, qos
from actors.interfaces.std_msgs.msg import String
from actors.logs import LogRecord
from tests.conformance import crossing
from tests.conformance.checks.common import Case, Vector, by_kind, expected, raises, refused, same
from tests.conformance.checks.qos_events import event_sequence
from tests.conformance.checks.qos_forms import POLICIES, arguments, endpoint

_ERRORS: dict[str, type[Exception]] = {
    "invalid_qos_profile": qos.InvalidQoS,
    "value_error": ValueError,
    "type_error": TypeError,
}
_PROFILES = {
    "clock_subscription": qos.CLOCK,
    "action_feedback": qos.ACTION_FEEDBACK,
    "lifecycle_transition_event": qos.TRANSITION_EVENT,
}


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
        raises(refused(expect["error"], _ERRORS), build)
        return
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        made = build()
    expected(expect, warns=bool(told), **described(made))


def construct(vector: Vector) -> None:
    built(vector["expect"], lambda: QoS(**arguments(vector["input"]["args"])))


def qos_or_depth(vector: Vector) -> None:
    built(vector["expect"], lambda: qos.of(vector["input"]["value"]))


def short_keys(vector: Vector) -> None:
    expected(vector["expect"], keys=[str(key) for key in POLICIES[vector["input"]["policy"]]])


def from_short_key(vector: Vector) -> None:
    expect, policy = vector["expect"], POLICIES[vector["input"]["policy"]]
    if expect.get("ok") is False:
        raises(refused(expect.get("error", "any"), _ERRORS), lambda: policy.from_key(vector["input"]["key"]))
    else:
        expected(expect, ok=True, value=str(policy.from_key(vector["input"]["key"])))


OLD, NEW = String(data="old"), String(data="new")
CHATTER = Topic(String, "/chatter")


async def meet(offered: QoS, requested: QoS) -> tuple[list[str], list[LogRecord]]:
    """What a subscription receives that comes between an old and a new message, and what both nodes say about it."""

    class Talker(Node): ...

    class Listener(Node): ...

    meeting = await crossing.meet(Talker, Listener)
    publisher = meeting.server.publisher(CHATTER, qos=offered)
    publisher.publish(OLD)
    await meeting.settle()
    stream = meeting.client.subscribe(CHATTER, qos=requested)
    await meeting.settle()
    publisher.publish(NEW)
    await meeting.settle()
    received = [(await stream.next(timeout=1.0)).data for _ in range(stream.received)]
    said = list(meeting.stage.logs)
    await meeting.stage.close()
    return received, said


def have_met(offered: QoS, requested: QoS) -> tuple[list[str], list[LogRecord]]:
    with crossing.runner() as runner:
        return runner.run(meet(offered, requested))


def incompatible_event(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]
    offered, requested = endpoint(given["publisher"]), endpoint(given["subscription"])
    received, said = have_met(offered, requested)
    expected(expect, messages_delivered=len(received))
    policy = qos.compatible(offered, requested).event_policy
    for side, node in (("publisher_event", "/talker"), ("subscription_event", "/listener")):
        told = [record for record in said if record.node == node and "incompatible QoS" in record.event]
        if side in expect:
            counts = {"total_count": len(told), "total_count_change": len(told)}
            expected(expect[side], last_policy_kind=policy if told else "INVALID", **counts)


def late_joiner(vector: Vector) -> None:
    given = vector["input"]
    received, _ = have_met(
        QoS(depth=10, durability=qos.Durability.from_key(given["publisher_durability"])),
        QoS(depth=10, durability=qos.Durability.from_key(given["subscription_durability"])),
    )
    expected(vector["expect"], receives_old="old" in received, receives_new="new" in received)
    same("order", received, sorted(received, reverse=True))
    expected(vector["expect"], received=received, receives=received)


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
