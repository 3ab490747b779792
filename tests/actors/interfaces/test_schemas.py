"""Types made from the schemas of recordings, and from IDL."""

from __future__ import annotations

import pytest

from actors.interfaces import Message, ServiceType, decode, definition_text, encode, get_message, schema_text, type_hash
from actors.interfaces.derived import event_message
from actors.interfaces.errors import InterfaceError
from actors.interfaces.geometry_msgs.msg import Point
from actors.interfaces.idl import parse_idl
from actors.interfaces.lifecycle_msgs.msg import TransitionEvent
from actors.interfaces.lookup import find
from actors.interfaces.parse import DefinitionError
from actors.interfaces.registry import known_names
from actors.interfaces.schemas import recorded_hash, recorded_type, ros_name
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import SetBool

LINE = "=" * 80


def test_the_schema_of_every_type_here_means_that_type() -> None:
    """Also as Windows writes lines, and of the events of services."""
    checked = 0
    for name in known_names():
        kind = find(name)
        assert kind is not None
        parts = [
            getattr(kind, part) for part in ("Request", "Response", "Goal", "Result", "Feedback") if hasattr(kind, part)
        ]
        if issubclass(kind, ServiceType):
            parts.append(event_message(kind))
        for one in [kind] if issubclass(kind, Message) else parts:
            text = schema_text(one)
            for written in (text, text.replace("\n", "\r\n")):
                assert recorded_hash(one.__ros_type__, "ros2msg", written) == type_hash(one)
                assert recorded_type(one.__ros_type__, "ros2msg", written) is one
            checked += 1
    assert checked > 300


def test_a_definition_that_differs_from_the_one_here_makes_a_type_of_its_own() -> None:
    """As Jazzy has it: the time is a number."""
    schema = (
        f"uint64 timestamp\nTransition transition\nState start_state\nState goal_state\n{LINE}\nMSG: lifecycle_msgs/Transition\n"
        f"uint8 id\nstring label\n{LINE}\nMSG: lifecycle_msgs/State\nuint8 id\nstring label\n"
    )
    kind = recorded_type("lifecycle_msgs/msg/TransitionEvent", "ros2msg", schema)
    assert [field.name for field in kind.__ros_fields__] == ["timestamp", "transition", "start_state", "goal_state"]
    assert get_message("lifecycle_msgs/msg/TransitionEvent") is TransitionEvent, "nothing else knows it"
    assert (
        type_hash(kind)
        == recorded_hash("lifecycle_msgs/msg/TransitionEvent", "ros2msg", schema)
        != type_hash(TransitionEvent)
    )
    assert definition_text(kind).startswith("uint64 timestamp")


def test_what_a_schema_leaves_out_is_taken_from_here() -> None:
    assert recorded_hash(
        "std_msgs/msg/Float64MultiArray", "ros2msg", "MultiArrayLayout layout\nfloat64[] data\n"
    ) == type_hash("std_msgs/msg/Float64MultiArray")


def test_the_events_of_a_service_are_made_from_its_definition_as_rosbag2_writes_it() -> None:
    schema = f"{LINE}\nSRV: garden_msgs/srv/Water\nint32 litres\n---\nPlant_State state\n\n{LINE}\nMSG: garden_msgs/msg/Plant_State\nfloat32 wetOnTop\n"
    kind = recorded_type("garden_msgs/srv/Water_Event", "ros2msg", schema)
    assert [str(field) for field in kind.__ros_fields__] == [
        "service_msgs/ServiceEventInfo info", "garden_msgs/Water_Request[<=1] request", "garden_msgs/Water_Response[<=1] response",
    ]  # fmt: skip
    assert get_message("garden_msgs/srv/Water_Event") is kind, (
        "what is not known here is known by the schema from now on"
    )
    assert get_message("garden_msgs/msg/Plant_State")().wetOnTop == 0.0  # type: ignore[attr-defined]


def test_a_type_without_fields_has_an_empty_definition() -> None:
    kind = recorded_type("garden_msgs/msg/Nothing", "ros2msg", "")
    assert kind.__ros_fields__ == ()
    assert decode(kind, b"\0\1\0\0\0") == kind()


