"""Laws of quality of service."""

from __future__ import annotations

import math
import pickle

from hypothesis import given
from hypothesis import strategies as st

from actors import QoS, qos
from actors.qos import Durability, History, Liveliness, Reliability

seconds = st.one_of(st.none(), st.just(math.inf), st.integers(1, 10**12).map(lambda nanoseconds: nanoseconds / 1e9))
concrete = st.builds(
    QoS,
    depth=st.integers(1, 1000),
    reliability=st.sampled_from([Reliability.RELIABLE, Reliability.BEST_EFFORT]),
    durability=st.sampled_from([Durability.VOLATILE, Durability.TRANSIENT_LOCAL]),
    deadline=seconds,
    lifespan=seconds,
    liveliness=st.sampled_from([Liveliness.AUTOMATIC, Liveliness.MANUAL_BY_TOPIC]),
    liveliness_lease=seconds,
)
raw = st.builds(
    QoS,
    depth=st.integers(1, 1000),
    reliability=st.sampled_from(Reliability),
    durability=st.sampled_from(Durability),
    deadline=seconds,
    liveliness=st.sampled_from(Liveliness),
    liveliness_lease=seconds,
)


@given(concrete)
def test_every_endpoint_is_compatible_with_itself(one: QoS) -> None:
    assert qos.compatible(one, one).level == "ok"


@given(concrete, concrete, concrete)
def test_what_is_offered_to_a_stronger_request_satisfies_a_weaker_one(a: QoS, b: QoS, c: QoS) -> None:
    if qos.compatible(a, b) and qos.compatible(b, c):
        assert qos.compatible(a, c)


@given(concrete, concrete)
def test_concrete_policies_leave_no_doubt(a: QoS, b: QoS) -> None:
    verdict = qos.compatible(a, b)

    assert verdict.level in ("ok", "error")
    assert bool(verdict.policies) == (verdict.level == "error")


@given(concrete, concrete, st.integers(1, 1000), seconds)
def test_depth_history_and_lifespan_play_no_part(a: QoS, b: QoS, depth: int, lifespan: float | None) -> None:
    kept = a.replace(depth=depth, lifespan=lifespan)
    all_kept = QoS(
        history=History.KEEP_ALL,
        reliability=b.reliability if b.reliable else Reliability.RELIABLE,
        durability=b.durability,
    )

    assert qos.compatible(kept, b) == qos.compatible(a, b)
    assert qos.compatible(a, all_kept.replace(history=History.KEEP_LAST)) == qos.compatible(a, all_kept)


@given(st.lists(concrete, max_size=5))
def test_a_best_available_subscription_asks_for_no_more_reliability_than_anyone_offers(offered: list[QoS]) -> None:
    resolved = qos.resolve_subscription(qos.BEST_AVAILABLE, offered)

    for one in offered:
        assert not {"reliability", "durability", "liveliness"} & set(qos.compatible(one, resolved).policies)


@given(st.lists(concrete, max_size=5))
def test_a_best_available_publisher_satisfies_every_subscription_it_knows(requested: list[QoS]) -> None:
    resolved = qos.resolve_publisher(qos.BEST_AVAILABLE, requested)

    assert all(qos.compatible(resolved, qos.resolve_subscription(one)) for one in requested)


@given(raw)
def test_resolution_leaves_nothing_open_and_changes_nothing_twice(one: QoS) -> None:
    for resolve in (qos.resolve_publisher, qos.resolve_subscription, qos.resolve_service):
        resolved = resolve(one)
        words = (resolved.history, resolved.reliability, resolved.durability, resolved.liveliness)
        assert not {"system_default", "best_available"} & set(words)
        assert resolve(resolved) == resolved


@given(raw)
def test_a_copy_through_pickle_or_replace_is_equal_with_an_equal_hash(one: QoS) -> None:
    for copy in (pickle.loads(pickle.dumps(one)), one.replace()):
        assert copy == one
        assert hash(copy) == hash(one)
        assert repr(copy) == repr(one)


@given(raw, raw)
def test_the_verdict_has_a_reason_exactly_when_it_is_not_ok(a: QoS, b: QoS) -> None:
    verdict = qos.compatible(a, b)

    assert bool(verdict.reason) == bool(verdict.policies) == (verdict.level != "ok")
