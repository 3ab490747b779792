"""Scenarios of communication are played twice: in one process, and over loop-back, as if the two sides were in two.

A test that cannot be played over loop-back says why: ``@pytest.mark.in_process("...")``.
"""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tests.loopback import actions, services

LINKS: dict[str, tuple[Callable[[pytest.MonkeyPatch], None], ...]] = {
    "tests.scenarios.test_services": (services.install, actions.install),
    "tests.scenarios.test_actions": (services.install, actions.install),
    "tests.scenarios.test_restarts": (services.install, actions.install),
}
"""What is linked over loop-back in the tests of each module."""


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if metafunc.module.__name__ not in LINKS:
        return
    alone = [mark.args[0] for mark in metafunc.definition.iter_markers("in_process")]
    metafunc.parametrize("link", ["in process"] if alone else ["in process", "loop-back"], indirect=True)


@pytest.fixture(autouse=True)
def link(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """How the two sides are linked."""
    way: str = getattr(request, "param", "in process")
    if way == "loop-back":
        for install in LINKS[request.module.__name__]:
            install(monkeypatch)
    return way
