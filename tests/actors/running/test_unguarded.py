"""A script that starts its tree without `if __name__ == "__main__":`, and processes that run it again to find its functions and classes."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.realtime

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


@pytest.mark.parametrize("way", ["offload", "process"])
def test_a_script_that_would_run_twice_is_told_where_to_start(way: str, tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    done = subprocess.run([sys.executable, script, way], capture_output=True, text=True, timeout=90.0, check=False)
    assert done.returncode == 1
    assert f"{script}, line 18: a process of this program reads the main module" in done.stderr
    assert "start it under `if __name__ == '__main__':`" in done.stderr
