"""The substitutions of Nav2 that launch files of many robots use."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from actors.launch import LaunchError
from actors.launch.conditions import IfCondition
from actors.launch.nav2 import HasNodeParams, LaunchConfigAsBool, ParseMultiRobotPose, ReplaceString, RewrittenYaml
from actors.launch.substitution import perform, shown
from actors.launch.substitutions.values import LaunchConfiguration
from tests.actors.launch.files import context, written

PARAMS = """
amcl:
  ros__parameters: {use_sim_time: true, rate: 5, frame: <robot>/base, names: [a, b]}
planner:
  ros__parameters: {rate: 7, topic: scan}
"""


def rewritten(folder: Path, rewrites: dict[str, Any], **options: Any) -> Any:
    source = written(folder, "params.yaml", PARAMS)
    path = perform(context(arguments={"x": "9"}), RewrittenYaml(source, rewrites, **options))
    return yaml.safe_load(Path(path).read_text())


def test_values_are_rewritten_by_key_or_by_place(tmp_path: Path) -> None:
    found = rewritten(
        tmp_path,
        {"use_sim_time": "false", "planner.ros__parameters.rate": LaunchConfiguration("x")},
        convert_types=True,
    )

    assert found["amcl"]["ros__parameters"] == {
        "use_sim_time": False,
        "rate": 5,
        "frame": "<robot>/base",
        "names": ["a", "b"],
    }
    assert found["planner"]["ros__parameters"]["rate"] == 9


def test_values_stay_texts_where_types_are_not_converted(tmp_path: Path) -> None:
    assert rewritten(tmp_path, {"rate": "5.0", "amcl": "stays"})["planner"]["ros__parameters"]["rate"] == "5.0"


def test_keys_and_whole_values_are_rewritten_below_a_root(tmp_path: Path) -> None:
    found = rewritten(
        tmp_path,
        {},
        root_key="robot1",
        key_rewrites={"topic": "scan_topic"},
        value_rewrites={"scan": "/scan", "a": "z"},
    )

    assert found["robot1"]["planner"]["ros__parameters"] == {"rate": 7, "scan_topic": "/scan"}
    assert found["robot1"]["amcl"]["ros__parameters"]["names"] == ["z", "b"]


def test_texts_in_a_file_are_replaced_under_a_condition(tmp_path: Path) -> None:
    source = written(tmp_path, "params.yaml", PARAMS)
    replacing = {"<robot>": ("r", "1")}

    replaced = perform(context(), ReplaceString(source, replacing))
    left = perform(context(), ReplaceString(source, replacing, condition=IfCondition("false")))

    assert "r1/base" in Path(replaced).read_text()
    assert left == str(source)
    assert perform(context(), ReplaceString(source, replacing, condition=IfCondition("true"))) != str(source)


def test_a_file_is_asked_for_the_parameters_of_a_node(tmp_path: Path) -> None:
    source = written(tmp_path, "params.yaml", PARAMS)

    assert [perform(context(), HasNodeParams(source, name)) for name in ("amcl", "nobody")] == ["True", "False"]


def test_a_configuration_is_read_as_a_truth_of_python() -> None:
    here = context(arguments={"a": "yes", "b": "0"})

    assert [perform(here, LaunchConfigAsBool(name)) for name in "ab"] == ["True", "False"]


def test_several_robots_are_read_from_an_argument(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["launch", "robots:=r1={x: 1, yaw: 0.5}; r2={}; ;r3=4"])

    assert ParseMultiRobotPose("robots").value() == {
        "r1": {"x": 1.0, "y": 0.0, "z": 0.0, "roll": 0.0, "pitch": 0.0, "yaw": 0.5},
        "r2": {"x": 0.0, "y": 0.0, "z": 0.0, "roll": 0.0, "pitch": 0.0, "yaw": 0.0},
    }
    assert ParseMultiRobotPose("others").value() == {}


def test_a_file_that_is_not_there_is_an_error_or_a_note() -> None:
    lenient = context(lenient=True)
    for substitution in (RewrittenYaml("/none", {}), ReplaceString("/none", {}), HasNodeParams("/none", "n")):
        with pytest.raises(LaunchError, match="there is no file /none"):
            perform(context(), substitution)
        assert perform(lenient, substitution) in ("/none", "False")


def test_they_show_what_they_read() -> None:
    assert shown(RewrittenYaml("a", {})) == "RewrittenYaml('a')" and shown(RewrittenYaml("a", {}).name) == "'a'"
    assert shown(ReplaceString("a", {})) == "ReplaceString('a')"
    assert shown(HasNodeParams("a", "n")) == "HasNodeParams('a', 'n')"
