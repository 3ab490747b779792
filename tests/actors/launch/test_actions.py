"""Arguments, conditions, groups, environment and includes: what they set, and for whom."""

from __future__ import annotations

from pathlib import Path

import pytest

from actors.launch import Launch, LaunchError
from tests.actors.launch.files import context, launch, python, tree, written, xml


def refused(path: Path, **arguments: str) -> str:
    with pytest.raises(LaunchError) as caught:
        launch(path, arguments)
    return str(caught.value)


def logged(path: Path, **arguments: str) -> list[str]:
    """The texts that the file would write to the log."""
    return [line.partition(": ")[2] for line in tree(path, arguments) if line.startswith("log ")]


# -- arguments ------------------------------------------------------------------------------------------------------------------


def test_an_argument_has_its_default_or_what_is_given(tmp_path: Path) -> None:
    path = xml(tmp_path, '<arg name="world" default="kitchen"/><log message="$(var world)"/>')

    assert logged(path) == ["kitchen"]
    assert logged(path, world="park") == ["park"]


def test_an_argument_without_a_default_is_required(tmp_path: Path) -> None:
    path = xml(tmp_path, '\n<arg name="world"/>')

    assert refused(path) == f'{path}:3: Required launch argument "world" was not provided.'
    assert "did you mean 'wrld'?" in refused(path, wrld="x")
    assert launch(path, {"world": "x"}).problems == []


def test_an_argument_is_one_of_its_choices(tmp_path: Path) -> None:
    path = python(tmp_path, "DeclareLaunchArgument('mode', default_value='walk', choices=['walk', 'stand'])")

    assert "argument 'mode' is 'wlk'; did you mean 'walk'?; valid are: walk, stand" in refused(path, mode="wlk")
    assert launch(path).show_arguments().splitlines()[2:] == [
        "    'mode':",
        "        Valid choices are: ['walk', 'stand']",
        "        (default: 'walk')",
    ]


def test_arguments_are_listed_as_ros_2_lists_them(tmp_path: Path) -> None:
    path = xml(
        tmp_path,
        """
        <arg name="a" default="$(env HOME)" description="Where it is."/>
        <arg name="b" description="x"><choice value="1"/><choice value="2"/></arg>
        <bool_arg name="c" default="true"/>
        <group if="false"><arg name="d"/><arg name="a"/></group>
        """,
    )

    assert launch(path, {"b": "1"}).show_arguments() == (
        """Arguments (pass arguments as '<name>:=<value>'):

    'a':
        Where it is.
        (default: EnvVar('HOME'))

    'b':
        x. Valid choices are: ['1', '2']

    'c':
        Valid choices are: ['true', 'false', 'True', 'False', '1', '0']
        (default: 'true')

    'd': *
        no description given

* argument(s) which are only used if specific conditions occur"""
    )
    assert launch(xml(tmp_path, "", "none.launch.xml")).show_arguments().splitlines()[-1] == "  No arguments."


def test_an_argument_that_is_met_without_its_condition_later_is_unconditional(tmp_path: Path) -> None:
    path = xml(tmp_path, '<group if="false"><arg name="a" default="1"/></group><arg name="a" default="2"/>')

    assert "'a':\n" in launch(path).show_arguments()


def test_the_arguments_of_included_files_are_listed_also_those_that_are_given_and_those_under_a_false_condition(
    tmp_path: Path,
) -> None:
    xml(tmp_path, '<arg name="a"/><arg name="b" default="1"/>', "inner.launch.xml")
    twice = '<arg name="c"/>' + '<include if="false" file="$(dirname)/other.launch.xml"/>' * 2
    xml(tmp_path, twice + '<include file="$(dirname)/absent.launch.xml"/>', "other.launch.xml")
    path = xml(
        tmp_path,
        '<include file="$(dirname)/inner.launch.xml"><arg name="a" value="1"/></include>'
        '<include if="false" file="$(dirname)/other.launch.xml"/><include if="false" file="$(var absent)"/>',
    )

    given = python(
        tmp_path,
        """IncludeLaunchDescription(LaunchDescriptionSource(launch_description=LaunchDescription(inside)),
           condition=IfCondition('false'))""",
        before="""
        from launch import LaunchDescriptionSource
        inside = [DeclareLaunchArgument('d'), RegisterEventHandler(OnShutdown(on_shutdown=LogInfo(msg='x')))]
        """,
    )

    shown = launch(path, lenient=True)

    assert launch(given).arguments == ["d"]
    assert shown.arguments == ["a", "b", "c"]
    assert "'c': *" in shown.show_arguments()
    assert shown.problems == []


