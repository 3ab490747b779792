"""Messages: every field type, services and actions in Python, definitions, descriptions, CDR, plain data."""

import tempfile
from pathlib import Path
from typing import Annotated, TypeAlias

from actors.interfaces import (
    ActionType, ArrayKind, BadDeclaration, Bytes, CdrError, Comments, Constant, DefinitionError, ErrorCode, Field, FieldType,
    InterfaceClass, InterfaceError, Kind, Message, MessageTypeError, MessageValueError, ServiceType, UnknownInterface, WStrings,
    add_folder, decode, definition_text, encode, fields_of, flaws, from_plain, get_action, get_message, get_service, known_names, load,
    load_folder, schema_text, show, to_plain, type_description, type_hash, type_name,
)
from actors.interfaces.sensor_msgs.msg import JointState
from actors.interfaces.types import (
    AtMost, Chars, Exactly, Many, bool_array, byte, byte_array, char, char_array, default, float32, float32_array, float64,
    float64_array, int16, int16_array, int32, int32_array, int64, int64_array, int8, int8_array, string, string_array, uint16,
    uint16_array, uint32, uint32_array, uint64, uint64_array, uint8, uint8_array, wstring, wstring_array,
)

# -- in Python

class Reading(Message, frozen=True, kw_only=True):
    """One reading of a probe."""

    channel: uint8 = 0
    celsius: float32 = 0.0
    volts: float64 = 0.0
    unit: Annotated[string, Chars(4)] = "degC"


class Everything(Message, frozen=True, kw_only=True):
    """A field of every type."""

    ok: bool = False
    octet: byte = 0
    letter: char = 0
    i8: int8 = 0
    i16: int16 = 0
    i32: int32 = 0
    i64: int64 = 0
    u16: uint16 = 0
    u32: uint32 = 0
    u64: uint64 = 0
    wide: wstring = ""
    flags: bool_array = default()
    octets: byte_array = default()
    letters: char_array = default()
    small: int8_array = default()
    samples: int16_array = default()
    codes: Annotated[int32_array, AtMost(5)] = default([1, 2])
    stamps: int64_array = default()
    picture: uint8_array = default()
    depth: uint16_array = default()
    points: uint32_array = default()
    ids: uint64_array = default()
    ranges: float32_array = default()
    covariance: Annotated[float64_array, Exactly(9)] = default()
    names: string_array = default()
    wide_names: wstring_array = default()
    readings: Many[Reading] = default()


made = Everything(picture=b"\x00\x01", readings=[Reading(celsius=21.5)])
assert made.picture.tolist() == [0, 1] and made.codes.tolist() == [1, 2] and made.covariance.shape == (9,)
for wrong, error in ((dict(channel="3"), MessageTypeError), (dict(channel=300), MessageValueError), (dict(unit="kelvin"), MessageValueError)):
    try:
        Reading(**wrong)
    except error as told:
        print(told)

class Measure_Request(Message, frozen=True, kw_only=True):
    channel: uint8 = 0


class Measure_Response(Message, frozen=True, kw_only=True):
    reading: Reading = default()


class Measure(ServiceType[Measure_Request, Measure_Response]):
    Request: TypeAlias = Measure_Request
    Response: TypeAlias = Measure_Response


class Survey_Goal(Message, frozen=True, kw_only=True):
    channels: uint8_array = default()


class Survey_Result(Message, frozen=True, kw_only=True):
    readings: Many[Reading] = default()


class Survey_Feedback(Message, frozen=True, kw_only=True):
    latest: Reading = default()


class Survey(ActionType[Survey_Goal, Survey_Result, Survey_Feedback]):
    Goal: TypeAlias = Survey_Goal
    Result: TypeAlias = Survey_Result
    Feedback: TypeAlias = Survey_Feedback


try:

    class Wrong(Message, frozen=True, kw_only=True):
        speed: complex = 0j

except BadDeclaration as error:
    print(error)

# -- from the files of ROS 2

share = Path(tempfile.mkdtemp())
kind: Kind = "msg"
(share / "probe_msgs" / kind).mkdir(parents=True)
(share / "probe_msgs" / kind / "Level.msg").write_text("# How full the tank is.\nuint8 FULL=100\nuint8 percent\n")
load_folder(share)
Level = get_message("probe_msgs/msg/Level")
assert Level.FULL == 100 and Level(percent=40).percent == 40

later = Path(tempfile.mkdtemp())
(later / "other_msgs" / kind).mkdir(parents=True)
(later / "other_msgs" / kind / "Flow.msg").write_text("float32 liters\n")
add_folder(later)  # read when a type of it is asked for
assert get_message("other_msgs/Flow")().liters == 0.0

(later / "other_msgs" / kind / "Bad.msg").write_text("int99 x\n")
try:
    load(later / "other_msgs" / kind / "Bad.msg")
except DefinitionError as error:
    code: ErrorCode = error.code
    print(error, code)

# -- by name, and what a type says about itself

twist: InterfaceClass = get_message("geometry_msgs/msg/Twist")
assert type_name(twist) == "geometry_msgs/msg/Twist" and "geometry_msgs/msg/Twist" in known_names("msg")
assert type_name(get_service("std_srvs/srv/SetBool")) == "std_srvs/srv/SetBool"
assert type_name(get_action("example_interfaces/Fibonacci")) == "example_interfaces/action/Fibonacci"
try:
    get_message("geometry_msgs/msg/Twits")
except UnknownInterface as error:
    print(error)
assert issubclass(UnknownInterface, InterfaceError)

first: Field = fields_of(Everything)[0]
assert first.name == "ok" and first.type == FieldType("bool")
unbounded: ArrayKind = "unbounded"
assert fields_of(Everything)[-1].type.array == unbounded
comments: Comments = "top"
print(show("probe_msgs/msg/Level", comments=comments))
assert "percent" in definition_text(Level)
assert schema_text(Level)  # what a bag keeps of it: its definition, and those of the types in its fields
assert type_hash(twist).startswith("RIHS01_") and type_description(twist)
assert Constant("FULL", FieldType("uint8"), 100).value == Level.FULL

# -- as bytes, and as plain data

sent: Bytes = encode(Reading(celsius=21.5))
assert decode(Reading, sent) == Reading(celsius=21.5)
layout: WStrings = "cyclone"  # how Cyclone DDS writes a wstring; rmw_zenoh_cpp and Fast CDR do it as "zenoh"
assert decode(Everything, encode(Everything(wide="Grüße"), wstrings=layout), wstrings=layout).wide == "Grüße"
try:
    decode(Reading, sent[:5])
except CdrError as error:
    print(error)

plain = to_plain(Reading(channel=2))
assert plain["channel"] == 2 and from_plain(Reading, {"channel": 2}) == Reading(channel=2)
print(flaws(JointState(name=["hip"], position=[0.1, 0.2])))  # fields that contradict each other
