"""Packages, their executables and their files, found by entry points, in folders of sources, and below prefixes."""

from __future__ import annotations

import sys
from importlib.metadata import entry_points
from pathlib import Path

import pytest

from actors import Node
from actors.launch.packages import (
    GROUP,
    NodeTarget,
    Packages,
    Program,
    UnknownExecutable,
    UnknownPackage,
    folder_of_module,
)
from actors.running.target import find
from actors.supervision.declarations import Supervisor
from robot.tutorials import EXECUTABLES
from tests.facts import lacks


def program(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("#!/bin/sh\n")
    path.chmod(0o755)
    return path


def source_package(folder: Path, name: str) -> Path:
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text(f"<package><name> {name} </name></package>")
    return folder


def installed(prefix: Path, package: str) -> Path:
    index = prefix / "share" / "ament_index" / "resource_index" / "packages"
    index.mkdir(parents=True, exist_ok=True)
    (index / package).touch()
    (prefix / "share" / package / "launch").mkdir(parents=True)
    return program(prefix / "lib" / package / "talker")


def test_a_node_of_the_tutorials_is_found_by_the_name_of_its_package() -> None:
    found = Packages(environment={}).find("humanoid_control", "planner")

    assert found == NodeTarget("humanoid_control", "planner", "robot.tutorials.humanoid_lab:Planner")


def test_both_names_of_the_battery_server_start_it() -> None:
    packages = Packages(environment={})

    one, other = (packages.find("my_first_robot", name) for name in ("battery_server", "battery_service_server"))

    assert isinstance(one, NodeTarget) and isinstance(other, NodeTarget) and one.target == other.target


TARGETS = {
    **{entry.name: entry.value for entry in entry_points(group=GROUP) if ":" in entry.value},
    **{f"{package}.{name}": target for package, nodes in EXECUTABLES.items() for name, target in nodes.items()},
}


@pytest.mark.parametrize("target", TARGETS.values(), ids=TARGETS)
def test_every_entry_point_and_example_leads_to_a_node_or_a_tree(target: str) -> None:
    made = find(target)()

    assert isinstance(made, Supervisor) or (isinstance(made, type) and issubclass(made, Node))


def test_a_console_script_is_an_executable_of_its_distribution() -> None:
    found = Packages(environment={}).find("robactor", "robactor")

    assert found == Program("robactor", "robactor", Path(sys.executable).parent / "robactor")
    assert Packages(environment={}).share("pytest") == folder_of_module("pytest")


def test_a_distribution_whose_script_was_removed_has_no_executable(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))

    with pytest.raises(UnknownPackage):
        Packages(environment={}).find("robactor", "robactor")


def test_the_prefixes_of_ament_are_searched_in_their_order(tmp_path: Path) -> None:
    first, second = tmp_path / "overlay", tmp_path / "underlay"
    over, _ = installed(first, "demo"), installed(second, "demo")
    (first / "lib" / "demo" / "readme").write_text("no program")
    packages = Packages(environment={"AMENT_PREFIX_PATH": f"{first}:{second}:"})

    assert packages.executables("demo") == {"talker": Program("demo", "talker", over)}
    assert packages.share("demo") == first / "share" / "demo"
    assert packages.prefix("demo") == first
    assert "demo" in packages.names()


def test_an_entry_point_comes_before_a_program_of_a_prefix_and_both_are_listed(tmp_path: Path) -> None:
    installed(tmp_path, "actors")
    program(tmp_path / "lib" / "actors" / "clock_publisher")

    found = Packages(environment={"AMENT_PREFIX_PATH": str(tmp_path)}).executables("actors")

    assert isinstance(found["clock_publisher"], NodeTarget)
    assert isinstance(found["talker"], Program)


def test_packages_are_found_by_their_package_xml_at_any_depth_and_else_by_their_folder(tmp_path: Path) -> None:
    inner = source_package(tmp_path / "repo" / "nested" / "folder", "driver")
    broken = tmp_path / "repo" / "broken"
    broken.mkdir()
    (broken / "package.xml").write_text("<package>")
    source_package(tmp_path / "repo" / "skipped" / "one", "ignored")
    (tmp_path / "repo" / "skipped" / "COLCON_IGNORE").touch()
    (tmp_path / "stand_in").mkdir()
    (tmp_path / ".git").mkdir()
    source_package(tmp_path / "too" / "deep" / "for" / "a" / "package" / "here", "deep")

    packages = Packages([tmp_path], {})

    assert packages.share("driver") == inner
    assert packages.prefix("driver") == inner
    assert packages.share("broken") == broken
    assert packages.share("stand_in") == tmp_path / "stand_in"
    assert packages.executables("stand_in") == {}
    assert {"ignored", "deep", ".git"}.isdisjoint(packages.names())


def test_programs_in_the_sources_of_a_package_are_executables(tmp_path: Path) -> None:
    folder = source_package(tmp_path / "driver", "driver")
    script, built = program(folder / "scripts" / "lidar"), program(folder / "lib" / "driver" / "imu")
    (folder / "scripts" / "notes.txt").write_text("")

    assert Packages([tmp_path], {}).executables("driver") == {
        "imu": Program("driver", "imu", built),
        "lidar": Program("driver", "lidar", script),
    }


