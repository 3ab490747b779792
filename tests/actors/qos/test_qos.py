"""Quality of service, as a user meets it."""

from __future__ import annotations

import copy
import itertools
import math
import pickle

import pytest

from actors import QoS, qos
from actors.qos import BEST_AVAILABLE_DURATION, Durability, History, InvalidQoS, Liveliness, QoSWarning, Reliability


@pytest.mark.parametrize(
    ("profile", "reliability", "durability", "depth"),
    [
        (qos.SENSOR_DATA, "best_effort", "volatile", 5),
        (qos.COMMANDS, "reliable", "volatile", 10),
        (qos.MAP, "reliable", "transient_local", 1),
        (qos.LOGS, "best_effort", "volatile", 20),
        (qos.SENSOR_STREAM, "best_effort", "volatile", 10),
        (qos.STATE, "reliable", "transient_local", 1),
    ],
)
def test_the_profiles_of_the_field(profile: QoS, reliability: str, durability: str, depth: int) -> None:
    assert profile.history is History.KEEP_LAST
    assert (profile.reliability, profile.durability, profile.depth) == (reliability, durability, depth)
    assert QoS(depth=depth, reliability=Reliability(reliability), durability=Durability(durability)) == profile


def test_the_hot_path_reads_plain_attributes() -> None:
    latched = qos.LATCHED

    assert (latched.depth, latched.limit, latched.keep_all) == (1, 1, False)
    assert latched.reliable
    assert latched.transient_local
    assert not qos.SENSOR_DATA.reliable
    assert not qos.SENSOR_DATA.transient_local


def test_a_number_stands_for_the_default_profile_with_that_depth() -> None:
    assert qos.of(3) == qos.DEFAULT.replace(depth=3)
    assert qos.of(qos.MAP) is qos.MAP


@pytest.mark.parametrize("wrong", ["10", 1.0, True, None])
def test_anything_else_is_refused(wrong: object) -> None:
    with pytest.raises(TypeError, match=r"a QoS or a depth.*: write 10, qos\.SENSOR_DATA or"):
        qos.of(wrong)  # type: ignore[arg-type]


def test_a_qos_without_history_and_depth_says_what_to_write() -> None:
    with pytest.raises(InvalidQoS, match=r"write QoS\(depth=10\)"):
        QoS()
    with pytest.raises(InvalidQoS, match="keep_last needs a depth"):
        QoS(history=History.KEEP_LAST)


def test_a_depth_of_zero_warns_and_keeps_one() -> None:
    with pytest.warns(QoSWarning, match="acts as depth 1"):
        made = QoS(depth=0)

    assert (made.depth, made.given_depth) == (1, 0)


def test_keep_all_is_bounded() -> None:
    unsaid = QoS(history=History.KEEP_ALL)
    small = QoS(history=History.KEEP_ALL, limit=3)

    assert unsaid.keep_all
    assert unsaid.limit == qos.KEEP_ALL_LIMIT
    assert small.limit == 3
    with pytest.raises(InvalidQoS, match="at least 1"):
        QoS(history=History.KEEP_ALL, limit=0)
    with pytest.raises(InvalidQoS, match="depth is the bound"):
        QoS(depth=3, limit=3)


def test_keep_all_with_best_effort_warns() -> None:
    with pytest.warns(QoSWarning, match="make it reliable"):
        QoS(history=History.KEEP_ALL, reliability=Reliability.BEST_EFFORT)


def test_replacing_one_policy_keeps_the_others() -> None:
    made = qos.MAP.replace(depth=4, deadline=0.5)

    assert (made.depth, made.durability, made.deadline) == (4, Durability.TRANSIENT_LOCAL, 0.5)
    assert made.replace(depth=1, deadline=None) == qos.MAP


def test_replacing_the_history_moves_the_bound() -> None:
    bounded = qos.DEFAULT.replace(history=History.KEEP_ALL, limit=7)

    assert bounded.replace(reliability=Reliability.RELIABLE).limit == 7
    assert bounded.replace(history=History.KEEP_LAST).limit == 10
    assert qos.DEFAULT.replace(history=History.KEEP_ALL).limit == qos.KEEP_ALL_LIMIT


