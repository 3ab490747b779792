"""Definitions read at run time: adding a file is enough; a bad one is refused with file and line."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest

from actors import Node, Service, Topic, publishes
from actors.interfaces import (
    BadDeclaration,
    DefinitionError,
    decode,
    encode,
    get_action,
    get_message,
    known_names,
    load,
    load_folder,
    registry,
)
from actors.interfaces.generate import generate
from actors.interfaces.std_msgs.msg import Header
from actors.testing import Rig


@pytest.fixture(autouse=True)
def _own_registry() -> Iterator[None]:
    """What a test loads is gone after it."""
    with (
        patch.object(registry, "_types", dict(registry._types)),
        patch.object(registry, "_folders", list(registry._folders)),
    ):
        yield


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write(tmp_path, "my_pkg/msg/Sample", "std_msgs/Header header\nReading[] readings  # [m]\nint32 LIMIT=5\n")
    write(tmp_path, "my_pkg/msg/Reading", "float64 value 1.5\nstring unit\n")
    write(tmp_path, "my_pkg/srv/Measure", "bool quick\n---\nSample sample\n")
    write(tmp_path, "other_pkg/action/Search", "float64 area\n---\nmy_pkg/Sample best\n---\nfloat64 done\n")
    return tmp_path


def write(folder: Path, name: str, text: str) -> Path:
    kind = name.split("/")[1]
    path = folder / f"{name}.{kind}"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def files(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.rglob("*") if path.is_file())


def test_a_folder_is_loaded_in_whatever_order_its_types_need_each_other(folder: Path) -> None:
    loaded = load_folder(folder)
    assert {cls.__ros_type__ for cls in loaded} == {
        "my_pkg/msg/Sample",
        "my_pkg/msg/Reading",
        "my_pkg/srv/Measure",
        "other_pkg/action/Search",
    }
    sample: Any = get_message("my_pkg/Sample")
    reading: Any = get_message("my_pkg/Reading")
    message = sample(header=Header(frame_id="lab"), readings=[reading(unit="m")])
    assert decode(sample, encode(message)) == message
    assert message.readings[0].value == 1.5
    assert sample.LIMIT == 5
    assert repr(reading()) == "my_pkg.msg.Reading(value=1.5, unit='')"
    search: Any = get_action("other_pkg/Search")
    assert search.Result(best=message).best is message


def test_a_file_added_later_is_found_when_its_name_is_asked_for(folder: Path) -> None:
    load_folder(folder)
    write(folder, "my_pkg/msg/Late", "Sample[2] samples\n")
    late: Any = get_message("my_pkg/msg/Late")
    assert len(late().samples) == 2


def test_definitions_in_folders_below_are_of_the_package(folder: Path) -> None:
    write(folder, "my_pkg/srv/motion/MoveJoint", "float64[6] position\n---\nbool success\n")
    (folder / "my_pkg/srvs").mkdir()
    (folder / "my_pkg/srvs/Pause.srv").write_text("---\nbool paused\n")
    assert {"my_pkg/srv/MoveJoint", "my_pkg/srv/Pause"} <= {cls.__ros_type__ for cls in load_folder(folder)}
    write(folder, "my_pkg/msg/arm/Late", "Reading reading\n")
    late: Any = get_message("my_pkg/msg/Late")
    assert late().reading.value == 1.5
    assert {"my_pkg/srv/MoveJoint", "my_pkg/msg/Late"} <= set(known_names())
    modules = generate(folder, "")
    assert "class MoveJoint(" in modules["my_pkg/srv.py"]
    assert "class Late(" in modules["my_pkg/msg.py"]


async def test_a_new_definition_is_published_and_served_without_a_build(tmp_path: Path, rig: Rig) -> None:
    report: Any = load(write(tmp_path, "fresh_msgs/msg/Report", "string text\nfloat32[3] where\n"))
    ask: Any = load(write(tmp_path, "fresh_msgs/srv/Ask", "string what\n---\nReport report\n"))
    asked = Service(ask, "ask")

    class Reporter(Node):
        out = publishes(Topic(report, "reports", 10))

        @asked.serve()
        async def answer(self, request: Any) -> Any:
            told = report(text=request.what, where=[1.0, 2.0, 3.0])
            self.out(told)
            return ask.Response(report=told)

    await rig.start(Reporter)
    heard = rig.probe(Topic(report, "reports", 10))
    answer = await rig.me.call(asked, ask.Request(what="all is well"))
    await rig.quiet()
    assert answer.report == heard.newest == report(text="all is well", where=[1.0, 2.0, 3.0])
    assert heard.newest.where.dtype == "float32"
    assert files(tmp_path) == ["Ask.srv", "Report.msg"]


def test_loading_again_gives_the_same_classes(folder: Path) -> None:
    assert load_folder(folder) == load_folder(folder)


def test_one_file_is_enough(tmp_path: Path) -> None:
    point: Any = load(write(tmp_path, "lone_pkg/msg/Point3", "float64 x\n"))
    assert point(x=1).x == 1.0
    assert get_message("lone_pkg/Point3") is point


def test_text_is_enough() -> None:
    adder: Any = load("int64 a\nint64 b\n---\nint64 sum\n", "lone_pkg/srv/Add")
    assert adder.Response(sum=3).sum == 3
    assert load("int64 a\nint64 b\n---\nint64 sum\n", "lone_pkg/srv/Add") is adder


def test_a_wrong_number_of_separators_is_refused_with_file_and_line(tmp_path: Path) -> None:
    path = write(tmp_path, "my_pkg/srv/Bad", "bool a\n---\nbool b\n---\nbool c\n")
    with pytest.raises(DefinitionError, match=rf"{path}, line 4: a \.srv file has one line '---'.*found 2") as error:
        load(path)
    assert (error.value.code, error.value.line) == ("invalid_service_spec", 4)
    path = write(tmp_path, "my_pkg/action/Bad", "bool a\n---\nbool b\n")
    with pytest.raises(DefinitionError, match=r"two lines '---': goal, result, feedback; found 1"):
        load(path)


def test_an_unknown_nested_type_is_refused_when_loading(tmp_path: Path) -> None:
    path = write(tmp_path, "my_pkg/msg/Bad", "# a comment\n\nstd_msgs/Heder header\n")
    with pytest.raises(
        DefinitionError, match=rf"{path}, line 3: type std_msgs/Heder is not known\. Did you mean 'std_msgs/msg/Header'"
    ):
        load(path)


def test_a_bad_file_in_a_folder_leaves_nothing_half_loaded(folder: Path) -> None:
    write(folder, "my_pkg/msg/Zero", "int33 x\n")
    with pytest.raises(
        DefinitionError, match=r"Zero\.msg, line 1: 'int33' is neither a primitive type nor 'package/Name'"
    ):
        load_folder(folder)
    assert registry.known("my_pkg/msg/Reading") is None


def test_a_type_that_contains_itself_is_refused(tmp_path: Path) -> None:
    write(tmp_path, "my_pkg/msg/Chicken", "Egg egg\n")
    write(tmp_path, "my_pkg/msg/Egg", "Chicken[] chicken\n")
    with pytest.raises(DefinitionError, match=r"Chicken\.msg: the type contains itself"):
        load_folder(tmp_path)


def test_a_type_of_ros_1_is_named_with_its_successor() -> None:
    with pytest.raises(DefinitionError, match="'time' is a type of ROS 1; write builtin_interfaces/Time"):
        load("time stamp", "my_pkg/msg/Old")


def test_a_type_cannot_change_while_the_program_runs(tmp_path: Path) -> None:
    path = write(tmp_path, "my_pkg/msg/Fickle", "int32 x\n")
    load(path)
    path.write_text("int64 x\n")
    with pytest.raises(BadDeclaration, match="my_pkg/msg/Fickle is known already with other fields"):
        load(path)
    with pytest.raises(BadDeclaration, match="std_msgs/msg/String is known already with other fields"):
        load("int32 data", "std_msgs/msg/String")


def test_an_empty_folder_is_an_error_that_says_what_was_expected(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"expected <package>/<msg\|srv\|action>"):
        load_folder(tmp_path)


def test_a_file_of_another_sort_is_refused(tmp_path: Path) -> None:
    (tmp_path / "Sample.idl").write_text("")
    (tmp_path / "Sample.msgs").write_text("")
    for name in ("Sample.idl", "Sample.msgs"):
        with pytest.raises(
            DefinitionError, match=r"expected a \.msg, \.srv or \.action definition, or an \.idl file in"
        ):
            load(tmp_path / name)


def test_an_idl_file_is_loaded_by_its_path_and_found_by_its_name(tmp_path: Path) -> None:
    text = 'module my_pkg {{ module msg {{ struct {0} {{ long aValue; @default (value="a#b") wstring<3> s; sequence<my_pkg::msg::Inner, 2> in; }}; }}; }};'
    path = tmp_path / "my_pkg/msg/Outer.idl"
    write(tmp_path, "my_pkg/msg/Inner", "")
    path.write_text(text.format("Outer"))
    registry.add_folder(tmp_path)
    assert "my_pkg/msg/Outer" in known_names("msg")
    outer: Any = get_message("my_pkg/Outer")
    assert outer is load(path)
    assert [str(field) for field in outer.__ros_fields__] == [
        "int32 aValue",
        "wstring<=3 s 'a#b'",
        "my_pkg/Inner[<=2] in",
    ]
    path.write_text(text.format("Other"))
    with pytest.raises(DefinitionError, match=rf"{path}: this defines my_pkg/msg/Other, expected my_pkg/msg/Outer"):
        load(path)
    path.write_text("\n\nunion")
    with pytest.raises(DefinitionError, match=rf"{path}, line 3: 'union' is not understood"):
        load(path)
    path.write_bytes(b"\xff")
    with pytest.raises(DefinitionError, match=rf"{path}: this is no UTF-8 text"):
        load_folder(tmp_path)


def test_a_keyword_of_python_can_be_a_field() -> None:
    odd: Any = load("int32 from\nint32[] lambda\nstring class\n", "my_pkg/msg/Odd")
    message = odd(**{"from": 1, "lambda": [2], "class": "c"})
    assert (getattr(message, "from"), message) == (1, decode(odd, encode(message)))
    with pytest.raises(TypeError, match=r"Odd\.from: expected int32"):
        odd(**{"from": "x"})


def test_an_empty_definition_is_a_type() -> None:
    assert encode(load("# nothing\n", "my_pkg/msg/Nothing")()) == bytes.fromhex("0001000000")


def test_comments_become_the_documentation() -> None:
    sample: Any = load("# One sample.\n# Of anything.\n\nint32 x\n", "my_pkg/msg/Documented")
    assert sample.__doc__ == "my_pkg/msg/Documented\n\nOne sample.\nOf anything."
