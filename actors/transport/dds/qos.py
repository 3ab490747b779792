"""Quality of service, between this library and Cyclone DDS."""

from __future__ import annotations

import ctypes as c
from collections.abc import Generator
from contextlib import contextmanager
from typing import Any, Final

from actors.transport.dds.format.qos import EndpointQos
from actors.transport.dds.library import DURATION_INFINITE, Library

POLICIES: Final = {
    2: "DURABILITY", 3: "PRESENTATION", 4: "DEADLINE", 5: "LATENCY_BUDGET", 6: "OWNERSHIP", 8: "LIVELINESS", 10: "PARTITION", 11: "RELIABILITY",
    12: "DESTINATION_ORDER", 21: "LIFESPAN", 24: "TYPE", 25: "DATA_REPRESENTATION",
}  # fmt: skip
"""The policies by which a writer and a reader may not fit each other, by the numbers that Cyclone DDS gives them."""

_UNLIMITED: Final = -1
_DEPTH_MOST: Final = 2**31 - 1


@contextmanager
def the_qos(library: Library, qos: EndpointQos) -> Generator[int]:
    """`qos` as `rmw_cyclonedds` sets it, for as long as the context lasts. But no write ever waits for room: it fails at once."""
    made: int = library.dds_create_qos()
    try:
        history = (1, _UNLIMITED) if qos.keep_all else (0, min(qos.depth, _DEPTH_MOST))
        library.dds_qset_writer_data_lifecycle(made, False)
        library.dds_qset_ignorelocal(made, 1)
        library.dds_qset_history(made, *history)
        library.dds_qset_reliability(made, int(qos.reliable), 0)
        if qos.transient_local:
            library.dds_qset_durability(made, 1)
            library.dds_qset_durability_service(made, 0, *history, _UNLIMITED, _UNLIMITED, _UNLIMITED)
        else:
            library.dds_qset_durability(made, 0)
        if qos.lifespan is not None:
            library.dds_qset_lifespan(made, _nanoseconds(qos.lifespan))
        if qos.deadline is not None:
            library.dds_qset_deadline(made, _nanoseconds(qos.deadline))
        library.dds_qset_liveliness(made, 2 if qos.manual_liveliness else 0, _nanoseconds(qos.lease))
        library.dds_qset_userdata(made, qos.user_data, len(qos.user_data))
        yield made
    finally:
        library.dds_delete_qos(made)


def read_qos(library: Library, qos: int | None) -> EndpointQos:
    """The quality of service that another process has announced. What it does not tell is as in `EndpointQos`, but best effort."""
    if not qos:
        return EndpointQos(reliable=False)
    reliability, durability, history, depth, liveliness = (c.c_int(0) for _ in range(5))
    depth.value = 1
    library.dds_qget_reliability(qos, c.byref(reliability), None)
    library.dds_qget_durability(qos, c.byref(durability))
    library.dds_qget_history(qos, c.byref(history), c.byref(depth))
    lease = c.c_int64(DURATION_INFINITE)
    library.dds_qget_liveliness(qos, c.byref(liveliness), c.byref(lease))
    return EndpointQos(
        reliable=reliability.value == 1,
        transient_local=durability.value >= 1,
        keep_all=history.value == 1,
        depth=max(depth.value, 1),
        deadline=_seconds(_asked(library.dds_qget_deadline, qos)),
        lifespan=_seconds(_asked(library.dds_qget_lifespan, qos)),
        manual_liveliness=liveliness.value == 2,
        lease=_seconds(lease.value),
        user_data=read_user_data(library, qos),
    )


def read_user_data(library: Library, qos: int | None) -> bytes:
    """The USER_DATA of a participant or endpoint, which the protocol bounds at 64 KiB."""
    where, size = c.c_void_p(), c.c_size_t()
    if not qos or not library.dds_qget_userdata(qos, c.byref(where), c.byref(size)) or not where:
        return b""
    try:
        return c.string_at(where, size.value)
    finally:
        library.dds_free(where)


def read_property(library: Library, qos: int | None, name: bytes) -> str:
    """What a participant tells of itself by that name, at most 256 characters; empty if it tells nothing."""
    where = c.c_void_p()
    if not qos or not library.dds_qget_prop(qos, name, c.byref(where)) or not where:
        return ""
    try:
        return c.string_at(where)[:256].decode(errors="replace")
    finally:
        library.dds_free(where)


def _asked(getter: Any, qos: int) -> int:
    duration = c.c_int64(DURATION_INFINITE)
    getter(qos, c.byref(duration))
    return duration.value


def _nanoseconds(seconds: float | None) -> int:
    return DURATION_INFINITE if seconds is None else min(round(seconds * 1e9), DURATION_INFINITE)


def _seconds(nanoseconds: int) -> float | None:
    return None if nanoseconds == DURATION_INFINITE else nanoseconds / 1e9
