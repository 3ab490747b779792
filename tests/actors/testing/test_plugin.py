"""The pytest plugin, in suites of its own: virtual time where it is asked for, and only there."""

from __future__ import annotations

import runpy
import subprocess
import sys
import textwrap
from pathlib import Path
from typing import Any

import pytest

from actors.testing import plugin
from tests.suites import run_pytest

ROOT = Path(__file__).parents[3]
LIBRARIES = Path(pytest.__file__).parents[1]

INI = """
[pytest]
asyncio_mode = {mode}
asyncio_default_fixture_loop_scope = function
filterwarnings = error
addopts = --strict-markers
"""

COMMON = """
    import asyncio
    import pytest
    import pytest_asyncio
    from actors import Node, every
    from actors.testing import Rig, VirtualLoop

    def is_virtual():
        return isinstance(asyncio.get_running_loop(), VirtualLoop)
"""


def suite(
    pytester: pytest.Pytester, body: str, *arguments: str, mode: str = "auto", conftest: str = ""
) -> pytest.RunResult:
    """Run a suite of one file, with the plugin as an installed package would bring it."""
    pytester.makeini(INI.format(mode=mode))
    if conftest:
        pytester.makeconftest(textwrap.dedent(conftest))
    pytester.makepyfile(textwrap.dedent(COMMON) + textwrap.dedent(body))
    return run_pytest(pytester, *arguments)


