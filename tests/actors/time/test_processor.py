"""What a thread gets of the processors, as Linux tells it of this one."""

from __future__ import annotations

import os
import subprocess
import sys
import time

import pytest

from actors.time.processor import Processor, Share, is_runnable

linux = pytest.mark.skipif(sys.platform != "linux", reason="Linux tells it")


@linux
def test_a_thread_that_computes_has_run_and_one_that_sleeps_has_not() -> None:
    processor = Processor(f"self/task/{os.getpid()}")
    begun, end = processor.share(), time.thread_time() + 0.05
    while time.thread_time() < end:
        pass
    computed = processor.share()
    assert computed.ran - begun.ran >= 0.04
    assert computed.waited >= begun.waited
    time.sleep(0.05)  # what is measured
    assert processor.share().ran - computed.ran < 0.04
    processor.close()
    processor.close()
    assert processor.share() == Share(0.0, 0.0)


def test_nothing_is_told_of_a_thread_that_there_is_not() -> None:
    assert Processor("self/task/0").share() == Share(0.0, 0.0)
    assert not is_runnable(0)


@linux
def test_a_process_that_computes_is_runnable_and_one_that_sleeps_is_not() -> None:
    assert is_runnable(os.getpid())
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as child:
        while is_runnable(child.pid):
            time.sleep(0.01)
        child.communicate(b"\n")
