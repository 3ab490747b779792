"""`topic`: what is sent, how often, how large, how old; and sending."""

from __future__ import annotations

import asyncio
import json
from typing import Any

import pytest

from actors import Child
from actors.interfaces.geometry_msgs.msg import Twist
from tests.cli.conftest import Command, SystemOf
from tests.cli.stage import Base, Camera, Listener, Talker
from tests.cli.test_other_verbs import Box
from tests.wires import wire as wire


async def until(condition: Any) -> None:
    async with asyncio.timeout(20):
        while not condition():
            await asyncio.sleep(0.01)


async def test_info_counts_the_ends_and_shows_all_of_each(system_of: SystemOf, command: Command) -> None:
    async with system_of(Talker, Child(Base, namespace="robot")):
        short = await command("topic", "info", "/chatter")
        assert (short.code, short.out) == (0, "Type: std_msgs/msg/String\nPublisher count: 1\nSubscription count: 0\n")
        assert (await command("topic", "info", "/robot/cmd_vel")).out.endswith(
            "Publisher count: 0\nSubscription count: 1\n"
        )
        verbose = (await command("topic", "info", "/robot/description", "-v")).out
    lines = verbose.splitlines()
    gid = next(line for line in lines if line.startswith("GID: "))
    assert len(gid.removeprefix("GID: ").split(".")) == 16
    lines.remove(gid)
    assert lines == [
        "Type: std_msgs/msg/String",
        "",
        "Publisher count: 1",
        "",
        "Node name: talker",
        "Node namespace: /",
        "Topic type: std_msgs/msg/String",
        "Topic type hash: RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
        "Endpoint type: PUBLISHER",
        "QoS profile:",
        "  Reliability: RELIABLE",
        "  History (Depth): KEEP_LAST (1)",
        "  Durability: TRANSIENT_LOCAL",
        "  Lifespan: Infinite",
        "  Deadline: Infinite",
        "  Liveliness: AUTOMATIC",
        "  Liveliness lease duration: Infinite",
        "",
        "Subscription count: 0",
        "",
    ]


async def test_type_and_find_lead_from_a_name_to_its_type_and_back(
    system_of: SystemOf, command: Command, robot: Command
) -> None:
    async with system_of(Talker):
        assert (await command("topic", "type", "/chatter")).out == "std_msgs/msg/String\n"
        found = await command("topic", "find", "std_msgs/msg/String")
        assert found.out == "/chatter\n/robot/description\n"
        assert (await command("topic", "find", "std_msgs/msg/String", "-c")).out == "2\n"
        nobody, unknown = await asyncio.gather(robot("topic", "type", "/nobody"), robot("topic", "info", "/chater"))
        assert (nobody.code, nobody.out, nobody.err) == (1, "", "")
        assert (unknown.code, unknown.err) == (1, "Unknown topic '/chater'; did you mean '/chatter'?\n")


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("topic", "info", "/chatter"), "Type: std_msgs/msg/String"),
        (("topic", "type", "/chatter"), "std_msgs/msg/String"),
        (("node", "info", "/talker"), "/talker"),
        (("service", "type", "/talker/get_parameters"), "rcl_interfaces/srv/GetParameters"),
        (("service", "info", "/talker/get_parameters"), "Type: rcl_interfaces/srv/GetParameters"),
    ],
)
async def test_what_is_asked_for_by_its_name_is_waited_for_a_moment(
    system_of: SystemOf, command: Command, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], line: str
) -> None:
    """A process that has just started, or a busy machine, used to be answered with `Unknown topic`."""
    monkeypatch.setattr("cli.graph.looking.LATE", 20.0)
    async with system_of(Base):
        asked = asyncio.ensure_future(command(*words))
        await asyncio.sleep(0)
        async with system_of(Talker):
            found = await asked

    assert (found.code, found.out.splitlines()[0]) == (0, line)


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("param", "list", "/camera"), "  use_sim_time"),
        (("lifecycle", "get", "/camera"), "unconfigured [1]"),
        (("topic", "echo", "/chatter", "--once"), "data: hello"),
        (("log", "--levels", "--node", "/arm"), "/arm: info (that of its process)"),
        (("component", "list", "/box", "--containers-only"), ""),
    ],
)
async def test_verbs_of_a_node_of_their_own_wait_for_what_they_are_asked_for(
    system_of: SystemOf, command: Command, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], line: str
) -> None:
    """They used to say that it is not there when nothing had been heard of it for 60 ms."""
    monkeypatch.setattr("cli.graph.looking.LATE", 20.0)
    monkeypatch.setattr("cli.graph.looking.QUIET", 0.001)  # as if the machine had been busy for all of it
    arm = Child(Base, name="arm", parameters={"enable_logger_service": True})
    async with system_of(Base) as system:
        asked = asyncio.ensure_future(command(*words))
        await until(lambda: any("cli" in node.fqn for node in system.graph.elsewhere()))
        async with system_of(Talker, Camera, arm, Child(Box, name="box")):
            found = await asked

    assert (found.code, found.err) == (0, "")
    assert line in found.out.splitlines() or not line


