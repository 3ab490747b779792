"""What is declared in pyproject.toml is imported, and the other way round; what is told of the distribution is true."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

import pytest

import actors

ROOT = Path(__file__).parents[2]
SETTINGS: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT, BUILD = SETTINGS["project"], SETTINGS["build-system"]
IMPORTED_AS = {"PyYAML": "yaml", "mujoco-core": "mujoco", "Pillow": "PIL", "eclipse-zenoh": "zenoh", "pyzmq": "zmq",
    "opentelemetry-api": "opentelemetry", "opentelemetry-sdk": "opentelemetry",
}  # fmt: skip
"""The name to import, for distributions that do not go by their own."""
OURS = {"actors", "robot", "cli", "tests"}
COMMANDS = {"coverage", "mypy", "pyright", "ruff"}
"""Tools that are started, not imported."""
PLUGINS = {"hatch_fancy_pypi_readme"}
"""What the build loads by itself."""
PYTEST_PLUGINS = {"pytest_xdist", "pytest_timeout"}
"""What pytest loads by itself."""
FOREIGN = {ROOT / "tests" / "interop" / "programs", ROOT / "tests" / "benchmarks" / "_wire" / "rclpy_nodes.py"}
"""Programs that run under a Python of their own, with packages that this project does not declare."""
BY_NAME = {"import_module", "importorskip", "find_spec"}
"""Functions that are given the name of a module."""


def declared(requirements: list[str]) -> set[str]:
    """The modules that a list of requirements brings."""
    names = {re.split(r"[\s<>=!~;\[]", requirement, maxsplit=1)[0] for requirement in requirements}
    return {IMPORTED_AS.get(name, name.replace("-", "_")) for name in names}


def imported(*folders: str, typing: bool = True) -> set[str]:
    """The modules of others that the files of these folders import, wherever in a file; `typing`: also what only type checkers see."""
    files = [
        file
        for folder in folders
        for file in (ROOT / folder).rglob("*.py")
        # a launch file imports what exists only while it is launched
        if FOREIGN.isdisjoint({file, *file.parents}) and not file.name.endswith(".launch.py")
    ]
    assert files
    found = {name for file in files for name in imported_by(file, typing)}
    return {name for name in found if name not in sys.stdlib_module_names | OURS}


def imported_by(file: Path, typing: bool = True) -> frozenset[str]:
    """The modules that a file imports."""
    return _imported_by(file)[typing]


@cache
def _imported_by(file: Path) -> tuple[frozenset[str], frozenset[str]]:
    """Those that it imports when it runs, and those that type checkers see."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    return frozenset(names_in(tree, False)), frozenset(names_in(tree, True))


def importers(*modules: str) -> list[str]:
    """The files of the product that import one of these modules."""
    files = (path for folder in ("actors", "robot", "cli") for path in (ROOT / folder).rglob("*.py"))
    named = (path for path in files if any(module in path.read_text(encoding="utf-8") for module in modules))
    return [path.relative_to(ROOT).as_posix() for path in named if imported_by(path) & {*modules}]


def names_in(tree: ast.AST, typing: bool) -> Iterator[str]:
    """The modules that a piece of code imports, or imports by name."""
    left = [tree]
    while left:
        node = left.pop()
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            if node.level == 0 and node.module is not None:
                yield node.module.partition(".")[0]
        elif isinstance(node, ast.If) and not typing and getattr(node.test, "id", "") == "TYPE_CHECKING":
            left += node.orelse
        else:
            if isinstance(node, ast.Call):
                yield from named_in(node)
            left += ast.iter_child_nodes(node)


def named_in(call: ast.Call) -> Iterator[str]:
    """Modules named by a text: `import_module("mujoco")`, or what a benchmark's contestant needs."""
    function = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
    texts = [call.args[0]] if function in BY_NAME and call.args else []
    texts += [keyword.value for keyword in call.keywords if keyword.arg == "needs"]
    for text in texts:
        if isinstance(text, ast.Constant) and isinstance(text.value, str):
            yield text.value.partition(".")[0]


def test_imports_are_found_wherever_they_stand() -> None:
    code = """
import a.b, c
from d.e import f
from . import g
if TYPE_CHECKING:
    import h
else:
    import i
def later():
    import j
    importlib.import_module("k.l"); pytest.importorskip("m"); import_module(name)
    Contestant("x", needs="n"); print("o")
"""
    assert set(names_in(ast.parse(code), True)) == set("acdhijkmn")
    assert set(names_in(ast.parse(code), False)) == set("acdijkmn")


def test_what_is_imported_is_declared() -> None:
    test = {"pytest", "pytest_asyncio"}
    extras = PROJECT["optional-dependencies"]
    optional = (
        declared(extras["security"])
        | declared(extras["images"])
        | declared(extras["plots"])
        | declared(extras["dds"])
        | {"opentelemetry"}
    )
    assert imported("actors", "robot", "cli") - test - optional <= declared(PROJECT["dependencies"])


