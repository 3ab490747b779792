"""Reading launch files: Python, XML and YAML."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from actors.errors import described
from actors.launch.entity import LaunchDescription, one_or_more
from actors.launch.errors import LaunchError, Line
from actors.suggest import did_you_mean

if TYPE_CHECKING:
    pass

SUFFIXES = (".py", ".xml", ".yaml", ".yml")
"""The kinds of launch files."""

MAKERS = ("generate_launch_description", "generate_test_description")
"""The function of a Python launch file that gives its description."""


def load(path: Path) -> LaunchDescription:
    """The launch description in a file. Raises `LaunchError`, with the line of the mistake."""
    if path.suffix == ".py":
        return load_python(path)
    if path.suffix == ".xml":
        from actors.launch.frontend.xml import read_xml

        return read_xml(path)
    if path.suffix in (".yaml", ".yml"):
        from actors.launch.frontend.yaml import read_yaml

        return read_yaml(path)
    if path.suffix == ".launch":
        text = path.read_text(encoding="utf-8", errors="replace").lstrip()
        if text.startswith("<"):
            from actors.launch.frontend.xml import read_xml

            return read_xml(path)
    raise LaunchError(f"{path}: a launch file ends in {', '.join(SUFFIXES)}")


def load_python(path: Path) -> LaunchDescription:
    """What ``generate_launch_description()`` of a Python file returns, inside of `shim`. Raises `LaunchError`."""
    module = load_module(path)
    make: Callable[[], Any] | None = next((getattr(module, n) for n in MAKERS if hasattr(module, n)), None)
    if make is None:
        functions = [name for name, value in vars(module).items() if callable(value)]
        near = did_you_mean(MAKERS[0], functions)
        raise LaunchError(f"{path} has no function {MAKERS[0]}(){near}")
    try:
        made = make()
    except LaunchError as error:
        raise error.at(_line_in(path, error)) from error.__cause__
    except Exception as error:
        raise LaunchError(described(error), _line_in(path, error)) from error
    given = one_or_more(made)[:1]  # launch_testing returns the description and what the tests are given
    if not given or not isinstance(given[0], LaunchDescription):
        raise LaunchError(f"{path}: {make.__name__}() returned {described(made)}, no LaunchDescription")
    return given[0]


def load_module(path: str | Path) -> ModuleType:
    """The module in a file, which need not be on the path of Python. Raises `LaunchError`."""
    from importlib.util import module_from_spec, spec_from_file_location

    path = Path(path)
    spec = spec_from_file_location(f"robactor_launch_file_{path.name.partition('.')[0]}", path)
    assert spec is not None
    assert spec.loader is not None  # the name ends in .py
    module = module_from_spec(spec)
    writes, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    try:
        spec.loader.exec_module(module)
    except SyntaxError as error:
        raise LaunchError(f"{error.msg}: {(error.text or '').strip()}", Line(str(path), error.lineno or 1)) from error
    except LaunchError as error:
        raise error.at(_line_in(path, error)) from error.__cause__
    except Exception as error:
        raise LaunchError(described(error), _line_in(path, error)) from error
    finally:
        sys.dont_write_bytecode = writes
    return module


def _line_in(path: Path, error: BaseException) -> Line:
    """The innermost line of this file on the way to the error; its first one, if it has none."""
    found = 1
    trace = error.__traceback__
    name = str(path.absolute())  # as the import system names it
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == name:
            found = trace.tb_lineno
        trace = trace.tb_next
    return Line(str(path), found)