def test_names_are_taken_as_others_write_them() -> None:
    assert ros_name("std_msgs::msg::String") == ros_name("std_msgs/String") == "std_msgs/msg/String"
    schema = f"std_msgs/msg/String a\nBorder[2] b\n{LINE}\nMSG: Border\nint8 LEFT_side=1\n{LINE}\nMSG: std_msgs/msg/String\nstring data\n"
    kind = recorded_type("garden_msgs/Hedge_2", "ros2msg", schema)
    assert kind.__ros_type__ == "garden_msgs/msg/Hedge_2"
    assert kind.__ros_fields__[0].message is String


IDL = f"""{LINE}
IDL: yard_msgs/msg/Box
// generated
#include "geometry_msgs/msg/Point.idl"
module yard_msgs {{ module msg {{
  typedef double double__3[3]; /* as rosidl
  writes it */
  const long MANY = 0x4;
  module Box_Constants {{ const int8 X = -1; const double Y = 0.5; @verbatim (language="comment", text="said" "so") const string S = "a\\"b\\n"; }};
  struct Later;
  @verbatim (language="comment", text="A box." "\\n" "More")
  struct Box {{
    geometry_msgs::msg::Point p; @default (value=0.5) @unit (value="m") double a, b[2];
    double__3 c; sequence<Lid, MANY> lids; sequence<yard_msgs::msg::Lid> more; string<5> s; @key @default (value="hi") wstring w;
    boolean z; @id (5) octet o; unsigned long long q; @default (value=TRUE) boolean _struct; @default (value='A') char letter;
  }};
}}; }};
{LINE}
IDL: yard_msgs/msg/Lid
module yard_msgs {{ module msg {{ struct Lid {{ uint8 structure_needs_at_least_one_member; }}; }}; }};
{LINE}
IDL: geometry_msgs/msg/Point
module geometry_msgs {{ module msg {{ struct Point {{ double x; double y; double z; }}; }}; }};
"""


def test_schemas_in_idl_are_read() -> None:
    kind = recorded_type("yard_msgs/msg/Box", "ros2idl", IDL)
    assert [str(field) for field in kind.__ros_fields__] == [
        "geometry_msgs/Point p", "float64 a 0.5", "float64[2] b", "float64[3] c", "yard_msgs/Lid[<=4] lids", "yard_msgs/Lid[] more",
        "string<=5 s", "wstring w 'hi'", "bool z", "byte o", "uint64 q", "bool struct True", "char letter 65",
    ]  # fmt: skip
    assert (kind.X, kind.Y, kind.S) == (-1, 0.5, 'a"b\n')  # type: ignore[attr-defined]
    assert kind.__doc__ == "yard_msgs/msg/Box\n\nA box.\nMore"
    assert kind.__ros_fields__[0].message is Point
    box = kind(lids=[get_message("yard_msgs/msg/Lid")()], q=7)
    assert (decode(kind, encode(box)).q, len(decode(kind, encode(box)).lids)) == (7, 1)  # type: ignore[attr-defined]
    assert (
        recorded_type("yard_msgs::msg::Bare", "omgidl", "module yard_msgs{module msg{struct Bare{long x;};};};")().x
        == 0
    )  # type: ignore[attr-defined]


def test_a_service_in_idl_is_read_too() -> None:
    text = "module yard_msgs { module srv { struct Open_Request { float f; }; struct Open_Response { wchar c; }; }; };"
    assert [each.name for each in parse_idl(text)] == ["yard_msgs/srv/Open_Request", "yard_msgs/srv/Open_Response"]
    kind = recorded_type("yard_msgs/srv/Open_Event", "ros2msg", f"{LINE}\nIDL: yard_msgs/srv/Open\n{text}")
    assert [field.name for field in kind.__ros_fields__] == ["info", "request", "response"]


def test_the_definition_of_a_service_alone_is_that_of_its_events() -> None:
    """As rosbag2 has written it: without a line that says so."""
    kind = recorded_type("yard_msgs/srv/Shut_Event", "ros2msg", "int64 a\n---\nstd_msgs/String b\n")
    assert [field.name for field in kind.__ros_fields__] == ["info", "request", "response"]
    (request, response) = (field.message for field in kind.__ros_fields__[1:])
    assert request is not None
    assert response is not None
    assert [str(field) for field in (*request.__ros_fields__, *response.__ros_fields__)] == [
        "int64 a",
        "std_msgs/String b",
    ]


