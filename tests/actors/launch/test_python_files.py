"""Launch files in Python: they run unchanged, by a shim that holds only while they are evaluated."""

from __future__ import annotations

import importlib
import sys
import types
from pathlib import Path

import pytest

from actors.launch import LaunchError, Packages
from actors.launch.shim import Unknown, shim
from actors.launch.shim_names import NAMES
from actors.launch.substitution import shown
from tests.actors.launch.files import context, launch, python, tree, written

TUTORIAL = """
from launch import LaunchDescription
from launch_ros.actions import Node


def generate_launch_description():
    return LaunchDescription([
        Node(package='humanoid_control', executable='sensor_simulator', name='sensor_simulator'),
        Node(package='humanoid_control', executable='planner', name='planner'),
        Node(package='humanoid_control', executable='motor_controller', name='motor_controller'),
    ])
"""


def refused(path: Path) -> str:
    with pytest.raises(LaunchError) as caught:
        launch(path)
    return str(caught.value)


def test_the_launch_file_of_the_tutorial_runs_unchanged(tmp_path: Path) -> None:
    assert tree(written(tmp_path, "humanoid_system.launch.py", TUTORIAL)) == [
        "sensor_simulator-1: humanoid_control/sensor_simulator as /sensor_simulator (robot.tutorials.humanoid_lab:SensorSimulator)",
        "planner-2: humanoid_control/planner as /planner (robot.tutorials.humanoid_lab:Planner)",
        "motor_controller-3: humanoid_control/motor_controller as /motor_controller (robot.tutorials.humanoid_lab:MotorController)",
    ]


@pytest.mark.parametrize("module", NAMES)
def test_every_name_that_is_offered_is_there(module: str) -> None:
    with shim(context()):
        found = importlib.import_module(module)
        assert found.__all__ == sorted(NAMES[module])
        assert all(getattr(found, name) is not None for name in found.__all__)


def test_an_installed_package_of_the_same_name_is_itself_again_afterwards(monkeypatch: pytest.MonkeyPatch) -> None:
    real = types.ModuleType("launch")
    monkeypatch.setitem(sys.modules, "launch", real)

    with shim(context()):
        assert importlib.import_module(real.__name__) is not real
        assert "launch_ros" not in sys.modules

    assert sys.modules["launch"] is real
    assert not any(name.partition(".")[0] in ("launch_ros", "ament_index_python") for name in sys.modules)


def test_nothing_is_left_in_python_after_a_launch_file_has_failed(tmp_path: Path) -> None:
    before = list(sys.path), list(sys.meta_path), set(sys.modules)

    refused(written(tmp_path, "a.launch.py", "import launch\nraise ValueError('no')"))

    assert (list(sys.path), list(sys.meta_path)) == before[:2]
    assert not {name for name in set(sys.modules) - before[2] if name.startswith("launch")}


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        (
            "from launch.actions import TimerActoin",
            1,
            "launch.actions.TimerActoin is not supported here; did you mean 'TimerAction'?",
        ),
        ("from launch.events import zzzz", 1, "launch.events.zzzz is not supported here; there are: ExecutionComplete"),
        ("from launch_ros import zzzz", 1, "launch_ros.zzzz is not supported here"),
        (
            "import launch.frontend.parser",
            1,
            "launch.frontend.parser is not supported here; did you mean 'launch.frontend.expose'",
        ),
        ("import no_such_module", 1, "ModuleNotFoundError: No module named 'no_such_module'"),
        ("x = 1\ndef f(:\n", 2, "invalid syntax: def f(:"),
        ("\n\nraise ValueError('no')", 3, "ValueError: no"),
        ("\ndef generate_launch_description():\n    x = 1\n    return 1 / 0", 4, "ZeroDivisionError: division by zero"),
        ("from launch import InvalidLaunchFileError as Wrong\nraise Wrong('no')", 2, "no"),
        (
            "from launch import InvalidLaunchFileError as Wrong\ndef generate_launch_description():\n    raise Wrong('no')",
            3,
            "no",
        ),
        (
            "from ament_index_python import get_package_share_directory as g\ng('humanoid_contrl')",
            2,
            "PackageNotFoundError: package 'humanoid_contrl'",
        ),
        (
            "from ament_index_python import get_package_prefix as g\ng('humanoid_contrl')",
            2,
            "did you mean 'humanoid_control'?",
        ),
    ],
)
def test_an_error_in_a_file_has_its_line(tmp_path: Path, text: str, line: int, words: str) -> None:
    path = written(tmp_path, "a.launch.py", text)

    assert refused(path).startswith(f"{path}:{line}: {words}") or words in refused(path).removeprefix(
        f"{path}:{line}: "
    )
    assert refused(path).startswith(f"{path}:{line}: ")


