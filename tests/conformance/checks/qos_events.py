"""`event_sequence` of `qos_compatibility`: readable scripts, asked of a real publisher and a real subscription on the virtual clock."""

from __future__ import annotations

import asyncio
import re
from typing import Any, Final

import msgspec

from actors import QoS, qos
from actors.graph.graph import Graph
from actors.interfaces.std_msgs.msg import String
from actors.qos.events import DeadlineMissed, IncompatibleQoS, LivelinessChanged, LivelinessLost, Matched, MessageLost
from actors.testing import VirtualLoop
from actors.topics.endpoint import EventStream
from actors.topics.publisher import Publisher
from actors.topics.stream import StreamSubscription
from actors.topics.timed_publisher import publisher_for
from tests.conformance.checks.common import Unsupported, Vector, expected, same, steps_of
from tests.conformance.checks.qos_forms import arguments

MESSAGE: Final = String(data="a message")
BOTH: Final = ("publisher", "subscription")
_EVENTS: Final[dict[str, dict[str, tuple[str, type[Any]]]]] = {
    "matched": {"publisher": ("publisher", Matched), "subscription": ("subscription", Matched)},
    "deadline_missed": {"publisher": ("publisher", DeadlineMissed), "subscription": ("subscription", DeadlineMissed)},
    "incompatible_qos": {
        "publisher": ("publisher", IncompatibleQoS),
        "subscription": ("subscription", IncompatibleQoS),
    },
    "liveliness": {
        "publisher_liveliness_lost": ("publisher", LivelinessLost),
        "subscription_liveliness_changed": ("subscription", LivelinessChanged),
    },
    "message_lost": {"subscription": ("subscription", MessageLost)},
}
"""For each event: the names under which a case expects it, and whose event of which kind that is."""
_ALIASES: Final = {
    "offered_deadline_missed": "deadline_missed",
    "requested_deadline_missed": "deadline_missed",
    "liveliness_lost": "liveliness",
    "liveliness_changed": "liveliness",
}
_OF_THE_SCRIPT: Final = {"kind", "entity", "event", "steps"}
"""The fields of `input` that are no policies of its endpoints."""


class Script:
    """One publisher and one subscription, seen through their events."""

    def __init__(self, given: Vector, steps: list[str]) -> None:
        event = given["event"]
        self.event = _ALIASES.get(event, event)
        if self.event not in _EVENTS:
            raise Unsupported(f"unsupported event {event!r}: known are {', '.join(_EVENTS)}")
        self.entity = given.get("entity", "both")
        policies = arguments({key: value for key, value in given.items() if key not in _OF_THE_SCRIPT})
        defaults = {"depth": 10, "deadline": 3600.0, "liveliness_lease": 3600.0, "liveliness": qos.Liveliness.AUTOMATIC}
        self.qos = QoS(**{**defaults, **policies})
        self.deadline, self.lease = self.qos.deadline or 3600.0, self.qos.liveliness_lease or 3600.0
        self.entry = Graph(asyncio.get_running_loop().time).topic("/chatter")
        self.publisher: Publisher[String] | None = None
        self.subscription: StreamSubscription[String] | None = None
        self.heard: dict[str, EventStream[Any]] = {}
        """What each side is told; of one that has been destroyed, what it was told until then."""
        for side in BOTH:  # who is created by a step is not there before
            if self.entity == side or (self.event != "matched" and f"{side}_created" not in steps):
                self.create(side)

    def create(self, side: str) -> None:
        if side == "publisher":
            self.publisher = publisher_for(_Silent(), self.entry, String, self.qos)
            self.heard[side] = self.publisher.events()
            self.entry.add_publisher(self.publisher)
        else:
            self.subscription = StreamSubscription(_Silent(), self.entry, String, self.qos)
            self.heard[side] = self.subscription.events()
            self.entry.add_subscription(self.subscription)

    def destroy(self, side: str) -> None:
        endpoint = self.publisher if side == "publisher" else self.subscription
        if endpoint is None:
            raise Unsupported(f"unsupported step: there is no {side} to destroy")
        endpoint.close()

    def publish(self) -> None:
        if self.publisher is None:
            raise Unsupported("unsupported step: there is no publisher to publish with")
        self.publisher(MESSAGE)

    def take(self) -> Vector:
        """What the events of the case say now, by the names under which it expects them."""
        found: dict[str, list[Any]] = {side: stream.take() for side, stream in self.heard.items()}
        return {name: self._said(kind, found.get(side, [])) for name, (side, kind) in _EVENTS[self.event].items()}

    @staticmethod
    def _said(kind: type[Any], events: list[Any]) -> Vector:
        """The event of this kind; where nothing has happened, zeros."""
        found = [event for event in events if isinstance(event, kind)]
        if found:
            return msgspec.structs.asdict(found[0])
        return {field: "INVALID" if field == "last_policy_kind" else 0 for field in kind.__struct_fields__}


