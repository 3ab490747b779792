"""One round of a contestant in this interpreter: ``python -m tests.benchmarks._wire.alone CONTESTANT WORK`` writes its figures."""

from __future__ import annotations

import asyncio
import json
import sys
from typing import cast

from tests.benchmarks._wire import Work, measure

if __name__ == "__main__":
    name, work = sys.argv[1:]
    print(json.dumps(asyncio.run(measure(name, cast(Work, work)))), flush=True)
