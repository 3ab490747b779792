"""Types that are defined by the descriptions of others: what cannot be defined, and what is left as it is."""

from __future__ import annotations

import time
from contextlib import suppress

import pytest

from actors.interfaces import InterfaceError, get_message, learning
from actors.interfaces.describing import described
from actors.interfaces.learning import define, definitions_of, read
from actors.interfaces.lookup import find
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
    define(definitions_of("std_msgs/msg/String", [answer("std_msgs/msg/String", 11)]))
    assert get_message("std_msgs/msg/String") is String
    assert [field.name for field in String.__ros_fields__] == ["data"]


def test_a_definition_whose_type_has_become_known_meanwhile_changes_nothing() -> None:
    name = "lost_msgs/msg/Twice"
    found = definitions_of(name, [answer(name, 11)])
    define(found)
    first = get_message(name)
    define(found)
    assert get_message(name) is first


def test_a_type_that_is_not_described_is_not_defined() -> None:
    define(
        definitions_of("lost_msgs/msg/Lost", [described(GetTypeDescription.Request(type_name="std_msgs/msg/String"))])
    )
    assert find("lost_msgs/msg/Lost") is None


def test_a_source_that_is_no_definition_gives_way_to_the_description_of_the_fields() -> None:
    name = "lost_msgs/msg/Found"
    text = TypeSource(type_name=name, encoding="msg", raw_file_contents="no definition at all!")
    define(
        definitions_of(
            name, [answer(name, 11, text, TypeSource(type_name=name, encoding="idl", raw_file_contents="module"))]
        )
    )
    assert [str(field.type) for field in get_message(name).__ros_fields__] == ["float64"]


def test_a_field_of_no_known_type_is_an_error() -> None:
    with pytest.raises(InterfaceError, match="type id 40, which is not known"):
        define(definitions_of("lost_msgs/msg/Wrong", [answer("lost_msgs/msg/Wrong", 40)]))


def test_a_field_with_a_name_that_is_none_is_an_error() -> None:
    name = "lost_msgs/msg/Bad"
    one = IndividualTypeDescription(type_name=name, fields=(Field(name="9 x", type=FieldType(type_id=11)),))
    told = GetTypeDescription.Response(successful=True, type_description=TypeDescription(type_description=one))
    with pytest.raises(InterfaceError):
        define(definitions_of(name, [told]))


def test_bounded_strings_and_bounded_arrays_of_them_are_described_by_their_bounds() -> None:
    name = "lost_msgs/msg/Bounded"
    kinds = (
        FieldType(type_id=21, string_capacity=5),
        FieldType(type_id=96 + 21, string_capacity=5, capacity=3),
        FieldType(type_id=48 + 11, capacity=2),
    )
    fields = tuple(Field(name=name, type=kind) for name, kind in zip("xyz", kinds, strict=True))
    told = TypeDescription(type_description=IndividualTypeDescription(type_name=name, fields=fields))
    define(definitions_of(name, [GetTypeDescription.Response(successful=True, type_description=told)]))
    assert [str(field.type) for field in get_message(name).__ros_fields__] == [
        "string<=5",
        "string<=5[<=3]",
        "float64[2]",
    ]


def told(*types: IndividualTypeDescription, text: str = "") -> GetTypeDescription_Response:
    described = TypeDescription(type_description=types[0], referenced_type_descriptions=types[1:])
    sources = [TypeSource(type_name=types[0].type_name, encoding="msg", raw_file_contents=text)] if text else ()
    return GetTypeDescription.Response(successful=True, type_description=described, type_sources=sources)


def one(name: str, *fields: tuple[str, FieldType]) -> IndividualTypeDescription:
    return IndividualTypeDescription(
        type_name=name, fields=tuple(Field(name=field, type=kind) for field, kind in fields)
    )


def holds(other: str) -> tuple[str, FieldType]:
    return "inner", FieldType(type_id=1, nested_type_name=other)


WRONG = "wrong_msgs/msg/Wrong"
CIRCLE = [one(WRONG, holds("wrong_msgs/msg/B")), one("wrong_msgs/msg/B", holds(WRONG))]
DEEP = [one(f"wrong_msgs/msg/D{depth}", holds(f"wrong_msgs/msg/D{depth + 1}")) for depth in range(300)]


