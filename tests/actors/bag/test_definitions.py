"""Recorded definitions count: in reading, in playing, in copying."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Sequence
from pathlib import Path

import pytest

from actors import Child, Topic
from actors.bag import BagError, BagReader, BagTopic, BagWriter, Player, PlayOptions, rewrite, topic_of, type_of
from actors.bag.conversion import here
from actors.interfaces import encode, type_hash
from actors.interfaces.derived import event_message
from actors.interfaces.geometry_msgs.msg import Point
from actors.interfaces.lifecycle_msgs.msg import State, TransitionEvent
from actors.interfaces.schemas import recorded_hash
from actors.interfaces.sensor_msgs.msg import Range
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import SetBool
from actors.logs import LogRecord
from actors.testing import Rig
from cli.verbs.bag import COMMAND
from tests.actors.bag.bags import BEGIN, WORDS, text

LINE = "=" * 80
JAZZY = (
    f"uint64 timestamp\nTransition transition\nState start_state\nState goal_state\n{LINE}\nMSG: lifecycle_msgs/Transition\n"
    f"uint8 id\nstring label\n{LINE}\nMSG: lifecycle_msgs/State\nuint8 id\nstring label\n"
)
HUMBLE = (
    f"std_msgs/Header header\nuint8 radiation_type\nfloat32 field_of_view\nfloat32 min_range\nfloat32 max_range\nfloat32 range\n{LINE}\n"
    f"MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n{LINE}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)
TURNED = BagTopic("/point", "geometry_msgs/msg/Point", "float64 z\nfloat64 y\nfloat64 x\n")
CHANGED = BagTopic("/changes", "lifecycle_msgs/msg/TransitionEvent", JAZZY)
RANGED = BagTopic("/range", "sensor_msgs/msg/Range", HUMBLE)
JSON = BagTopic("/json", "Pose", "{}", schema_encoding="jsonschema", serialization_format="json")
EMPTY_POINT = recorded_hash("geometry_msgs/msg/Point", "ros2msg", "")
UNKNOWN = BagTopic("/unknown", "field_msgs/msg/Furrow")


def old(topic: BagTopic, **fields: object) -> bytes:
    return encode(type_of(topic)(**fields))


def bag_of(path: Path, messages: Sequence[tuple[BagTopic, bytes]]) -> Path:
    with BagWriter(path) as bag:
        for number, (topic, data) in enumerate(messages):
            bag.write(topic, data, received_ns=BEGIN + number, published_ns=BEGIN)
    return path


def test_what_was_recorded_is_shown_as_it_was_recorded(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    messages = [
        (TURNED, old(TURNED, z=3.0, y=2.0, x=1.0)),
        (CHANGED, old(CHANGED, timestamp=1_700_000_000_000_000_000, goal_state=State(id=3, label="active"))),
        (RANGED, old(RANGED, range=1.5)),
        (BagTopic("/ping", "field_msgs/msg/Ping", schema_encoding="ros2msg"), b"\0\1\0\0\0"),
        (topic_of("/set/_service_event", event_message(SetBool)), encode(event_message(SetBool)())),
    ]
    assert COMMAND.main(["echo", str(bag_of(tmp_path / "old", messages)), "--json"]) == 0
    shown = capsys.readouterr().out
    assert '"message": {"z": 3.0, "y": 2.0, "x": 1.0}' in shown
    assert '"timestamp": 1700000000000000000' in shown
    assert '"range": 1.5}' in shown and "variance" not in shown
    assert '"message": {}' in shown
    assert '"/set/_service_event"' in shown


def test_echo_goes_on_beside_what_cannot_be_decoded(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    messages = [
        (WORDS, text("a")),
        (JSON, b"{}"),
        (UNKNOWN, b""),
        (JSON, b"{}"),
        (WORDS, text("b")),
        (WORDS, text("c")),
    ]
    assert COMMAND.main(["echo", str(bag_of(tmp_path / "mixed", messages)), "-n", "2"]) == 1
    told = capsys.readouterr()
    assert [line for line in told.out.splitlines() if line.startswith("data")] == ["data: a", "data: b"]
    assert [line.partition(":")[2][:28] for line in told.err.splitlines()] == [
        " /json is recorded in 'json'", " /unknown: unknown message '",
    ]  # fmt: skip


async def test_a_player_plays_the_fields_that_both_definitions_have_and_says_which_not(
    rig: Rig, tmp_path: Path
) -> None:
    messages = [
        (TURNED, old(TURNED, z=3.0, y=2.0, x=1.0)), (CHANGED, old(CHANGED, timestamp=1, goal_state=State(id=3, label="active"))),
        (RANGED, old(RANGED, range=1.5)), (JSON, b"{}"), (UNKNOWN, b""), (WORDS, text("a")), (TURNED, b"\0\1\0\0"),
    ]  # fmt: skip
    path = bag_of(tmp_path / "old", messages)
    lines: list[LogRecord] = []
    await rig.start(Child(Player, args=(path, PlayOptions(paused=True))))
    rig.system.observe(lines=lines.append)
    points, changes = rig.probe(Topic(Point, "/point", 10)), rig.probe(Topic(TransitionEvent, "/changes", 10))
    ranges, words = rig.probe(Topic(Range, "/range", 10)), rig.probe(Topic(String, "/words", 10))
    play = rig.node(Player)
    play.unpause()
    await play.wait()
    assert list(points) == [Point(x=1.0, y=2.0, z=3.0)]
    assert list(changes) == [TransitionEvent(goal_state=State(id=3, label="active"))]
    assert list(ranges) == [Range(range=1.5)]
    assert [message.data for message in words] == ["a"]
    assert play.played == 4, "what was published, and nothing else"


def test_types_are_converted_field_by_field_by_name() -> None:
    assert here(WORDS).type is String
    changed = here(CHANGED)
    assert (changed.type, changed.left_out, changed.defaults) == (TransitionEvent, ("timestamp",), ("stamp",))
    assert (here(TURNED).left_out, here(TURNED).defaults) == ((), ())
    joint = BagTopic(
        "/joint", "sensor_msgs/msg/JointState", "string[] name\nfloat32[] position\nstring velocity\nfloat64 effort\n"
    )
    assert (here(joint).left_out, here(joint).defaults) == (("velocity", "effort"), ("header", "velocity", "effort"))
    (position,) = here(joint).decode(old(joint, name=("a",), position=[0.5])).position  # type: ignore[attr-defined]
    assert position == 0.5
    path = BagTopic(
        "/path",
        "geometry_msgs/msg/Polygon",
        f"Point32[] points\n{LINE}\nMSG: geometry_msgs/Point32\nfloat32 x\nint32 y\nstring z\n",
    )
    spot = type_of(path).__ros_fields__[0].message
    assert spot is not None
    assert (here(path).left_out, here(path).defaults) == (("points.z",), ("points.z",))
    (point,) = here(path).decode(old(path, points=(spot(x=1.0, y=2, z="c"),))).points  # type: ignore[attr-defined]
    assert (point.x, point.y, point.z) == (1.0, 2.0, 0.0)
    for schema in ("int8 other\n", f"Other data\n{LINE}\nMSG: std_msgs/Other\nint8 x\n"):
        with pytest.raises(BagError, match="which has no field in common with the one here"):
            here(BagTopic("/words", "std_msgs/msg/String", schema))
    number = BagTopic("/number", "std_msgs/msg/Int32", "float64 data\n")
    with pytest.raises(BagError, match="no field in common"):
        here(number)
    nested = BagTopic("/pose", "geometry_msgs/msg/Pose", f"Point position\n{LINE}\nMSG: geometry_msgs/Point\nint8 a\n")
    with pytest.raises(BagError, match="no field in common"):
        here(nested)


def test_messages_of_different_definitions_are_kept_apart_when_bags_are_merged(tmp_path: Path) -> None:
    new = topic_of("/point", Point)
    first = bag_of(tmp_path / "old", [(TURNED, old(TURNED, z=3.0))])
    second = bag_of(tmp_path / "new", [(new, encode(Point(z=3.0)))])
    rewrite([first, second], tmp_path / "both")
    with BagReader(tmp_path / "both") as bag:
        assert sorted(here(one.topic).decode(one.data).z for one in bag.messages()) == [3.0, 3.0]  # type: ignore[attr-defined]
        assert len(bag.topics) == 2
    broken = BagTopic("/point", "geometry_msgs/msg/Point", "?\n")
    rewrite([bag_of(tmp_path / "broken", [(broken, b"x")])], tmp_path / "copy")
    with BagReader(tmp_path / "copy") as bag:
        assert bag.topics == (broken,)


def test_a_hash_alone_is_compared_too(tmp_path: Path) -> None:
    other = BagTopic("/words", "std_msgs/msg/String", type_hash="RIHS01_" + "0" * 64)
    with pytest.raises(BagError, match=r"was recorded with another definition .RIHS01_000"):
        type_of(other)
    assert type_of(BagTopic("/words", "std_msgs/msg/String", type_hash=type_hash(String))) is String
    assert type_of(BagTopic("/words", "std_msgs/msg/String", type_hash="unknown")) is String
    rewrite([bag_of(tmp_path / "old", [(other, text("a"))])], tmp_path / "copy")
    with BagReader(tmp_path / "copy") as bag:
        assert bag.topics[0].schema == "", "not that of another definition"


def test_a_definition_that_rosbag2_could_not_classify_is_read(tmp_path: Path) -> None:
    """The definition of a service that needs no other one is in its files with the encoding `unknown`."""
    schema = f"{LINE}\nSRV: field_msgs/srv/Sow\nint8 x\n---\nint8 y\n"
    path = tmp_path / "events.db3"
    database = sqlite3.connect(path)
    database.executescript(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);"
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);"
        "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT, encoding TEXT, encoded_message_definition TEXT, type_description_hash TEXT);"
        "CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER, metadata TEXT);"
        "INSERT INTO topics VALUES(1, '/sow/_service_event', 'field_msgs/srv/Sow_Event', 'cdr');"
    )
    database.execute(
        "INSERT INTO message_definitions VALUES(1, 'field_msgs/srv/Sow_Event', 'unknown', ?, '')", (schema,)
    )
    database.commit()
    database.close()
    with BagReader(path) as bag:
        assert [field.name for field in type_of(bag.topics[0]).__ros_fields__] == ["info", "request", "response"]


def test_an_empty_definition_counts_where_the_type_has_no_fields(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    point = encode(Point(x=1.0, y=2.0, z=3.0))
    bare = BagTopic("/bare", "geometry_msgs/msg/Point", "\n", schema_encoding="ros2msg")
    same = BagTopic("/same", bare.type, type_hash=type_hash(Point), schema_encoding="ros2msg")
    was_empty = BagTopic("/was_empty", bare.type, type_hash=EMPTY_POINT, schema_encoding="ros2msg")
    other = BagTopic("/other", bare.type, type_hash="RIHS01_" + "0" * 64, schema_encoding="ros2msg")
    hoe = BagTopic("/hoe", "field_msgs/msg/Hoe", schema_encoding="ros2msg")
    rake = BagTopic("/rake", "field_msgs/msg/Rake", type_hash="RIHS01_" + "0" * 64, schema_encoding="ros2msg")
    assert type_of(bare) is type_of(same) is Point
    assert not type_of(was_empty).__ros_fields__
    for topic, said in ((other, "recorded with another definition"), (rake, "unknown message 'field_msgs/msg/Rake'")):
        with pytest.raises(BagError, match=said):
            type_of(topic)
    messages = [(bare, point), (same, point), (hoe, b"\0\1\0\0\0"), (hoe, point), (was_empty, b"\0\1\0\0\0")]
    bag = bag_of(tmp_path / "walk", messages)
    assert COMMAND.main(["echo", str(bag), "--json"]) == 1
    out, err = capsys.readouterr()
    shown = [json.loads(line) for line in out.splitlines()]
    assert [(one["topic"], one["message"].get("z")) for one in shown] == [
        ("/bare", 3.0), ("/same", 3.0), ("/hoe", None), ("/was_empty", None),
    ]  # fmt: skip
    assert "the bag's definition of field_msgs/msg/Hoe is empty, and a message has 28 bytes" in err
    rewrite([bag], tmp_path / "new")
    with BagReader(tmp_path / "new") as read:
        assert {topic.name: topic.schema.split()[-2:] for topic in read.topics} == {
            "/bare": ["float64", "z"], "/same": ["float64", "z"], "/hoe": [], "/was_empty": [],
        }  # fmt: skip
