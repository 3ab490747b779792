"""The options of quality of service, and how a subscription fits itself to the publishers that are there."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from cli.parsing import natural, positive_float

if TYPE_CHECKING:
    from actors import QoS

_PROFILES = (
    "default",
    "sensor_data",
    "services_default",
    "parameters",
    "parameter_events",
    "system_default",
    "best_available",
    "rosout_default",
    "clock",
)


def add_qos_options(parser: argparse.ArgumentParser, what: str, profile: str) -> None:
    """The options of a publisher or subscription; `profile` counts where nothing is said."""
    group = parser.add_argument_group("quality of service")

    def add(policy: str, *choices: str, help: str = "") -> None:
        names = ", ".join(choices)
        group.add_argument(f"--qos-{policy}", choices=choices, metavar=policy.upper(), help=help or names)

    add("profile", *_PROFILES, help=f"of the {what} ({profile}): {', '.join(_PROFILES)}")
    group.add_argument("--qos-depth", type=natural, metavar="N", help="how many messages its queue keeps")
    add("history", "system_default", "keep_last", "keep_all", "unknown")
    add("reliability", "system_default", "reliable", "best_effort", "unknown", "best_available")
    add("durability", "system_default", "transient_local", "volatile", "unknown", "best_available")
    add("liveliness", "system_default", "automatic", "manual_by_topic", "unknown", "best_available")
    group.add_argument("--qos-liveliness-lease-duration-seconds", type=positive_float, metavar="S")


def stated_qos(options: argparse.Namespace, default: QoS) -> QoS:
    """What the options say; where they say nothing, their profile, or `default`."""
    from actors import qos

    chosen = default if options.qos_profile is None else qos.profile(options.qos_profile)
    return chosen.replace(**_stated(options))


def _stated(options: argparse.Namespace) -> Any:
    from actors import qos

    stated: dict[str, Any] = {}
    for policy, kind in (
        ("history", qos.History),
        ("reliability", qos.Reliability),
        ("durability", qos.Durability),
        ("liveliness", qos.Liveliness),
    ):
        value = getattr(options, f"qos_{policy}")
        if value is not None:
            stated[policy] = kind.from_key(value)
    if options.qos_depth is not None:
        stated["depth"] = options.qos_depth
    if options.qos_liveliness_lease_duration_seconds is not None:
        stated["liveliness_lease"] = options.qos_liveliness_lease_duration_seconds
    return stated


def fitting_qos(offered: Sequence[QoS], options: argparse.Namespace) -> QoS:
    """Sensor data's quality of service; reliable or transient local if all publishers are. What the options say counts more."""
    from actors import qos

    fitting: dict[str, Any] = {}
    if options.qos_profile is None:
        if offered and all(each.reliable for each in offered):
            fitting["reliability"] = qos.Reliability.RELIABLE
        if offered and all(each.transient_local for each in offered):
            fitting["durability"] = qos.Durability.TRANSIENT_LOCAL
    return stated_qos(options, qos.SENSOR_DATA.replace(**fitting))


def objections(offered: Sequence[tuple[str, QoS]], wanted: QoS) -> list[str]:
    """A line for each publisher, given by its node, from which a subscription gets nothing, with the flag that mends it."""
    from actors import qos

    lines: list[str] = []
    for node, offer in offered:
        verdict = qos.compatible(offer, wanted)
        if not verdict:
            flags = [f"--qos-{each} {getattr(offer, each)}" for each in ("reliability", "durability", "liveliness")
                     if each in verdict.policies]  # fmt: skip
            remedy = f": use {' '.join(flags)}" if flags else ""
            lines.append(f"nothing comes from {node}, {verdict.reason}{remedy}")
    return lines
