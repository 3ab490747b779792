"""`launch_tests`: the runs of a launch test file; each starts the launch, and tests it while it runs and after its end."""

from __future__ import annotations

import functools
import inspect
import unittest
from collections.abc import Callable, Mapping, Sequence
from contextvars import copy_context
from dataclasses import dataclass
from pathlib import Path
from threading import Event, Thread
from types import ModuleType
from typing import Any, TextIO, cast

from actors.checks import NoPublicConstructor, create
from actors.errors import described
from actors.launch import events
from actors.launch.actions.events import RegisterEventHandler
from actors.launch.context import LaunchContext
from actors.launch.entity import LaunchDescription, evaluate
from actors.launch.errors import LaunchError
from actors.launch.handlers import EventHandler, OnProcessExit, OnProcessIO, OnProcessStart
from actors.launch.launching import arguments_text
from actors.launch.loading import IncludeLaunchDescription, LaunchDescriptionSource, load_module
from actors.launch.packages import Packages
from actors.launch.plan import Scope
from actors.launch.service import LaunchService
from actors.launch.shim import shim
from actors.launch.testing.records import IoHandler, ProcInfoHandler


def suite_of(module: ModuleType, given: Mapping[str, object], *, after: bool) -> unittest.TestSuite:
    """The tests of a module that run beside the launch, or those that run `after` its end.

    What is `given` reaches a test, ``setUp`` and so on by the names of their arguments, and as ``self.<name>``.
    """
    loader = unittest.TestLoader()
    suite = unittest.TestSuite()
    for case in vars(module).values():
        if not (isinstance(case, type) and issubclass(case, unittest.TestCase)) or case.__module__ != module.__name__:
            continue
        if getattr(case, "__post_shutdown_test__", False) == after:
            suite.addTest(loader.loadTestsFromTestCase(_bound(case, loader.getTestCaseNames(case), given)))
    return suite


def _bound(case: type[unittest.TestCase], names: Sequence[str], given: Mapping[str, Any]) -> type[unittest.TestCase]:
    """The class with methods that get what they ask for."""
    members: dict[str, Any] = {name: value for name, value in given.items() if not hasattr(case, name)}
    for name in (*names, "setUp", "tearDown"):
        members[name] = _with(getattr(case, name), given)
    for name in ("setUpClass", "tearDownClass"):
        members[name] = classmethod(_with(getattr(case, name).__func__, given))
    members["__module__"], members["__qualname__"] = case.__module__, case.__qualname__
    return type(case.__name__, (case,), members)


def _with(function: Callable[..., object], given: Mapping[str, object]) -> Callable[..., object]:
    chosen = {name: given[name] for name in inspect.signature(function).parameters if name in given}

    @functools.wraps(function)
    def call(*arguments: object) -> Any:
        return function(*arguments, **chosen)

    return call


READY_SECONDS = 15.0
"""How long the launch may take until it is ready for its tests, unless the file says otherwise."""
LAST_MOMENT = 0.1
"""How long after the last test the launch goes on, in seconds, unless a process ends before: one that is about to end gets no signal."""
MAKER = "generate_test_description"


def launch_tests(path: Path, *, packages: Packages | None = None) -> list[LaunchTest]:
    """The runs of a file: one, or one for each row of its ``parametrize``. Nothing is started. Raises `LaunchError`."""
    context = LaunchContext(packages)
    context.packages.add_package_of(path)
    with shim(context):
        module = load_module(path)
    make = getattr(module, MAKER, None)
    if make is None:
        raise LaunchError(f"{path} has no function {MAKER}()")
    rows = getattr(make, "__parametrized__", [{}])
    wanted = set(inspect.signature(make).parameters)
    for row in rows:
        if wanted != set(row):
            raise LaunchError(f"{path}: {MAKER} takes {_names(wanted)}, but parametrize gives {_names(set(row))}")
    return [create(LaunchTest, path, module, make, row, context) for row in rows]


class LaunchTest(metaclass=NoPublicConstructor):
    """One run of a launch test, which can be repeated. There is no public constructor: `launch_tests` gives them."""

    def __init__(
        self,
        path: Path,
        module: ModuleType,
        make: Callable[..., object],
        parameters: Mapping[str, object],
        context: LaunchContext,
    ) -> None:
        values = ", ".join(map(str, parameters.values()))
        self.name = f"{path.name}[{values}]" if parameters else path.name
        """The file, and the values of this run."""
        self._path = path
        self._module = module
        self._make = make
        self._parameters = parameters
        self._context = context

    def run(self, arguments: Mapping[str, str] | None = None, *, report: TextIO | None = None) -> Outcome:
        """Launch, run the tests, end the launch, and run those for after its end. Raises `LaunchError` and `unittest.SkipTest`.

        `arguments` are those of the launch, name to text; tests get them as `test_args`. The tests run in a thread of their own, the launch
        in this one, so that its nodes and processes go on while a test waits. A launch that ends before its tests, or is not ready for them
        in time, is a failure. Results are written to `report`, or to stderr, as `unittest` does.
        """
        with shim(self._context):
            description, given = self._described()
            execution = _Execution(self._module, description, {**given, **self._parameters}, arguments or {}, report)
            seconds = getattr(self._make, "__ready_to_test_action_timeout__", READY_SECONDS)
            return execution.outcome(seconds, stays=getattr(self._make, "__keep_alive__", False))

    def show_arguments(self) -> str:
        """The arguments of the launch, as `ros2 launch --show-args` lists them."""
        context = LaunchContext(self._context.packages, lenient=True)
        with shim(context):
            evaluate([self._described()[0]], context, Scope("test", ""))
        return arguments_text(context)

    def _described(self) -> tuple[LaunchDescription, Mapping[str, object]]:
        """What the function of the file returns: the description, and what tests are given."""
        made: object = self._make(**self._parameters)
        description, given = cast("tuple[Any, Mapping[str, Any]]", made if isinstance(made, tuple) else (made, {}))
        if not isinstance(description, LaunchDescription):
            raise LaunchError(f"{self._path}: {MAKER}() returned {described(description)}, no LaunchDescription")
        return description, given


