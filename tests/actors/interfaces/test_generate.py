"""The generated modules: up to date, and right for definitions with odd names."""

from __future__ import annotations

import importlib
import inspect
import runpy
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest

from actors.interfaces import BadDeclaration, Message, load_folder, registry
from actors.interfaces.generate import generate, main

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize("home", ["actors.interfaces", "robot.interfaces", "robot.interfaces.tutorials"])
def test_the_modules_that_ship_are_up_to_date(home: str, capsys: pytest.CaptureFixture[str]) -> None:
    folder = ROOT.joinpath(*home.split("."))
    status = main([str(folder / "share"), "--out", str(folder), "--home", home, "--check"])
    assert status == 0, capsys.readouterr().out


@pytest.fixture
def share(tmp_path: Path) -> Iterator[Path]:
    folder = tmp_path / "share"
    write(folder, "odd_pkg/msg/Zebra", '# Striped.\n\nint32 string\nstring text "a\\"b"\n')
    write(
        folder,
        "odd_pkg/msg/Header",
        "std_msgs/Header header  # when [s]\nZebra[<=2] zebras\nfloat64 INF=inf\nfloat32 f nan\n",
    )
    write(
        folder,
        "odd_pkg/msg/Ant",
        "Header[2] headers\nint32[] a [1, 2]\nstring[<=2] s ['x']\nfloat64 default 2.5\nbool float64_array true\n",
    )
    write(folder, "odd_pkg/srv/Ask", "std_msgs/Header header\n---\nHeader header\nwstring<=3[] words\n")
    write(
        folder, "odd_pkg/action/AnActionWithANameSoLongThatTheLineWouldNotHoldIt", "int8 x\n---\nint8 y\n---\nint8 z\n"
    )
    with (
        patch.object(registry, "_types", dict(registry._types)),
        patch.object(registry, "_folders", list(registry._folders)),
    ):
        yield folder
    for name in [name for name in sys.modules if name.partition(".")[0] == "made_here"]:
        del sys.modules[name]


def write(folder: Path, name: str, text: str) -> None:
    path = folder / f"{name}.{name.split('/')[1]}"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def test_odd_names_are_generated_so_that_they_work(share: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = share.parent / "made_here"
    assert main([str(share), "--out", str(out), "--home", "made_here"]) == 0
    monkeypatch.syspath_prepend(share.parent)
    registry.add_folder(share, "made_here")
    generated = {
        cls.__ros_type__: cls
        for module in ("msg", "srv", "action")
        for cls in vars(importlib.import_module(f"made_here.odd_pkg.{module}")).values()
        if isinstance(cls, type) and issubclass(cls, Message) and cls.__module__.startswith("made_here")
    }
    assert len(generated) == 8
    zebra: Any = generated["odd_pkg/msg/Zebra"]
    assert (zebra().string, zebra().text) == (0, 'a"b')
    ant: Any = generated["odd_pkg/msg/Ant"]
    assert (ant().default, ant().s, ant().a.tolist(), ant().float64_array) == (2.5, ("x",), [1, 2], True)
    assert {name: described(cls) for name, cls in generated.items()} == loaded_from(share)


def described(cls: type[Message]) -> list[str]:
    """All that a class says of itself."""
    return [*map(str, cls.__ros_fields__), *map(str, cls.__ros_constants__), inspect.cleandoc(cls.__doc__ or "")]


def loaded_from(share: Path) -> dict[str, list[str]]:
    """The same types, read from their files instead."""
    with patch.object(registry, "_types", {}), patch.object(registry, "_folders", [registry._folders[0]]):
        load_folder(share)
        classes = [cls for name, cls in registry._types.items() if name.startswith("odd_pkg/")]
        return {cls.__ros_type__: described(cls) for cls in classes if issubclass(cls, Message)}


def test_check_names_what_is_old_and_writes_nothing(share: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = share.parent / "made_here"
    main([str(share), "--out", str(out)])
    assert main([str(share), "--out", str(out), "--check"]) == 0
    (out / "odd_pkg/msg.py").write_text("old")
    assert main([str(share), "--out", str(out), "--check"]) == 1
    assert "msg.py is missing or old" in capsys.readouterr().out
    assert (out / "odd_pkg/msg.py").read_text() == "old"
    main([str(share), "--out", str(out)])
    assert "4 modules, 1 written" in capsys.readouterr().out


def test_a_definition_that_cannot_be_read_ends_the_command_with_file_and_line(
    share: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(share, "odd_pkg/msg/Bad", "int33 x\n")
    with pytest.raises(SystemExit):
        main([str(share)])
    assert "Bad.msg, line 1: 'int33' is neither" in capsys.readouterr().err


def test_an_empty_folder_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main([str(tmp_path)])
    assert "no definition in" in capsys.readouterr().err


def test_a_keyword_as_a_field_name_cannot_be_generated_and_says_what_to_do(share: Path) -> None:
    write(share, "odd_pkg/msg/Keyword", "int32 from\n")
    with pytest.raises(BadDeclaration, match=r"field 'from' is a Python keyword.*load this package at run time"):
        generate(share, "made_here")


def test_a_package_that_needs_no_type_names_imports_none(tmp_path: Path) -> None:
    write(tmp_path, "plain_pkg/msg/Empty", "")
    modules = generate(tmp_path, "made_here")
    assert "actors.interfaces.types" not in modules["plain_pkg/msg.py"]


def test_it_is_a_program(share: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "argv", ["generate", str(share), "--out", str(share.parent / "made_here"), "--check"])
    with pytest.raises(SystemExit) as stopped:
        runpy.run_path(inspect.getfile(generate), run_name="__main__")
    assert stopped.value.code == 1
    assert "is missing or old" in capsys.readouterr().out