def test_a_file_needs_the_function_and_a_description(tmp_path: Path) -> None:
    assert refused(written(tmp_path, "a.launch.py", "def generate_launch_descripton(): ...")).endswith(
        "has no function generate_launch_description(); did you mean 'generate_launch_descripton'?"
    )
    assert "generate_launch_description() returned int 3, no LaunchDescription" in refused(
        written(tmp_path, "b.launch.py", "def generate_launch_description(): return 3")
    )
    assert "returned NoneType None" in refused(
        written(tmp_path, "c.launch.py", "def generate_launch_description(): pass")
    )


def test_a_launch_test_gives_a_description_too(tmp_path: Path) -> None:
    path = written(
        tmp_path,
        "a_test.launch.py",
        """
        from launch import LaunchDescription
        from launch_testing.actions import ReadyToTest

        def generate_test_description():
            return LaunchDescription([ReadyToTest()]), {'context': 1}
        """,
    )

    assert tree(path) == ["emit ReadyToTest"]


def test_modules_are_found_by_their_parts_and_by_their_files_too(tmp_path: Path) -> None:
    path = python(
        tmp_path,
        "LogInfo(msg=launch.substitutions.TextSubstitution(text='x')), Late()",
        before="""
        import launch, launch_ros, launch.logging
        import lifecycle_msgs.msg
        from launch.actions.timer_action import TimerAction
        from launch.substitutions.launch_configuration import LaunchConfiguration
        assert lifecycle_msgs.msg.Transition.TRANSITION_CONFIGURE == 1
        assert launch_ros.events.lifecycle.ChangeState and launch_ros.actions.Node is Node
        assert not hasattr(launch, '__no_such__')
        launch.logging.get_logger().debug('x')
        class Late(Action):
            def execute(self, context):
                from launch.actions import LogInfo
                return [LogInfo(msg='late')]
        """,
    )

    assert tree(path) == ["log info: x", "log info: late"]


def test_the_index_of_packages_answers_as_that_of_ros_2(tmp_path: Path) -> None:
    path = python(
        tmp_path,
        "LogInfo(msg=text)",
        before="""
        from ament_index_python import *
        from ament_index_python.packages import get_package_share_directory
        from ament_index_python.resources import has_resource
        share = get_package_share_directory('humanoid_control')
        assert str(get_package_share_path('humanoid_control')) == share == get_package_prefix('humanoid_control')
        assert get_packages_with_prefixes()['humanoid_control'] == share
        assert has_resource('packages', 'humanoid_control') == share
        assert not has_resource('packages', 'nowhere') and not has_resource('plugins', 'x')
        try:
            get_package_share_directory('nowhere')
        except PackageNotFoundError as error:
            text = str(error).partition(' (')[0]
        """,
    )

    assert tree(path) == ["log info: package 'nowhere' not found"]


def test_helpers_for_extensions_of_the_user_are_there(tmp_path: Path) -> None:
    path = python(
        tmp_path,
        "Greeting(['a', LaunchConfiguration('b', default='c')])",
        before="""
        from launch.utilities import *
        class Greeting(Action):
            def __init__(self, text):
                super().__init__()
                ensure_argument_type(text, (str, list), 'text', 'Greeting')
                self.text = normalize_to_list_of_substitutions(text)
            def execute(self, context):
                return normalize_to_list_of_entities(LogInfo(msg=perform_substitutions(context, self.text)))
        try:
            ensure_argument_type(3, str, 'text')
        except TypeError as error:
            assert str(error) == 'argument: text is 3, not one of: str'
        """,
    )

    assert tree(path) == ["log info: ac"]