def test_the_package_around_a_launch_file_is_found_but_does_not_replace_a_known_one(tmp_path: Path) -> None:
    folder = source_package(tmp_path / "ws" / "bringup", "bringup")
    packages = Packages(environment={})

    packages.add_package_of(folder / "launch" / "robot.launch.py")
    packages.add_package_of(source_package(tmp_path / "other", "bringup") / "robot.launch.py")
    packages.add_package_of(Path("/robot.launch.py"))

    assert packages.share("bringup") == folder


def test_an_unknown_package_is_answered_with_the_nearest_and_with_all() -> None:
    with pytest.raises(
        UnknownPackage,
        match=r"'humanoid_contrl' not found; did you mean 'humanoid_control'\? \(there are: actors, camera_dr",
    ) as e:
        Packages(environment={}).find("humanoid_contrl", "planner")
    assert "more" not in str(e.value)


def test_a_long_list_of_packages_is_cut(tmp_path: Path) -> None:
    for number in range(50):
        (tmp_path / f"package_{number}").mkdir()

    with pytest.raises(UnknownPackage, match=r"package_1, .* and \d+ more\)$"):
        Packages([tmp_path], {}).share("zzz")


def test_an_unknown_executable_is_answered_with_the_nearest_and_with_all_of_its_package(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    packages = Packages([tmp_path], {})

    with pytest.raises(UnknownExecutable) as caught:
        packages.find("humanoid_control", "plannr")
    with pytest.raises(UnknownExecutable, match=r"'empty' has no executable 'any' .there is none."):
        packages.find("empty", "any")

    (tmp_path / "empty" / "setup.py").touch()
    with pytest.raises(UnknownExecutable, match=r".there is none; pip install -e .*empty makes those known that it"):
        packages.find("empty", "any")

    facts = "'humanoid_control' 'plannr' 'planner' motor_controller planner sensor_simulator"
    assert lacks(str(caught.value), facts) == []


def test_a_file_is_found_anywhere_in_its_package(tmp_path: Path) -> None:
    folder = source_package(tmp_path / "bringup", "bringup")
    (folder / "launch" / "more").mkdir(parents=True)
    wanted = folder / "launch" / "more" / "robot.launch.py"
    wanted.touch()
    packages = Packages([tmp_path], {})

    assert packages.file("bringup", "robot.launch.py") == wanted
    with pytest.raises(UnknownExecutable, match=r"did you mean 'robot.launch.py'\? .there are: robot.launch.py"):
        packages.file("bringup", "robt.launch.py", (".launch.py",))
    with pytest.raises(UnknownExecutable, match="there is none"):
        packages.file("bringup", "x", (".none",))
    (folder / "robot.launch.py").touch()
    with pytest.raises(LookupError, match=r"has several files 'robot\.launch\.py'"):
        packages.file("bringup", "robot.launch.py")


def test_modules_without_a_folder_have_none() -> None:
    assert folder_of_module("no_such_module") is None
    assert folder_of_module("no_such_package.module") is None
    assert folder_of_module("sys") is None
    assert folder_of_module("robot.tutorials.ring") == folder_of_module("robot.tutorials")


def test_a_package_of_the_user_takes_the_place_of_a_tutorial_of_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing of the tutorial is left: neither its executables nor its files. Wherever the user's package is."""
    talker = installed(tmp_path / "prefix", "my_package")
    source_package(tmp_path / "src" / "planning", "planning")
    info = tmp_path / "site" / "mine-1.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: mine\nVersion: 1\n")
    (info / "entry_points.txt").write_text("[robactor.nodes]\ncontrol.motor_node = garden.motor:Motor\n")
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    packages = Packages([tmp_path / "src"], {"AMENT_PREFIX_PATH": str(tmp_path / "prefix")})

    assert packages.executables("my_package") == {"talker": Program("my_package", "talker", talker)}
    assert packages.share("my_package") == tmp_path / "prefix" / "share" / "my_package"
    assert packages.executables("planning") == {}
    assert packages.share("planning") == tmp_path / "src" / "planning"
    assert packages.executables("control") == {"motor_node": NodeTarget("control", "motor_node", "garden.motor:Motor")}
    assert packages.share("camera_driver") == folder_of_module("robot.tutorials")


def test_a_tutorial_is_no_package_of_the_environment() -> None:
    assert {entry.name.partition(".")[0] for entry in entry_points(group=GROUP)}.isdisjoint(EXECUTABLES)


def test_examples_that_cannot_be_loaded_or_hold_nothing_hurt_no_other_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    info = tmp_path / "odd-1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: odd\nVersion: 1\n")
    (info / "entry_points.txt").write_text(
        "[robactor.examples]\nodd = odd_examples:PACKAGES\ngone = no_such_module:X\n"
    )
    (tmp_path / "odd_examples.py").write_text('PACKAGES = {"hollow": {}}\n')
    monkeypatch.syspath_prepend(str(tmp_path))
    packages = Packages(environment={})

    assert isinstance(packages.find("humanoid_control", "planner"), NodeTarget)
    assert packages.executables("hollow") == {}
    with pytest.raises(UnknownPackage):
        packages.share("hollow")


def test_our_nodes_of_ros_2_go_before_those_of_a_prefix(tmp_path: Path) -> None:
    installed(tmp_path, "tf2_ros")
    program(tmp_path / "lib" / "tf2_ros" / "static_transform_publisher")
    packages = Packages(environment={"AMENT_PREFIX_PATH": str(tmp_path)})

    assert isinstance(packages.find("tf2_ros", "static_transform_publisher"), NodeTarget)
