"""Zenoh's publishers and subscribers for a `Delivery`, declared as `rmw_zenoh` declares them, so that late joiners of ROS 2 get the history."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Final

from actors.transport.keyed.protocol import BULK, Delivery
from actors.transport.zenoh import objects
from actors.transport.zenoh.contact import Source
from actors.transport.zenoh.library import bare, direct, import_ext, import_zenoh
from actors.transport.zenoh.outlets import Publishers

_PATIENCE: Final = 5.0
"""Seconds within which a publisher must tell what it keeps."""

_PRIORITIES: Final = (
    "REAL_TIME",
    "INTERACTIVE_HIGH",
    "INTERACTIVE_LOW",
    "DATA_HIGH",
    "DATA",
    "DATA_LOW",
    "BACKGROUND",
)


def declare_publishers(session: objects.Session, key: str, delivery: Delivery, thin_links: bool) -> Publishers:
    """What an outlet sends with. With history it is an advanced publisher, which keeps samples and answers those who come later."""
    zenoh, ext = import_zenoh(), import_ext()
    # One that is kept is not dropped on the way either: nothing would tell those who listen that it was the last one.
    promised = delivery.reliable and bool(delivery.keep_all or delivery.history)
    blocks = promised or (thin_links and delivery.priority >= BULK)
    settings: dict[str, object] = {
        "congestion_control": zenoh.CongestionControl.BLOCK if blocks else zenoh.CongestionControl.DROP,
        # Zenoh drops what is sent with best effort, even if it is to block.
        "reliability": zenoh.Reliability.RELIABLE if delivery.reliable or blocks else zenoh.Reliability.BEST_EFFORT,
        "priority": getattr(zenoh.Priority, _PRIORITIES[delivery.priority - 1]),
        "express": delivery.express,
        "allowed_destination": zenoh.Locality.REMOTE,
    }
    plain = session.declare_publisher(key, **settings)
    if not delivery.history:
        return Publishers(plain, plain, blocks)
    # Without a heartbeat: it is a task of Zenoh's, and to undeclare the publisher waits for its end with Python's lock held. The thread that
    # would end it may be waiting for that lock, in a callback: then the process hangs for good.
    misses = ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=None)
    advanced = ext.declare_advanced_publisher(
        session,
        key,
        cache=ext.CacheConfig(max_samples=delivery.history),
        publisher_detection=True,
        sample_miss_detection=misses if delivery.reliable else None,
        **settings,
    )
    return Publishers(plain, advanced, blocks)


def declare_subscriber(
    session: objects.Session, key: str, delivery: Delivery, arrived: Callable[[objects.Sample], None]
) -> objects.Declared:
    """A subscriber that calls `arrived` on Zenoh's threads. With history it asks advanced publishers for it, older and later ones."""
    zenoh, ext = import_zenoh(), import_ext()
    remote = zenoh.Locality.REMOTE
    if not delivery.history:
        return session.declare_subscriber(key, bare(arrived), allowed_origin=remote)
    recovery = ext.RecoveryConfig(periodic_queries=None, heartbeat=True)
    subscriber: objects.Declared = ext.declare_advanced_subscriber(
        session,
        key,
        bare(arrived),
        allowed_origin=remote,
        history=ext.HistoryConfig(detect_late_publishers=True, max_samples=delivery.history),
        recovery=recovery if delivery.reliable else None,
        subscriber_detection=True,
    )
    return subscriber


def ask_history(
    session: objects.Session,
    key: str,
    most: int,
    source: Source,
    answered: Callable[[objects.Reply], None],
    complete: Callable[[], None],
) -> None:
    """Ask one advanced publisher for the last `most` samples that it keeps. `complete` is called in any case; both on Zenoh's threads."""
    zenoh = import_zenoh()

    with suppress(zenoh.ZError):  # the session has been closed; `complete` is called nevertheless
        session.get(
            f"{key}/@adv/pub/{source[0]}/{source[1]}/**?_max={most};_anyke",
            direct(answered, complete),
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=_PATIENCE,
            allowed_destination=zenoh.Locality.REMOTE,
        )
