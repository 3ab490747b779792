"""A script that starts its tree without `if __name__ == "__main__":`, and processes that run it again to find its functions and classes."""

from __future__ import annotations

import asyncio
import os
import runpy
import subprocess
import sys
from pathlib import Path

import pytest
from anyio import BrokenWorkerProcess, to_process

from actors import Node, execute, run

SCRIPT = """
import asyncio, sys
from actors import Child, Intensity, Node, Supervisor, background, run

def heavy(n: int) -> int:
    return 2 * n

class Asks(Node):
    @background
    async def ask(self) -> None:
        await self.offload(heavy, 2)

async def main() -> None:
    child = Child(Asks, process="process" in sys.argv)
    async with asyncio.timeout(60.0), run(Supervisor("all", child, intensity=Intensity(0, within=1.0))) as system:
        await system.wait()

asyncio.run(main())
"""


TOLD = "start it under `if __name__ == '__main__':`"


def test_a_main_module_that_a_process_of_the_program_reads_starts_no_system(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        "import asyncio\nfrom actors import Node, execute, run\n\nasync def main():\n    async with run(Node): ...\n\nexecute(main)\n"
    )
    with pytest.raises(RuntimeError, match=TOLD) as refused:
        runpy.run_path(str(script), run_name="__mp_main__")
    assert str(refused.value).startswith(f"{script}, line 7: ")


async def _offloaded() -> None:
    async with run(Node, sinks=()) as system, asyncio.timeout(60.0):
        await system.node(Node).offload(os._exit, 3)


def test_a_worker_that_dies_is_told() -> None:
    with pytest.raises(BrokenWorkerProcess):
        execute(_offloaded)


def test_why_a_worker_could_not_be_prepared_is_the_error(monkeypatch: pytest.MonkeyPatch) -> None:
    async def unprepared(*arguments: object, cancellable: bool) -> None:  # anyio's own leaves its process unclosed here
        raise BrokenWorkerProcess("Error during worker process initialization") from RuntimeError(TOLD)

    monkeypatch.setattr(to_process, "run_sync", unprepared)
    with pytest.raises(RuntimeError, match=TOLD):
        execute(_offloaded)


@pytest.mark.realtime
@pytest.mark.parametrize("way", ["offload", "process"])
def test_a_script_that_would_run_twice_is_told_where_to_start(way: str, tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    done = subprocess.run([sys.executable, script, way], capture_output=True, text=True, timeout=90.0, check=False)
    assert done.returncode == 1
    assert f"{script}, line 18: a process of this program reads the main module" in done.stderr
    assert TOLD in done.stderr