async def test_everything_can_be_had_as_json(system_of: SystemOf, command: Command) -> None:
    async with system_of(Talker):
        topics = json.loads((await command("topic", "list", "--json")).out)
        assert {"name": "/chatter", "types": ["std_msgs/msg/String"]} in topics
        info = json.loads((await command("topic", "info", "/chatter", "--json")).out)
        assert [end["node"] for end in info["publishers"]] == ["/talker"]
        assert info["publishers"][0]["qos"]["reliability"] == "reliable"
        message = json.loads((await command("topic", "echo", "/joints", "--once", "--json")).out)
        assert (message["name"], message["position"]) == (["hip", "knee"], [0.25, 1.0])
        field = json.loads((await command("topic", "echo", "/joints", "--once", "--json", "--field", "name")).out)
        assert field == ["hip", "knee"]


async def test_echo_prints_fields_items_and_commas(system_of: SystemOf, command: Command) -> None:
    async with system_of(Talker):
        item = await command("topic", "echo", "/joints", "--once", "--field", "position.[1]")
        assert (item.code, item.out) == (0, "1.0\n---\n")
        last = await command("topic", "echo", "/joints", "--once", "--field", "name[-1]", "--field", "position[0]")
        assert (last.code, last.out) == (0, "knee\n0.25\n---\n")
        before = await command("topic", "echo", "/joints", "--once", "--field", "name[-3]")
        assert (before.code, before.err) == (1, "Invalid field 'name[-3]': there is no item -3; it has 2\n")
        two = await command("topic", "echo", "/joints", "--once", "--field", "name", "--field", "position.[0]")
        assert two.out == "['hip', 'knee']\n0.25\n---\n"
        beyond = await command("topic", "echo", "/joints", "--once", "--field", "name.[2]")
        assert (beyond.code, beyond.err) == (1, "Invalid field 'name.[2]': there is no item 2; it has 2\n")
        csv = (await command("topic", "echo", "/joints", "--once", "--csv")).out
        assert csv.strip().split(",")[2:] == ["", "hip", "knee", "0.25", "1.0", "", ""]
        short = (await command("topic", "echo", "/joints", "--once", "--no-arr", "--field", "header")).out
        assert short.startswith("stamp:\n")
        none = (await command("topic", "echo", "/joints", "--once", "--no-arr", "--no-str")).out
        assert "name: '<sequence type: string, length: 2>'\n" in none
        assert "frame_id: '<string length: <0>>'\n" in none


async def test_echo_prints_only_what_a_filter_lets_through(system_of: SystemOf, command: Command) -> None:
    async with system_of(Talker):
        passed = await command(
            "topic", "echo", "/joints", "--once", "--filter", "m.position[0] < 0.5", "--field", "name"
        )
        assert passed.code == 1, "the filter sees the field, as in ros2"
        assert "AttributeError" in passed.err
        whole = await command("topic", "echo", "/chatter", "--once", "--filter", "m.data == 'hello'")
        assert whole.out == "data: hello\n---\n"
        none = await command("topic", "echo", "/chatter", "--timeout", "0.5", "--once", "--filter", "m.data ==")
        assert (none.code, none.out) == (1, "")
        assert none.err.startswith("--filter 'm.data ==' is no expression of Python: ")


async def test_echo_raw_prints_the_bytes_of_a_type_that_need_not_be_known(
    system_of: SystemOf, command: Command, wire: str
) -> None:
    async with system_of(Talker):
        raw = await command("topic", "echo", "/chatter", "--raw", "--once")
    padding = "\\x00\\x00" if wire == "dds" else ""
    assert (raw.code, raw.out) == (0, f"b'\\x00\\x01\\x00\\x00\\x06\\x00\\x00\\x00hello\\x00{padding}'\n---\n")


async def test_echo_fits_itself_to_what_is_offered_and_says_when_a_flag_does_not_fit(
    system_of: SystemOf, command: Command
) -> None:
    async with system_of(Talker):
        fits = await command("topic", "echo", "/joints", "--once", "--field", "name")
        assert (fits.code, fits.err) == (0, "")
        kept = await command("topic", "echo", "/robot/description", "--once")
        assert kept.out == "data: four legs\n---\n"
        stubborn = await command("topic", "echo", "/joints", "--qos-reliability", "reliable", "--timeout", "0.3")
    assert (stubborn.code, stubborn.out) == (1, "")
    assert stubborn.err == (
        "/joints: nothing comes from /talker, the publisher offers less than the subscription requests: reliability "
        "(offered best_effort, requested reliable): use --qos-reliability best_effort\n"
        "no message on /joints for 0.3 s\n"
    )


