"""`node info`, `interface`, `pkg`, `graph`, `log`, `component`, `daemon`, `multicast` and `completion`."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path

import pytest

from actors import Child, Node, Service, every
from actors.interfaces.composition_interfaces.srv import (
    ListNodes,
    ListNodes_Request,
    ListNodes_Response,
    LoadNode,
    LoadNode_Request,
    LoadNode_Response,
    UnloadNode,
    UnloadNode_Request,
    UnloadNode_Response,
)
from actors.parameters.messages import from_parameter
from cli.verbs.completion import candidates
from tests import warm
from tests.cli.conftest import Command, SystemOf
from tests.cli.stage import Adder, Base, Motor, Talker
from tests.wires import BOTH


async def test_a_node_is_shown_with_all_that_it_has(system_of: SystemOf, command: Command) -> None:
    async with system_of(Adder, Child(Base, namespace="robot")):
        adder = await command("node", "info", "/adder")
        base = (await command("node", "info", "robot/base")).out
        as_json = json.loads((await command("node", "info", "/adder", "--json")).out)
        unknown = await command("node", "info", "/ader")
    assert (adder.code, adder.err) == (0, "")
    assert adder.out.startswith(
        "/adder\n  Subscribers:\n\n  Publishers:\n    /parameter_events: rcl_interfaces/msg/ParameterEvent\n"
        "    /rosout: rcl_interfaces/msg/Log\n  Service Servers:\n    /add_two_ints: example_interfaces/srv/AddTwoInts\n"
    )
    assert adder.out.endswith("  Service Clients:\n\n  Action Servers:\n\n  Action Clients:\n\n")
    assert "  Subscribers:\n    /robot/cmd_vel: geometry_msgs/msg/Twist\n" in base
    assert as_json["Service Servers"]["/add_two_ints"] == ["example_interfaces/srv/AddTwoInts"]
    assert (unknown.code, unknown.err) == (1, "Unable to find node '/ader'; did you mean '/adder'?\n")


async def test_a_definition_is_shown_with_the_types_in_it(command: Command) -> None:
    shown = await command("interface", "show", "my_robot_interfaces/msg/SensorData")
    assert shown.code == 0
    lines = shown.out.splitlines()
    header = next(index for index, line in enumerate(lines) if line.startswith("std_msgs/Header header"))
    assert lines[header + 1 : header + 5] == [
        "\tbuiltin_interfaces/Time stamp",
        "\t\tint32 sec",
        "\t\tuint32 nanosec",
        "\tstring frame_id",
    ]
    assert "---" in (await command("interface", "show", "std_srvs/srv/SetBool")).out.splitlines()
    gps = await command("interface", "show", "NavSatFix")
    assert gps.out == (await command("interface", "show", "sensor_msgs/msg/NavSatFix")).out != ""


async def test_types_are_listed_by_package_and_kind(command: Command) -> None:
    services = (await command("interface", "list", "-s")).out
    assert services.startswith("Services:\n    ")
    assert "    std_srvs/srv/Trigger\n" in services
    assert "/msg/" not in services
    assert (await command("interface", "package", "std_srvs")).out == (
        "std_srvs/srv/Empty\nstd_srvs/srv/SetBool\nstd_srvs/srv/Trigger\n"
    )
    packages = (await command("interface", "packages", "-a")).out.splitlines()
    assert "example_interfaces" in packages
    assert "std_msgs" not in packages
    prototype = await command("interface", "proto", "std_srvs/srv/SetBool")
    assert prototype.out == '"data: false\n"\n'
    assert (await command("interface", "proto", "std_srvs/srv/SetBool", "--no-quotes")).out == "data: false\n\n"


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (("show", "std_msg/msg/String"), "Unknown package 'std_msg'. Did you mean 'std_msgs'"),
        (
            ("show", "std_msgs/msg/Strin"),
            "Could not find the interface 'std_msgs/msg/Strin'. Did you mean 'std_msgs/msg/String'",
        ),
        (("package", "std_msg"), "Unknown package 'std_msg'; did you mean 'std_msgs'"),
        (
            ("show", "String"),
            "String is the name of 2 types; write one of example_interfaces/msg/String, std_msgs/msg/String",
        ),
        (("show", "Twistt"), "there is no type Twistt; did you mean 'Twist'?"),
    ],
)
async def test_a_type_that_is_not_known_is_one_line_with_the_nearest(
    words: tuple[str, ...], error: str, command: Command
) -> None:
    refused = await command("interface", *words)
    assert (refused.code, refused.out) == (1, "")
    assert refused.err.startswith(error)
    assert refused.err.count("\n") == 1


async def test_types_of_a_folder_are_known_without_a_build(command: Command, tmp_path: Path) -> None:
    definition = tmp_path / "garden_msgs" / "msg" / "Gnome.msg"
    definition.parent.mkdir(parents=True)
    definition.write_text("string name\nfloat64 height\n")
    shown = await command("interface", "show", "garden_msgs/msg/Gnome", "--interfaces", str(tmp_path))
    assert shown.out == "string name\nfloat64 height\n"
    (tmp_path / "garden_msgs" / "msg" / "Leftover.msg").write_text("absent_msgs/Thing thing\n")
    shown = await command("interface", "show", "garden_msgs/msg/Gnome", "--interfaces", str(tmp_path))
    assert (shown.code, shown.out) == (0, "string name\nfloat64 height\n"), "one bad file does not hide the others"
    assert "Leftover.msg, line 1: type absent_msgs/Thing is not known" in shown.err
    for bad, content, said in (
        ("garden_msgs/msg/Leftover.msg", b"# gr\xfc\xdfe\n", "Leftover.msg: this is no UTF-8 text"),
        ("garden_msgs/msg/Leftover.msg", b"int32 x\n", ""),
        ("sensor_msgs/msg/Range.msg", b"float32 range\n", "Range is known already with other fields"),
    ):
        (tmp_path / bad).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / bad).write_bytes(content)
        shown = await command("interface", "show", "garden_msgs/msg/Gnome", "--interfaces", str(tmp_path))
        assert (shown.code, shown.out) == (0, "string name\nfloat64 height\n"), bad
        assert said in shown.err
    missing = await command("interface", "list", "--interfaces", str(tmp_path / "nothing"))
    assert missing.code == 1
    assert missing.err.startswith("--interfaces ")


async def test_packages_and_executables_are_those_of_the_tutorials(command: Command) -> None:
    assert "communication_demo" in (await command("pkg", "list")).out.splitlines()
    executables = (await command("pkg", "executables", "communication_demo")).out
    assert "communication_demo sensor_simulator\n" in executables
    assert "communication_demo processor\n" in executables
    full = (await command("pkg", "executables", "communication_demo", "--full-path")).out
    assert "robot.tutorials.communication_demo:SensorSimulator\n" in full
    found = json.loads((await command("pkg", "executables", "communication_demo", "--json")).out)
    path = "robot.tutorials.communication_demo:SensorSimulator"
    assert {"package": "communication_demo", "name": "sensor_simulator", "path": path} in found
    unknown = await command("pkg", "executables", "communication_dem")
    assert unknown.code == 1
    assert unknown.err.startswith("Package 'communication_dem' not found; did you mean 'communication_demo'?")


async def test_a_new_python_package_has_a_node_that_runs(
    command: Command, tmp_path: Path, environment: dict[str, str]
) -> None:
    words = (
        "--build-type",
        "ament_python",
        "--dependencies",
        "rclpy",
        "std_msgs",
        "--destination-directory",
        str(tmp_path),
    )
    made = await command("pkg", "create", "garden", *words, "--node-name", "gnome_node", "--license", "MIT")
    assert (made.code, made.err) == (0, "")
    assert made.out.startswith("going to create a new package\npackage name: garden\n")
    folder = tmp_path / "garden"
    assert {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()} == {
        "package.xml",
        "setup.py",
        "setup.cfg",
        "resource/garden",
        "garden/__init__.py",
        "garden/gnome_node.py",
    }
    assert "<depend>std_msgs</depend>" in (folder / "package.xml").read_text()
    assert (
        "'robactor.nodes': ['garden = garden', 'garden.gnome_node = garden.gnome_node:GnomeNode']"
        in (folder / "setup.py").read_text()
    )
    check = "from garden.gnome_node import GnomeNode; from actors import Node; assert issubclass(GnomeNode, Node)"
    done = warm.run("-c", check, cwd=folder, env=environment)
    assert done.returncode == 0, done.stderr
    again = await command("pkg", "create", "garden", *words)
    assert again.code == 1
    assert "The directory already exists: " in again.err


async def test_a_package_of_interfaces_is_made_and_a_bad_name_is_not(command: Command, tmp_path: Path) -> None:
    made = await command(
        "pkg", "create", "garden_msgs", "--dependencies", "std_msgs", "--destination-directory", str(tmp_path)
    )
    assert made.code == 0
    cmake = (tmp_path / "garden_msgs" / "CMakeLists.txt").read_text()
    assert "find_package(std_msgs REQUIRED)" in cmake
    assert cmake.rstrip().endswith("ament_package()")
    bad = await command("pkg", "create", "Garden", "--destination-directory", str(tmp_path))
    assert (bad.code, bad.out) == (1, "")
    assert not (tmp_path / "Garden").exists()


async def test_the_graph_is_drawn_as_text_for_graphviz_and_for_mermaid(
    system_of: SystemOf, command: Command, tmp_path: Path
) -> None:
    async with system_of(Talker, Base, Adder):
        text = await command("graph")
        dot = (await command("graph", "--format", "dot")).out
        path = tmp_path / "graph.mmd"
        written = await command("graph", "--format", "mermaid", "-o", str(path))
        everything = (await command("graph", "--all")).out
    assert (text.code, text.err) == (0, "")
    assert "  /cmd_vel [geometry_msgs/msg/Twist]\n    (nobody) -> /base\n" in text.out
    assert "  /add_two_ints [example_interfaces/srv/AddTwoInts]\n    (nobody) -> /adder\n" in text.out
    assert "/rosout" not in text.out
    assert "/rosout" in everything
    assert '  "node /talker" -> "topic /chatter";\n' in dot
    assert (written.code, written.out) == (0, "")
    assert path.read_text().startswith("flowchart LR\n")


class Speaker(Node):
    async def on_start(self) -> None:
        self.log.info("all is well")
        self.log.warning("it gets warm")


async def test_log_lines_are_filtered_by_level_node_and_text(system_of: SystemOf, robot: Command) -> None:
    async with system_of(Child(Speaker, name="left", namespace="legs"), Child(Speaker, name="camera")):
        past, warmth, left, legs = await asyncio.gather(
            robot("log", "--past"),
            robot("log", "--past", "--level", "warn"),
            robot("log", "--past", "--node", "/legs/left", "--match", "well"),
            robot("log", "--past", "--node", "/legs/", "--exclude", "well", "--json"),
        )
    spoken = sorted(line.split("] ", 2)[0][1:] + " " + line.split("] ", 2)[2] for line in past.out.splitlines())
    assert spoken == [
        "INFO [camera]: all is well",
        "INFO [legs.left]: all is well",
        "WARN [camera]: it gets warm",
        "WARN [legs.left]: it gets warm",
    ]
    assert len(warmth.out.splitlines()) == 2
    assert [line.split("]: ")[1] for line in left.out.splitlines()] == ["all is well"]
    (one,) = (json.loads(line) for line in legs.out.splitlines())
    assert (one["level"], one["name"], one["message"]) == ("WARN", "legs.left", "it gets warm")
    assert (await robot("log", "--match", "(")).code == 1


LIST = Service(ListNodes, "~/_container/list_nodes")
LOAD = Service(LoadNode, "~/_container/load_node")
UNLOAD = Service(UnloadNode, "~/_container/unload_node")


class Box(Node):
    """A container that only keeps books."""

    async def on_start(self) -> None:
        self.loaded: dict[int, str] = {}
        self.asked: list[LoadNode_Request] = []

    @LIST.serve()
    async def list_nodes(self, request: ListNodes_Request) -> ListNodes_Response:
        return ListNodes.Response(full_node_names=list(self.loaded.values()), unique_ids=list(self.loaded))

    @LOAD.serve()
    async def load_node(self, request: LoadNode_Request) -> LoadNode_Response:
        if request.plugin_name != "demo::Talker":
            return LoadNode.Response(error_message=f"there is no {request.plugin_name}")
        self.asked.append(request)
        number = len(self.asked)
        self.loaded[number] = f"{request.node_namespace}/{request.node_name}"
        return LoadNode.Response(success=True, full_node_name=self.loaded[number], unique_id=number)

    @UNLOAD.serve()
    async def unload_node(self, request: UnloadNode_Request) -> UnloadNode_Response:
        known = self.loaded.pop(request.unique_id, None)
        return UnloadNode.Response(success=known is not None, error_message="" if known else "no such component")


@BOTH
async def test_components_are_loaded_listed_and_unloaded(system_of: SystemOf, command: Command) -> None:
    async with system_of(Box) as system:
        words = ("-n", "ann", "--node-namespace", "/left", "-r", "a:=b", "-p", "rate:=5", "--log-level", "debug")
        loaded = await command("component", "load", "/box", "demo", "demo::Talker", *words)
        assert (loaded.code, loaded.out) == (0, "Loaded component 1 into '/box' container node as '/left/ann'\n")
        (asked,) = system.node(Box).asked
        assert (asked.package_name, asked.remap_rules, asked.log_level) == ("demo", ("a:=b",), 10)
        assert [(each.name, each.value) for each in map(from_parameter, asked.parameters)] == [("rate", 5)]
        assert (await command("component", "list")).out == "/box\n  1  /left/ann\n"
        assert (await command("component", "list", "/box")).out == "  1  /left/ann\n"
        assert (await command("component", "list", "--containers-only")).out == "/box\n"
        failed = await command("component", "load", "/box", "demo", "demo::Nobody")
        assert (failed.code, failed.err) == (1, "Failed to load component: there is no demo::Nobody\n")
        unloaded = await command("component", "unload", "/box", "1", "9")
        assert unloaded.out == "Unloaded component 1 from '/box' container node\n"
        assert unloaded.err.startswith("Failed to unload component 9 from '/box' container node")
        assert unloaded.err.count("\n") == 1
        assert unloaded.code == 1
        absent = await command("component", "list", "/bx")
        assert (absent.code, absent.err) == (1, "Unable to find container node '/bx'; did you mean '/box'?\n")


async def test_the_daemon_is_said_to_be_needless(command: Command) -> None:
    status = await command("daemon", "status")
    assert (status.code, status.err) == (0, "")
    assert status.out.startswith("The daemon is not running")
    for verb in ("start", "stop"):
        assert (await command("daemon", verb)).out.startswith("There is no daemon")


async def test_a_datagram_is_sent_and_an_address_that_is_none_is_one_line(command: Command) -> None:
    wrong = await command("multicast", "send", "--group", "here")
    assert (wrong.code, wrong.err) == (1, "'here' is no IPv4 address, such as 225.0.0.1\n")


async def test_the_words_that_may_come_next_are_those_of_commands_verbs_and_options(command: Command) -> None:
    assert candidates(["inter"]) == ["interface"]
    assert candidates(["topic", "e"]) == ["echo"]
    assert candidates(["topic", "echo", "--no-"]) == ["--no-arr", "--no-str", "--no-lost-messages", "--no-daemon"]
    assert candidates(["topic", "pub", "/x", "y", "--qos-reliability", "b"]) == ["best_effort", "best_available"]
    assert candidates(["nothing", "x"]) == []
    for shell in ("bash", "zsh", "fish"):
        assert "robactor completion words -- " in (await command("completion", shell)).out


async def test_the_words_that_may_come_next_are_the_names_of_the_graph(system_of: SystemOf, command: Command) -> None:
    async with system_of(Talker, Motor):
        assert (await command("completion", "words", "--", "topic", "echo", "/ch")).out == "/chatter\n"
        assert (
            await command("completion", "words", "--", "topic", "pub", "/chatter", "")
        ).out == "std_msgs/msg/String\n"
        assert (await command("completion", "words", "--", "param", "get", "/m")).out == "/motor\n"
    assert (
        "std_msgs/msg/String" in (await command("completion", "words", "--", "interface", "show", "std_msgs/msg/S")).out
    )


class Chatty(Node):
    @every(hz=50)
    def speak(self) -> None:
        self.log.debug("thinking")


async def test_log_shows_and_sets_the_levels_of_nodes_that_serve_them(system_of: SystemOf, command: Command) -> None:
    told = {"enable_logger_service": True}
    tree = (Child(Chatty, name="arm", parameters=told), Child(Chatty, name="left", namespace="legs"))
    async with system_of(*tree) as system:
        assert (await command("log", "--levels")).out == "/arm: info (that of its process)\n"
        assert "thinking" not in (await command("log", "--past")).out
        done = await command("log", "--set", "/legs/left:=debug")
        assert done.code == 1
        assert done.err == ("/legs/left: no logger service; start it with --ros-args -p enable_logger_service:=true\n")
        done = await command("log", "--set", "arm:=debug")
        assert (done.code, done.err, done.out) == (0, "", "arm of the process of /arm: debug\n")
        assert system.node("/arm").log.level == 10
        assert system.node("/legs/left").log.level == 20
        assert json.loads((await command("log", "--levels", "--json")).out) == {"/arm": {"": "info", "arm": "debug"}}
        assert " [arm]: thinking" in (await command("log", "--past", "--level", "debug", "--node", "arm")).out
        done = await command("log", "--set", "error", "--set", "arm:=unset")
        assert done.out == "all loggers of the process of /arm: error\narm of the process of /arm: unset\n"
        assert system.node("/legs/left").log.level == system.node("/arm").log.level == 40
        unknown = await command("log", "--set", "arm:=loud")
        assert (unknown.code, unknown.err.split(";")[0]) == (1, "--set arm:=loud: 'loud' is not a log level")
        absent = await command("log", "--set", "leg:=debug")
        assert (absent.code, absent.err) == (1, "Node not found: leg\n")