class _Execution:
    """One execution of a run: the launch in this thread, and beside it the tests in another.

    Invariants: `_ready` is set by the launch, and `_active` by the thread of the tests when they are done; then it ends the launch.
    """

    def __init__(
        self,
        module: ModuleType,
        description: LaunchDescription,
        given: Mapping[str, object],
        arguments: Mapping[str, str],
        report: TextIO | None,
    ) -> None:
        self._runner = unittest.TextTestRunner(report, verbosity=2)
        self._info, self._output = ProcInfoHandler(), IoHandler()
        self._service = LaunchService()
        self._service.include_launch_description(self._watched(description, arguments))
        self._module = module
        self._given = {**given, "proc_info": self._info, "proc_output": self._output, "test_args": dict(arguments)}
        self._ready = Event()
        self._late = self._over = False
        """Whether the launch was not ready in time, and whether it has ended before it was ready."""
        self._active: unittest.TestResult | None = None

    def _watched(self, description: LaunchDescription, arguments: Mapping[str, str]) -> LaunchDescription:
        """The description with handlers that note what happens."""

        def started(event: events.ProcessEvent, context: LaunchContext) -> None:
            self._info.append(event)
            self._output.track(event.process_name)

        def ended(event: events.ProcessEvent, context: LaunchContext) -> None:
            self._info.append(event)

        def ready(event: object, context: LaunchContext) -> None:
            self._ready.set()

        handlers = (
            OnProcessStart(on_start=started),
            OnProcessExit(on_exit=ended),
            OnProcessIO(on_stdout=self._output.append, on_stderr=self._output.append),
            EventHandler(matcher=lambda event: isinstance(event, events.ReadyToTest), entities=ready),
        )
        source = LaunchDescriptionSource(launch_description=description)
        include = IncludeLaunchDescription(source, launch_arguments=arguments.items())
        return LaunchDescription([*map(RegisterEventHandler, handlers), include])

    def outcome(self, seconds: float, *, stays: bool) -> Outcome:
        """Launch and test. The launch is given so many seconds to be ready; if it `stays` it does not end before the tests are done."""
        here = copy_context()  # by which functions such as `get_package_prefix` know their packages
        beside = Thread(target=here.run, args=(self._test, seconds), name="launch tests", daemon=True)
        beside.start()
        try:
            code = self._service.run(shutdown_when_idle=not stays)
        finally:
            self._over = not self._ready.is_set()
            self._ready.set()  # so that the thread ends, without running a test, if the launch has ended before
        if code or self._over or self._active is None:
            if code:
                why = f"exit code {code}"
            elif self._late:
                why = f"it was not ready within {seconds:g} s"
            else:
                why = "nothing was left to run: add ReadyToTest() where it is missing, or keep_alive()"
            return Outcome(
                0, (("launch", f"The launch ended before its tests were done. {why}\n{self._output.tail()}"),)
            )
        return Outcome.of(self._active, self._runner.run(suite_of(self._module, self._given, after=True)))

    def _test(self, seconds: float) -> None:
        """Wait until the launch is ready, run the tests, and end the launch."""
        try:
            self._late = not self._ready.wait(seconds)
            if not (self._late or self._over):
                given = {**self._given, "launch_service": self._service}
                self._active = self._runner.run(suite_of(self._module, given, after=False))
                with self._info.proc_event:
                    self._info.proc_event.wait(LAST_MOMENT)
        finally:
            self._service.shutdown()


@dataclass(frozen=True)
class Outcome:
    """How many tests ran, and those that failed: the name of each, and what it raised."""

    tests: int
    failures: tuple[tuple[str, str], ...] = ()

    @classmethod
    def of(cls, *results: unittest.TestResult) -> Outcome:
        failures = [(test.id(), text) for result in results for test, text in (*result.errors, *result.failures)]
        failures += [(test.id(), "unexpected success") for result in results for test in result.unexpectedSuccesses]
        return cls(sum(result.testsRun for result in results), tuple(failures))


def _names(names: set[str]) -> str:
    return ", ".join(sorted(names)) or "nothing"
