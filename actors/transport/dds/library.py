"""The C library of Cyclone DDS, as the package `cyclonedds` brings it.

The classes of that package serialize by its own types, which it announces, and hold the interpreter while a full writer waits. Therefore this
module calls the same library as they do: its public functions, and those of its serialized data, which carry bytes that another has encoded.
"""

from __future__ import annotations

import ctypes as c
import sys
from functools import cache
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Final

from actors.transport.protocol import WireUnavailable

_ERRORS: Final = 0x3
"""What the library writes to the standard error stream: errors, but no warnings, a line of which each malformed packet of a stranger would be.
`Tracing` in CYCLONEDDS_URI is another matter."""

ANY_STATE: Final = 0x7F
"""Samples read and unread, of instances new and old, alive and not."""
DURATION_INFINITE: Final = 2**63 - 1
TIMEOUT: Final = -10

DATA_AVAILABLE: Final = 1 << 8
_RESTRICT_REPRESENTATION: Final = 1 << 7
_XCDR1: Final = 1 << 0
_ONE_BYTE: Final = (0x01010000, 0, 0)
"""The type of all topics: a structure that begins with one byte, as every message of ROS 2 does. The library checks only that; it neither
looks at nor drops what follows. No type information is announced, as `rmw_cyclonedds` announces none: readers and writers match by name."""


def _memory(base: object) -> list[tuple[str, Any]]:
    """The fields of `ddsrt_iovec_t`: those of the system's sockets."""
    windows = sys.platform == "win32"
    fields = [("base", base), ("length", c.c_uint32 if windows else c.c_size_t)]
    return fields[::-1] if windows else fields


class Vector(c.Structure):
    """A piece of memory that Python owns."""

    _fields_ = _memory(c.c_char_p)


class Region(c.Structure):
    """The same, of memory that the library owns."""

    _fields_ = _memory(c.c_void_p)


class SampleInfo(c.Structure):
    """What the library tells of a sample."""

    _fields_ = [
        ("sample_state", c.c_uint), ("view_state", c.c_uint), ("instance_state", c.c_uint), ("valid", c.c_bool),
        ("stamp", c.c_int64), ("instance", c.c_uint64), ("publication", c.c_uint64),
        ("disposed", c.c_uint32), ("without_writers", c.c_uint32), ("rank", c.c_uint32), ("generation", c.c_uint32), ("absolute", c.c_uint32),
    ]  # fmt: skip


class BuiltinParticipant(c.Structure):
    """A sample of DCPSParticipant."""

    _fields_ = [("key", c.c_ubyte * 16), ("qos", c.c_void_p)]


class BuiltinEndpoint(c.Structure):
    """A sample of DCPSPublication or DCPSSubscription."""

    _fields_ = [
        ("key", c.c_ubyte * 16), ("participant", c.c_ubyte * 16), ("participant_instance", c.c_uint64),
        ("topic", c.c_void_p), ("type", c.c_void_p), ("qos", c.c_void_p),
    ]  # fmt: skip


class Status(c.Structure):
    """Any of the statuses of an endpoint: a total and its change come first in each."""

    _fields_ = [
        ("total", c.c_int32),
        ("change", c.c_int32),
        ("third", c.c_int32),
        ("fourth", c.c_int32),
        ("last", c.c_uint64),
    ]


class _Serialized(c.Structure):
    _fields_ = [("data", c.c_void_p), ("size", c.c_uint32)]


class _Descriptor(c.Structure):
    _fields_ = [
        ("size", c.c_uint32), ("align", c.c_uint32), ("flags", c.c_uint32), ("keys_count", c.c_uint32), ("name", c.c_char_p), ("keys", c.c_void_p),
        ("operations_count", c.c_uint32), ("operations", c.c_void_p), ("meta", c.c_char_p),
        ("information", _Serialized), ("mapping", _Serialized), ("representations", c.c_uint32),
    ]  # fmt: skip


_operations: Final = (c.c_uint32 * len(_ONE_BYTE))(*_ONE_BYTE)


def the_descriptor(type_name: str) -> Any:
    """What the library must know of a type: hardly more than its name."""
    return _Descriptor(
        size=1,
        align=1,
        flags=_RESTRICT_REPRESENTATION,
        name=type_name.encode(),
        operations_count=len(_ONE_BYTE),
        operations=c.addressof(_operations),
        meta=b"",
        representations=_XCDR1,
    )


