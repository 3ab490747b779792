"""What is published, wheel and source distribution: nothing is in them that is not meant, and nothing is missing.

`.ci/nightly --only package` judges both with twine and uses the wheel in an environment of its own.
"""

from __future__ import annotations

import tarfile
import zipfile
from email import message_from_bytes
from email.message import Message
from pathlib import Path, PurePosixPath

import pytest
from hatchling.build import build_sdist, build_wheel

ROOT = Path(__file__).parents[2]
META = "robactor-0.1.0.dist-info"

WHEEL = {
    "actors": {".py", ".typed", ".msg", ".srv", ".action", "NOTICE"},
    "cli": {".py", ".typed", ".html", ".js", ".css", ".svg", ".json", "NOTICE"},
    "robot": {".py", ".typed", ".msg", ".srv", ".action", ".xml", ".yaml", "NOTICE"},
    META: {"METADATA", "WHEEL", "RECORD", ".txt", "LICENSE", "NOTICE"},
}
"""What the wheel holds: for each folder the suffixes, or the names of what has none."""

SOURCES = {
    "actors": WHEEL["actors"],
    "cli": WHEEL["cli"],
    "robot": WHEEL["robot"],
    "docs": {".md", ".py", ".png", ".svg", ".toml", ".css", ".js", ".json", ".webp"},
    "tests": {".py", ".md", ".txt", ".json", ".toml", ".msg", ".srv", ".action", ".mjs", ".map", ".scen"},
    ".ci": {"run", "nightly", "vendor", ".json", ".ts", ".prettierignore"},
    ".": {"README.md", "CHANGELOG.md", "LICENSE", "pyproject.toml", ".gitignore", "PKG-INFO"},
}


def kinds(names: list[str]) -> dict[str, set[str]]:
    """The suffixes in each folder at the top; whole names of what has none, and of what lies at the top itself."""
    found: dict[str, set[str]] = {}
    for name in map(PurePosixPath, names):
        top = name.parts[0] if len(name.parts) > 1 else "."
        found.setdefault(top, set()).add(name.suffix if name.suffix and top != "." else name.name)
    return found


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the wheel and the source distribution, built as an installer builds them."""
    folder = tmp_path_factory.mktemp("dist")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        build_wheel(str(folder))
        build_sdist(str(folder))
    return folder


@pytest.fixture(scope="module")
def wheel(folder: Path) -> zipfile.ZipFile:
    return zipfile.ZipFile(folder / "robactor-0.1.0-py3-none-any.whl")


@pytest.fixture(scope="module")
def sources(folder: Path) -> list[str]:
    """The files of the source distribution, from its top."""
    with tarfile.open(folder / "robactor-0.1.0.tar.gz") as archive:
        return [one.name.removeprefix("robactor-0.1.0/") for one in archive.getmembers() if one.isfile()]


@pytest.fixture(scope="module")
def metadata(wheel: zipfile.ZipFile) -> Message:
    return message_from_bytes(wheel.read(f"{META}/METADATA"))


def test_the_wheel_holds_what_is_meant(wheel: zipfile.ZipFile) -> None:
    assert kinds(wheel.namelist()) == WHEEL


def test_the_source_distribution_holds_what_is_meant(sources: list[str]) -> None:
    assert kinds(sources) == SOURCES


def test_no_module_of_the_packages_is_missing(wheel: zipfile.ZipFile, sources: list[str]) -> None:
    modules = {
        path.relative_to(ROOT).as_posix() for top in ("actors", "cli", "robot") for path in (ROOT / top).rglob("*.py")
    }
    assert modules == {name for name in wheel.namelist() if name.endswith(".py")}
    assert modules <= {*sources}


def test_every_wheel_that_is_built_from_the_sources_is_this_one(
    folder: Path, wheel: zipfile.ZipFile, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with tarfile.open(folder / "robactor-0.1.0.tar.gz") as archive:
        archive.extractall(tmp_path, filter="data")
    monkeypatch.chdir(tmp_path / "robactor-0.1.0")
    again = zipfile.ZipFile(tmp_path / build_wheel(str(tmp_path)))
    assert {one.filename: one.CRC for one in again.infolist()} == {one.filename: one.CRC for one in wheel.infolist()}


def test_type_checkers_take_the_types_of_all_packages(wheel: zipfile.ZipFile) -> None:
    assert {name for name in wheel.namelist() if name.endswith("py.typed")} == {
        "actors/py.typed",
        "cli/py.typed",
        "robot/py.typed",
    }


def test_the_licences_of_others_come_with_their_files(wheel: zipfile.ZipFile) -> None:
    names = ("LICENSE", "actors/interfaces/NOTICE", "cli/web/page/vendor/NOTICE")
    texts = {name: wheel.read(f"{META}/licenses/{name}").decode() for name in names}
    assert "Apache License" in texts["LICENSE"]
    bsd = texts["actors/interfaces/NOTICE"]  # the message packages that are not under ROS 2's usual licence
    assert "Willow Garage" in bsd
    assert "Redistribution and use in source and binary forms" in bsd
    assert "THIS SOFTWARE IS PROVIDED BY THE COPYRIGHT HOLDERS" in bsd
    assert texts["cli/web/page/vendor/NOTICE"].count("Permission is hereby granted") == 3


def test_an_index_shows_a_readme_without_what_it_cannot_show(metadata: Message) -> None:
    """Neither the pictures nor the documents lie beside it there; and what is installed is what is on the index."""
    text = str(metadata.get_payload())
    assert metadata["Description-Content-Type"] == "text/markdown"
    assert text.startswith("# robactor\n")
    assert "![" not in text
    assert "](" not in text.replace("](http", "")
    assert "**Concepts**: nodes and actors" in text
    assert "pip install robactor && .venv/bin/python -m robot run" in text


def test_the_commands_and_the_plugin_are_declared(wheel: zipfile.ZipFile) -> None:
    points = wheel.read(f"{META}/entry_points.txt").decode()
    assert "[console_scripts]\nrobactor = cli.entry:console\n" in points
    assert "[pytest11]\nactors.testing.plugin = actors.testing.plugin\n" in points
