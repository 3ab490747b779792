"""A pytest plugin: the suite under the eager task factory. `-p tests.tools.eager` starts every task of every loop within `create_task`.

Python 3.12 and later. Tests that are marked `task_order` are about the order in which tasks take their first step and are left out. Not all of
the others pass: journals refuse such a loop, and some ends, joins and players differ. Processes that tests start run as they always do.
"""

from __future__ import annotations

import asyncio
import sys
from typing import Any

import pytest


def pytest_configure(config: pytest.Config) -> None:
    if sys.version_info < (3, 12):
        raise pytest.UsageError(
            "-p tests.tools.eager: tasks can be started eagerly from Python 3.12 on; run it with that"
        )
    begin = asyncio.BaseEventLoop.__init__

    def eager(self: asyncio.BaseEventLoop, *given: Any, **named: Any) -> None:
        begin(self, *given, **named)
        self.set_task_factory(asyncio.eager_task_factory)

    asyncio.BaseEventLoop.__init__ = eager  # type: ignore[method-assign]
    config.add_cleanup(lambda: setattr(asyncio.BaseEventLoop, "__init__", begin))


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    ordered = [item for item in items if item.get_closest_marker("task_order") is not None]
    if ordered:
        config.hook.pytest_deselected(items=ordered)
        items[:] = [item for item in items if item not in ordered]