def test_a_default_may_be_a_truth_of_python(tmp_path: Path) -> None:
    path = python(
        tmp_path, "DeclareBooleanLaunchArgument('gui', default_value=True), LogInfo(msg=LaunchConfiguration('gui'))"
    )

    assert logged(path) == ["true"]


# -- conditions -----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "holds"), [("true", True), (" TRUE ", True), ("1", True), ("false", False), ("0", False)]
)
def test_a_condition_is_true_or_false(tmp_path: Path, text: str, holds: bool) -> None:
    path = xml(tmp_path, f'<log if="{text}" message="if"/><log unless="{text}" message="unless"/>')

    assert logged(path) == ["if" if holds else "unless"]


@pytest.mark.parametrize("text", ["", "maybe", "yes"])
def test_any_other_condition_is_an_error(tmp_path: Path, text: str) -> None:
    path = xml(tmp_path, f'<log if="{text}" message="x"/>')

    assert f"is {text!r}; it must be 'true', '1', 'false' or '0'" in refused(path)


def test_a_condition_may_compare_a_launch_configuration(tmp_path: Path) -> None:
    path = python(
        tmp_path,
        """
        SetLaunchConfiguration('mode', 'walk'),
        LogInfo(msg='a', condition=LaunchConfigurationEquals('mode', 'walk')),
        LogInfo(msg='b', condition=LaunchConfigurationNotEquals('mode', 'walk')),
        LogInfo(msg='c', condition=LaunchConfigurationEquals('none', None)),
        LogInfo(msg='d', condition=Condition(predicate=lambda context: False)),
        LogInfo(msg='e', condition=Condition()),
        """,
    )

    assert logged(path) == ["a", "c", "e"]


def test_conditions_show_what_they_ask() -> None:
    from actors.launch.conditions import (
        Condition,
        IfCondition,
        LaunchConfigurationEquals,
        LaunchConfigurationNotEquals,
        UnlessCondition,
    )

    assert IfCondition("x").describe() == "if 'x'"
    assert UnlessCondition("x").describe() == "unless 'x'"
    assert LaunchConfigurationEquals("a", "b").describe() == "if a == 'b'"
    assert LaunchConfigurationNotEquals("a", None).describe() == "if a != not set"
    assert Condition().describe() == "Condition"


# -- scopes ---------------------------------------------------------------------------------------------------------------------


def test_what_a_group_sets_ends_with_it_unless_it_is_not_scoped(tmp_path: Path) -> None:
    path = xml(
        tmp_path,
        """
        <let name="a" value="outer"/>
        <group><let name="a" value="inner"/><log message="$(var a)"/></group>
        <log message="$(var a)"/>
        <group scoped="false"><let name="a" value="leaked"/></group>
        <log message="$(var a)"/>
        """,
    )

    assert logged(path) == ["inner", "outer", "leaked"]


def test_a_group_without_forwarding_begins_with_what_it_is_given(tmp_path: Path) -> None:
    path = xml(
        tmp_path,
        """
        <let name="a" value="1"/><let name="b" value="2"/>
        <group forwarding="false"><keep name="b" value="$(var b)"/><log message="$(var a none) $(var b)"/></group>
        """,
    )

    assert logged(path) == ["none 2"]


def test_configurations_can_be_unset_reset_pushed_and_popped(tmp_path: Path) -> None:
    path = python(
        tmp_path,
        """
        SetLaunchConfiguration('a', '1'), SetLaunchConfiguration('b', '1'),
        PushLaunchConfigurations(), UnsetLaunchConfiguration('a'), SetLaunchConfiguration('b', '2'),
        LogInfo(msg=[LaunchConfiguration('a', default='none'), LaunchConfiguration('b')]),
        PopLaunchConfigurations(),
        LogInfo(msg=[LaunchConfiguration('a', default='none'), LaunchConfiguration('b')]),
        ResetLaunchConfigurations({'b': LaunchConfiguration('a')}),
        LogInfo(msg=[LaunchConfiguration('a', default='none'), LaunchConfiguration('b')]),
        """,
    )

    assert logged(path) == ["none2", "11", "none1"]


