"""`run(tree, parameters=, argv=)`: what a run says of the nodes of its tree, and what it is told when that cannot be."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import pytest

from actors import (
    Child,
    DynamicSupervisor,
    Node,
    StartFailed,
    Supervisor,
    System,
    Topic,
    blocking,
    open_node,
    parameter,
    publishes,
    run,
)
from actors.interfaces.std_msgs.msg import String
from actors.logs import DEBUG, LogRecord
from actors.nodes import ParameterServer
from actors.parameters.files import InvalidParams
from actors.running.arguments import InvalidRosArguments, UnknownRosArguments
from actors.running.options import parameters_by_node
from actors.runtime.incarnation import incarnation_of
from actors.system import system_of
from actors.testing import Rig

WORDS = Topic(String, "words")


class Gait(Node):
    words = publishes(WORDS)
    speed = parameter(0.5, ge=0.0, le=2.0)
    mode = parameter("walk")

    async def on_start(self) -> None:
        self.log.debug("gait ready")


class Arm(Node):
    reach = parameter(0.9)


class Strict(Node):
    load = parameter(1)

    @load.validate
    def _even(self, value: int) -> str | None:
        return "odd" if value % 2 else None


def tree() -> Supervisor:
    left = Supervisor("left", children=[Child(Gait, namespace="/left")])
    return Supervisor("robot", children=[Child(Gait), Child(Arm, parameters={"reach": 0.7}), left])


def a_gait() -> Gait:
    return Gait()


class Lines(list[LogRecord]):
    def __call__(self, record: LogRecord) -> None:
        self.append(record)


def node(system: System, fqn: str) -> Any:
    core = system.runtime.directory.find(fqn)
    assert core is not None
    return core.node


def ros(*words: str) -> list[str]:
    return ["--ros-args", *words]


# -- parameters -----------------------------------------------------------------------------------------------------------------


@pytest.mark.virtual
async def test_a_mapping_sets_parameters_by_full_name_and_by_pattern() -> None:
    said = {"/**": {"mode": "trot"}, "gait": {"speed": 1}, "/left/gait": {"mode": "crawl"}}
    async with run(tree(), parameters=said, sinks=()) as system:
        assert (node(system, "/gait").speed, node(system, "/gait").mode) == (1.0, "trot")
        assert (node(system, "/left/gait").speed, node(system, "/left/gait").mode) == (0.5, "crawl")
        assert node(system, "/arm").reach == 0.7


@pytest.mark.virtual
async def test_a_parameter_that_is_not_behind_ros_args_sets_nothing_and_is_named() -> None:
    told = Lines()
    argv = ["--fast", "-p", "speed:=1.0", "speed:=0.7", *ros("-p", "mode:=crawl")]
    async with run(tree(), argv=argv, sinks=(told,)) as system:
        assert (node(system, "/gait").speed, node(system, "/gait").mode) == (0.5, "crawl")
    left = [line.fields["argument"] for line in told if line.event == "not after --ros-args, so not a parameter"]
    assert left == ["-p speed:=1.0", "speed:=0.7"]


@pytest.mark.virtual
async def test_of_several_sources_the_later_counts_and_files_are_read(tmp_path: Path) -> None:
    first, second = tmp_path / "first.yaml", tmp_path / "second.yaml"
    first.write_text("/gait:\n  ros__parameters:\n    speed: 1.0\n    mode: pace\n", encoding="utf-8")
    second.write_text("/gait:\n  ros__parameters:\n    speed: 1.5\n", encoding="utf-8")
    async with run(tree(), parameters=[str(first), second, {"/arm": {"reach": 0.2}}], sinks=()) as system:
        assert (node(system, "/gait").speed, node(system, "/gait").mode) == (1.5, "pace")
        assert node(system, "/arm").reach == 0.2


@pytest.mark.virtual
async def test_the_order_of_sources_is_that_of_ros_2() -> None:
    """Default, then the arguments of the program, then those of one node, then what the program says itself."""
    lines = Lines()
    argv = ros("-p", "speed:=0.1", "-p", "mode:=trot", "-p", "arm:reach:=0.1")
    plain = Child(Gait, name="plain")
    own = Child(Gait, name="own", parameters={"mode": "pace"})
    async with run([plain, own, Child(Arm, parameters={"reach": 0.7})], sinks=(lines,), argv=argv,
                   parameters={"own": {"speed": 2.0}}) as system:  # fmt: skip
        assert (node(system, "/plain").speed, node(system, "/plain").mode) == (0.1, "trot")
        assert (node(system, "/own").speed, node(system, "/own").mode) == (2.0, "pace")
        assert node(system, "/arm").reach == 0.7
    told = [line.fields for line in lines if line.event == "argument without effect"]
    assert told == [
        {"node_name": "/own", "parameter": "mode", "its_child_says": "pace"},
        {"node_name": "/arm", "parameter": "reach", "its_child_says": 0.7},
    ]


@pytest.mark.virtual
async def test_what_counts_all_the_same_is_not_told() -> None:
    lines = Lines()
    argv = ros("-p", "arm:reach:=0.7", "-p", "gait:mode:=trot")
    gait = Child(Gait, parameters={"mode": "pace"})
    async with run(
        gait, Child(Arm, parameters={"reach": 0.7}), sinks=(lines,), argv=argv, parameters={"gait": {"mode": "run"}}
    ):
        pass
    assert [line for line in lines if line.event == "argument without effect"] == []


@pytest.mark.virtual
async def test_they_hold_for_every_life_and_for_nodes_that_come_later() -> None:
    fleet = DynamicSupervisor("fleet", Child(Gait))
    said = {"/**": {"speed": 1.5, "reach": 3.0}}
    async with run(fleet, parameters=said, argv=ros("-r", "two:__ns:=/far"), sinks=()) as system:
        assert system.supervisor is not None
        await system.supervisor.spawn(name="one")
        await system.supervisor.spawn(name="two")
        assert node(system, "/one").speed == node(system, "/far/two").speed == 1.5
        node(system, "/one").stop()
        await asyncio.sleep(1.0)
        assert (incarnation_of(node(system, "/one")).incarnation, node(system, "/one").speed) == (2, 1.5)
        async with open_node("script") as script:
            assert incarnation_of(script).identity.overrides == {"speed": 1.5, "reach": 3.0}


@pytest.mark.virtual
async def test_a_node_that_allows_undeclared_parameters_takes_any() -> None:
    async with run(ParameterServer, parameters={"parameter_server": {"anything": 7}}, sinks=()) as system:
        assert node(system, "/parameter_server").values == {"anything": 7}


@pytest.mark.virtual
async def test_what_a_function_makes_is_checked_when_it_is_made() -> None:
    async with run(
        Child(a_gait, name="gait"), parameters={"gait": {"speed": 1.5}, "/**": {"reach": 1.0}}, sinks=()
    ) as system:
        assert node(system, "/gait").speed == 1.5
    with pytest.raises(StartFailed, match="/gait has no parameter 'sped'; did you mean 'speed'"):
        async with run(Child(a_gait, name="gait"), parameters={"gait": {"sped": 1.5}}, sinks=()):
            pass


@pytest.mark.virtual
async def test_a_value_that_the_nodes_own_check_refuses_fails_its_start() -> None:
    with pytest.raises(StartFailed, match="node /strict cannot start with load = 3: odd"):
        async with run(Strict, parameters={"strict": {"load": 3}}, sinks=()):
            pass


@pytest.mark.parametrize(
    ("parameters", "told"),
    [
        ({"gate": {"speed": 1.0}}, r"run\(parameters=...\): gate: no node is called that; did you mean '/gait'\?"),
        ({"/right/gait": {"speed": 1.0}}, "no node is called that; did you mean '/gait' or '/left/gait'?"),
        ({"xyzzy": {"speed": 1.0}}, "no node is called that; there are: /gait, /arm, /left/gait"),
        ({"/*/arm": {"reach": 1.0}}, r"/\*/arm: no node is called that; did you mean '/arm'"),
        ({"gait": {"sped": 1.0}}, "gait: there is no parameter 'sped'; did you mean 'speed'?"),
        (
            {"arm": {"xyzzy": 1.0}},
            "there is no parameter 'xyzzy'; there are: reach, start_type_description_service, use_sim_time",
        ),
        ({"/**": {"xyzzy": 1.0}}, r"/\*\*: there is no parameter 'xyzzy'; there are: mode, reach, speed, "),
        ({"gait": {"speed": 9.0}}, "node /gait cannot have 'speed' = 9.0: "),
        ({"gait": {"speed": "fast"}}, "node /gait: .*speed"),
        ({"gait": {"speed": object()}}, "node /gait: 'speed': a parameter cannot hold <object"),
        ({"speed": 1.0}, "'speed': write {node: {parameter: value}}"),
        (5, r"run\(parameters=...\): 5 is neither the path of a parameter file nor {node: {parameter: value}}"),
        ([{}, None], "None is neither the path of a parameter file nor"),
        ("no/such.yaml", "no/such.yaml: cannot read the parameter file: No such file"),
    ],
)
def test_a_mistake_is_one_line_that_says_what_where_and_what_to_do(parameters: Any, told: str) -> None:
    with pytest.raises(InvalidParams, match=told) as caught:
        run(tree(), parameters=parameters)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            "/gate:\n  ros__parameters:\n    speed: 1.0\n",
            "f.yaml:3: /gate: no node is called that; did you mean '/gait'",
        ),
        (
            "/gait:\n  ros__parameters:\n    mode: pace\n    sped: 1.0\n",
            "f.yaml:4: /gait: there is no parameter 'sped'; did you mean",
        ),
        ("/gait:\n  ros__parameters:\n    speed: 9.0\n", "f.yaml:3: node /gait cannot have 'speed' = 9.0"),
        ("/gait:\n  ros__parameters:\n    speed:\n", "f.yaml:3: speed: has no value"),
    ],
)
@pytest.mark.parametrize("by", ["parameters", "argv"])
def test_a_mistake_in_a_file_names_its_line(text: str, told: str, by: str, tmp_path: Path) -> None:
    file = tmp_path / "f.yaml"
    file.write_text(text, encoding="utf-8")
    given: dict[str, Any] = {"parameters": file} if by == "parameters" else {"argv": ros("--params-file", str(file))}
    with pytest.raises(ValueError, match=told):
        run(tree(), **given)


def test_what_dynamic_children_are_called_nobody_knows_before() -> None:
    whole = Supervisor("robot", children=[Child(Arm), DynamicSupervisor("fleet", Child(Gait))])
    words = ros("-r", "gait_7:words:=w", "--log-level", "gait_7:=debug")
    with pytest.warns(RuntimeWarning, match="never entered"):
        run(whole, parameters={"gait_7": {"speed": 1.0}}, argv=words)
    with pytest.raises(InvalidParams, match="no parameter 'reech'; did you mean 'reach'"):
        run(whole, parameters={"arm": {"reech": 1.0}})


def test_a_part_of_a_tree_takes_its_part_of_the_parameters() -> None:
    said = {"/**": {"mode": "trot", "reach": 1.0}, "/left/gait": {"speed": 2.0}}
    assert parameters_by_node("here", tree(), said) == {
        "/gait": {"mode": "trot"},
        "/arm": {"reach": 1.0},
        "/left/gait": {"mode": "trot", "speed": 2.0},
    }
    with pytest.raises(InvalidParams, match="here: gate: no node is called that"):
        parameters_by_node("here", tree(), {"gate": {"speed": 1.0}})
    made = Supervisor("robot", children=[Child(a_gait, name="made"), DynamicSupervisor("fleet", Child(Gait))])
    assert parameters_by_node("here", made, {"made": {"any": 1}, "later": {"any": 1}}) == {"/made": {"any": 1}}


# -- arguments ------------------------------------------------------------------------------------------------------------------


@pytest.mark.virtual
async def test_arguments_remap_and_set_and_what_is_left_is_the_programs_own() -> None:
    argv = ["prog", "--fast", *ros("-r", "words:=/loud", "-r", "arm:__node:=hand", "-p", "hand:reach:=0.3"), "--", "3"]
    async with run(Child(Gait, remap={"words": "/own"}), Child(Gait, name="two"), Arm, argv=argv, sinks=()) as system:
        assert system.argv == ("prog", "--fast", "3")
        assert sorted(name for name in system.graph.topics if "o" in name) == ["/loud", "/own"]
        assert node(system, "/hand").reach == 0.3


@pytest.mark.virtual
async def test_without_arguments_nothing_is_left() -> None:
    async with run(Gait, sinks=()) as system:
        assert system.argv == ()


@pytest.mark.virtual
async def test_log_levels_are_those_of_the_logger_or_of_its_nearest_ancestor() -> None:
    lines = Lines()
    async with run(tree(), sinks=(lines,), argv=ros("--log-level", "warn", "--log-level", "left:=debug")) as system:
        assert node(system, "/gait").log.level == 30
        assert node(system, "/left/gait").log.level == DEBUG
        assert system.runtime.system_log.level == 30
    assert {line.node for line in lines if line.event == "gait ready"} == {"/left/gait"}


@pytest.mark.virtual
async def test_stdout_logs_can_be_disabled() -> None:
    lines = Lines()
    async with run(tree(), sinks=(lines,), argv=ros("--disable-stdout-logs")) as system:
        system.log.info("hello")
        assert system.records[-1].event == "hello"
    assert lines == []


@pytest.mark.parametrize(
    ("words", "kind", "told"),
    [
        (
            ("-p", "gait:sped:=1.0"),
            InvalidParams,
            "-p gait:sped:=1.0: gait: there is no parameter 'sped'; did you mean 'speed'",
        ),
        (
            ("-p", "gate:speed:=1.0"),
            InvalidParams,
            "-p gate:speed:=1.0: gate: no node is called that; did you mean '/gait'",
        ),
        (("-p", "gait:speed:=fast"), InvalidParams, "-p gait:speed:=fast: node /gait"),
        (("-p", "speed"), InvalidRosArguments, "write"),
        (("--speed", "3"), UnknownRosArguments, "unknown ROS arguments: '--speed', '3'; write -- before"),
        (
            ("-r", "gate:a:=b"),
            InvalidRosArguments,
            r"no node is called 'gate'; did you mean 'gait'\? \(in: --ros-args --remap gate:a:=b",
        ),
        (("-r", "xyzzy:a:=b"), InvalidRosArguments, "no node is called 'xyzzy'; there are: arm, gait"),
        (
            ("--log-level", "left.gate:=debug"),
            InvalidRosArguments,
            "has the logger 'left.gate'; did you mean 'left.gait'",
        ),
        (
            ("--log-level", "rcl:=debug"),
            InvalidRosArguments,
            "no node has the logger 'rcl'; there are: arm, gait, left.gait",
        ),
        (("--enclave", "/x"), InvalidRosArguments, "has no effect here; leave it out .*--enclave"),
        (("--log-file-name", "x"), InvalidRosArguments, "has no effect here"),
        (("--log-config-file", "x"), InvalidRosArguments, "has no effect here"),
        (("--disable-rosout-logs",), InvalidRosArguments, "has no effect here"),
    ],
)
def test_a_wrong_argument_is_one_line(words: tuple[str, ...], kind: type[ValueError], told: str) -> None:
    with pytest.raises(kind, match=told) as caught:
        run(tree(), argv=ros(*words))
    assert "\n" not in str(caught.value)


# -- nodes of scripts -----------------------------------------------------------------------------------------------------------


@pytest.mark.virtual
async def test_a_node_of_a_script_takes_arguments_of_its_own() -> None:
    argv = ros("-r", "__ns:=/far", "-r", "words:=loud", "-r", "other:=x", "-p", "a:=1", "-p", "b:=2", "-p", "nobody:c:=3",
               "--log-level", "debug")  # fmt: skip
    async with open_node("ear", argv=argv, remap={"words": "/own"}, parameters={"b": 5}, sinks=()) as ear:
        assert ear.fqn == "/far/ear"
        assert incarnation_of(ear).identity.overrides == {"a": 1, "b": 5}
        assert incarnation_of(ear).identity.topic("words") == "/own"
        assert incarnation_of(ear).identity.topic("other") == "/far/x"
        assert ear.log.level == DEBUG


@pytest.mark.parametrize("levels", [("far.ear:=warn",), ("far:=warn",), ("info", "far.ear:=warn")])
@pytest.mark.virtual
async def test_the_level_of_a_scripts_node_is_that_of_its_logger(levels: tuple[str, ...]) -> None:
    words = [word for level in levels for word in ("--log-level", level)]
    async with open_node("ear", namespace="/far", argv=ros(*words), sinks=()) as ear:
        assert ear.log.level == 30
    async with open_node("eye", namespace="/far", argv=ros("--log-level", "far.ear:=warn"), sinks=()) as eye:
        assert eye.log.level == 20


def test_a_node_of_a_script_cannot_silence_the_log_of_all() -> None:
    with pytest.raises(InvalidRosArguments, match="has no effect here"):
        open_node("ear", argv=ros("--disable-stdout-logs"))


def test_a_blocking_node_hands_its_arguments_to_its_tree_or_takes_them_itself() -> None:
    with blocking.open_node("script", tree=tree(), argv=ros("-p", "gait:speed:=1.5"), sinks=()) as script:

        async def speed(me: Node) -> float:
            return float(node(system_of(me), "/gait").speed)

        assert script.run(speed) == 1.5
    with blocking.open_node("script", argv=ros("-r", "__node:=other"), sinks=()) as script:
        assert script.name == "other"
    with pytest.raises(InvalidParams, match="no node is called that"):
        blocking.open_node("script", tree=tree(), argv=ros("-p", "gate:speed:=1.5"))


# -- tests ----------------------------------------------------------------------------------------------------------------------


async def test_a_rig_takes_parameters_as_a_run_does(rig: Rig) -> None:
    system = await rig.start(tree(), parameters={"/left/gait": {"speed": 1.25}})
    assert (node(system, "/left/gait").speed, node(system, "/gait").speed) == (1.25, 0.5)
    assert [line for line in rig.logs if line.event == "gait ready"] != []


async def test_a_rig_refuses_them_as_a_run_does(rig: Rig) -> None:
    with pytest.raises(InvalidParams, match=r"rig.start\(parameters=...\): gate: no node is called that"):
        await rig.start(tree(), parameters={"gate": {"speed": 1.0}})
