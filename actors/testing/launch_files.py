"""Launch tests in pytest: a file whose ``generate_test_description`` is marked with ``pytest.mark.launch_test`` is one test for each launch.

Where `launch_testing` itself is installed, its own plugin collects such files.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast
from unittest import SkipTest

import pytest

if TYPE_CHECKING:
    from actors.launch.testing import LaunchTest

ORIGINAL = "launch_testing"
"""The package whose plugin collects these files, where it is installed."""


def launch_test_file(path: Path, parent: pytest.Collector) -> LaunchTestFile | None:
    """The collector of a launch test; None for any other file."""
    text = path.read_text(encoding="utf-8", errors="replace")
    if "mark.launch_test" not in text or not _is_marked(text) or find_spec(ORIGINAL) is not None:
        return None
    return cast("LaunchTestFile", cast("Any", LaunchTestFile).from_parent(parent, path=path))


def _is_marked(text: str) -> bool:
    """Whether a module has the function, with the mark."""
    try:
        module = ast.parse(text)
    except SyntaxError:
        return False  # which pytest tells
    return any(
        isinstance(part, ast.FunctionDef)
        and part.name == "generate_test_description"
        and any("mark.launch_test" in ast.unparse(one) for one in part.decorator_list)
        for part in module.body
    )


class LaunchTestFile(pytest.File):
    """A launch test file."""

    def collect(self) -> Iterator[pytest.Item]:
        from actors.launch.testing import launch_tests

        for test in launch_tests(self.path):
            yield cast("Any", _LaunchTestItem).from_parent(self, name=test.name, test=test)


class _LaunchTestItem(pytest.Item):
    """One launch with its tests."""

    def __init__(self, *, test: LaunchTest, **known: object) -> None:
        super().__init__(**known)  # type: ignore[arg-type]  # what pytest gives every item
        self._test = test

    def runtest(self) -> None:
        try:
            outcome = self._test.run()
        except SkipTest as reason:
            pytest.skip(str(reason))
        if outcome.failures:
            pytest.fail("\n\n".join(f"{name}\n{text}" for name, text in outcome.failures), pytrace=False)

    def reportinfo(self) -> tuple[Path, int, str]:
        return self.path, 0, f"launch test {self.name}"
