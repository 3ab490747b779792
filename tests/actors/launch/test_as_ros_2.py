"""What public launch files rely on, beyond the tutorials: as ROS 2 does it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from actors.launch import LaunchError, Packages
from actors.launch.packages import Program
from actors.launch.parameters import Layer
from actors.launch.plan import NodeSpec, jobs
from actors.launch.program import ros_arguments
from actors.parameters.files import ParameterOverrides
from actors.testing import Rig
from tests.actors.launch.files import launch, python, tree, written, xml
from tests.actors.launch.test_actions import logged
from tests.actors.launch.test_composition import started
from tests.actors.launch.test_packages import program, source_package
from tests.actors.launch.test_processes import ran
from tests.actors.launch.test_service import names, said


async def test_what_a_launch_file_sets_in_os_environ_is_the_environment_of_the_launch(tmp_path: Path) -> None:
    path = python(
        tmp_path,
        """
        SetEnvironmentVariable("B_OF_LAUNCH", "2"),
        OpaqueFunction(function=lambda context: [LogInfo(msg=[os.environ["B_OF_LAUNCH"]])]),
        LogInfo(msg=[EnvironmentVariable("A_OF_LAUNCH")]),
        ExecuteProcess(cmd=["sh", "-c", "echo child sees $A_OF_LAUNCH $B_OF_LAUNCH"], output="screen"),
        """,
        before="import os\nos.environ['A_OF_LAUNCH'] = '1'",
    )

    found = await ran(path)

    assert found.lines == ["[sh-1] child sees 1 2"]
    assert [line for line in found.log if line in ("1", "2")] == ["2", "1"]
    assert "A_OF_LAUNCH" not in os.environ and "B_OF_LAUNCH" not in os.environ


def test_a_group_ends_what_was_set_in_os_environ_inside_of_it(tmp_path: Path) -> None:
    path = python(
        tmp_path,
        """
        GroupAction([OpaqueFunction(function=changed), LogInfo(msg=[EnvironmentVariable("A_OF_LAUNCH")])]),
        LogInfo(msg=[EnvironmentVariable("A_OF_LAUNCH")]),
        """,
        before="import os\nos.environ['A_OF_LAUNCH'] = 'outer'\ndef changed(context): os.environ['A_OF_LAUNCH'] = 'inner'",
    )

    assert logged(path) == ["inner", "outer"]


@pytest.mark.parametrize("retries", [0, 2])
async def test_handlers_are_told_once_of_the_end_of_each_run(tmp_path: Path, retries: int) -> None:
    path = python(
        tmp_path,
        f"""
        p := ExecuteProcess(cmd=["false"], respawn=True, respawn_delay=0.01, respawn_max_retries={retries}),
        RegisterEventHandler(OnProcessExit(target_action=p, on_exit=[LogInfo(msg=["a run has ended"])])),
        """,
    )

    found = await ran(path)

    assert found.log.count("a run has ended") == retries + 1


async def test_a_component_is_loaded_without_the_parameters_that_it_does_not_declare(rig: Rig, tmp_path: Path) -> None:
    path = xml(
        tmp_path,
        """
        <node_container pkg="rclcpp_components" exec="component_container" name="box" namespace="">
          <composable_node pkg="control" plugin="MotorController" name="motor">
            <param name="max_velocity" value="25e-1"/><param name="other" value="1"/>
          </composable_node>
        </node_container>
        """,
    )

    await started(rig, path)

    assert "/motor" in names(rig) and "Max velocity: 2.5" in said(rig, "/motor")
    assert "/motor has no parameter 'other'; it is left out" in said(rig, "/box")


async def test_the_parameter_file_of_a_component_may_be_a_map_without_nodes(rig: Rig, tmp_path: Path) -> None:
    file = written(tmp_path, "p.yaml", "max_velocity: 25e-1\n")
    path = xml(
        tmp_path,
        f"""
        <node_container pkg="rclcpp_components" exec="component_container" name="box" namespace="">
          <composable_node pkg="control" plugin="MotorController" name="motor"><param from="{file}"/></composable_node>
        </node_container>
        """,
    )

    await started(rig, path)

    assert "Max velocity: 2.5" in said(rig, "/motor")


@pytest.mark.parametrize("text", ["talker:\n  ros_parameters:\n    a: 1\n", "/**:\n\tros__parameters: {}\n", "a: [\n"])
def test_a_malformed_parameter_file_is_one_line_with_file_and_line_and_nothing_starts(
    tmp_path: Path, text: str
) -> None:
    file = written(tmp_path, "p.yaml", text)
    path = xml(tmp_path, f'<node pkg="control" exec="motor_node"><param from="{file}"/></node>')

    with pytest.raises(LaunchError) as caught:
        launch(path)
    assert f"{file}:" in str(caught.value) and "\n" not in str(caught.value)
    assert [str(problem) for problem in launch(path, lenient=True).problems] == [str(caught.value)]


def test_values_without_a_namespace_are_for_all_nodes_of_the_program(tmp_path: Path) -> None:
    def sent(name: str | None, namespace: str) -> ParameterOverrides:
        words = ros_arguments(NodeSpec("p", "e", name, namespace, [Layer({"a": 1})], [], [], [], None), tmp_path)
        return ParameterOverrides().with_file(words[words.index("--params-file") + 1])

    assert sent("costmap", "").for_node("/any/other") == {"a": 1}
    assert sent("costmap", "/r").for_node("/any/other") == {}
    assert sent("costmap", "/r").for_node("/r/costmap") == {"a": 1}


def test_a_package_of_the_users_goes_before_an_example_of_the_same_name(tmp_path: Path) -> None:
    folder = source_package(tmp_path / "src" / "my_robot_pkg", "my_robot_pkg")
    own = program(folder / "scripts" / "service_client")
    packages = Packages([tmp_path / "src"], environment={})

    assert packages.share("my_robot_pkg") == folder
    assert packages.find("my_robot_pkg", "service_client") == Program("my_robot_pkg", "service_client", own)


def test_what_is_shown_of_later_is_not_done(tmp_path: Path) -> None:
    precious = written(tmp_path, "precious.txt", "")
    path = python(
        tmp_path,
        f"""
        ExecuteProcess(cmd=["sleep", "1"]),
        RegisterEventHandler(OnShutdown(on_shutdown=[
            OpaqueFunction(function=lambda _: os.remove({str(precious)!r})),
            LogInfo(msg=[Command("rm {precious}")]),
            LogInfo(msg=["bye"]),
        ])),
        """,
        before="import os",
    )

    shown = tree(path, lenient=True)

    assert precious.exists()
    assert "log info: bye" in shown
    assert any("OpaqueFunction" in line for line in shown)


def test_names_that_public_launch_files_use_are_there(tmp_path: Path) -> None:
    other = written(tmp_path, "other.py", "def word():\n    return 'from the other'\n")
    path = python(
        tmp_path,
        """
        LogInfo(msg=load_python_launch_file_as_module(OTHER).word()),
        OpaqueFunction(function=lambda c: [LogInfo(msg=str(IfCondition("true")._predicate_func(c)))]),
        """,
        before=f"from launch.launch_description_sources import load_python_launch_file_as_module\nOTHER = {str(other)!r}",
    )

    assert logged(path) == ["from the other", "True"]


def test_a_file_that_is_nested_too_deeply_is_refused_with_its_line(tmp_path: Path) -> None:
    path = xml(tmp_path, "<group>\n" * 3000 + "</group>" * 3000)

    with pytest.raises(LaunchError, match=rf"{path}:\d+: it is nested more than 100 levels deep"):
        launch(path)


def test_a_rewritten_file_is_gone_with_the_process_and_its_texts_stay_texts(tmp_path: Path) -> None:
    source = written(tmp_path, "p.yaml", "a:\n  ros__parameters: {axis: 'y', rate: 1e3, other: 1}\n")
    program = f"""