def box(members: str) -> str:
    return f"module yard_msgs {{ module msg {{ struct Bad {{ {members} }}; }}; }};"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (box("sequence<sequence<long>> x;"), "a sequence of sequences"),
        (box("long x[2][3];"), "an array of arrays"),
        ("module a { module msg { typedef long l[2]; struct Bad { sequence<l> x; }; }; };", "a sequence of sequences or arrays"),
        (box("long x, x;"), "'x' is there twice"),
        (box("long double x;"), "'long double' is no type that a message of ROS can hold"),
        (box("other::Thing x;"), "'other::Thing' is not known"),
        (box("string<0> x;"), "'0' is not a positive number"),
        (box("string<1.5> x;"), "'1.5' is not a positive number"),
        (box("string<;> x;"), "';' is no value"),
        (box("; x;"), "';' is no type"),
        (box("long 5;"), "'5' is no name"),
        (box("long x"), "expected ';', not '}'"),
        (box("Bad x;"), "contains itself"),
        (box("@default (value=\"a\") long x;"), "'a' is not a value of int32"),
        (box("Absent x;"), "yard_msgs/msg/Absent is neither in its definition"),
        ("module yard_msgs { module msg { const long X = \"a\"; }; };", "'a' is not a value of int32"),
        ("struct Bad { long x; };", "struct Bad is not in a module PACKAGE"),
        ("module yard_msgs { module msg {", "a '}' is missing at the end"),
        ("union", "'union' is not understood here"),
        ("struct", "it ends too early"),
        ("$", "is no IDL"),
        ("", "the definition of yard_msgs/msg/Bad is not in its schema"),
    ],
)  # fmt: skip
def test_what_is_wrong_in_idl_is_said(text: str, said: str) -> None:
    with pytest.raises(InterfaceError) as caught:
        recorded_type("yard_msgs/msg/Bad", "ros2idl", text)
    assert said in str(caught.value)


def test_a_schema_is_bounded_before_it_is_understood() -> None:
    with pytest.raises(InterfaceError, match="more than 1048576"):
        recorded_type("yard_msgs/msg/Wide", "ros2msg", "#" * 2_000_000)
    many = "".join(f"\n{LINE}\nMSG: yard_msgs/M{number}\nint8 x\n" for number in range(2000))
    with pytest.raises(InterfaceError, match="consists of 2001 parts"):
        recorded_type("yard_msgs/msg/Wide", "ros2msg", f"int8 x{many}")
    deep = "".join(f"\n{LINE}\nMSG: yard_msgs/M{number}\nM{number + 1} x\n" for number in range(500))
    with pytest.raises(InterfaceError, match="too many others within each other"):
        recorded_type("yard_msgs/msg/Deep", "ros2msg", f"M0 x{deep}\n{LINE}\nMSG: yard_msgs/M500\nint8 x\n")
    with pytest.raises(InterfaceError, match="'a/b/c' in the definition of"):
        recorded_type("yard_msgs/msg/Odd", "ros2msg", f"int8 x\n{LINE}\nMSG: a/b/c\nint8 x\n")
    for line in ("int8 __class__", "int8 _X=1", "a/b/c/d x", "é/B x", "yard_msgs/srv x/y z"):
        with pytest.raises(DefinitionError):
            recorded_type("yard_msgs/msg/Odd", "ros2msg", line)
    with pytest.raises(InterfaceError, match="std_srvs/srv/SetBool is neither in its definition"):
        recorded_type("yard_msgs/msg/Odd", "ros2msg", f"{SetBool.__ros_type__} x\n")
    with pytest.raises(InterfaceError, match="yard_msgs/msg/Absent is neither in the definition of yard_msgs/msg/Odd"):
        recorded_hash("yard_msgs/msg/Odd", "ros2msg", "Absent x")
    assert find("yard_msgs/msg/Deep") is find("yard_msgs/msg/Odd") is None
