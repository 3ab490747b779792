"""Messages as bytes: the layout where it is easily got wrong, and bytes that lie."""

from __future__ import annotations

import struct
import tracemalloc
from typing import Any

import numpy as np
import pytest

from actors.interfaces import CdrError, MessageTypeError, decode, encode, load
from actors.interfaces.geometry_msgs.msg import Point, Polygon, PoseArray, Twist
from actors.interfaces.rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, ParameterValue
from actors.interfaces.sensor_msgs.msg import Image, JointState
from actors.interfaces.std_msgs.msg import Bool, Byte, Empty, Float32, Header, Int32, String, UInt8MultiArray
from actors.interfaces.std_srvs.srv import SetBool, Trigger
from actors.interfaces.unique_identifier_msgs.msg import UUID

LITTLE, BIG = bytes.fromhex("00010000"), bytes.fromhex("00000000")


def test_a_string_is_counted_with_its_nul() -> None:
    assert encode(String(data="hi")) == LITTLE + struct.pack("<I", 3) + b"hi\0"
    assert encode(String()) == LITTLE + bytes.fromhex("0100000000")


def test_a_type_without_fields_is_one_zero_byte() -> None:
    assert encode(Trigger.Request()) == encode(Empty()) == bytes.fromhex("0001000000")
    assert decode(Empty, LITTLE) == Empty()  # some leave the byte out


def test_numbers_stand_at_multiples_of_their_size_from_the_end_of_the_header() -> None:
    cls: Any = load("uint8 a\nfloat64 b\nuint8 c\nuint16 d\nuint8 e\nuint32 f", "tests/msg/Aligned")
    assert encode(cls(a=1, b=2.0, c=3, d=4, e=5, f=6)) == LITTLE + struct.pack("<B7xdBxHB3xI", 1, 2.0, 3, 4, 5, 6)


def test_elements_of_a_sequence_are_aligned_only_where_there_are_any() -> None:
    cls: Any = load("float64[] a\nuint32 b\nint64[] c", "tests/msg/Sparse")
    assert encode(cls(b=7)) == LITTLE + struct.pack("<III", 0, 7, 0)
    assert encode(cls(a=[1.0], b=7, c=[2])) == LITTLE + struct.pack("<I4xdII" + "q", 1, 1.0, 7, 1, 2)


def test_a_message_in_big_endian_order_is_read() -> None:
    data = BIG + struct.pack(">IIII", 1, 2, 2, ord("m") << 24) + struct.pack(">I", 0)
    assert decode(Header, data).frame_id == "m"
    numbers: Any = load("int16[] a\nint32[2] b\nbool[] c", "tests/msg/Numbers")
    data = BIG + struct.pack(">IhhiiI??", 2, 1, -2, 3, -4, 2, True, False)
    assert decode(numbers, data) == numbers(a=[1, -2], b=[3, -4], c=[True, False])


def test_bytes_after_the_last_field_are_ignored() -> None:
    assert decode(Int32, encode(Int32(data=7)) + b"\xff\xff\xff") == Int32(data=7)


@pytest.mark.parametrize("data", [b"", b"\0", b"\0\1\0"])
def test_data_without_a_whole_header_are_refused(data: bytes) -> None:
    with pytest.raises(CdrError, match="std_msgs/msg/Int32"):
        decode(Int32, data)


@pytest.mark.parametrize("header", ["00030000", "00070000", "01000000", "ffff0000"])
def test_other_encodings_are_refused_by_their_header(header: str) -> None:
    with pytest.raises(CdrError, match=r"header .* is not that of plain CDR"):
        decode(Int32, bytes.fromhex(header) + bytes(4))


def test_data_that_end_too_early_are_refused() -> None:
    with pytest.raises(CdrError, match=r"geometry_msgs/msg/Twist: the data end too early \(50 bytes\)"):
        decode(Twist, encode(Twist())[:50])


def test_a_length_beyond_the_data_is_refused_with_field_and_place() -> None:
    with pytest.raises(
        CdrError, match=r"String\.data: a length of 4294967295 at byte 4 goes beyond the end of the data \(9 bytes\)"
    ):
        decode(String, LITTLE + struct.pack("<I", 2**32 - 1) + b"\0")
    with pytest.raises(CdrError, match=r"PoseArray\.poses: a length of 1000000"):
        decode(PoseArray, encode(PoseArray())[:-4] + struct.pack("<I", 1_000_000))
    with pytest.raises(CdrError, match=r"UInt8MultiArray\.data: a length of 10"):
        decode(UInt8MultiArray, encode(UInt8MultiArray())[:-4] + struct.pack("<I", 10))


