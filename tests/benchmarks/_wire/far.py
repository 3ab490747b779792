"""The far end: ``python -m tests.benchmarks._wire.far CONTESTANT WORK PORT``. It ends when it is killed, or its pipe is closed."""

from __future__ import annotations

import asyncio
import importlib
import os
import sys
import threading


def _with_parent() -> None:
    sys.stdin.read()
    os._exit(0)


if __name__ == "__main__":
    threading.Thread(target=_with_parent, daemon=True).start()
    name, work, port = sys.argv[1:]
    asyncio.run(importlib.import_module(f"tests.benchmarks._wire.{name}").far(work, int(port)))