_P, _E, _D, _I, _H = c.c_void_p, c.c_int32, c.c_int64, c.c_int, c.c_uint64
_FUNCTIONS: Final[dict[str, tuple[object, ...]]] = {  # what a function returns, and what it takes
    "dds_set_log_mask": (None, c.c_uint32),
    "dds_strretcode": (c.c_char_p, _E),
    "dds_create_domain": (_E, c.c_uint32, c.c_char_p),
    "dds_create_participant": (_E, c.c_uint32, _P, _P),
    "dds_create_topic": (_E, _E, _P, c.c_char_p, _P, _P),
    "dds_create_writer": (_E, _E, _E, _P, _P),
    "dds_create_reader": (_E, _E, _E, _P, _P),
    "dds_create_waitset": (_E, _E),
    "dds_delete": (_E, _E),
    "dds_get_guid": (_E, _E, _P),
    "dds_get_instance_handle": (_E, _E, _P),
    "dds_get_entity_sertype": (_E, _E, _P),
    "dds_set_status_mask": (_E, _E, c.c_uint32),
    "dds_get_status_changes": (_E, _E, _P),
    "dds_waitset_attach": (_E, _E, _E, c.c_ssize_t),
    "dds_waitset_detach": (_E, _E, _E),
    "dds_waitset_set_trigger": (_E, _E, c.c_bool),
    "dds_waitset_wait": (_E, _E, _P, c.c_size_t, _D),
    "dds_take": (_E, _E, _P, _P, c.c_size_t, c.c_uint32),
    "dds_return_loan": (_E, _E, _P, _E),
    "dds_takecdr": (_E, _E, _P, c.c_uint32, _P, c.c_uint32),
    "dds_writecdr": (_E, _E, _P),
    "dds_wait_for_acks": (_E, _E, _D),
    "dds_assert_liveliness": (_E, _E),
    "dds_get_matched_subscriptions": (_E, _E, _P, c.c_size_t),
    "dds_get_matched_publications": (_E, _E, _P, c.c_size_t),
    "dds_get_matched_subscription_data": (_P, _E, _H),
    "dds_get_matched_publication_data": (_P, _E, _H),
    "dds_builtintopic_free_endpoint": (None, _P),
    "dds_get_publication_matched_status": (_E, _E, _P),
    "dds_get_subscription_matched_status": (_E, _E, _P),
    "dds_get_offered_incompatible_qos_status": (_E, _E, _P),
    "dds_get_requested_incompatible_qos_status": (_E, _E, _P),
    "dds_get_offered_deadline_missed_status": (_E, _E, _P),
    "dds_get_requested_deadline_missed_status": (_E, _E, _P),
    "dds_get_liveliness_lost_status": (_E, _E, _P),
    "dds_get_liveliness_changed_status": (_E, _E, _P),
    "dds_get_sample_lost_status": (_E, _E, _P),
    "ddsi_serdata_from_ser_iov": (_P, _P, _I, c.c_size_t, _P, c.c_size_t),
    "ddsi_serdata_size": (c.c_uint32, _P),
    "ddsi_serdata_to_ser": (None, _P, c.c_size_t, c.c_size_t, _P),
    "ddsi_serdata_to_ser_ref": (_P, _P, c.c_size_t, c.c_size_t, _P),
    "ddsi_serdata_to_ser_unref": (None, _P, _P),
    "ddsi_serdata_ref": (_P, _P),
    "ddsi_serdata_unref": (None, _P),
    "dds_create_qos": (_P,),
    "dds_delete_qos": (None, _P),
    "dds_free": (None, _P),
    "dds_qset_reliability": (None, _P, _I, _D),
    "dds_qset_history": (None, _P, _I, _E),
    "dds_qset_durability": (None, _P, _I),
    "dds_qset_durability_service": (None, _P, _D, _I, _E, _E, _E, _E),
    "dds_qset_lifespan": (None, _P, _D),
    "dds_qset_deadline": (None, _P, _D),
    "dds_qset_liveliness": (None, _P, _I, _D),
    "dds_qset_ignorelocal": (None, _P, _I),
    "dds_qset_writer_data_lifecycle": (None, _P, c.c_bool),
    "dds_qset_userdata": (None, _P, c.c_char_p, c.c_size_t),
    "dds_qget_reliability": (c.c_bool, _P, _P, _P),
    "dds_qget_history": (c.c_bool, _P, _P, _P),
    "dds_qget_durability": (c.c_bool, _P, _P),
    "dds_qget_lifespan": (c.c_bool, _P, _P),
    "dds_qget_deadline": (c.c_bool, _P, _P),
    "dds_qget_liveliness": (c.c_bool, _P, _P, _P),
    "dds_qget_userdata": (c.c_bool, _P, _P, _P),
    "dds_qget_prop": (c.c_bool, _P, c.c_char_p, _P),
}
_QUICK: Final = (
    "dds_get_status_changes",
    "dds_takecdr",
    "dds_writecdr",
    "ddsi_serdata_from_ser_iov",
    "ddsi_serdata_size",
    "ddsi_serdata_to_ser",
    "ddsi_serdata_to_ser_ref",
    "ddsi_serdata_to_ser_unref",
    "ddsi_serdata_unref",
)


class Library:
    """The functions of the library.

    Those of `quick` keep the interpreter, because to give it away and to get it back takes longer than they do. None of them waits, calls
    Python, or takes a lock under which the library would; the others let Python's other threads run.
    """

    def __init__(self, path: str, handle: int) -> None:
        released, kept = c.CDLL(path, handle=handle), c.PyDLL(path, handle=handle)
        for name in _FUNCTIONS:
            setattr(self, name, _declared(released, name))
        self.quick: Any = SimpleNamespace(**{name: _declared(kept, name) for name in _QUICK})

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...


def _declared(library: c.CDLL, name: str) -> object:
    function = getattr(library, name)
    function.restype, *function.argtypes = _FUNCTIONS[name]
    return function


@cache
def load() -> Library:
    """The library. Raises WireUnavailable if it is not installed, or too old or new."""
    try:
        from cyclonedds.internal import DDS
    except Exception as error:  # its loader raises an exception of its own
        raise WireUnavailable(
            f"DDS needs the package cyclonedds, which cannot be imported ({error}): pip install 'robactor[dds]'"
        ) from error
    handle = DDS._dll_handle  # pyright: ignore[reportPrivateUsage]  # the library that the wheel has loaded
    try:
        library = Library(handle._name, handle._handle)
    except AttributeError as error:
        raise WireUnavailable(
            f"the installed cyclonedds lacks a function ({error}): pip install 'cyclonedds>=11,<12'"
        ) from error
    library.dds_set_log_mask(_ERRORS)
    return library


def reason(code: int) -> str:
    """What a negative return code means, in a few words."""
    text: bytes = load().dds_strretcode(code)
    return text.decode(errors="replace")
