"""What the programs of this folder share: they read commands as lines of JSON, and write what happens as lines of JSON.

They run under a Python of their own, in which nothing of this project is installed.
"""

import json
import sys
import threading
from collections.abc import Callable, Iterator
from typing import Any


def say(kind: str, **more: object) -> None:
    """Write one line, whole, from any thread."""
    with _writing:
        print(json.dumps({"kind": kind, **more}), flush=True)


_writing = threading.Lock()


def commands() -> Iterator[dict[str, Any]]:
    """What is to be done, until nobody is left who could say so."""
    for line in sys.stdin:
        yield json.loads(line)


def obey(table: dict[str, Callable[..., object]]) -> None:
    """Carry out commands: ``{"do": "publish", "number": 3, ...}`` is answered by ``done`` of that number, or by ``failed`` with the error."""
    say("ready")
    for command in commands():
        what, number = command.pop("do"), command.pop("number")
        try:
            say("done", number=number, value=table[what](**command))
        except Exception as error:
            say("failed", number=number, error=f"{type(error).__name__}: {error}")
