"""What a run leaves behind besides its report: a flight record (`--flight-record`), a trace (`--trace`), journals in bags (`--replay`), spans (`--spans`)."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from actors.bag import FlightRecord, FlightRecorder, Trace
    from actors.replay import Journal
    from actors.typing import Observer
    from robot.run.judge import Score
    from robot.run.options import Options


class Recordings:
    """Records from before the tree starts until after it has stopped. The record ends at the first fall, if there is one."""

    def __init__(self, options: Options, score: Score, *, reachable: bool = False) -> None:
        self._path = options.flight_record
        self._score = score
        self._recorder: FlightRecorder | None = None
        if options.flight_record is not None:
            from actors.bag import FlightRecorder

            self._recorder = FlightRecorder()
        alone = not (options.processes or options.machines)
        self._journal: Journal | None = None
        if options.replay or (reachable and alone):
            from actors.replay import Journal

            self._journal = Journal(*options.replay, publish=True, folder=options.journals, on_request=reachable)
        self._trace: Trace | None = None
        if options.trace:
            from actors.bag import Trace

            self._trace = Trace()
        self._fall: FlightRecord | None = None
        each = self._journal, self._recorder, self._trace, _spans() if options.spans else None
        self.observers: tuple[Observer, ...] = tuple(one for one in each if one is not None)

    def look(self) -> None:
        """Save the record at the first fall, before later messages displace it."""
        if self._recorder is not None and self._fall is None and self._score.falls:
            self._fall = self._recorder.freeze()

    def conclude(self, *, quiet: bool) -> dict[str, str]:
        """Write the file, print the trace; what the report has to say of them. Call it when the system has stopped."""
        words: dict[str, str] = {}
        if self._recorder is not None and self._path is not None:
            words |= self._write(self._recorder, self._path, quiet)
        if self._trace is not None:
            words["trace"] = self._trace.hexdigest()
            print(f"trace {words['trace']}", flush=True)
        return words

    def _write(self, recorder: FlightRecorder, path: str, quiet: bool) -> dict[str, str]:
        self.look()
        failure = sys.exception()
        why = f"{type(failure).__name__}: {failure}" if isinstance(failure, Exception) else "the run ended"
        if self._fall is not None:
            why = "the robot fell"
        try:
            (self._fall or recorder.freeze()).write(path, notes={"why": why})
        except OSError as error:
            print(f"robot run: --flight-record {path}: {error}", file=sys.stderr)
            return {}
        if not quiet:
            print(f"flight record: {path} ({why})", file=sys.stderr)
        return {"flight_record": path, "flight_record_of": why}


def _spans() -> Observer:
    from actors.diagnostics.spans import Spans  # late: it needs an extra

    return Spans()
