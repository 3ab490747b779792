"""What happens in the process of a trial: forked from a server that has loaded pytest and the libraries, but nothing of the project."""

from __future__ import annotations

import os
import sys
from typing import Final

OUTPUT: Final = "output.txt"
"""The file in the folder of the copy with what the last run of the tests printed."""
PROFILE: Final = "mutants"
"""The hypothesis profile of a trial."""
PRELOADED: Final = (
    "pytest",
    "pytest_asyncio.plugin",
    "hypothesis",
    "anyio.pytest_plugin",
    "numpy",
    "msgspec",
    "structlog",
)
MEMORY: Final = 4 * 2**30
"""Bytes that a mutant may take before it is stopped."""


def run_tests(folder: str, arguments: list[str]) -> None:
    """Run pytest in `folder` with the packages that are there, and exit with its code."""
    import resource

    import pytest
    from hypothesis import Phase, settings

    os.setsid()  # so that it can be killed with all that it starts
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    output = os.open(os.path.join(folder, OUTPUT), os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(output, 1)
    os.dup2(output, 2)
    os.chdir(folder)
    os.environ["PYTHONPATH"] = folder
    sys.path.insert(0, folder)
    own = set(os.listdir(folder))
    for name in list(sys.modules):  # this very module came from the original
        if name.partition(".")[0] in own:
            del sys.modules[name]
    # whether an example is found matters here, not how small it can be made
    settings.register_profile(PROFILE, derandomize=True, phases=[Phase.explicit, Phase.generate])
    code = int(pytest.main(arguments))
    sys.stdout.flush()
    os._exit(code)  # a thread that a mutant has left behind must not hold it up
