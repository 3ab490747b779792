"""The thread for calls that may wait."""

from __future__ import annotations

import asyncio
import subprocess
import sys
import threading

import pytest

from actors.transport.worker import Worker, _wait


async def test_calls_are_made_in_order_and_their_errors_reach_the_one_who_waits() -> None:
    worker, made = Worker("a worker"), list[int]()

    def fail() -> None:
        raise LookupError("no such thing")

    worker.do(lambda: made.append(1))
    assert await worker.result(lambda: [*made, 2]) == [1, 2]
    with pytest.raises(LookupError, match="no such thing"):
        await worker.result(fail)
    worker.close()


async def test_a_call_that_raises_is_reported_and_the_next_ones_are_made(monkeypatch: pytest.MonkeyPatch) -> None:
    reported: list[object] = []
    monkeypatch.setattr("threading.excepthook", reported.append)
    worker = Worker("a worker")

    def fail() -> None:
        raise MemoryError("no room for an image")

    worker.do(fail)
    assert await worker.result(lambda: "made") == "made"
    worker.close()
    (report,) = reported
    assert (report.exc_type, str(report.exc_value)) == (MemoryError, "no room for an image")  # type: ignore[attr-defined]
    assert report.thread.name == "a worker"  # type: ignore[attr-defined]


def test_a_call_that_outlives_the_loop_of_the_one_who_waited_disturbs_nobody() -> None:
    """A start that failed while the session was being opened used to end with a traceback of the thread."""
    worker, go_on, done = Worker("a worker"), threading.Event(), threading.Event()

    async def wait() -> None:
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(worker.result(go_on.wait), 0.01)

    asyncio.run(wait())
    go_on.set()
    worker.do(done.set)  # reached only by a thread that is alive
    assert done.wait(10.0)
    worker.close()


def test_the_end_of_the_process_waits_for_the_calls_of_a_closed_worker() -> None:
    """A thread that came back from Zenoh after the end of the interpreter had begun aborted the process: exit code 134 instead of 1."""
    program = (
        "import sys, time; from actors.transport.worker import Worker, _wait; worker = Worker('a worker'); "
        "worker.do(lambda: time.sleep(0.5)); worker.do(lambda: print('done', flush=True)); worker.close(); sys.exit(1)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (1, "done\n", "")


def test_the_end_of_the_process_waits_no_longer_than_some_seconds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("actors.transport.worker._LAST", 0.01)
    worker, go_on = Worker("a worker"), threading.Event()
    worker.do(lambda: (go_on.wait(), None)[1])
    worker.close()
    _wait()
    assert not go_on.is_set()
    go_on.set()
    _wait()
