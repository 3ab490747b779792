"""The flight records of processes: what a recorder of a process has kept is written to a file when its child fails."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Protocol, runtime_checkable

from actors.system import System


class Recorder(Protocol):
    """What records the system of a process, such as a `FlightRecorder`."""

    def attach(self, system: System, /) -> object: ...

    def dump(self, path: str | os.PathLike[str], /, *, notes: Mapping[str, str] | None = None) -> Path:
        """Write what has been recorded to a file. Raises `OSError`."""
        ...


@runtime_checkable
class ForProcesses(Protocol):
    """An observer of a system that wants its processes to be recorded, too."""

    def for_process(self) -> Callable[[], Recorder]:
        """What makes the recorder of a process; `pickle` can copy it."""
        ...


def makers(observers: Iterable[object]) -> tuple[Callable[[], Recorder], ...]:
    """What makes the recorders of a process, for these observers of its parent."""
    return tuple(observer.for_process() for observer in observers if isinstance(observer, ForProcesses))


def save(recorders: Iterable[Recorder], path: tuple[str, ...], why: str) -> Iterable[str]:
    """Write what they have recorded to files in the temporary folder of the system. Yields each file's path, or why there is none."""
    for recorder in recorders:
        name = f"flight-{'-'.join(path)}-{os.getpid()}.mcap"
        try:
            yield str(recorder.dump(Path(tempfile.gettempdir()) / name, notes={"reason": why}))
        except Exception as error:
            yield f"could not be written: {error}"