def test_a_bound_that_is_broken_is_refused() -> None:
    fine = encode(ParameterDescriptor(floating_point_range=[FloatingPointRange()]))
    lie = fine.replace(struct.pack("<I", 1) + bytes(4) + bytes(24), struct.pack("<I", 2) + bytes(4) + bytes(48))
    with pytest.raises(
        CdrError, match=r"ParameterDescriptor\.floating_point_range: 2 elements, but at most 1 are allowed"
    ):
        decode(ParameterDescriptor, lie)
    cls: Any = load("string<=3 word\nwstring<=2 wide", "tests/msg/Short")
    with pytest.raises(CdrError, match=r"Short\.word: string<=3 holds at most 3 characters, got 4"):
        decode(cls, LITTLE + struct.pack("<I5s3xI", 5, b"long\0", 0))


def test_a_sequence_of_nothing_cannot_be_long() -> None:
    cls: Any = load("std_msgs/Empty[] nothing", "tests/msg/Void")
    with pytest.raises(CdrError, match=r"Void\.nothing: a length of 4294967295"):
        decode(cls, LITTLE + struct.pack("<I", 2**32 - 1))
    assert len(decode(cls, LITTLE + struct.pack("<I", 5) + bytes(5)).nothing) == 5


def test_text_that_is_not_utf_8_is_read_as_rclpy_reads_it() -> None:
    assert decode(String, LITTLE + struct.pack("<I", 3) + b"\xfc!\0").data == "�!"
    assert decode(String, LITTLE + struct.pack("<I", 2) + b"ab").data == "ab"  # a sender that forgets the NUL
    assert decode(String, LITTLE + struct.pack("<I", 0)).data == ""


def test_text_with_lone_surrogates_cannot_be_sent() -> None:
    with pytest.raises(CdrError, match=r"String\.data: 'utf-8' codec can't encode"):
        encode(String(data="\ud800"))
    with pytest.raises(CdrError, match=r"JointState\.name\[1\]"):
        encode(JointState(name=["a", "\ud800"]))
    with pytest.raises(CdrError, match=r"Header\.frame_id|PoseArray\.header\.frame_id"):
        encode(PoseArray(header=Header(frame_id="\udfff")))


@pytest.mark.parametrize("wstrings", ["zenoh", "cyclone"])
def test_wide_strings_hold_what_does_not_fit_one_unit(wstrings: Any) -> None:
    cls: Any = load("wstring text", "tests/msg/Wide")
    message = cls(text="aß漢🤖")
    data = encode(message, wstrings=wstrings)
    assert data[4:8] == struct.pack("<I", 5 if wstrings == "zenoh" else 10)
    assert decode(cls, data, wstrings=wstrings) == message
    with pytest.raises(CdrError, match=r"Wide\.text: a length of 5|Wide\.text: a length of 10"):
        decode(cls, data[:-1], wstrings=wstrings)
    odd = LITTLE + struct.pack("<II", 1, 0x12345) if wstrings == "zenoh" else LITTLE + struct.pack("<I", 1) + b"a"
    assert decode(cls, odd, wstrings=wstrings).text == "�"


def test_a_bool_that_is_neither_0_nor_1_is_true() -> None:
    assert decode(Bool, LITTLE + b"\x05").data is True
    value = ParameterValue(bool_array_value=[True, False])
    flags = decode(ParameterValue, encode(value).replace(b"\x02\0\0\0\x01\x00", b"\x02\0\0\0\x07\x00")).bool_array_value
    assert flags.tolist() == [True, False]
    assert flags.view(np.uint8).tolist() == [1, 0]


def test_decoded_arrays_are_aligned_and_cannot_be_changed() -> None:
    state = decode(JointState, encode(JointState(name=["abc"], position=[1.0, 2.0])))
    assert state.position.flags.aligned
    assert not state.position.flags.writeable
    assert not decode(UUID, encode(UUID(uuid=range(16)))).uuid.flags.writeable


def test_an_image_is_decoded_without_a_copy() -> None:
    data = encode(Image(data=bytes(100_000)))
    assert np.shares_memory(decode(Image, data).data, np.frombuffer(data, np.uint8))


def test_only_messages_can_be_encoded() -> None:
    with pytest.raises(TypeError, match="is not a message class"):
        encode(3)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="take one of its parts"):
        decode(SetBool, b"\0\1\0\0")  # type: ignore[type-var]


def test_a_sequence_of_any_length_is_read_in_memory_of_its_own_order() -> None:
    data = encode(Polygon(points=[]))[:-4] + struct.pack("<I", 2**20) + bytes(12 * 100)
    decode(Polygon, encode(Polygon()))  # the decoder is compiled now, which takes memory of its own
    tracemalloc.start()
    with pytest.raises(CdrError):
        decode(Polygon, data)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 10 * len(data)


def test_the_checks_of_a_type_are_made_at_its_first_message_even_in_decoding() -> None:
    cls: Any = load("geometry_msgs/Point[2] ends\nbyte b", "tests/msg/Fresh")
    message = decode(cls, LITTLE + bytes(48) + b"\x07")
    assert message == cls(ends=[Point(), Point()], b=7)
    with pytest.raises(MessageTypeError):
        cls(ends=[Byte(), Float32()])