def test_no_test_meets_other_processes_unless_it_names_a_transport_whatever_the_shell_has(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_zenoh_cpp")
    body = """
        import os
        from actors import open_node
        from actors.system import system_of
        from actors.transport import transport_from_environment

        async def test_alone():
            async with open_node("alone") as node:
                assert not system_of(node).runtime.observers.opening, "nothing is opened beside the node"
            assert transport_from_environment(os.environ) is None

        def test_by_name(monkeypatch):
            monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_zenoh_cpp")
            assert transport_from_environment(os.environ) is not None
    """
    suite(pytester, body).assert_outcomes(passed=2)


def test_time_is_virtual_for_a_rig_directly_or_through_a_fixture_and_for_the_mark_only(
    pytester: pytest.Pytester,
) -> None:
    body = """
        @pytest_asyncio.fixture
        async def robot(rig):
            await rig.start(Node)
            return rig

        async def test_rig(rig):
            assert is_virtual()
            await asyncio.sleep(3600.0)

        async def test_through_a_fixture(robot):
            assert is_virtual()
            await robot.advance(3600.0)

        @pytest.mark.virtual
        async def test_marked():
            assert is_virtual()
            await asyncio.sleep(3600.0)

        @pytest.mark.virtual
        class TestClass:
            async def test_in_a_marked_class(self):
                assert is_virtual()

        async def test_plain():
            fresh = asyncio.new_event_loop()
            fresh.close()
            assert type(asyncio.get_running_loop()) is type(fresh)

        def test_not_even_async():
            with pytest.raises(RuntimeError):
                asyncio.get_running_loop()
    """
    suite(pytester, body).assert_outcomes(passed=6)


def test_a_failed_test_says_which_field_of_which_message_was_meant(pytester: pytest.Pytester) -> None:
    body = """
        from actors.interfaces.geometry_msgs.msg import Twist

        def test_twist():
            Twist(linaer=None)
    """
    result = suite(pytester, body)
    result.stdout.fnmatch_lines(["*Unexpected keyword argument 'linaer' of Twist; did you mean 'linear'?"])


def test_the_names_of_tests_stay_what_they_are(pytester: pytest.Pytester) -> None:
    body = """
        async def test_plain(): ...

        async def test_rig(rig): ...
    """
    outcome = suite(pytester, body, "--collect-only", "-q")
    assert [line.partition("::")[2] for line in outcome.outlines[:2]] == ["test_plain", "test_rig"]


def test_a_test_file_may_import_inspect(pytester: pytest.Pytester) -> None:
    """Python 3.12 takes the module `inspect` for a coroutine function."""
    suite(pytester, "import inspect\nasync def test_it(rig): pass").assert_outcomes(passed=1)


def test_a_suite_keeps_the_loops_that_its_own_hook_gives_it(pytester: pytest.Pytester) -> None:
    conftest = """
        import asyncio

        class OwnLoop(asyncio.SelectorEventLoop): ...

        def pytest_asyncio_loop_factories(config, item):
            return {"own": OwnLoop}
    """
    body = """
        async def test_plain():
            assert type(asyncio.get_running_loop()).__name__ == "OwnLoop"

        async def test_rig(rig):
            assert is_virtual()
    """
    suite(pytester, body, conftest=conftest).assert_outcomes(passed=2)


def test_a_suite_keeps_one_loop_for_the_session_if_it_wants_one(pytester: pytest.Pytester) -> None:
    body = """
        seen = []

        @pytest.mark.asyncio(loop_scope="session")
        async def test_first():
            seen.append(asyncio.get_running_loop())

        @pytest.mark.asyncio(loop_scope="session")
        async def test_second():
            assert seen == [asyncio.get_running_loop()]

        async def test_rig(rig):
            assert is_virtual()

        @pytest.mark.asyncio(loop_scope="session")
        async def test_rig_elsewhere(rig):
            with pytest.raises(RuntimeError, match="another event loop than its rig"):
                await rig.start(Node)
    """
    suite(pytester, body).assert_outcomes(passed=4)


def test_in_strict_mode_a_marked_test_gets_its_rig(pytester: pytest.Pytester) -> None:
    body = """
        @pytest.mark.asyncio
        async def test_rig(rig):
            await rig.start(Node)
            await rig.advance(1.0)
    """
    suite(pytester, body, mode="strict").assert_outcomes(passed=1)


def test_the_rig_is_closed_after_the_test_and_a_leak_fails_it_with_the_timeline(pytester: pytest.Pytester) -> None:
    body = """
        async def test_leaky(rig):
            await rig.start(Node, seed=42)
            await rig.advance(1.5)
            rig.kept = asyncio.create_task(asyncio.sleep(1e6), name="forgotten")

        async def test_clean(rig):
            await rig.start(Node)
    """
    outcome = suite(pytester, body)
    outcome.assert_outcomes(passed=2, errors=1)
    outcome.stdout.fnmatch_lines(
        [
            "*Leak: left over after the system's end: task forgotten*",
            "*- rig -*",
            "rig: seed=42 t=1.500000 s; the last * log lines:",
        ]
    )


def test_a_failing_test_shows_what_happened_in_its_system(pytester: pytest.Pytester) -> None:
    body = """
        class Brittle(Node):
            @every(hz=1)
            async def tick(self):
                self.log.warning("creaking", force=7)
                raise OSError("snapped")

        async def test_it_holds(rig):
            await rig.start(Brittle, seed=7)
            await rig.advance(1.0)

        def test_without_a_rig():
            raise AssertionError("plain")
    """
    outcome = suite(pytester, body)
    outcome.assert_outcomes(failed=2)
    outcome.stdout.fnmatch_lines(
        [
            '*raise OSError("snapped")',
            "*UnexpectedFailure: system/brittle (incarnation 1) failed at t=1.000 s: OSError: snapped (at *in Brittle.tick)",
            "*- rig -*",
            "rig: seed=7 t=1.000000 s; the last 4 log lines:",
            "*0.000] debug system: started brittle child='system/brittle'",
            "*1.000] warning /brittle: creaking force=7",
            "*1.000] error system: child terminated child='system/brittle' reason='it raised OSError: snapped'*",
            '* raise OSError("snapped")',
            "*1.000] info system: restarted brittle (life 2) at once child='system/brittle'",
        ]
    )
    assert outcome.stdout.str().count("- rig -") == 1


def test_what_deadlocks_is_reported_not_waited_for(pytester: pytest.Pytester) -> None:
    body = """
        @pytest.mark.virtual
        async def test_forever():
            await asyncio.Event().wait()
    """
    outcome = suite(pytester, body)
    outcome.assert_outcomes(failed=1)
    outcome.stdout.fnmatch_lines(["*Deadlock: Nothing is left that could wake a task*"])


def test_a_conftest_that_lists_the_plugin_as_well_does_not_register_it_twice(pytester: pytest.Pytester) -> None:
    """What `-p` does an entry point of the same name does, too; `pyproject.toml` gives it that name for this reason."""
    body = """
        async def test_rig(rig):
            assert is_virtual()
    """
    conftest = """
        pytest_plugins = ["actors.testing.plugin"]
    """
    suite(pytester, body, conftest=conftest).assert_outcomes(passed=1)


def test_the_entry_point_has_the_name_of_the_module() -> None:
    import tomllib

    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["entry-points"]["pytest11"] == {"actors.testing.plugin": "actors.testing.plugin"}


def test_without_pytest_asyncio_other_suites_run_as_ever_and_a_rig_says_what_is_missing(tmp_path: Path) -> None:
    (tmp_path / "sitecustomize.py").write_text(
        textwrap.dedent("""
            import sys
            from importlib.abc import MetaPathFinder

            class Hide(MetaPathFinder):
                def find_spec(self, name, path, target=None):
                    if name.partition(".")[0] == "pytest_asyncio":
                        raise ModuleNotFoundError(name=name)

            sys.meta_path.insert(0, Hide())
        """),
        encoding="utf-8",
    )
    (tmp_path / "pytest.ini").write_text("[pytest]\n", encoding="utf-8")
    (tmp_path / "test_it.py").write_text("def test_it():\n    assert True\n", encoding="utf-8")
    (tmp_path / "test_robot.py").write_text("async def test_robot(rig):\n    assert True\n", encoding="utf-8")
    environment = {
        "PYTHONPATH": f"{tmp_path}:{ROOT}:{LIBRARIES}", "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTHONDONTWRITEBYTECODE": "1",
    }  # fmt: skip
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "actors.testing.plugin",
        "-p",
        "no:cacheprovider",
    ]
    done = subprocess.run(
        [*command, "test_it.py"], capture_output=True, text=True, timeout=60, cwd=tmp_path, env=environment
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "1 passed" in done.stdout
    done = subprocess.run(
        [*command, "test_robot.py"], capture_output=True, text=True, timeout=60, cwd=tmp_path, env=environment
    )
    assert done.returncode == 2, done.stdout + done.stderr
    assert "test_robot uses the fixture 'rig', which needs pytest-asyncio: pip install pytest-asyncio" in done.stdout


def test_without_pytest_asyncio_the_fixture_is_pytest_s_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pytest_asyncio", None)
    module = runpy.run_path(str(ROOT / "actors" / "testing" / "plugin.py"))
    assert module["fixture"] is pytest.fixture


def test_there_is_nothing_to_configure_and_nothing_is_warned_of(pytester: pytest.Pytester) -> None:
    pytester.makepyfile("async def test_rig(rig): assert rig.loop.time() == 0.0")
    result = pytester.runpytest_subprocess(
        "-p", "actors.testing.plugin", "-p", "no:cacheprovider", "-p", "no:looptime_plugin", "-W", "error"
    )
    result.assert_outcomes(passed=1)
    assert "asyncio_default_fixture_loop_scope is unset" not in result.stdout.str() + result.stderr.str()
    assert "PytestDeprecationWarning" not in result.stdout.str() + result.stderr.str()


def test_a_tree_that_never_starts_fails_the_test_with_what_it_waits_for(pytester: pytest.Pytester) -> None:
    body = """
        class Endless(Node):
            async def on_start(self):
                while True:
                    await self.clock.sleep(1.0)

        async def test_endless(rig):
            await rig.start(Endless)

        async def test_soon(rig):
            await rig.start(Endless, within=10.0)

        async def test_the_next(rig):
            class Fine(Node): ...

            await rig.start(Fine)
    """
    result = suite(pytester, body)
    result.assert_outcomes(failed=2, passed=1)
    result.stdout.fnmatch_lines_random(
        [
            "*rig.start: not started within 3600 s: /endless awaits *.py:* in Endless.on_start.*",
            "*rig.start: not started within 10 s: /endless awaits *.py:* in Endless.on_start.*",
        ]
    )


def test_a_coroutine_test_with_a_rig_is_refused_where_pytest_asyncio_is_not_there(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def test_robot(rig: object) -> None: ...

    monkeypatch.setattr(plugin, "fixture", pytest.fixture)
    collector: Any = pytest.Module
    with pytest.raises(
        pytest.Collector.CollectError, match="test_robot uses the fixture 'rig', which needs pytest-asyncio"
    ):
        plugin.pytest_pycollect_makeitem(collector, "test_robot", test_robot)
