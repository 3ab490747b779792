"""Types declared in plain Python: messages, services, actions, and what is said when a declaration cannot work."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, TypeAlias

import numpy as np
import pytest

from actors.interfaces import (
    ActionType,
    BadDeclaration,
    Constant,
    FieldType,
    Message,
    MessageTypeError,
    MessageValueError,
    ServiceType,
    decode,
    definition_text,
    encode,
    fields_of,
    get_message,
    load,
    to_plain,
    type_description,
    type_hash,
    type_name,
)
from actors.interfaces.geometry_msgs.msg import Point, Twist
from actors.interfaces.message import make_message
from actors.interfaces.naming import own_type_name
from actors.interfaces.std_srvs.srv import SetBool
from actors.interfaces.types import (
    AtMost,
    Chars,
    Exactly,
    Many,
    bool_array,
    byte,
    byte_array,
    default,
    float32,
    float64,
    float64_array,
    int16,
    int32_array,
    string,
    string_array,
    uint8,
    wstring,
)


class Pose2D(Message, frozen=True, kw_only=True):
    """A pose in the plane, as a user would declare it."""

    PLANAR: ClassVar[uint8] = 1
    MOOD: ClassVar[string] = "calm"
    cache: ClassVar[dict[str, int]] = {}

    x: float64 = 0.0
    y: float64 = 0.0
    theta: float32 = 0.5
    level: int16
    label: Annotated[string, Chars(5)] = "home"
    path: Many[Point] = default()
    corners: Annotated[Many[Point], Exactly(2)] = default()
    names: Annotated[string_array, Chars(4), AtMost(3)] = default(["a"])
    covariance: Annotated[float64_array, Exactly(3)] = default([1, 2, 3])
    codes: Annotated[int32_array, AtMost(2)] = default()
    flags: bool_array = default()
    raw: byte_array = default()
    one: byte = 0
    wide: wstring = ""
    plain: int = 0
    twist: Twist = default()

    def norm(self) -> float:
        return float(np.hypot(self.x, self.y))


def test_a_class_has_the_name_of_its_package_and_the_fields_of_its_annotations() -> None:
    assert type_name(Pose2D) == "tests/msg/Pose2D"
    assert [str(field.type) for field in fields_of(Pose2D)] == [
        "float64",
        "float64",
        "float32",
        "int16",
        "string<=5",
        "geometry_msgs/Point[]",
        "geometry_msgs/Point[2]",
        "string<=4[<=3]",
        "float64[3]",
        "int32[<=2]",
        "bool[]",
        "byte[]",
        "byte",
        "wstring",
        "int64",
        "geometry_msgs/Twist",
    ]
    assert Pose2D.__ros_constants__ == (
        Constant("PLANAR", FieldType("uint8"), 1),
        Constant("MOOD", FieldType("string"), "calm"),
    )
    assert get_message("tests/Pose2D") is Pose2D


def test_fields_have_the_defaults_of_the_declaration_or_of_ros() -> None:
    pose = Pose2D(level=0)
    assert pose == Pose2D(**{})  # every field has a default, as in ROS
    assert (pose.level, pose.label, pose.theta, pose.names) == (0, "home", 0.5, ("a",))
    assert pose.covariance.tolist() == [1.0, 2.0, 3.0]
    assert pose.corners == (Point(), Point())
    assert pose.twist == Twist()
    assert Pose2D(level=1, x=3, y=4).norm() == 5.0


def test_a_declared_message_travels_like_any_other() -> None:
    pose = Pose2D(level=-3, path=[Point(x=1.0)], names=["ab", "c"], codes=[7], flags=[True], raw=b"ab", wide="ü")
    assert decode(Pose2D, encode(pose)) == pose


def test_the_definition_of_a_declared_class_read_as_text_gives_the_same_type() -> None:
    text = definition_text(Pose2D)
    loaded = load(text, "other/msg/Pose2D")
    assert definition_text(loaded) == text
    assert to_plain(loaded()) == to_plain(Pose2D(level=0))
    assert (
        type_description(loaded)["type_description"]["fields"] == type_description(Pose2D)["type_description"]["fields"]
    )
    assert [(f.name, f.type, f.default) for f in loaded.__ros_fields__] == [
        (f.name, f.type, f.default) for f in Pose2D.__ros_fields__
    ]


@pytest.mark.parametrize(
    ("field", "value", "text"),
    [
        ("label", "longer", r"Pose2D\.label: string<=5 holds at most 5 characters, got 6"),
        ("names", ["a", "b", "c", "d"], r"Pose2D\.names: string<=4\[<=3\] holds at most 3 elements, got 4"),
        ("names", ["longer"], r"Pose2D\.names\[0\]: string<=4 holds at most 4 characters"),
        ("codes", [1, 2, 3], r"Pose2D\.codes: int32\[<=2\] holds at most 2 elements, got 3"),
        ("corners", [Point()], r"Pose2D\.corners: geometry_msgs/Point\[2\] holds exactly 2 elements, got 1"),
        ("level", 2**15, r"Pose2D\.level: 32768 is out of range for int16"),
    ],
)
def test_bounds_are_checked_when_a_message_is_built(field: str, value: object, text: str) -> None:
    changes: dict[str, Any] = {field: value}
    with pytest.raises(MessageValueError, match=text):
        Pose2D(**changes)


def test_an_invariant_of_the_class_is_checked_after_the_types() -> None:
    class Percent(Message, frozen=True, kw_only=True):
        value: float64 = 0.0

        def __post_init__(self) -> None:
            if self.value > 100.0:
                raise ValueError("more than all")

    assert Percent(value=3).value == 3.0
    with pytest.raises(MessageTypeError):
        Percent(value="3")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="more than all"):
        Percent(value=101.0)


def test_annotations_may_be_text_and_mention_names_of_the_function() -> None:
    class Inner(Message, frozen=True, kw_only=True):
        x: float64 = 0.0

    class Outer(Message, frozen=True, kw_only=True):
        inner: Inner = default()
        many: Many[Inner] = default()

    assert Outer(many=[Inner(x=1.0)]).many[0].x == 1.0


def test_a_class_must_say_that_it_is_frozen_and_keyword_only() -> None:
    with pytest.raises(BadDeclaration, match=r"write `class Bare\(Message, frozen=True, kw_only=True\)`"):

        class Bare(Message):  # type: ignore[misc]
            x: float64 = 0.0

    with pytest.raises(BadDeclaration, match="takes no options but frozen and kw_only"):

        class Ordered(Message, frozen=True, kw_only=True, order=True):
            x: float64 = 0.0


def test_a_message_has_no_other_parent() -> None:
    with pytest.raises(BadDeclaration, match="a message has one parent, Message; put the other message in a field"):

        class Taller(Pose2D, frozen=True, kw_only=True):
            z: float64 = 0.0

    class Mixin:
        pass

    with pytest.raises(BadDeclaration, match=r"one parent, Message, got \['Message', 'Mixin'\]"):

        class Mixed(Message, Mixin, frozen=True, kw_only=True):
            z: float64 = 0.0


def declare(annotation: Any, value: Any = None) -> type[Message]:
    """A message class with one field of this annotation."""
    body = {"__module__": __name__, "__annotations__": {"field": annotation}}
    if value is not None:
        body["field"] = value
    return make_message("Odd", body)


@pytest.mark.parametrize(
    ("annotation", "text"),
    [
        (complex, "is not a type a message can hold"),
        (list[int], "is not a type a message can hold"),
        (SetBool, "is not a type a message can hold"),
        ("Decimal", r"Odd\.field: annotation 'Decimal' cannot be read: name 'Decimal' is not defined"),
        (Many[float64_array], "a sequence of sequences does not exist"),
        (Annotated[float64, Exactly(3)], "bounds an array; this is float64"),
        (Annotated[float64, Chars(3)], "bounds the characters of a string; this is float64"),
        (Annotated[float64_array, Exactly(0)], "a bound must be at least 1"),
        (Annotated[float64_array, Exactly(3), AtMost(4)], r"bounds an array; this is float64\[3\]"),
    ],
)
def test_an_annotation_that_ros_cannot_hold_is_refused(annotation: Any, text: str) -> None:
    with pytest.raises(BadDeclaration, match=text):
        declare(annotation)


def test_a_default_of_the_wrong_type_is_refused_with_the_class() -> None:
    with pytest.raises(MessageTypeError, match=r"Odd\.field: expected float64"):
        declare(float64, "fast")
    with pytest.raises(MessageValueError, match=r"Odd\.field: 40000 is out of range for int16"):
        declare(int16, 40000)


@pytest.mark.parametrize(
    ("module", "name", "ros"),
    [
        ("robot.navigation.types", "Pose2D", "robot/msg/Pose2D"),
        ("__main__", "Pose2D", "main/msg/Pose2D"),
        ("my_pkg.msg", "Pose2D", "my_pkg/msg/Pose2D"),
        ("deep.my_pkg.srv", "Plan_Request", "my_pkg/srv/Plan_Request"),
        ("MyModule", "Plan_Response", "mymodule/srv/Plan_Response"),
        ("app", "Move_Feedback", "app/action/Move_Feedback"),
        ("9lives", "Cat", "main/msg/Cat"),
    ],
)
def test_where_a_class_gets_its_ros_name_from(module: str, name: str, ros: str) -> None:
    assert own_type_name(module, name) == ros


@pytest.mark.parametrize("name", ["pose", "My_Pose", "Pose_Request_Request", "Pösé"])
def test_a_name_that_ros_does_not_know_is_refused(name: str) -> None:
    with pytest.raises(BadDeclaration, match="not a name for a ROS type"):
        own_type_name("app", name)


def test_a_name_may_be_stated_but_not_taken_from_a_definition() -> None:
    class Odd_Name(Message, frozen=True, kw_only=True):
        __ros_type__ = "my_pkg/msg/OddName"
        x: float64 = 0.0

    assert get_message("my_pkg/OddName") is Odd_Name
    with pytest.raises(BadDeclaration, match=r"std_msgs/msg/String is defined by .*String\.msg; use that type"):

        class Text(Message, frozen=True, kw_only=True):
            __ros_type__ = "std_msgs/msg/String"
            data: string = ""


def test_a_class_declared_again_replaces_the_earlier_one() -> None:
    def declare_it(kind: Any) -> type[Message]:
        class Again(Message, frozen=True, kw_only=True):
            x: kind = default()

        return Again

    first, second = declare_it(float64), declare_it(string)
    assert first is not second
    assert get_message("tests/Again") is second


class Plan_Request(Message, frozen=True, kw_only=True):
    start: Point = default()


class Plan_Response(Message, frozen=True, kw_only=True):
    success: bool = False


class Plan(ServiceType[Plan_Request, Plan_Response]):
    Request: TypeAlias = Plan_Request
    Response: TypeAlias = Plan_Response


def test_a_service_type_ties_two_messages_and_is_never_built_itself() -> None:
    assert type_name(Plan) == "tests/srv/Plan"
    assert type_name(Plan.Request) == "tests/srv/Plan_Request"
    assert (Plan.Request, Plan.Response) == (Plan_Request, Plan_Response)
    with pytest.raises(TypeError, match=r"Plan is a service type; build Plan\.Request"):
        Plan()
    assert definition_text(Plan) == f"{definition_text(Plan_Request)}---\n{definition_text(Plan_Response)}"
    assert type_hash(Plan).startswith("RIHS01_")


def test_a_service_whose_parts_have_other_names_is_refused() -> None:
    with pytest.raises(
        BadDeclaration, match=r"its Request is tests/srv/Plan_Request, but ROS 2 wants tests/srv/Other_Request"
    ):

        class Other(ServiceType[Plan_Request, Plan_Response]):
            pass


def test_a_service_without_its_parts_is_refused() -> None:
    with pytest.raises(BadDeclaration, match=r"write `class Loose\(ServiceType\[Loose_Request, Loose_Response\]\)`"):

        class Loose(ServiceType):  # type: ignore[type-arg]
            pass


def test_an_alias_that_contradicts_the_base_is_refused() -> None:
    with pytest.raises(BadDeclaration, match=r"Request is .*Plan_Response.*, but the base says .*Plan_Request"):

        class Swapped(ServiceType[Plan_Request, Plan_Response]):
            Request: TypeAlias = Plan_Response


class Move_Goal(Message, frozen=True, kw_only=True):
    x: float64 = 0.0


class Move_Result(Message, frozen=True, kw_only=True):
    success: bool = False


class Move_Feedback(Message, frozen=True, kw_only=True):
    distance: float64 = 0.0


class Move(ActionType[Move_Goal, Move_Result, Move_Feedback]):
    pass


def test_an_action_type_ties_three_messages() -> None:
    parts: Any = Move
    assert type_name(Move) == "tests/action/Move"
    assert (parts.Goal, parts.Result, parts.Feedback) == (Move_Goal, Move_Result, Move_Feedback)
    with pytest.raises(TypeError, match="Move is an action type"):
        Move()
    assert definition_text(Move) == "float64 x\n---\nbool success\n---\nfloat64 distance\n"


class Start(Message, frozen=True, kw_only=True):
    """A message whose nested field does not begin at zero, and whose class holds things that are no constants."""

    ORIGIN: ClassVar[Point] = Point()
    PRIMES: ClassVar[int32_array] = np.array([2, 3], np.int32)

    place: Point = Point(x=1.0)


def test_a_nested_field_may_have_a_default_of_its_own() -> None:
    assert Start().place == Point(x=1.0)
    assert Start(place=Point()).place == Point()


def test_a_class_variable_of_a_kind_that_ros_has_no_constants_of_is_the_classes_own_business() -> None:
    assert Start.__ros_constants__ == ()
    assert Point() == Start.ORIGIN