async def test_what_is_published_arrives_as_often_as_was_asked_for(system_of: SystemOf, command: Command) -> None:
    async with system_of(Listener) as system:
        twist = "{linear: {x: 0.5}, angular: {z: 0.3}}"
        sent = await command("topic", "pub", "/cmd_vel", "geometry_msgs/msg/Twist", twist, "--times", "3", "-r", "50")
        listener = system.node(Listener)
        await until(lambda: len(listener.heard) == 3)
        assert all(
            (message.linear.x, message.angular.z, message.linear.y) == (0.5, 0.3, 0.0) for message in listener.heard
        )
    assert (sent.code, sent.err) == (0, "")
    shown = (
        "geometry_msgs.msg.Twist(linear=geometry_msgs.msg.Vector3(x=0.5, y=0.0, z=0.0), "
        "angular=geometry_msgs.msg.Vector3(x=0.0, y=0.0, z=0.3))"
    )
    published = "".join(f"publishing #{number}: {shown}\n\n" for number in (1, 2, 3))
    assert sent.out.replace("Waiting for at least 1 matching subscription(s)...\n", "") == (
        f"publisher: beginning loop\n{published}"
    )


async def test_now_and_auto_are_the_instant_of_sending(system_of: SystemOf, command: Command) -> None:
    import time

    async with system_of(Listener) as system:
        before = time.time()
        sent = await command("topic", "pub", "--once", "/pose", "geometry_msgs/msg/PoseStamped", "{header: auto}")
        assert sent.code == 0
        poses = system.node(Listener).poses
        await until(lambda: poses)
        assert before - 1 <= poses[0].header.stamp.sec <= time.time() + 1
        assert poses[0].header.frame_id == ""


async def test_a_publication_for_nobody_gives_up_after_the_time_that_it_is_given(
    meeting: int, command: Command
) -> None:
    alone = await command(
        "topic",
        "pub",
        "--once",
        "/x",
        "std_msgs/msg/String",
        "{data: a}",
        "--max-wait-time-secs",
        "0.2",
        "--spin-time",
        "0.1",
    )
    assert alone.code == 1
    assert alone.err == "Timed out waiting for subscribers: Expected 1 subscribers but only got 0 subscribers\n"
    misused = await command("topic", "pub", "/x", "std_msgs/msg/String", "--max-wait-time-secs", "1")
    assert misused.err == (
        "--max-wait-time-secs option is only effective with --wait-matching-subscriptions, --once or --times\n"
    )


@pytest.mark.parametrize(
    ("values", "error"),
    [
        (
            "{linear: {x: fast}}",
            "Failed to populate field: Twist.linear.x: expected float64 (a float or an int), got str 'fast'\n",
        ),
        (
            "{linera: {x: 1}}",
            "Twist: geometry_msgs/msg/Twist has no field 'linera'; it has linear, angular. Did you mean 'linear'?\n",
        ),
        (
            "{linear: {x: 1}",
            "the values are no YAML (line 1, column 16): expected ',' or '}', but got '<stream end>'\n",
        ),
        ("0.5", "The passed value needs to be a dictionary in YAML format, such as {linear: ...}\n"),
    ],
)
async def test_a_value_that_does_not_fit_is_one_line_that_names_the_field(
    values: str, error: str, system_of: SystemOf, command: Command
) -> None:
    async with system_of(Listener) as system:
        refused = await command("topic", "pub", "--once", "/cmd_vel", "geometry_msgs/msg/Twist", values)
        assert system.node(Listener).heard == []
    assert refused.code == 1
    assert refused.err.endswith(error)
    assert refused.err.count("\n") == 1


async def test_messages_that_echo_has_written_to_a_file_can_be_published_again(
    system_of: SystemOf, command: Command, tmp_path: Any
) -> None:
    path = tmp_path / "twists.yaml"
    path.write_text("linear: {x: 1.0}\n---\nlinear: {x: 2.0}\n---\n")
    async with system_of(Listener) as system:
        words = ("--yaml-file", str(path), "-r", "50", "-w", "1")
        assert (await command("topic", "pub", "/cmd_vel", "geometry_msgs/msg/Twist", *words)).code == 0
        heard = system.node(Listener).heard
        await until(lambda: len(heard) == 2)
        assert heard == [Twist(linear=Twist().linear.replace(x=x)) for x in (1.0, 2.0)]
    missing = await command("topic", "pub", "/cmd_vel", "geometry_msgs/msg/Twist", "--yaml-file", "nothing.yaml")
    assert missing.code == 1
    assert missing.err.startswith("nothing.yaml cannot be read: ")


async def test_a_name_that_can_be_none_is_one_line(meeting: int, command: Command) -> None:
    for words in (
        ("topic", "echo", "/a//b"),
        ("topic", "info", "no spaces"),
        ("topic", "pub", "a-b", "std_msgs/msg/String"),
    ):
        refused = await command(*words)
        assert refused.code == 1
        assert "is not a valid" in refused.err
        assert refused.err.count("\n") == 1
