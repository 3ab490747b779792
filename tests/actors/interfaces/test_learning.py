"""Types that are defined by the descriptions of others: what cannot be defined, and what is left as it is."""

from __future__ import annotations

import pytest

from actors.interfaces import InterfaceError, get_message
from actors.interfaces.describing import described
from actors.interfaces.learning import define
from actors.interfaces.registry import find
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.type_description_interfaces.msg import (
    Field,
    FieldType,
    IndividualTypeDescription,
    TypeDescription,
    TypeSource,
)
from actors.interfaces.type_description_interfaces.srv import GetTypeDescription, GetTypeDescription_Response


def answer(name: str, type_id: int, *sources: TypeSource) -> GetTypeDescription_Response:
    field = Field(name="x", type=FieldType(type_id=type_id))
    one = IndividualTypeDescription(type_name=name, fields=(field,))
    return GetTypeDescription.Response(
        successful=True, type_description=TypeDescription(type_description=one), type_sources=sources
    )


def test_a_type_that_is_known_stays_as_it_is() -> None:
    define("std_msgs/msg/String", [answer("std_msgs/msg/String", 11)])
    assert get_message("std_msgs/msg/String") is String
    assert [field.name for field in String.__ros_fields__] == ["data"]


def test_a_type_that_is_not_described_is_not_defined() -> None:
    define("lost_msgs/msg/Lost", [described(GetTypeDescription.Request(type_name="std_msgs/msg/String"))])
    assert find("lost_msgs/msg/Lost") is None


def test_a_source_that_is_no_definition_gives_way_to_the_description_of_the_fields() -> None:
    name = "lost_msgs/msg/Found"
    text = TypeSource(type_name=name, encoding="msg", raw_file_contents="no definition at all!")
    define(name, [answer(name, 11, text, TypeSource(type_name=name, encoding="idl", raw_file_contents="module"))])
    assert [str(field.type) for field in get_message(name).__ros_fields__] == ["float64"]


def test_a_field_of_no_known_type_is_an_error() -> None:
    with pytest.raises(InterfaceError, match="type id 40, which is not known"):
        define("lost_msgs/msg/Wrong", [answer("lost_msgs/msg/Wrong", 40)])


def test_a_field_with_a_name_that_is_none_is_an_error() -> None:
    name = "lost_msgs/msg/Bad"
    one = IndividualTypeDescription(type_name=name, fields=(Field(name="9 x", type=FieldType(type_id=11)),))
    told = GetTypeDescription.Response(successful=True, type_description=TypeDescription(type_description=one))
    with pytest.raises(InterfaceError):
        define(name, [told])


def test_bounded_strings_and_bounded_arrays_of_them_are_described_by_their_bounds() -> None:
    name = "lost_msgs/msg/Bounded"
    kinds = (
        FieldType(type_id=21, string_capacity=5),
        FieldType(type_id=96 + 21, string_capacity=5, capacity=3),
        FieldType(type_id=48 + 11, capacity=2),
    )
    fields = tuple(Field(name=name, type=kind) for name, kind in zip("xyz", kinds, strict=True))
    told = TypeDescription(type_description=IndividualTypeDescription(type_name=name, fields=fields))
    define(name, [GetTypeDescription.Response(successful=True, type_description=told)])
    assert [str(field.type) for field in get_message(name).__ros_fields__] == [
        "string<=5",
        "string<=5[<=3]",
        "float64[2]",
    ]