def test_a_qos_never_changes() -> None:
    with pytest.raises(AttributeError, match=r"qos.replace\(depth=...\)"):
        qos.DEFAULT.depth = 3
    with pytest.raises(AttributeError):
        del qos.DEFAULT.depth
    assert qos.DEFAULT.depth == 10


def test_equal_policies_are_equal_values() -> None:
    assert {qos.DEFAULT: "found"}[QoS(depth=10)] == "found"
    assert qos.DEFAULT != qos.SENSOR_DATA
    assert qos.DEFAULT != 10


@pytest.mark.parametrize("name", qos.profile_names())
def test_a_profile_survives_pickle_copy_and_any_case(name: str) -> None:
    profile = qos.profile(name)

    assert pickle.loads(pickle.dumps(profile)) == profile
    assert copy.copy(profile) is copy.deepcopy(profile) is profile
    assert qos.profile(name.upper()) is profile


def test_an_unknown_profile_or_policy_lists_what_there_is() -> None:
    with pytest.raises(InvalidQoS, match="sensor_data"):
        qos.profile("sensors")
    with pytest.raises(InvalidQoS, match="best_effort"):
        Reliability.from_key("unreliable")
    with pytest.raises(InvalidQoS, match="best_effort"):
        QoS(depth=1, reliability="unreliable")  # type: ignore[arg-type]


def test_policies_may_be_given_as_their_short_keys() -> None:
    assert QoS(depth=1, reliability="best_effort") == QoS(depth=1, reliability=Reliability.BEST_EFFORT)  # type: ignore[arg-type]


@pytest.mark.parametrize("unspecified", [None, 0, 0.0])
def test_zero_durations_are_unspecified(unspecified: float | None) -> None:
    assert QoS(depth=1, deadline=unspecified, lifespan=unspecified, liveliness_lease=unspecified) == QoS(depth=1)


def test_an_infinite_duration_is_kept_as_said_and_means_unspecified_to_an_endpoint() -> None:
    endless = QoS(depth=1, deadline=math.inf, lifespan=math.inf, liveliness_lease=math.inf)

    assert "deadline infinite" in repr(endless)
    assert qos.compatible(qos.DEFAULT, endless).policies == ("deadline", "liveliness_lease_duration")
    assert qos.resolve_subscription(endless) == qos.resolve_subscription(QoS(depth=1))
    assert qos.compatible(qos.resolve_publisher(qos.DEFAULT), qos.resolve_subscription(endless)).level == "ok"


@pytest.mark.parametrize("wrong", [-1.0, math.nan])
def test_other_durations_are_refused(wrong: float) -> None:
    with pytest.raises(InvalidQoS, match="deadline is a time in seconds"):
        QoS(depth=1, deadline=wrong)


def test_the_repr_shows_what_differs_from_the_ordinary() -> None:
    made = qos.MAP.replace(deadline=0.1, liveliness=Liveliness.MANUAL_BY_TOPIC)

    assert repr(made) == "QoS(keep_last 1, reliable, transient_local, manual_by_topic, deadline 0.1 s)"
    assert repr(QoS(history=History.KEEP_ALL, limit=5)) == "QoS(keep_all up to 5, reliable, volatile)"
    assert "reliability system_default" in repr(qos.SYSTEM_DEFAULT)


def test_nine_of_sixteen_pairs_deliver() -> None:
    kinds = [
        QoS(depth=1, reliability=reliability, durability=durability)
        for reliability in (Reliability.RELIABLE, Reliability.BEST_EFFORT)
        for durability in (Durability.TRANSIENT_LOCAL, Durability.VOLATILE)
    ]
    delivering = [
        (offered, requested)
        for offered, requested in itertools.product(kinds, kinds)
        if qos.compatible(qos.resolve_publisher(offered), qos.resolve_subscription(requested))
    ]

    assert len(delivering) == 9
    for offered, requested in delivering:
        assert offered.reliable or not requested.reliable
        assert offered.transient_local or not requested.transient_local


