"""A profile of ROS as the policies of a reader or writer of DDS, and back.

A writer that keeps samples (TRANSIENT_LOCAL) keeps them for late readers to the same depth: its durability service has its history, and no
other limit. Writers do not dispose of their instances when they end (autodispose is off).
"""

from __future__ import annotations

import warnings
from functools import lru_cache
from typing import Final, NamedTuple

from actors.qos.policies import BEST_AVAILABLE_DURATION, Durability, History, Liveliness, QoS, QoSWarning, Reliability

INFINITE: Final = 2**63 - 1
"""The nanoseconds of an infinite duration in DDS."""
_SECOND: Final = 10**9
_DEEPEST: Final = 2**31 - 1


class DdsQos(NamedTuple):
    """The policies that ROS sets. Durations are in nanoseconds; all others have the defaults of DDS."""

    reliable: bool
    transient_local: bool
    depth: int | None
    """That of KEEP_LAST; None for KEEP_ALL, which is without a limit."""
    deadline: int = INFINITE
    lifespan: int = INFINITE
    manual: bool = False
    """Whether liveliness is MANUAL_BY_TOPIC and not AUTOMATIC."""
    lease: int = INFINITE


@lru_cache(maxsize=1024)
def write_qos(qos: QoS) -> DdsQos:
    """Return the policies for a profile. Never raises.

    As in ROS 2, ``system_default`` is reliable, volatile, KEEP_LAST and automatic, and a depth of 0 is 1. ``best_available`` has to be
    resolved before; without it is taken as ``system_default``. ``limit`` concerns only this process.
    """
    return DdsQos(
        reliable=qos.reliable,
        transient_local=qos.transient_local,
        depth=None if qos.keep_all else min(qos.depth, _DEEPEST),
        deadline=_nanoseconds(qos.deadline),
        lifespan=_nanoseconds(qos.lifespan),
        manual=qos.liveliness is Liveliness.MANUAL_BY_TOPIC,
        lease=_nanoseconds(qos.liveliness_lease),
    )


def _nanoseconds(seconds: float | None) -> int:
    if seconds is None or seconds == BEST_AVAILABLE_DURATION or seconds * _SECOND >= INFINITE:
        return INFINITE
    return max(round(seconds * _SECOND), 1)


@lru_cache(maxsize=1024)
def parse_qos(qos: DdsQos, *, history_known: bool = True) -> QoS:
    """Return the profile of these policies, as ROS 2 shows it. Never raises.

    Fast DDS does not send its history: with `history_known` False it is ``unknown``.
    """
    history = History.KEEP_ALL if qos.depth is None else History.KEEP_LAST
    with warnings.catch_warnings():  # the user of this process cannot change a peer's profile
        warnings.simplefilter("ignore", QoSWarning)
        return QoS(
            history=history if history_known else History.UNKNOWN,
            depth=None if qos.depth is None and history_known else max(qos.depth or 1, 1),
            reliability=Reliability.RELIABLE if qos.reliable else Reliability.BEST_EFFORT,
            durability=Durability.TRANSIENT_LOCAL if qos.transient_local else Durability.VOLATILE,
            deadline=_seconds(qos.deadline),
            lifespan=_seconds(qos.lifespan),
            liveliness=Liveliness.MANUAL_BY_TOPIC if qos.manual else Liveliness.AUTOMATIC,
            liveliness_lease=_seconds(qos.lease),
        )


def _seconds(nanoseconds: int) -> float | None:
    return nanoseconds / _SECOND if 0 < nanoseconds < INFINITE else None