def test_what_was_not_pushed_cannot_be_popped(tmp_path: Path) -> None:
    path = python(tmp_path, "PopLaunchConfigurations()")
    environment = python(tmp_path, "PopEnvironment()", name="environment.launch.py")

    assert "there is no scope to end: a Pop action without its Push action" in refused(path)
    assert "PopEnvironment without PushEnvironment" in refused(environment)


def test_reset_in_xml_keeps_what_it_names(tmp_path: Path) -> None:
    path = xml(
        tmp_path,
        '<let name="a" value="1"/><reset><keep name="b" value="$(var a)"/></reset><log message="$(var a x)$(var b)"/>',
    )

    assert logged(path) == ["x1"]


def test_environment_variables_are_set_for_what_follows(tmp_path: Path) -> None:
    path = xml(
        tmp_path,
        """
        <set_env name="A" value="1"/>
        <append_env name="A" value="2" separator=","/>
        <append_env name="A" value="0" separator="," prepend="true"/>
        <append_env name="B" value="b"/>
        <log message="$(env A) $(env B)"/>
        <unset-env name="A"/>
        <unset-env name="A"/>
        <log message="$(env A none)"/>
        <rep_env><env name="C" value="c"/></rep_env>
        <log message="$(env B none)$(env C)"/>
        <reset_env/>
        <log message="$(env C none)"/>
        <set_ros_log_dir new_log_dir="/logs"/>
        <log message="$(log_dir)"/>
        """,
    )

    assert logged(path) == ["0,1,2 b", "none", "nonec", "none", "/logs"]


def test_the_environment_can_be_pushed_and_popped(tmp_path: Path) -> None:
    path = python(
        tmp_path,
        """
        PushEnvironment(), SetEnvironmentVariable('A', '1'),
        LogInfo(msg=EnvironmentVariable('A', default_value='none')),
        PopEnvironment(),
        LogInfo(msg=EnvironmentVariable('A', default_value='none')),
        """,
    )

    assert logged(path) == ["1", "none"]


# -- loops, functions, includes ----------------------------------------------------------------------------------------------------


def test_a_loop_goes_through_numbers_and_through_sets_of_values(tmp_path: Path) -> None:
    path = xml(
        tmp_path,
        """
        <for len="2" name="i"><log message="robot $(index i)"/></for>
        <for_each values="{name: a, fast: true};{name: b}">
          <for len="1" name="i"><log message="$(for-var name) $(for-var fast no) $(index i)"/></for>
        </for_each>
        <for_each values=""><log message="never"/></for_each>
        """,
    )

    assert logged(path) == ["robot 0", "robot 1", "a true 0", "b no 0"]


def test_a_loop_says_what_it_cannot_go_through(tmp_path: Path) -> None:
    assert "the length of a loop is a whole number, not 'two'" in refused(xml(tmp_path, '<for len="two" name="i"/>'))
    assert "the values of a loop are YAML structures such as {name: a}, not '3'" in refused(
        xml(tmp_path, '<for_each values="3"/>')
    )


def test_loops_of_python_call_a_function(tmp_path: Path) -> None:
    path = python(
        tmp_path,
        """
        ForLoop('2', function=lambda i: [LogInfo(msg=str(i))]),
        ForEach('{name: a}', function=lambda name, last='z': LogInfo(msg=name + last)),
        ForEach('{}', function=lambda **_: None),
        """,
    )

    assert logged(path) == ["0", "1", "az"]


def test_a_function_sees_the_context_and_returns_what_follows(tmp_path: Path) -> None:
    path = python(
        tmp_path,
        "DeclareLaunchArgument('n', default_value='2'), OpaqueFunction(function=robots, args=['robot'], kwargs={'first': 1})",
        before="""
        def robots(context, name, first):
            n = int(LaunchConfiguration('n').perform(context))
            assert context.perform_substitution(LaunchConfiguration('n')) == '2'
            return [LogInfo(msg=f'{name}{i}') for i in range(first, first + n)]
        """,
    )

    assert logged(path) == ["robot1", "robot2"]


