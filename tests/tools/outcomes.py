"""A pytest plugin: `-p tests.tools.outcomes --outcomes FILE` writes how each test ended, one a line, in the order in which they ended."""

from __future__ import annotations

from pathlib import Path

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--outcomes", type=Path, metavar="FILE", help="write how each test ended")


def pytest_configure(config: pytest.Config) -> None:
    worker = hasattr(config, "workerinput")  # its reports come to the main process, too
    if (path := config.getoption("--outcomes")) is not None and not worker:
        config.pluginmanager.register(_Outcomes(path), "outcomes of this suite")


class _Outcomes:
    """What is written of one suite; suites that tests run within themselves are not seen."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._lines: list[str] = []

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.when == "call" or report.outcome != "passed":
            self._lines.append(f"{report.nodeid} {report.when} {report.outcome}\n")

    def pytest_sessionfinish(self) -> None:
        self._path.write_text("".join(self._lines), encoding="utf-8")