class _Silent:
    """Nobody: it takes part and says nothing."""

    fqn = "/somebody"

    def warn(self, event: str, **fields: object) -> None:
        raise AssertionError(event)


_NUMBERS: Final = {"half_a": 0.5, "a": 1, "one": 1, "two": 2, "three": 3, "four": 4, "five": 5, "ten": 10}
_SPANS: Final = "(?P<span>period|deadline|lease)s?"
_COUNTED: Final = re.compile(rf"wait_(?P<count>{'|'.join(_NUMBERS)}|\d+)_{_SPANS}(?P<manner>_\w+)?")
_COMPARED: Final = re.compile(rf"wait_(?P<how>longer|more|shorter|less)_than_((a|one|the)_)?{_SPANS}(?P<manner>_\w+)?")
_ALONE: Final = re.compile(r"_without_\w+")
_ASSERTING: Final = re.compile(r"_(with|while)_(assert|asserting|assert_liveliness|asserting_liveliness)")


async def wait(script: Script, step: str) -> None:
    """A step that waits: a number of deadlines or leases, or somewhat more or less than one."""
    if (found := _COUNTED.fullmatch(step)) is not None:
        count: float = _NUMBERS[found["count"]] if found["count"] in _NUMBERS else int(found["count"])
    elif (found := _COMPARED.fullmatch(step)) is not None:
        count = 1.5 if found["how"] in ("longer", "more") else 0.5
    else:
        raise Unsupported(f"unsupported step {step!r}")
    manner = found["manner"] or ""
    span = script.lease if found["span"] == "lease" else script.deadline
    if _ASSERTING.fullmatch(manner) and script.publisher is not None:
        for _ in range(round(count * 2)):
            script.publisher.assert_liveliness()
            await asyncio.sleep(span / 2)
    elif not manner or _ALONE.fullmatch(manner):
        await asyncio.sleep(count * span)
    else:
        raise Unsupported(f"unsupported step {step!r}")


async def play(script: Script, step: str) -> None:
    """One step of a script, by its readable name."""
    side, _, change = step.rpartition("_")
    if side in BOTH and change in ("created", "destroyed"):
        script.create(side) if change == "created" else script.destroy(side)
    elif step == "publish_in_time":
        for _ in range(7):
            script.publish()
            await asyncio.sleep(script.deadline / 2)
    elif step == "publish":
        script.publish()
    elif step in ("assert", "assert_liveliness") and script.publisher is not None:
        script.publisher.assert_liveliness()
    else:
        await wait(script, step)


async def _played(given: Vector, steps: list[str]) -> tuple[Script, list[Vector]]:
    script = Script(given, steps)
    taken: list[Vector] = []
    for step in steps:
        if step in ("take_event", "take_events"):
            taken.append(script.take())
        else:
            await play(script, step)
    return script, taken


def event_sequence(vector: Vector) -> None:
    expect = vector["expect"]
    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        script, taken = runner.run(_played(vector["input"], steps_of(vector)))
    if "events" in expect:
        for index, (got, wanted) in enumerate(zip(taken, expect["events"], strict=True)):
            if set(wanted) <= set(got):
                for side, event in wanted.items():
                    same(f"event {index} of the {side}", got[side], event)
            else:
                same(f"event {index}", next(event for side, event in got.items() if _is_of(side, script)), wanted)
    for side in set(expect) - {"events"}:
        if side not in taken[-1]:
            raise Unsupported(f"unsupported expectation {side!r}: known are {', '.join(taken[-1])}")
        expected(expect[side], **taken[-1][side])


def _is_of(side: str, script: Script) -> bool:
    """Whether a name of an event belongs to the entity whose events a case lists."""
    return script.entity == "both" or side.startswith(script.entity)
