"""A profile of ROS as the policies of a reader or writer of DDS, and back.

A writer that keeps samples (TRANSIENT_LOCAL) keeps them for late readers to the same depth: its durability service has its history, and no
other limit. Writers do not dispose of their instances when they end (autodispose is off).
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from actors.qos.policies import BEST_AVAILABLE_DURATION, Durability, History, Liveliness, QoS, QoSWarning, Reliability

_SHORTEST: Final = 1e-9
_LONGEST: Final = 9.2e9
"""Seconds; what is longer is infinite in the 64 bits of DDS."""


@dataclass(frozen=True, slots=True)
class EndpointQos:
    """The policies that ROS sets, and USER_DATA; all others have the defaults of DDS. Durations are in seconds; None: infinite, or not given."""

    reliable: bool = True
    transient_local: bool = False
    keep_all: bool = False
    depth: int = 1
    """That of KEEP_LAST."""
    deadline: float | None = None
    lifespan: float | None = None
    manual_liveliness: bool = False
    """MANUAL_BY_TOPIC instead of AUTOMATIC."""
    lease: float | None = None
    user_data: bytes = b""


def write_qos(qos: QoS, user_data: bytes = b"") -> EndpointQos:
    """Return the policies for a profile. Never raises.

    As in ROS 2, ``system_default`` is reliable, volatile, KEEP_LAST and automatic, and a depth of 0 is 1. ``best_available`` has to be
    resolved before; without it is taken as ``system_default``. ``limit`` concerns only this process.
    """
    return EndpointQos(
        reliable=qos.reliable,
        transient_local=qos.transient_local,
        keep_all=qos.keep_all,
        depth=qos.depth,
        deadline=_written(qos.deadline),
        lifespan=_written(qos.lifespan),
        manual_liveliness=qos.liveliness is Liveliness.MANUAL_BY_TOPIC,
        lease=_written(qos.liveliness_lease),
        user_data=user_data,
    )


def _written(seconds: float | None) -> float | None:
    if seconds is None or seconds == BEST_AVAILABLE_DURATION or seconds > _LONGEST:
        return None
    return max(seconds, _SHORTEST)


@lru_cache(maxsize=1024)
def parse_qos(qos: EndpointQos, *, history_known: bool = True) -> QoS:
    """Return the profile of these policies, as ROS 2 shows it. Never raises.

    Fast DDS does not send its history: with `history_known` False it is ``unknown``.
    """
    history = History.KEEP_ALL if qos.keep_all else History.KEEP_LAST
    with warnings.catch_warnings():  # the user of this process cannot change a peer's profile
        warnings.simplefilter("ignore", QoSWarning)
        return QoS(
            history=history if history_known else History.UNKNOWN,
            depth=None if qos.keep_all and history_known else max(qos.depth, 1),
            reliability=Reliability.RELIABLE if qos.reliable else Reliability.BEST_EFFORT,
            durability=Durability.TRANSIENT_LOCAL if qos.transient_local else Durability.VOLATILE,
            deadline=_parsed(qos.deadline),
            lifespan=_parsed(qos.lifespan),
            liveliness=Liveliness.MANUAL_BY_TOPIC if qos.manual_liveliness else Liveliness.AUTOMATIC,
            liveliness_lease=_parsed(qos.lease),
        )


def _parsed(seconds: float | None) -> float | None:
    return seconds if seconds is not None and 0 < seconds <= _LONGEST else None
