"""The pytest plugin: the fixtures `rig` and `lab`, and virtual time for the tests that request one.

A test runs on the virtual clock if it uses `rig` or `lab`, directly or through another fixture, or is marked ``@pytest.mark.virtual``. All other
tests keep the event loop that pytest-asyncio or another plugin gives them. Without pytest-asyncio this plugin does nothing but say so.
"""

from __future__ import annotations

import asyncio
import inspect
import os
import warnings
from collections.abc import AsyncIterator, Callable, Generator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import pytest

if TYPE_CHECKING:
    from pytest_asyncio import fixture

    from actors.testing.lab import Lab
    from actors.testing.rig import Rig
else:
    try:
        from pytest_asyncio import fixture
    except ModuleNotFoundError:  # pytest loads this plugin in every suite, whether it needs it or not
        fixture = pytest.fixture

_FIXTURES = {"lab", "rig"}
"""The fixtures that need the virtual clock."""
LoopFactories = Mapping[str, Callable[[], asyncio.AbstractEventLoop]]


@pytest.hookimpl(tryfirst=True)
def pytest_configure(config: pytest.Config) -> None:
    # pytest-asyncio asks every project to set this option. It makes no difference to these tests. pytest removes this filter after all
    # plugins are configured.
    warnings.filterwarnings("ignore", 'The configuration option "asyncio_default_fixture_loop_scope" is unset')
    # Whatever the shell has, where every user of ROS 2 exports it: no test meets the graph of other processes, and moves a robot there,
    # unless it names a transport itself.
    os.environ["RMW_IMPLEMENTATION"] = "in_process"
    config.addinivalue_line("markers", "launch_test: this generate_test_description makes the file a launch test")
    config.addinivalue_line("markers", "virtual: run this test on the virtual clock of actors.testing")


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("robactor")
    group.addoption(
        "--scenario-seeds", type=int, help="how many seeds every @scenario tries, instead of its own number"
    )
    group.addoption(
        "--scenario-replay", metavar="TRIAL", help="run one trial of a @scenario, as its failure has printed it"
    )
    where = "the folder for the flight records of failed tests that use `rig` (default: pytest's temporary folder)"
    group.addoption("--flight-records", metavar="DIR", help=where)
    parser.addini("flight_records", where, type="paths", default=[])


@pytest.hookimpl(tryfirst=True)
def pytest_pycollect_makemodule(module_path: Path, parent: pytest.Collector) -> pytest.Module | None:
    """Collect a launch test as one."""
    from actors.testing.launch_files import launch_test_file

    return cast("pytest.Module | None", launch_test_file(module_path, parent))


@pytest.hookimpl(tryfirst=True)
def pytest_pycollect_makeitem(collector: pytest.Collector, name: str, obj: object) -> None:
    """Collect a coroutine test that uses `rig` or `lab` or is marked `virtual` as an asyncio test, also in pytest-asyncio's strict mode."""
    # With Python 3.12, the module `inspect` itself is taken for one.
    if not callable(obj) or not inspect.iscoroutinefunction(obj):
        return
    marks = getattr(obj, "pytestmark", ())
    wanted = sorted(_FIXTURES & inspect.signature(obj).parameters.keys())
    if wanted and fixture is pytest.fixture:
        raise collector.CollectError(
            f"{name} uses the fixture {wanted[0]!r}, which needs pytest-asyncio: pip install pytest-asyncio"
        )
    if wanted or any(mark.name == "virtual" for mark in marks):
        pytest.mark.asyncio(obj)


@pytest.hookimpl(wrapper=True, optionalhook=True)
def pytest_asyncio_loop_factories(
    config: pytest.Config, item: pytest.Item
) -> Generator[None, LoopFactories | None, LoopFactories]:
    """Use a virtual loop for the tests that request it. For others, use what another plugin provides, or the default."""
    others = yield
    if item.get_closest_marker("virtual") is not None or _FIXTURES & set(getattr(item, "fixturenames", ())):
        from actors.time.virtual_loop import VirtualLoop

        return {"virtual": VirtualLoop}
    return others if others is not None else {"asyncio": asyncio.new_event_loop}


@fixture
async def rig(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> AsyncIterator[Rig]:
    """Provide a `Rig`. After the test it is closed and checked for leaks."""
    from actors.bag import FlightRecorder
    from actors.testing.rig import Rig

    rig = Rig()
    request.node.stash[_RIG] = rig
    request.node.stash[_FLIGHT] = (rig.observe(FlightRecorder()), tmp_path_factory)
    yield rig
    await rig.close()


@fixture
async def lab(request: pytest.FixtureRequest) -> AsyncIterator[Lab]:
    """Provide a `Lab`. After the test it is closed, and all of its systems are checked for leaks."""
    from actors.testing.lab import Lab

    lab = Lab()
    request.node.stash[_LAB] = lab
    yield lab
    await lab.close()


_LAB = pytest.StashKey["Lab"]()
_RIG = pytest.StashKey["Rig"]()
_FLIGHT = pytest.StashKey[Any]()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Add the log of the system, the flight record and what the error means to the report of a failed test, whether it failed itself or at its clean-up."""
    if call.excinfo is not None:
        from actors.errors import explain

        explain(call.excinfo.value)
    report = yield
    if report.failed and (rig := item.stash.get(_RIG, None)) is not None:
        from actors.testing.flight_records import save_flight

        report.sections.append(("rig", rig.timeline()))
        if report.when == "call" and (findings := rig.findings()):
            report.sections.append(("check_tree", "\n".join(map(str, findings))))
        recorder, temporary = item.stash[_FLIGHT]
        if (flight := save_flight(recorder, item.config, temporary, item.nodeid)) is not None:
            report.sections.append(("flight record", flight))
    if report.failed and (lab := item.stash.get(_LAB, None)) is not None:
        report.sections.append(("lab", lab.timeline()))
    if report.when == "teardown" and _LAB in item.stash:
        del item.stash[_LAB]
    if report.when == "teardown" and _RIG in item.stash:
        del item.stash[_FLIGHT], item.stash[_RIG]  # a session may have thousands of tests, each with a robot
    return report
