"""Any message of any type survives its encoding, and a second encoder writes the same bytes."""

from __future__ import annotations

import random
from contextlib import suppress
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_types_from_msg, get_typestore  # pyright: ignore[reportUnknownVariableType]

from actors.interfaces import CdrError, Field, Message, decode, definition_text, encode, from_plain, load, to_plain
from actors.interfaces.arrays import DTYPES
from actors.interfaces.fields import INTEGER_RANGES
from tests.properties.messages import random_message, shipped_types

TYPES = shipped_types()

PRIMITIVES = (*DTYPES, "string", "wstring")
ALL_KINDS = "\n".join(
    [
        *(
            f"{base} one{i}\n{base}[] many{i}\n{base}[3] three{i}\n{base}[<=2] few{i}"
            for i, base in enumerate(PRIMITIVES)
        ),
        "string<=3 short",
        "string<=3[<=2] short_few",
        "wstring<=3[] short_wide",
        "std_msgs/Empty[] empties",
        "std_msgs/Header[] headers",
        "int8 shift",
        "std_msgs/Header[2] two_headers",
        "geometry_msgs/Point[] points",
        "int8 shift_again",
        "geometry_msgs/Pose[2] poses",
        "std_msgs/Empty empty",
    ]
)


def elements(field: Field) -> st.SearchStrategy[Any]:
    base = field.type.base
    if field.message is not None:
        return messages(field.message)
    if base == "bool":
        return st.booleans()
    if base in INTEGER_RANGES:
        return st.integers(*INTEGER_RANGES[base])
    if base in {"float32", "float64"}:
        return st.floats(width=32 if base == "float32" else 64, allow_nan=False)
    return st.text(st.characters(exclude_categories=["Cs"]), max_size=field.type.string_bound or 12)


def values(field: Field) -> st.SearchStrategy[Any]:
    kind = field.type
    if not kind.is_array:
        return elements(field)
    least = kind.size if kind.array == "fixed" else 0
    return st.lists(elements(field), min_size=least, max_size=kind.size or 4)


def messages(cls: type[Message]) -> st.SearchStrategy[Any]:
    return st.builds(cls, **{field.name: values(field) for field in cls.__ros_fields__})


@given(st.data())
def test_a_message_of_any_type_survives_its_encoding(data: st.DataObject) -> None:
    cls = data.draw(st.sampled_from(TYPES))
    message = data.draw(messages(cls))
    encoded = encode(message)
    assert decode(cls, encoded) == message
    assert encode(decode(cls, encoded)) == encoded
    assert decode(cls, memoryview(bytearray(encoded + b"\xa5\xa5\xa5"))) == message


@given(st.data())
def test_a_message_with_every_kind_of_field_survives_both_forms_of_wide_strings(data: st.DataObject) -> None:
    cls = load(ALL_KINDS, "tests/msg/AllKinds")
    message = data.draw(messages(cls))
    for wstrings in ("zenoh", "cyclone"):
        encoded = encode(message, wstrings=wstrings)
        assert decode(cls, encoded, wstrings=wstrings) == message
    assert from_plain(cls, to_plain(message)) == message


@pytest.mark.parametrize("cls", TYPES, ids=lambda cls: cls.__ros_type__)
def test_every_type_that_ships_survives_its_encoding(cls: type[Message]) -> None:
    for seed in range(3):
        message = random_message(cls, random.Random(seed))
        assert decode(cls, encode(message)) == message
        assert from_plain(cls, to_plain(message)) == message


@given(st.data())
def test_every_prefix_of_an_encoding_is_refused_or_read_but_never_worse(data: st.DataObject) -> None:
    cls = data.draw(st.sampled_from(TYPES))
    encoded = encode(random_message(cls, random.Random(data.draw(st.integers(0, 99)))))
    cut = data.draw(st.integers(0, len(encoded)))
    with suppress(CdrError):  # and no other error
        decode(cls, encoded[:cut])


@given(st.data())
def test_any_bytes_are_refused_or_read_but_never_worse(data: st.DataObject) -> None:
    cls = data.draw(st.sampled_from(TYPES))
    for order in (b"\x00\x01\x00\x00", b"\x00\x00\x00\x00"):
        with suppress(CdrError):  # and no other error
            decode(cls, order + data.draw(st.binary(max_size=200)))


ORACLE = get_typestore(Stores.EMPTY)


def oracle_name(cls: type[Message]) -> str:
    package, _, name = cls.__ros_type__.split("/")
    return f"{package}/msg/{name}"  # rosbags knows messages only


def oracle_class(cls: type[Message]) -> Any:
    """The class that rosbags makes of our definition of a message and of all it contains."""
    name = oracle_name(cls)
    if name not in ORACLE.types:
        for field in cls.__ros_fields__:
            if field.message is not None:
                oracle_class(field.message)
        ORACLE.register(get_types_from_msg(definition_text(cls), name))
    return ORACLE.types[name]


def oracle_message(message: Message) -> Any:
    cls = oracle_class(type(message))
    return cls(**{field.name: _oracle_value(field, getattr(message, field.name)) for field in message.__ros_fields__})


def _oracle_value(field: Field, value: Any) -> Any:
    if field.type.is_numeric_array:
        return np.asarray(value, DTYPES[field.type.base])
    if field.type.is_array:
        return [oracle_message(item) if field.message else item for item in value]
    return oracle_message(value) if field.message else value


def _oracle_can(cls: type[Message]) -> bool:
    """rosbags has no wide strings, takes a single byte for a signed one, and knows no types derived from services."""
    for field in cls.__ros_fields__:
        base = field.type.base
        if base == "wstring" or (base == "byte" and not field.type.is_array) or "_" in base.rpartition("/")[2]:
            return False
        if field.message is not None and not _oracle_can(field.message):
            return False
    return True


@pytest.mark.parametrize("cls", [cls for cls in TYPES if _oracle_can(cls)], ids=lambda cls: cls.__ros_type__)
def test_the_oracle_writes_and_reads_the_same_bytes(cls: type[Message]) -> None:
    for seed in range(3):
        message = random_message(cls, random.Random(seed))
        encoded = encode(message)
        assert bytes(ORACLE.serialize_cdr(oracle_message(message), oracle_name(cls))).hex() == encoded.hex()
        swapped = bytes(ORACLE.serialize_cdr(oracle_message(message), oracle_name(cls), little_endian=False))
        assert decode(cls, swapped) == message


def test_the_oracle_was_asked_about_most_types() -> None:
    assert sum(map(_oracle_can, TYPES)) > 250
