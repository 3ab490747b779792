"""Offered quality of service as the YAML text that rosbag2 keeps for each topic."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Final, TypeVar

from actors.bag.yaml_text import load_yaml
from actors.qos import InvalidQoS, resolve_publisher
from actors.qos.policies import Durability, History, Liveliness, Policy, QoS, Reliability

P = TypeVar("P", bound=Policy)

FOREVER: Final = (9_223_372_036, 854_775_807)
"""The seconds and nanoseconds that stand for an unspecified duration (RMW_DURATION_INFINITE)."""

_NUMBERED: Final[Mapping[type[Policy], tuple[Policy, ...]]] = {
    History: (History.SYSTEM_DEFAULT, History.KEEP_LAST, History.KEEP_ALL, History.UNKNOWN),
    Reliability: (
        Reliability.SYSTEM_DEFAULT,
        Reliability.RELIABLE,
        Reliability.BEST_EFFORT,
        Reliability.UNKNOWN,
        Reliability.BEST_AVAILABLE,
    ),
    Durability: (
        Durability.SYSTEM_DEFAULT,
        Durability.TRANSIENT_LOCAL,
        Durability.VOLATILE,
        Durability.UNKNOWN,
        Durability.BEST_AVAILABLE,
    ),
    Liveliness: (
        Liveliness.SYSTEM_DEFAULT,
        Liveliness.AUTOMATIC,
        Liveliness.UNKNOWN,
        Liveliness.MANUAL_BY_TOPIC,
        Liveliness.UNKNOWN,
        Liveliness.BEST_AVAILABLE,
    ),
}
"""The policies by the numbers of rmw, which bags of older versions have instead of words."""

_POLICIES: Final[Mapping[str, type[Policy]]] = {
    "history": History,
    "reliability": Reliability,
    "durability": Durability,
    "liveliness": Liveliness,
}
_DURATIONS: Final = {
    "deadline": "deadline",
    "lifespan": "lifespan",
    "liveliness_lease_duration": "liveliness_lease",
}
_IGNORED: Final = "avoid_ros_namespace_conventions"


def qos_profiles_text(offered: Iterable[QoS]) -> str:
    """The QoS offered by the publishers of a topic, as the YAML text of rosbag2's metadata, version 9."""
    return "".join(_profile_text(resolve_publisher(qos)) for qos in offered)


def parse_qos_profiles(text: str) -> tuple[QoS, ...]:
    """The profiles in such a text, of any version of rosbag2. Raises `InvalidQoS` for what is none."""
    try:
        listed: object = load_yaml(text) or []
    except ValueError as error:
        raise InvalidQoS(f"the quality of service of a topic cannot be read: {error}") from None
    if not isinstance(listed, list):
        raise InvalidQoS(f"the quality of service of a topic is a list of profiles, not {listed!r:.60}")
    return tuple(qos_from_mapping(one) for one in listed)  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]


def qos_from_mapping(profile: Mapping[str, object]) -> QoS:
    """One profile, from its policies by name; what is left out is as in `QoS`. Raises `InvalidQoS`."""
    if not isinstance(profile, Mapping):  # pyright: ignore[reportUnnecessaryIsInstance]  # it comes from a file
        raise InvalidQoS(f"a profile is a mapping of policies, not {profile!r:.60}")
    given: dict[str, Any] = {}
    for name, value in profile.items():
        if name in _POLICIES:
            given[name] = _policy(_POLICIES[name], value)
        elif name in _DURATIONS:
            given[_DURATIONS[name]] = _seconds(name, value)
        elif name == "depth":
            given[name] = value
        elif name != _IGNORED:
            raise InvalidQoS(
                f"{name!r} is no policy of a profile; there are {', '.join([*_POLICIES, 'depth', *_DURATIONS])}"
            )
    if given.get("history") is History.KEEP_ALL:
        given.pop("depth", None)
    if given.get("depth") == 0 and given.get("history") is not History.SYSTEM_DEFAULT:
        given["depth"] = 1  # as it acts
    if "depth" not in given and "history" not in given:
        given["depth"] = 10
    try:
        return QoS(**given)
    except TypeError as error:
        raise InvalidQoS(str(error)) from None


def _policy(kind: type[P], value: object) -> P:
    if isinstance(value, int):
        known = _NUMBERED[kind]
        if not 0 <= value < len(known):
            raise InvalidQoS(f"{value} is no number of a {kind.__name__.lower()} policy")
        return kind(known[value])
    return kind.from_key(str(value))


def _seconds(name: str, value: object) -> float | None:
    if not isinstance(value, Mapping) or not {"sec", "nsec"} <= set(value):  # pyright: ignore[reportUnknownArgumentType]
        raise InvalidQoS(f"{name} is given by sec and nsec, not {value!r:.60}")
    sec, nsec = int(value["sec"]), int(value["nsec"])  # pyright: ignore[reportUnknownArgumentType]
    if sec < 0 or nsec < 0:
        raise InvalidQoS(f"{name} cannot be negative: {value!r:.60}")
    whole = sec * 1_000_000_000 + nsec
    return None if whole == 0 or sec >= FOREVER[0] else whole / 1e9


def _profile_text(qos: QoS) -> str:
    lines = [f"- history: {qos.history}", f"  depth: {qos.given_depth}"]
    lines += [f"  reliability: {qos.reliability}", f"  durability: {qos.durability}"]
    lines += [*_duration_lines("deadline", qos.deadline), *_duration_lines("lifespan", qos.lifespan)]
    lines += [f"  liveliness: {qos.liveliness}", *_duration_lines("liveliness_lease_duration", qos.liveliness_lease)]
    return "\n".join([*lines, "  avoid_ros_namespace_conventions: false\n"])


def _duration_lines(name: str, seconds: float | None) -> list[str]:
    sec, nsec = FOREVER if seconds is None else divmod(round(seconds * 1e9), 1_000_000_000)
    return [f"  {name}:", f"    sec: {sec}", f"    nsec: {nsec}"]