def test_an_error_in_a_function_has_its_line(tmp_path: Path) -> None:
    path = python(
        tmp_path,
        "OpaqueFunction(function=fails)",
        before="""
        def fails(context):
            return 1 / 0
        """,
    )

    assert refused(path) == f"{path}:19: OpaqueFunction: ZeroDivisionError: division by zero (at {path}:16)"


def test_an_include_is_evaluated_with_its_arguments_which_stay_set(tmp_path: Path) -> None:
    xml(tmp_path, '<arg name="a" default="1"/><log message="inner $(var a) $(filename)"/>', "sub/inner.launch.xml")
    path = python(
        tmp_path,
        """
        IncludeLaunchDescription(AnyLaunchDescriptionSource([ThisLaunchFileDir(), '/sub/inner.launch.xml']),
                                 launch_arguments={'a': '2'}.items()),
        LogInfo(msg=['outer ', LaunchConfiguration('a')]),
        GroupAction([IncludeLaunchDescription('%s', launch_arguments={'a': '3'})]),
        LogInfo(msg=['outer ', LaunchConfiguration('a'), ' ', ThisLaunchFile()]),
        IncludeLaunchDescription(LaunchDescriptionSource(launch_description=LaunchDescription([LogInfo(msg='direct')]))),
        """
        % (tmp_path / "sub" / "inner.launch.xml"),
    )

    inner = tmp_path / "sub" / "inner.launch.xml"
    assert logged(path) == [f"inner 2 {inner}", "outer 2", f"inner 3 {inner}", f"outer 2 {path}", "direct"]


def test_an_include_that_is_not_there_is_an_error_with_the_nearest(tmp_path: Path) -> None:
    path = xml(tmp_path, '<include file="$(dirname)/systm.launch.xml"/>')
    nowhere = xml(tmp_path, '<include file="/no/where/x.launch.xml"/>', "nowhere.launch.xml")

    assert refused(path) == (
        f"{path}:3: there is no launch file {tmp_path}/systm.launch.xml; did you mean 'system.launch.xml'?".replace(
            ":3:", ":2:"
        )
    )
    assert refused(nowhere).endswith("there is no launch file /no/where/x.launch.xml")


def test_files_that_include_each_other_are_a_circle(tmp_path: Path) -> None:
    path = xml(tmp_path, '<include file="$(filename)"/>')

    assert "is included by itself: 50 launch files include each other" in refused(path)


def test_a_source_shows_where_it_is() -> None:
    from actors.launch.loading import LaunchDescriptionSource

    assert LaunchDescriptionSource(["a", "b"]).describe() == "'a' + 'b'"


# -- entities -------------------------------------------------------------------------------------------------------------------


def test_an_action_of_the_user_says_what_follows_of_it(tmp_path: Path) -> None:
    path = python(
        tmp_path,
        "Twice('hi'), Twice('no', condition=IfCondition('false')), Silent()",
        before="""
        class Twice(Action):
            def __init__(self, text, **options):
                super().__init__(**options)
                self.text = text
            def execute(self, context):
                return [LogInfo(msg=self.text), LogInfo(msg=self.text)]
        class Silent(Action):
            def execute(self, context):
                return None
        """,
    )

    assert logged(path) == ["hi", "hi"]


def test_what_is_no_action_is_refused(tmp_path: Path) -> None:
    assert "str 'hello' is no action, so it cannot be part of a launch description" in refused(
        python(tmp_path, "'hello'")
    )
    assert "Action: NotImplementedError: Action does not define execute(context)" in refused(
        python(tmp_path, "Action()")
    )
    assert "cannot be part of a launch description" in refused(python(tmp_path, "LaunchDescriptionEntity()"))


def test_a_deprecated_file_says_so(tmp_path: Path) -> None:
    path = written(tmp_path, "a.launch.xml", '<launch deprecated="use b"><log message="x"/></launch>')

    assert [str(one) for one in launch(path).problems] == ["this launch file is deprecated: use b"]