@pytest.mark.parametrize(
    "answer",
    [
        pytest.param(told(*CIRCLE), id="types that contain each other"),
        pytest.param(told(one(WRONG, holds(WRONG))), id="a type that contains itself"),
        pytest.param(told(one(WRONG, holds("x"))), id="a name that is none"),
        pytest.param(told(one(WRONG, holds("../msg/X"))), id="a path"),
        pytest.param(told(one(WRONG, holds("a/b/c/d"))), id="a name of four parts"),
        pytest.param(told(one(WRONG, ("a" * 200 + "!", FieldType(type_id=6)))), id="a field name that takes a try"),
        pytest.param(told(one(WRONG, ("x", FieldType(type_id=0)))), id="no type id"),
        pytest.param(told(one(WRONG, ("x", FieldType(type_id=49, capacity=0, nested_type_name=WRONG)))), id="no size"),
        pytest.param(told(one(WRONG), text="int32 x\n" * 200_000), id="a text without end"),
        pytest.param(told(one(WRONG, *((f"f{n}", FieldType(type_id=6)) for n in range(5000)))), id="wide"),
        pytest.param(told(one(WRONG, holds(DEEP[0].type_name)), *DEEP), id="deep"),
        pytest.param(told(one(WRONG), *(one(f"wrong_msgs/msg/T{n}") for n in range(5000))), id="many types"),
    ],
)  # fmt: skip
def test_what_is_no_description_is_an_error_soon_and_defines_nothing(answer: GetTypeDescription_Response) -> None:
    begun = time.process_time()
    with pytest.raises(InterfaceError) as caught:
        define(definitions_of(WRONG, [answer]))
    assert len(str(caught.value)) < 2000
    assert find(WRONG) is None
    assert time.process_time() - begun < 1.0


@pytest.mark.parametrize(
    "text",
    [
        "int32 " + "a" * 100_000 + "!",
        "int32 X=0x" + "f" * 200_000,
        "int32[" + "9" * 5000 + "] x",
        "string<=" + "9" * 5000 + " x",
        "float64[] x [" + "1," * 100_000 + "]",
        "string[] x [" + '"a",' * 200_000 + '"]',
        "string[] x [" + " ," * 200_000 + "]",
        'string x "' + '\\"' * 200_000 + "x",
        "# [" + "[" * 400_000 + "\nint32 x",
        "int32 x # [" + "a" * 800_000,
        "\n".join(f"int32 f{number}" for number in range(60_000)),
    ],
    ids=lambda text: text[:20],
)
def test_text_is_read_in_time_that_grows_with_its_length_alone(text: str) -> None:
    begun = time.process_time()
    with suppress(InterfaceError):
        read({"wrong_msgs/msg/Text": text})
    assert time.process_time() - begun < 2.0


def test_a_text_that_says_something_else_than_the_description_does_not_count() -> None:
    name = "lost_msgs/msg/Other"
    define(
        definitions_of(
            name, [answer(name, 11, TypeSource(type_name=name, encoding="msg", raw_file_contents="string y"))]
        )
    )
    assert [str(field) for field in get_message(name).__ros_fields__] == ["float64 x"]


def test_a_text_that_says_the_same_is_kept_with_its_constants_and_comments() -> None:
    name = "lost_msgs/msg/Same"
    text = "char X=1\n# how far [m]\nchar x\n"
    source = TypeSource(type_name=name, encoding="msg", raw_file_contents=text)
    define(definitions_of(name, [answer(name, 3, source)]))
    assert get_message(name).X == 1  # type: ignore[attr-defined]


def test_so_many_types_are_learnt_and_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("actors.interfaces.learning._MOST_LEARNT", len(learning._learnt) + 1)  # pyright: ignore[reportPrivateUsage]
    define(read({"many_msgs/msg/A": "int32 x"}))
    with pytest.raises(InterfaceError, match="types have been learnt from others"):
        define(read({"many_msgs/msg/B": "int32 x"}))
    define(read({"many_msgs/msg/A": "int32 x"}))