def test_the_reason_names_the_policies_and_both_sides() -> None:
    verdict = qos.compatible(qos.SENSOR_DATA, qos.MAP.replace(deadline=0.1))

    assert verdict.level == "error"
    assert not verdict
    assert verdict.policies == ("reliability", "durability", "deadline")
    assert "reliability (offered best_effort, requested reliable)" in verdict.reason
    assert "deadline (offered unspecified, requested 0.1 s)" in verdict.reason
    assert verdict.event_policy == "DEADLINE"


def test_a_lease_is_reported_as_liveliness() -> None:
    verdict = qos.compatible(qos.DEFAULT, qos.DEFAULT.replace(liveliness_lease=1.0))

    assert verdict.policies == ("liveliness_lease_duration",)
    assert verdict.event_policy == "LIVELINESS"


def test_two_raw_default_profiles_are_a_doubt_and_two_endpoints_are_not() -> None:
    raw = qos.compatible(qos.DEFAULT, qos.DEFAULT)
    real = qos.compatible(qos.resolve_publisher(qos.DEFAULT), qos.resolve_subscription(qos.DEFAULT))

    assert (raw.level, raw.policies, raw.event_policy) == ("warning", ("liveliness",), "INVALID")
    assert raw
    assert real.level == "ok"


def test_one_nanosecond_decides_about_a_deadline() -> None:
    request = qos.DEFAULT.replace(deadline=1.0)

    assert qos.compatible(request, request)
    assert not qos.compatible(qos.DEFAULT.replace(deadline=1.000000001), request)


def test_best_available_takes_what_every_publisher_offers() -> None:
    mixed = [qos.MAP.replace(deadline=2.0), qos.SENSOR_DATA.replace(deadline=3.0)]
    resolved = qos.resolve_subscription(qos.BEST_AVAILABLE, mixed)

    assert (resolved.reliability, resolved.durability) == ("best_effort", "volatile")
    assert resolved.deadline == 3.0
    assert all(qos.compatible(qos.resolve_publisher(one), resolved) for one in mixed)


def test_best_available_of_a_publisher_suits_every_subscription_that_it_knows() -> None:
    requests = [
        qos.DEFAULT.replace(deadline=2.0, liveliness_lease=4.0),
        qos.SENSOR_DATA.replace(deadline=3.0, liveliness=Liveliness.MANUAL_BY_TOPIC),
    ]
    resolved = qos.resolve_publisher(qos.BEST_AVAILABLE, requests)

    assert (resolved.reliability, resolved.durability) == ("reliable", "transient_local")
    assert (resolved.liveliness, resolved.deadline, resolved.liveliness_lease) == ("manual_by_topic", 2.0, 4.0)
    assert all(qos.compatible(resolved, one) for one in requests)


def test_best_available_of_a_publisher_without_subscriptions_promises_no_times() -> None:
    resolved = qos.resolve_publisher(qos.BEST_AVAILABLE)

    assert (resolved.reliability, resolved.durability, resolved.liveliness) == (
        "reliable",
        "transient_local",
        "automatic",
    )
    assert (resolved.deadline, resolved.liveliness_lease) == (None, None)


def test_best_available_is_never_used_by_services() -> None:
    assert qos.resolve_service(qos.BEST_AVAILABLE) == qos.resolve_service(qos.SERVICES)


def test_system_default_is_resolved_to_one_reliable_message() -> None:
    resolved = qos.resolve_publisher(qos.SYSTEM_DEFAULT)

    assert resolved == QoS(depth=1, liveliness=Liveliness.AUTOMATIC)


@pytest.mark.parametrize("depth", [True, 2.0, "10"])
def test_a_depth_that_is_no_whole_number_is_refused(depth: object) -> None:
    with pytest.raises(TypeError, match="depth is a number of messages"):
        QoS(depth=depth)  # type: ignore[arg-type]


def test_a_duration_that_follows_the_other_side_says_so() -> None:
    assert "best_available" in repr(QoS(depth=1, deadline=BEST_AVAILABLE_DURATION))


def test_what_is_odd_about_a_profile_is_said_to_who_wrote_it_and_not_again_to_who_uses_it() -> None:
    with pytest.warns(QoSWarning, match="KEEP_ALL with best_effort"):
        odd = QoS(history=History.KEEP_ALL, limit=2, reliability=Reliability.BEST_EFFORT)
    assert qos.resolve_subscription(odd, []).liveliness is Liveliness.AUTOMATIC
