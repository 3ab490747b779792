"""Substitutions: each gives the text that ROS 2's has, and an error that names the nearest word where it has none."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from actors.launch.errors import LaunchError, SubstitutionFailure
from actors.launch.substitution import Substitution, as_bool, normalized, perform, shown
from actors.launch.substitutions.grammar import parse_command_line, parse_substitution
from actors.launch.substitutions.logic import (
    AllSubstitution,
    AndSubstitution,
    AnySubstitution,
    EqualsSubstitution,
    IfElseSubstitution,
    NotEqualsSubstitution,
    NotSubstitution,
    OrSubstitution,
    PythonExpression,
    StringJoinSubstitution,
)
from actors.launch.substitutions.paths import (
    Command,
    ExecutableInPackage,
    FileContent,
    FindExecutable,
    FindPackagePrefix,
    FindPackageShare,
    PathJoinSubstitution,
    PathSubstitution,
    ThisLaunchFile,
    ThisLaunchFileDir,
)
from actors.launch.substitutions.values import (
    AnonName,
    EnvironmentVariable,
    ForEachVar,
    ForLoopIndex,
    LaunchConfiguration,
    LaunchLogDir,
    LocalSubstitution,
    Parameter,
)
from tests.actors.launch.files import context

SHARE = str(Path(__file__).parents[3] / "robot" / "tutorials")


def value(text: str, **arguments: str) -> str:
    """What a text of XML or YAML stands for."""
    return perform(context(arguments=arguments), parse_substitution(text))


def failure(text: str, **arguments: str) -> str:
    with pytest.raises(LaunchError) as caught:
        value(text, **arguments)
    return str(caught.value)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("plain", "plain"),
        ("", ""),
        ("$(var name)", "spot"),
        ("a $(var name) b$(var name)", "a spot bspot"),
        ("$(var missing default)", "default"),
        ("$(var missing 'with space')", "with space"),
        ("$(var $(var key))", "spot"),
        ("$(env HOME)", "/home/ros"),
        ("$(env NOTHING other)", "other"),
        ("$(env NOTHING '')", ""),
        ("$(eval '1 + 2')", "3"),
        ("$(eval 'cos(0)')", "1.0"),
        ("$(eval 'math.pi > 3')", "True"),
        ("$(eval 'sys.maxsize > 0' 'sys, os')", "True"),
        ('$(eval \'"$(var name)" == "spot"\')', "True"),
        ("$(eval \"'$(var name)' in ['spot']\")", "True"),
        ("$(not true)", "false"),
        ("$(and true 1)", "true"),
        ("$(and true off)", "false"),
        ("$(or false yes)", "true"),
        ("$(any false false no)", "false"),
        ("$(all true on 1)", "true"),
        ("$(equals a a)", "true"),
        ("$(equals 1 true)", "true"),
        ("$(equals 1.0 1)", "true"),
        ("$(equals a b)", "false"),
        ("$(not-equals a b)", "true"),
        ("$(if true yes no)", "yes"),
        ("$(if false yes)", ""),
        ("$(path-join a b $(var name))", "a/b/spot"),
        ("$(string-join - a b c)", "a-b-c"),
        ("$(command 'echo hi')", "hi\n"),
        ("$(command 'sh -c \"echo out; echo err >&2\"' ignore)", "out\n"),
        ("$(command 'sh -c \"echo err >&2\"' capture)", "err\n"),
        ("$(log_dir)", os.path.join(os.path.expanduser("~"), ".ros", "log")),
        ("$(find-pkg-share humanoid_control)", SHARE),
        ("$(find-pkg-prefix humanoid_control)", SHARE),
        ("$(exec-in-pkg robactor robactor)", str(Path(sys.executable).parent / "robactor")),
        (r"\$(var name)", "$(var name)"),
        (r"costs \$5 and $5", "costs $5 and $5"),
        ("$(var missing \"a 'quoted' one\")", "a 'quoted' one"),
        (r"$(var missing 'it\'s')", "it's"),
        (r"$(var missing a\)b)", "a)b"),
        ("$(var missing pre$(var name)post)", "prespotpost"),
    ],
)
def test_a_text_stands_for_its_value(text: str, expected: str) -> None:
    assert value(text, name="spot", key="name") == expected


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("$(var nme)", "launch configuration 'nme' does not exist; did you mean 'name'?"),
        ("$(env HME)", "environment variable 'HME' does not exist; did you mean 'HOME'?"),
        (
            "$(find-pkg-shre x)",
            "there is no substitution 'find-pkg-shre'; did you mean 'find-pkg-share'? (in $(find-pkg-shre x))",
        ),
        ("$(zzz)", "there is no substitution 'zzz'; there are: all, and, anon"),
        ("$()", "there is no substitution ''"),
        ("$(var)", "$(var ...) takes 1 to 2 arguments, not 0"),
        ("$(eval 1 + 2 + 3)", "takes 1 to 2 arguments, not 5"),
        ("$(equals a)", "$(equals ...) takes 2 arguments, not 1"),
        ("$(var name", "a parenthesis is missing at the end of '$(var name'"),
        ("$(var 'name)", "a quotation mark ' is missing"),
        ("$(not maybe)", "'maybe' is 'maybe', neither 'true' nor 'false'"),
        ("$(eval 'nothing')", "the expression 'nothing' has no value: NameError"),
        ("$(command 'no_such_program')", "the command 'no_such_program' failed: [Errno 2]"),
        ("$(command 'sh -c \"echo bad >&2; exit 3\"')", "failed: bad"),
        ("$(command 'sh -c \"exit 3\"')", "failed: exit code 3"),
        ("$(command 'sh -c \"echo bad >&2\"')", "failed: bad"),
        ("$(command ls sometimes)", "on_stderr is fail, warn, ignore or capture, not 'sometimes'"),
        ("$(find-pkg-share humanoid_contrl)", "did you mean 'humanoid_control'?"),
        ("$(exec-in-pkg planner humanoid_control)", "is a node of this framework, no program with a path"),
        ("$(find-exec no_such_program)", "no program 'no_such_program' on the PATH"),
        ("$(file-content /no/such/file)", "/no/such/file cannot be read"),
        ("$(filename)", "there is no launch file here"),
        ("$(dirname)", "there is no launch file here"),
        ("$(param missing)", "no global parameter 'missing' has been set"),
        ("$(for-var x)", "there is no variable 'x' in this round"),
    ],
)
def test_a_text_without_a_value_is_an_error_that_says_why(text: str, words: str) -> None:
    assert words in failure(text, name="spot")


def test_a_lenient_context_notes_what_is_wrong_once_and_goes_on_with_a_text_that_shows_it() -> None:
    here = context(lenient=True)

    assert perform(here, parse_substitution("$(var nme)/x")) == "$(var nme)/x"
    assert perform(here, parse_substitution("$(var nme)")) == "$(var nme)"

    assert [str(problem) for problem in here.problems] == ["launch configuration 'nme' does not exist"]


def test_what_a_command_says_on_stderr_may_be_a_warning() -> None:
    here = context()

    assert perform(here, Command("sh -c 'echo out; echo careful >&2'", on_stderr="warn")) == "out\n"

    assert "says: careful" in str(here.problems[0])


def test_the_words_of_a_command_line_are_separated_outside_of_quotation_marks_and_substitutions() -> None:
    here = context(arguments={"name": "a b"})

    words = [
        perform(here, word)
        for word in parse_command_line("run --x=$(var name) 'one $(var name)' \"three's\"''  $(var name)x ")
    ]

    assert words == ["run", "--x=a b", "one a b", "three's", "a bx"]
    with pytest.raises(SubstitutionFailure, match="a quotation mark ' is missing"):
        parse_command_line("it's")


def test_files_are_read_and_programs_found(tmp_path: Path) -> None:
    (tmp_path / "robot.urdf").write_text("<robot/>")
    tool = tmp_path / "tool"
    tool.write_text("")
    tool.chmod(0o755)
    here = context(environment={"PATH": str(tmp_path)})
    here.file = tmp_path / "system.launch.py"

    assert perform(here, FileContent(PathJoinSubstitution([tmp_path, "robot.urdf"]))) == "<robot/>"
    assert perform(here, FindExecutable(name="tool")) == str(tool)
    assert perform(here, [ThisLaunchFileDir(), "/x"]) == str(tmp_path / "x")
    assert perform(here, ThisLaunchFile()) == str(here.file)


def test_paths_are_joined_by_a_slash() -> None:
    here = context()

    joined = FindPackageShare("humanoid_control") / "config" / ["a", "b.yaml"]

    assert perform(here, joined) == f"{SHARE}/config/ab.yaml"
    assert perform(here, PathSubstitution("a") / "b") == "a/b"


def test_a_package_is_found_at_once_where_a_launch_file_asks_for_it() -> None:
    from actors.launch import packages_api

    with packages_api.used(context()):
        assert FindPackageShare("any").find("humanoid_control") == SHARE
        with pytest.raises(LaunchError, match="'nowhere' not found"):
            FindPackagePrefix("any").find("nowhere")


def test_an_anonymous_name_is_the_same_within_a_launch_and_another_for_another_name() -> None:
    here = context()

    one, again, other = (perform(here, AnonName(name)) for name in ("rviz", "rviz", "gui"))

    assert one == again != other and one.startswith("rviz_") and other.startswith("gui_")


def test_locals_are_what_a_handler_has_set() -> None:
    here = context()
    here.extend_globals({"event": SimpleNamespace(returncode=3)})

    assert perform(here, LocalSubstitution("event.returncode", "the exit code")) == "3"
    with pytest.raises(SubstitutionFailure, match=r"'event\.reason' has no value here"):
        perform(here, LocalSubstitution("event.reason"))
    assert here.get_locals_as_dict()["event"].returncode == 3


def test_the_log_folder_is_that_of_the_environment() -> None:
    assert perform(context(environment={"ROS_LOG_DIR": "/logs"}), LaunchLogDir()) == "/logs"
    assert perform(context(environment={"ROS_HOME": "/ros"}), LaunchLogDir()) == "/ros/log"


def test_global_parameters_and_variables_of_loops_are_found_by_name() -> None:
    here = context()
    here.scoped.parameters += ["/some/file.yaml", ("rate", 10), ("rate", 20), ("on", True)]
    here.extend_globals({"for_each": {"index": "2"}})

    assert perform(here, Parameter("rate")) == "20"
    assert perform(here, Parameter("on")) == "true"
    assert perform(here, Parameter("none", default="7")) == "7"
    assert perform(here, ForLoopIndex("index")) == "2"
    assert perform(here, ForEachVar("none", default_value="x")) == "x"
    with pytest.raises(SubstitutionFailure, match="did you mean 'index'"):
        perform(here, ForEachVar("indx"))


@pytest.mark.parametrize("given", [True, False, 3, 2.5])
def test_a_default_may_be_a_truth_or_a_number(given: Any) -> None:
    assert perform(context(), LaunchConfiguration("x", default=given)) == str(given).lower()


@pytest.mark.parametrize(
    ("left", "right", "same"),
    [(None, "", True), (True, "true", True), (1, "1.0", True), (0.5, "0.50", True), ("a", "A", False)],
)
def test_values_of_python_can_be_compared(left: Any, right: Any, same: bool) -> None:
    here = context()

    assert as_bool(here, EqualsSubstitution(left, right)) is same
    assert as_bool(here, NotEqualsSubstitution(left, right)) is not same


def test_a_class_of_the_user_is_a_substitution_like_any_other() -> None:
    class Shout(Substitution):
        def perform(self, context: object) -> str:
            return "HEY"

    assert perform(context(), [Shout(), "!", Path("/x")]) == "HEY!/x"
    assert repr(Shout()) == "Shout()"
    with pytest.raises(NotImplementedError, match="does not define perform"):
        perform(context(), Substitution())


def test_what_is_no_text_is_refused() -> None:
    with pytest.raises(TypeError, match="3 is neither a text, nor a substitution"):
        normalized(3)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("substitution", "text"),
    [
        (LaunchConfiguration("x"), "LaunchConfig('x')"),
        (EnvironmentVariable("x"), "EnvVar('x')"),
        (LocalSubstitution("event.x"), "Local('event.x')"),
        (AnonName("x"), "AnonName('x')"),
        (Parameter("x"), "Parameter('x')"),
        (ForEachVar("x"), "ForEachVar('x')"),
        (ForLoopIndex("x"), "ForLoopIndex('x')"),
        (AndSubstitution("a", "b"), "And('a', 'b')"),
        (OrSubstitution("a", "b"), "Or('a', 'b')"),
        (AnySubstitution("a", "b", "c"), "Any('a', 'b', 'c')"),
        (AllSubstitution("a"), "All('a')"),
        (NotSubstitution("a"), "Not('a')"),
        (EqualsSubstitution("a", 1), "Equals('a', '1')"),
        (IfElseSubstitution("a", "b"), "IfElse('a', 'b', '')"),
        (StringJoinSubstitution(["a", "b"]), "StringJoin('a', 'b')"),
        (PythonExpression(["1 + ", LaunchConfiguration("x")]), "PythonExpr('1 + ' + LaunchConfig('x'))"),
        (PathSubstitution("a"), "Path('a')"),
        (PathJoinSubstitution(["a", "b"]), "PathJoin('a', 'b')"),
        (FindPackageShare("a"), "FindPackageShare('a')"),
        (ExecutableInPackage("e", "p"), "ExecInPackage('e', 'p')"),
        (FindExecutable(name="a"), "FindExec('a')"),
        (ThisLaunchFileDir(), "ThisLaunchFileDir()"),
        (FileContent("a"), "FileContent('a')"),
        (Command("ls"), "Command('ls')"),
    ],
)
def test_a_substitution_shows_what_it_is_made_of(substitution: Substitution, text: str) -> None:
    assert shown(substitution) == text
