"""Suites of their own that tests run: with the plugin as an installed package would bring it."""

from __future__ import annotations

import numpy as np  # noqa: F401
import pytest

from actors.testing import VirtualLoop  # noqa: F401

# pytester forgets what its suites import first: half of a package would stay, and numpy can be loaded only once


def run_pytest(pytester: pytest.Pytester, *arguments: str) -> pytest.RunResult:
    """Run the suite that is in `pytester`'s folder."""
    return pytester.runpytest_inprocess(
        "-p", "actors.testing.plugin", "-p", "no:cacheprovider", "-p", "no:looptime_plugin",
        "-o", "asyncio_default_fixture_loop_scope=function", *arguments,
    )  # fmt: skip