def test_a_description_grows_by_what_is_added_to_it(tmp_path: Path) -> None:
    path = python(
        tmp_path,
        "more",
        before="""
        more = LaunchDescription()
        more.add_action(LogInfo(msg='a'))
        more.add_entity(LogInfo(msg='b'))
        assert LogInfo(msg='x').describe() == 'LogInfo'
        """,
    )

    assert logged(path) == ["a", "b"]


def test_log_lines_have_levels(tmp_path: Path) -> None:
    path = xml(
        tmp_path,
        """
        <log_debug message="d"/><log_info message="i"/><log_warning message="w"/><log_error message="e"/>
        <log level="WARN" message="x"/>
        """,
    )

    assert tree(path) == ["log debug: d", "log info: i", "log warning: w", "log error: e", "log warning: x"]
    assert "there is no level 'loud'; there are: debug, info" in refused(
        xml(tmp_path, '<log level="loud" message="x"/>')
    )


def test_a_lenient_evaluation_shows_what_it_could_not_evaluate(tmp_path: Path) -> None:
    path = xml(tmp_path, '<log message="a"/><for len="x" name="i"/><include file="/nowhere"/><arg name="needed"/>')

    shown = launch(path, lenient=True)

    assert shown.show().splitlines()[1:] == [
        "├─ log info: a",
        "├─ ForLoop: the length of a loop is a whole number, not 'x'",
        "└─ IncludeLaunchDescription: there is no launch file /nowhere",
    ]
    assert len(shown.problems) == 3


def test_a_file_that_cannot_be_read_at_all_is_a_problem_of_a_lenient_evaluation(tmp_path: Path) -> None:
    found = Launch(tmp_path / "none.launch.py", lenient=True)

    assert [str(one) for one in found.problems] == [f"there is no launch file {tmp_path}/none.launch.py"]
    assert found.show() == "launch (supervisor, one_for_one)"


def test_a_context_without_a_scope_has_nothing_to_end() -> None:
    with pytest.raises(LaunchError):
        context().pop()


def test_arguments_are_found_below_timers_and_handlers_and_included_descriptions_that_do_not_apply(
    tmp_path: Path,
) -> None:
    path = python(
        tmp_path,
        """
        GroupAction([
            TimerAction(period=1.0, actions=[DeclareLaunchArgument('a')]),
            RegisterEventHandler(OnProcessExit(on_exit=[DeclareLaunchArgument('b')])),
            RegisterEventHandler(OnProcessExit(on_exit=lambda event, context: None)),
            LaunchDescription([DeclareLaunchArgument('c')]),
        ], condition=IfCondition('false')),
        """,
    )

    assert launch(path).arguments == ["a", "b", "c"]


def test_a_condition_that_is_neither_does_not_hold_where_a_file_is_only_shown(tmp_path: Path) -> None:
    path = xml(tmp_path, '<log if="maybe" message="x"/><log message="y"/>')

    assert tree(path, lenient=True) == ["log info: y"]


def test_programs_are_shown_with_their_paths_and_named_by_their_executable(tmp_path: Path) -> None:
    import sys

    path = python(
        tmp_path,
        """
        Node(package='robactor', executable='robactor'), by_path,
        RegisterEventHandler(OnProcessStart(target_action=by_path, on_start=[])),
        """,
        before=f"by_path = Node(executable='{sys.executable}')",
    )

    assert tree(path) == [
        f"robactor-1: robactor/robactor (process {Path(sys.executable).parent / 'robactor'})",
        f"{Path(sys.executable).name}-2: {sys.executable} (process {sys.executable})",
        f"when started: {sys.executable!r}",
    ]


def test_a_program_that_is_not_on_the_path_is_refused_with_its_line(tmp_path: Path) -> None:
    assert refused(xml(tmp_path, '<node exec="no_such_program"/>')).endswith(
        ":2: there is no program 'no_such_program'"
    )


def test_a_group_in_which_nothing_is_started_is_no_part_of_the_tree(tmp_path: Path) -> None:
    assert tree(xml(tmp_path, '<group><let name="a" value="1"/></group>')) == []
