"""Types that only other processes know: described by their nodes, and defined here."""

from __future__ import annotations

import asyncio
import signal
from pathlib import Path

import pytest
import pytest_asyncio

from actors.bag import BagReader
from actors.interfaces import encode, get_message, load, type_hash
from actors.interfaces.describing import described
from actors.interfaces.learning import define, definitions_of
from actors.interfaces.type_description_interfaces.srv import GetTypeDescription
from tests.cli.conftest import Command, Start
from tests.facts import lacks

PROGRAM = """
import asyncio
from actors import Node, Topic, Service, every, publishes, run, Action, Done
from actors.interfaces import load_folder
from actors.transport import transport_from_environment
import os
for _ in (load_folder("."),): pass
from actors.interfaces import get_message, get_service, get_action
Gnome, Paint, Dig = get_message("garden_msgs/Gnome"), get_service("garden_msgs/Paint"), get_action("garden_msgs/Dig")
PAINT, DIG = Service(Paint, "paint"), Action(Dig, "dig")
class Garden(Node):
    gnomes = publishes(Topic(Gnome, "gnomes", 10))
    @every(hz=100)
    def tick(self):
        self.gnomes(Gnome(name="Ann", hat=dict_hat()))
    @PAINT.serve()
    async def paint(self, request):
        return Paint.Response(message=f"{request.gnome} is {request.colours[0]}")
    @DIG.serve()
    async def dig(self, goal):
        yield Dig.Feedback(depth=0.5)
        yield Done(Dig.Result(depth=goal.depth))
def dict_hat():
    return get_message("garden_msgs/Hat")(height=0.25, dots=[1, 2])
async def main():
    async with run(Garden, transport=transport_from_environment(os.environ), sinks=()) as system:
        print("ready", flush=True)
        await system.wait()
asyncio.run(main())
"""

DEFINITIONS = {
    "msg/Hat.msg": "float64 height\\nuint8[] dots\\n",
    "msg/Gnome.msg": "string<=10 name\\nHat hat\\nint32[2] shoes\\nfloat32[<=3] coins\\n",
    "srv/Paint.srv": "string gnome\\nstring[] colours\\n---\\nstring message\\n",
    "action/Dig.action": "float64 depth\\n---\\nfloat64 depth\\n---\\nfloat64 depth\\n",
}


@pytest_asyncio.fixture
async def garden(tmp_path: Path, start: Start) -> None:
    """A process whose types nobody else knows."""
    for name, text in DEFINITIONS.items():
        path = tmp_path / "garden_msgs" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text.replace("\\n", "\n"))
    process = await start("-c", PROGRAM, cwd=tmp_path)
    async with asyncio.timeout(30):
        assert await process.stdout.readline() == b"ready\n"


async def test_a_message_type_that_only_its_publisher_knows_is_fetched_from_it(garden: None, robot: Command) -> None:
    heard = await robot("topic", "echo", "/gnomes", "--once")
    assert (heard.code, heard.err) == (0, "")
    assert heard.out == ("name: Ann\nhat:\n  height: 0.25\n  dots:\n  - 1\n  - 2\nshoes:\n- 0\n- 0\ncoins: []\n---\n")


async def test_so_is_that_of_a_service_and_of_an_action(garden: None, robot: Command) -> None:
    painted = await robot("service", "call", "/paint", "garden_msgs/srv/Paint", "{gnome: Ann, colours: [red]}")
    assert (painted.code, painted.err) == (0, "")
    assert painted.out.endswith("response:\ngarden_msgs.srv.Paint_Response(message='Ann is red')\n\n")
    dug = await robot("action", "send_goal", "/dig", "garden_msgs/action/Dig", "{depth: 2}", "-f")
    assert (dug.code, dug.err) == (0, "")
    assert "Feedback:\n    depth: 0.5\n" in dug.out
    assert dug.out.endswith("Result:\n    depth: 2.0\n\nGoal finished with status: SUCCEEDED\n")


async def test_a_type_that_nobody_describes_is_one_line_that_says_what_to_give(garden: None, robot: Command) -> None:
    unknown = await robot("topic", "pub", "--once", "/gnomes", "garden_msgs/msg/Gnom", "{}")
    assert (unknown.code, unknown.out) == (1, "")
    assert unknown.err.startswith("The passed message type is invalid: ")
    assert unknown.err.count("\n") == 1