def test_only_the_authority_imports_what_makes_certificates() -> None:
    assert importers("cryptography") == ["actors/transport/security/authority.py"]
    assert declared(PROJECT["optional-dependencies"]["security"]) == {"cryptography"}


def test_only_the_library_of_dds_imports_cyclone() -> None:
    assert importers("cyclonedds") == ["actors/transport/dds/library.py"]
    assert declared(PROJECT["optional-dependencies"]["dds"]) == {"cyclonedds"}


def test_only_spans_import_opentelemetry() -> None:
    assert importers("opentelemetry") == [
        "actors/diagnostics/spans.py",
        "robot/run/options.py",
    ]  # which only asks whether it is there
    assert declared(PROJECT["optional-dependencies"]["otel"]) == {"opentelemetry"}


def test_what_pytest_runs_may_import_pytest_and_nothing_else_may() -> None:
    assert {tuple(path.split("/")[:2]) for path in importers("pytest", "pytest_asyncio")} == {("actors", "testing")}
    assert {"pytest", "pytest_asyncio"} <= declared(PROJECT["optional-dependencies"]["test"])


def test_what_is_declared_is_imported() -> None:
    assert declared(PROJECT["dependencies"]) == imported("actors", "robot", "cli", typing=False) - {
        "PIL",  # of the extra `images`
        "cryptography",  # of the extra `security`
        "cyclonedds",  # of the extra `dds`
        "matplotlib",  # of the extra `plots`
        "opentelemetry",  # of the extra `otel`
        "pytest",
        "pytest_asyncio",
    }


def test_the_extras_are_what_the_tests_import_and_the_tools_that_check_them() -> None:
    extras, groups = PROJECT["optional-dependencies"], SETTINGS["dependency-groups"]
    test, docs = declared(extras["test"]), declared(extras["docs"])
    bench, browser = declared(groups["bench"]), declared(groups["browser"])
    used = imported("tests", "actors/testing") - {"no_such_module_anywhere", *imported("tests/site") & docs}
    assert used <= test | bench | browser | {"mypy"} | declared(PROJECT["dependencies"])
    assert test - used == {"coverage"} | PLUGINS | PYTEST_PLUGINS
    assert declared(groups["lint"]) | {"coverage"} == COMMANDS
    assert declared(BUILD["requires"]) == PLUGINS | {"hatchling"}
    assert bench <= imported("tests/benchmarks")
    assert docs == imported("tests/site") & docs | {"zensical"}  # which is started


def test_each_tool_of_the_test_extra_is_started_by_a_check() -> None:
    checks = "".join(path.read_text(encoding="utf-8") for path in (ROOT / ".ci").iterdir() if path.is_file())
    assert {tool for tool in COMMANDS if re.search(rf"\b{tool}\b", checks)} == COMMANDS


def test_the_version_is_that_of_the_distribution_and_costs_nothing_until_asked() -> None:
    assert actors.__version__ == PROJECT["version"] == metadata.version("robactor")
    code = "import sys, actors; print('importlib.metadata' in sys.modules, actors.__version__)"
    done = subprocess.run(
        [sys.executable, "-S", "-c", code], capture_output=True, text=True, cwd=ROOT, env=_with_packages()
    )
    assert done.stdout.split() == ["False", PROJECT["version"]], done.stderr
    with pytest.raises(AttributeError, match="module 'actors' has no attribute 'Nod'"):
        _ = actors.Nod  # type: ignore[attr-defined]


def test_without_an_installation_the_version_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(metadata.Distribution, "from_name", _nothing)
    with pytest.raises(AttributeError, match=r"none is installed: pip install \."):
        _ = actors.__version__


def _nothing(name: str) -> metadata.Distribution:
    raise metadata.PackageNotFoundError(name)


def _with_packages() -> dict[str, str]:
    """The environment of an interpreter without `site`, whose start-up files import much of their own."""
    return {"PYTHONPATH": str(Path(pytest.__file__).parents[1])}


def test_the_notice_names_the_packages_that_are_not_under_our_licence() -> None:
    robots = ["robot/interfaces/NOTICE", "robot/interfaces/unitree/NOTICE"]
    notices = ["actors/interfaces/NOTICE", *robots, "cli/web/page/vendor/NOTICE"]
    assert PROJECT["license-files"] == ["LICENSE", *notices]
    assert "nav2_msgs" in (ROOT / robots[0]).read_text()
    notice = (ROOT / "actors/interfaces/NOTICE").read_text(encoding="utf-8")
    packages = {folder.name for folder in (ROOT / "actors/interfaces/share").iterdir()}
    assert packages <= set(re.findall(r"\w+", notice))
    assert "Copyright (c) 2008, Willow Garage, Inc." in notice
    assert "Copyright (C) 2012, Jack O'Quin" in notice
    assert "Redistribution and use in source and binary forms" in notice


def test_the_classifiers_name_the_versions_of_python_that_are_tried() -> None:
    versions = [text.rpartition(" ")[2] for text in PROJECT["classifiers"] if ":: 3." in text]
    assert versions == ["3.11", "3.12", "3.13"]
    assert PROJECT["requires-python"] == f">={versions[0]}"