from actors.launch.context import LaunchContext
from actors.launch.nav2 import RewrittenYaml
from actors.parameters.files import ParameterOverrides
path = RewrittenYaml({str(source)!r}, {{}}).perform(LaunchContext())
print(path)
print(ParameterOverrides().with_file(path).for_node("/a"))
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=60)

    path, values = done.stdout.splitlines()
    assert values == "{'axis': 'y', 'rate': 1000.0, 'other': 1}"
    assert not Path(path).exists()


def test_after_an_absent_module_there_are_problems_but_none_about_what_stands_in_for_it(tmp_path: Path) -> None:
    path = python(
        tmp_path,
        """
        absent_module.Driver(), Node(package="control", executable="motor_node", parameters=[config.to_dict(), "/none.yaml"]),
        """,
        before="import absent_module\nconfig = absent_module.Builder()\nconfig['a'] = 1",
    )

    problems = launch(path, lenient=True).problems

    assert [problem.problem for problem in problems] == [
        "the Python module 'absent_module' is not installed; what it would give is left out",
        "parameter file /none.yaml cannot be read, so it is left out: No such file or directory",
    ]


@pytest.mark.parametrize("given", ["''", "'/'", "LaunchConfiguration('x', default='')"])
def test_an_empty_namespace_counts_as_given(tmp_path: Path, given: str) -> None:
    path = python(
        tmp_path,
        f"Node(package='control', executable='motor_node', name='n', namespace={given}, parameters=[{{'a': 1}}])",
    )
    (job,) = jobs(launch(path)._plan)

    assert job.node is not None
    words = ros_arguments(job.node, tmp_path)
    assert "__ns:=/" in words
    assert Path(words[-1]).read_text().startswith("/n:")


def test_an_empty_namespace_of_a_group_counts_as_given(tmp_path: Path) -> None:
    path = python(tmp_path, "PushRosNamespace(''), Node(package='control', executable='motor_node', name='n')")

    assert tree(path) == ["motor_node-1: control/motor_node as /n (robot.tutorials.motor_controller:MotorController)"]
    (job,) = jobs(launch(path)._plan)
    assert job.node is not None
    assert job.node.namespace == "/"


def test_one_of_two_texts_is_needed_to_choose(tmp_path: Path) -> None:
    with pytest.raises(LaunchError, match="needs if_value"):
        launch(python(tmp_path, "LogInfo(msg=IfElseSubstitution('true'))"))