def test_modules_of_packages_in_folders_can_be_imported(tmp_path: Path) -> None:
    written(tmp_path, "ws/helper/package.xml", "<package><name>helper</name></package>")
    written(tmp_path, "ws/helper/helper/__init__.py", "TEXT = 'helped'")
    path = python(tmp_path, "LogInfo(msg=TEXT)", before="from helper import TEXT")

    assert tree(path, packages=Packages([tmp_path / "ws"], {})) == ["log info: helped"]


def test_what_is_not_installed_is_stood_in_for_where_a_file_is_only_shown(tmp_path: Path) -> None:
    path = python(
        tmp_path,
        "LogInfo(msg=unknown.text), LogInfo(msg=str(unknown()['x'].y)), LogInfo(msg=share), Node(package='control', executable='motor_node', "
        "parameters=[unknown])",
        before="""
        import no_such_module.inner
        from no_such_module import thing
        from ament_index_python import get_package_share_directory
        import actors.nothing_here_either if False else None
        """.replace("import actors.nothing_here_either if False else None", "unknown = thing.make(1, a=2)")
        + "\n        for each in unknown:\n            raise ValueError\n        share = get_package_share_directory('nowhere')\n"
        + "        assert not hasattr(no_such_module, '__x__') and not hasattr(unknown, '__x__')\n",
    )

    found = launch(path, lenient=True)
    assert shown(Unknown("a.b")) == "$(a.b)"

    assert [line.strip("│├└─ ") for line in found.show().splitlines()[1:]] == [
        "log info: $(no_such_module.thing.make.text)",
        "log info: $(no_such_module.thing.make.y)",
        "log info: $(find-pkg-share nowhere)",
        "motor_node-1: control/motor_node (robot.tutorials.motor_controller:MotorController)",
        "parameters of $(no_such_module.thing.make) (not here)",
    ]
    assert "the Python module 'no_such_module' is not installed" in str(found.problems[0])


def test_a_part_that_an_installed_package_lacks_is_not_stood_in_for(tmp_path: Path) -> None:
    found = launch(python(tmp_path, "", before="import actors.no_such_part"), lenient=True)

    assert "No module named 'actors.no_such_part'" in str(found.problems[0])


def test_what_the_stand_in_for_a_module_cannot_do_is_no_further_problem(tmp_path: Path) -> None:
    path = written(
        tmp_path,
        "a.launch.py",
        "import no_such_module\ndef generate_launch_description():\n    return no_such_module.make() + 'x'\n",
    )

    found = launch(path, lenient=True)

    assert found.is_broken
    (problem,) = found.problems
    assert "the Python module 'no_such_module' is not installed" in str(problem)


def test_the_utilities_of_launch_and_launch_ros_are_there(tmp_path: Path) -> None:
    path = python(
        tmp_path,
        "OpaqueFunction(function=shown)",
        before="""
        from launch.events.process import ProcessIO, ProcessStdout
        from launch.frontend import expose
        from launch.utilities.type_utils import *
        from launch_ros.utilities import *
        assert issubclass(ProcessStdout, ProcessIO)
        assert [prefix_namespace(*pair) for pair in ((None, None), ('a', None), ('a', 'b'), ('/a', '/b'), ('/', 'b'), ('/a', ''), (None, '/'))] \\
            == [None, 'a', 'a/b', '/b', '/b', '/a', '/']
        assert [make_namespace_absolute(one) for one in (None, 'a', '/a')] == [None, '/a', '/a']
        assert [len(one) for one in normalize_remap_rules([('a', ['b', 'c'])])[0]] == [1, 2]
        def shown(context):
            text = normalize_typed_substitution(['1', LaunchConfiguration('x', default='2')], int)
            numbers = perform_typed_substitution(context, normalize_typed_substitution('[1, 2]', list[int]), list[int])
            assert normalize_typed_substitution(3, int) == 3 and is_substitution(text) and not is_substitution('a')
            given = normalize_parameters([{'a': LaunchConfiguration('x', default='2')}, '/nowhere.yaml'])
            return [LogInfo(msg=f'{perform_typed_substitution(context, text, int)} {numbers} {evaluate_parameters(context, given)}')]
        """,
    )

    assert tree(path) == ["log info: 12 [1, 2] ({'a': 2}, PosixPath('/nowhere.yaml'))"]
