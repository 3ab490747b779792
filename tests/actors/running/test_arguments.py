"""The arguments behind --ros-args, as a user meets them."""

from __future__ import annotations

from pathlib import Path

import pytest

from actors.logs.levels import Level
from actors.names.remapping import Rule
from actors.running.arguments import InvalidRosArguments, RosArguments, UnknownRosArguments, parse


def test_a_program_without_ros_arguments_keeps_all_of_its_own() -> None:
    got = parse(["prog", "--speed", "3", "--", "-r"])

    assert got.user_args == ("prog", "--speed", "3", "--", "-r")
    assert got == RosArguments(argv=got.argv, user_indices=(0, 1, 2, 3, 4))


def test_ros_and_user_arguments_may_alternate() -> None:
    got = parse(["prog", "a", "--ros-args", "-r", "x:=y", "--", "b", "--ros-args", "--ros-args", "-e", "/safe"])

    assert got.user_args == ("prog", "a", "b")
    assert got.remap_rules == (Rule.parse("x:=y"),)
    assert got.enclave == "/safe"


def test_parameters_keep_the_order_of_the_command_line(tmp_path: Path) -> None:
    file = tmp_path / "gait.yaml"
    file.write_text("gait:\n  ros__parameters:\n    speed: 1.0\n    name: trot\n")

    got = parse(["--ros-args", "-p", "speed:=0.5", "--params-file", str(file), "-p", "gait:name:=walk"])

    assert got.parameters.for_node("/gait") == {"speed": 1.0, "name": "walk"}
    assert got.parameters.for_node("/arm") == {"speed": 0.5}
    assert got.params_files == (str(file),)


def test_log_levels_are_by_logger_and_the_last_one_wins() -> None:
    levels = ("debug", "gait:=warn", "gait:=ERROR", "Info")
    got = parse(["--ros-args", *(word for level in levels for word in ("--log-level", level))])

    assert got.default_log_level is Level.INFO
    assert got.logger_levels == (("gait", Level.ERROR),)


def test_the_switches_are_on_until_told_and_the_last_word_counts() -> None:
    got = parse(["--ros-args", "--disable-rosout-logs", "--disable-stdout-logs", "--enable-rosout-logs"])

    assert (got.stdout_logs, got.rosout_logs, got.external_lib_logs) == (False, True, True)


def test_log_files_are_named() -> None:
    got = parse(["--ros-args", "--log-config-file", "log.conf", "--log-file-name", "run7"])

    assert (got.log_config_file, got.log_file_name) == ("log.conf", "run7")


def test_what_ros_does_not_know_is_kept_and_refused_when_a_node_is_made() -> None:
    got = parse(["prog", "--ros-args", "--speed", "3", "-r", "a:=b"])

    assert got.unknown_args == ("--speed", "3")
    assert got.remap_rules == (Rule.parse("a:=b"),)
    with pytest.raises(UnknownRosArguments, match="'--speed', '3'; write -- before") as caught:
        got.require_known()
    assert caught.value.arguments == ("--speed", "3")


def test_without_unknown_arguments_nothing_is_refused() -> None:
    got = parse(["--ros-args", "-p", "a:=1"])

    assert got.require_known() is got


@pytest.mark.parametrize(
    "flag", ["-r", "--remap", "-p", "--param", "--params-file", "--log-level", "--log-config-file", "-e", "--enclave"]
)
def test_a_flag_without_its_value_is_refused(flag: str) -> None:
    with pytest.raises(InvalidRosArguments, match="the value after this flag is missing") as caught:
        parse(["prog", "--ros-args", flag])
    assert caught.value.arguments == (flag,)


@pytest.mark.parametrize(
    ("flag", "value", "why"),
    [
        ("-r", "nonsense", "not a remapping rule"),
        ("-p", "speed", r"write \[node:\]name:=value"),
        ("-p", "speed:=", "there is no value"),
        ("-p", "speed:={a: 1}", "not a map"),
        ("--params-file", "/no/such/file.yaml", "cannot read the parameter file"),
        ("--log-level", "LOUD", "not a log level"),
        ("--log-level", ":=debug", "write LEVEL or logger:=LEVEL"),
        ("--log-level", "a:=debug:=info", "write LEVEL or logger:=LEVEL"),
    ],
)
def test_a_wrong_value_is_refused_with_the_reason(flag: str, value: str, why: str) -> None:
    with pytest.raises(InvalidRosArguments, match=why) as caught:
        parse(["--ros-args", flag, value])
    assert caught.value.arguments == (flag, value)
    assert str(caught.value).endswith(f"(in: --ros-args {flag} {value})")


def test_a_mistake_in_a_file_is_told_with_file_and_line(tmp_path: Path) -> None:
    file = tmp_path / "gait.yaml"
    file.write_text("gait:\n  ros__parameters:\n    speed:\n")

    with pytest.raises(InvalidRosArguments, match=r"gait\.yaml:3: speed: has no value"):
        parse(["--ros-args", "--params-file", str(file)])


def test_a_rule_outside_of_a_block_is_deprecated() -> None:
    with pytest.warns(DeprecationWarning, match="write --ros-args --remap a:=b"):
        got = parse(["prog", "a:=b", "not a:=rule"])

    assert got.remap_rules == (Rule.parse("a:=b"),)
    assert got.user_args == ("prog", "not a:=rule")