async def test_definitions_are_written_from_what_nodes_know_and_modules_from_the_definitions(
    garden: None, robot: Command, tmp_path: Path
) -> None:
    share = tmp_path / "fetched" / "share"
    wrote = await robot("interface", "generate", "garden_msgs", "--definitions", "--out", str(share))
    assert (wrote.code, wrote.err, wrote.out) == (0, "", f"4 definitions, 4 written, in {share}\n")
    files = {str(path.relative_to(share / "garden_msgs")): path.read_text() for path in share.rglob("*.*")}
    manifest, cmake = files.pop("package.xml"), files.pop("CMakeLists.txt")
    assert files == {name: text.replace("\\n", "\n") for name, text in DEFINITIONS.items()}
    assert "<name>garden_msgs</name>" in manifest and "rosidl_interface_packages" in manifest
    needs = [line.split(">")[1].split("<")[0] for line in manifest.splitlines() if "<depend>" in line]
    assert [f"find_package({each} REQUIRED)" in cmake for each in needs] == [True] * len(needs) != []
    again = await robot("interface", "generate", "garden_msgs/msg/Gnome", "--definitions", "--out", str(share))
    assert again.out == f"2 definitions, 0 written, in {share}\n"
    made = await robot("interface", "generate", str(share))
    assert (made.code, made.err) == (0, "")
    assert made.out.startswith(f"4 modules, 4 written, in {share.parent}\n")
    assert "class Gnome(Message" in (share.parent / "garden_msgs" / "msg.py").read_text()
    (share / "garden_msgs" / "msg" / "Hat.msg").write_text("float32 height\n")
    old = await robot("interface", "generate", str(share), "--check")
    assert old.code == 1
    assert old.out.endswith(f"is missing or old; run robactor interface generate {share}\n")
    differs = await robot("interface", "generate", "garden_msgs", "--definitions", "--out", str(share))
    path = share / "garden_msgs" / "msg" / "Hat.msg"
    assert differs.code == 1
    assert lacks(differs.err, f"{path} differs move") == []


@pytest.mark.parametrize("sources", [True, False])
def test_a_type_that_is_defined_by_its_description_has_the_same_hash_and_bytes(sources: bool) -> None:
    """Both ways lead to it: the texts of the definitions, and without them the descriptions of the fields."""
    package = f"shed{int(sources)}_msgs"
    load("float64 height\nbool[3] dots\n", f"{package}/msg/Hat")
    original = load("string<=10 name\nHat[<=2] hats\nwstring[] notes\nbyte b\n", f"{package}/msg/Gnome")
    answer = described(GetTypeDescription.Request(type_name=f"{package}/msg/Gnome", include_type_sources=sources))
    renamed = answer.replace(
        type_description=_renamed(answer.type_description, package),
        type_sources=[_renamed(each, package) for each in answer.type_sources],
    )
    define(definitions_of(f"new_{package}/msg/Gnome", [renamed]))
    made = get_message(f"new_{package}/msg/Gnome")
    assert made is not original
    assert [str(field.type).replace("new_", "") for field in made.__ros_fields__] == [
        str(field.type) for field in original.__ros_fields__
    ]
    assert encode(made(name="Ann", notes=["a"], b=7)) == encode(original(name="Ann", notes=["a"], b=7))
    assert type_hash(made) != type_hash(original)  # the names of the packages are part of it


def _renamed(message: object, package: str) -> object:
    """A description of the same type in another package, which is not known here yet."""
    import msgspec

    from actors.interfaces import from_plain, to_plain

    text = msgspec.json.encode(to_plain(message)).decode()  # type: ignore[arg-type]
    return from_plain(type(message), msgspec.json.decode(text.replace(package, f"new_{package}")))  # type: ignore[type-var]


async def test_a_type_that_ships_is_written_when_it_is_asked_for_and_one_that_nobody_knows_is_one_line(
    meeting: int, command: Command, tmp_path: Path
) -> None:
    wrote = await command("interface", "generate", "nav_msgs/Path", "--definitions", "--out", str(tmp_path))
    assert (wrote.code, wrote.out) == (0, f"1 definitions, 1 written, in {tmp_path}\n")
    assert "geometry_msgs/PoseStamped[] poses" in (tmp_path / "nav_msgs" / "msg" / "Path.msg").read_text()
    unknown = await command("interface", "generate", "nav_msg", "--definitions", "--spin-time", "0.1")
    assert unknown.code == 1
    assert unknown.err.startswith("nav_msg is no type and no package that is known here, and no node uses it.")
    assert "nav_msgs" in unknown.err
    two = await command("interface", "generate", "a", "b")
    assert (two.code, two.err.count("\n")) == (1, 1)


async def test_a_recorder_asks_for_the_types_that_it_does_not_know(
    garden: None, start: Start, robot: Command, tmp_path: Path
) -> None:
    bag = tmp_path / "walk"
    process = await start("bag", "record", "--all", "-o", str(bag))
    async with asyncio.timeout(60):
        while "Subscription count: 1\n" not in (await robot("topic", "info", "/dig/_action/feedback")).out:
            assert process.returncode is None
        dug = await robot("action", "send_goal", "/dig", "garden_msgs/action/Dig", "{depth: 2}")
        process.send_signal(signal.SIGINT)
        _, error = await process.communicate()
    assert (dug.code, process.returncode) == (0, 0)
    assert b"not recorded" not in error
    with BagReader(bag) as read:
        counts = {topic.name: count for topic, count in read.metadata.topics.items()}
        types = {topic.name: topic.type for topic in read.topics}
        first = next(iter(read.messages(["/gnomes"]))).data
    assert types["/gnomes"] == "garden_msgs/msg/Gnome"
    assert b"Ann" in first
    assert counts["/gnomes"] > 5
    assert types["/dig/_action/feedback"] == "garden_msgs/action/Dig_FeedbackMessage"
    assert counts["/dig/_action/feedback"] == 1
