"""`explore` on systems that it has never seen: what it finds, what it leaves in peace, and what it says of what it cannot run."""

from __future__ import annotations

import asyncio
import multiprocessing
import os
import subprocess
import sys
import threading
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import pytest

from actors.testing import Rig, explore
from actors.testing.explore import main
from actors.testing.simulation import isolated
from actors.testing.simulation.isolated import Elsewhere, Isolated, in_a_copy
from actors.testing.simulation.trial import Outcome, Scenario, Trial
from actors.time.virtual_loop import VirtualLoop
from tests.actors.testing import buggy_systems, odd_systems
from tests.facts import lacks

ROOT = str(Path(__file__).parents[3])
ODD = "tests.actors.testing.odd_systems"


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT)
    monkeypatch.chdir(tmp_path)


def explored(capfd: pytest.CaptureFixture[str], name: str, *options: str) -> tuple[int, str, str]:
    code = main([f"{ODD}:{name}", *options])
    return code, *capfd.readouterr()


def replay_line(found: str) -> list[str]:
    line = next(line for line in found.splitlines() if line.startswith("replay: "))
    return ["--replay", line.partition("--replay ")[2].strip("'")]


@pytest.mark.parametrize(
    ("name", "kind", "words"),
    [
        ("lost_update", "AssertionError", "a deposit was lost"),
        ("SHARING", "AssertionError", "a write was lost"),
        ("asking_back", "CallCycle", "/asked waits for /asking waits for /asked"),
        ("lock_order", "InvariantBroken", "waits for a lock of /two eat"),
        ("impatient", "CallTimeout", "supervisor impatient gave up"),
        ("port", "OSError", "did not start"),
        ("deaf", "Leak", "left over after the system's end: task /deaf work"),
        ("Blind", "RuntimeError", "blind did not start: it raised RuntimeError: no camera"),
        ("Hesitant", "InvariantBroken", "and no end: /hesitant is starting, at "),
        ("clinging", "InvariantBroken", "the system is to stop; /clinging is stopping, at "),
        ("Exits", "ProcessEnded", "with exit code 3"),
        ("AsksToExit", "ProgramExit", "AsksToExit.leave asked the program to exit: SystemExit: 3"),
        ("Killed", "ProcessEnded", "with signal 9"),
    ],
)
def test_what_is_wrong_is_found_within_200_seeds_said_and_replayed(
    name: str, kind: str, words: str, capfd: pytest.CaptureFixture[str]
) -> None:
    code, found, errors = explored(capfd, name)
    assert (code, errors) == (1, "")
    head = found.splitlines()[0]
    assert head.startswith(f"{ODD}:{name}: {kind} with events in ")
    assert words in found
    assert "rig.expect_failure" not in found, "there is no test to say so"
    again, shown, errors = explored(capfd, name, *replay_line(found))
    assert (again, errors) == (1, "")
    assert words in shown


def test_a_flood_is_found(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(VirtualLoop, "max_spins", 2000)
    code, found, _ = explored(capfd, "Flood")
    assert code == 1
    assert "/flood flood (Flood.flood) runs again and again" in found


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("made_by_a_coroutine", ["--seeds", "6"]),
        ("side_by_side", ["--seeds", "6"]),
        ("Holder.tree", ["--seeds", "6"]),
        ("finishes", ["--seeds", "10"]),
        ("delicate", ["--seeds", "20", "--faults", "crash"]),
        ("one_order", ["--seeds", "6", "--seconds", "20"]),
        ("Echo", ["--seeds", "10", "--faults", "none"]),
        ("Threads", ["--seeds", "6"]),
    ],
)
def test_a_system_in_order_is_left_in_peace(name: str, options: list[str], capfd: pytest.CaptureFixture[str]) -> None:
    code, said, errors = explored(capfd, name, "--seconds", "5", *options)
    assert (code, errors) == (0, ""), said
    assert "no failure" in said


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("wants_more", "it is called without arguments, and cannot be: missing a required argument: 'robot'"),
        ("runs_by_itself", "what should make a tree had made none after 60 s: it is to return a tree, not to run it"),
        ("no_tree", "what should make a tree made int 5: return a Supervisor, a Child or a node class"),
        ("cannot_be_made", "the tree could not be made: OSError: no configuration (at "),
        ("NOTHING", "is int 5: neither a tree, nor a node class"),
        ("LATE", "is Topic(Int32, 'late'): neither a tree"),
        ("Holder", "is the class Holder: neither a tree"),
        ("Holder.leaf", "has nothing of the name 'Holder.leaf'; trees that it has: "),
    ],
)
def test_what_is_no_tree_is_refused_in_one_line(name: str, said: str, capfd: pytest.CaptureFixture[str]) -> None:
    code, out, errors = explored(capfd, name, "--seeds", "1")
    assert (code, out) == (2, "")
    (line,) = errors.splitlines()
    assert said in line


def test_a_replay_of_what_is_no_tree_is_refused_as_well(capfd: pytest.CaptureFixture[str]) -> None:
    code, out, errors = explored(capfd, "no_tree", "--replay", "0")
    assert (code, out) == (2, "")
    assert "made int 5" in errors


@pytest.mark.parametrize(
    ("content", "name", "said"),
    [
        ("", "absent_one:tree", "no module named 'absent_one', neither here in"),
        ("", "absent_one.part:tree", "no module named 'absent_one.part', neither here in"),
        (
            "import absent_library",
            "strange:tree",
            "cannot be imported: No module named 'absent_library' (at {here}/strange.py:1)",
        ),
        ("x = y", "strange:tree", "cannot be imported: NameError: name 'y' is not defined (at {here}/strange.py:1)"),
        ("x = (", "strange:tree", "cannot be imported: SyntaxError: "),
        ("raise SystemExit(1)", "strange:tree", "cannot be imported: SystemExit: 1 (at {here}/strange.py:1)"),
        ("", "strange:tree", "has nothing of the name 'tree'; trees that it has: none"),
        ("", "strange.py:tree", "name the module as an import does: strange:tree"),
        ("", "./robot/strange.py:tree", "name the module as an import does: robot.strange:tree"),
        ("tree = dict", "strange:tree", "is the class dict: neither a tree"),
        ("tree = max", "strange:tree", "the tree could not be made: TypeError: "),
    ],
)
def test_what_cannot_be_imported_is_said_with_its_line(
    content: str, name: str, said: str, capfd: pytest.CaptureFixture[str]
) -> None:
    Path("strange.py").write_text(content, encoding="utf-8")
    assert main([name, "--seeds", "1"]) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert said.format(here=os.getcwd()) in line
    sys.modules.pop("strange", None)


@pytest.mark.parametrize(("file", "said"), [("no/such/folder/x.mcap", "no such folder"), (".", "it is a folder")])
def test_a_flight_record_that_cannot_be_written_is_said_before_the_search(
    file: str, said: str, capfd: pytest.CaptureFixture[str]
) -> None:
    code, out, errors = explored(capfd, "Blind", "--flight-record", file)
    assert (code, out) == (2, "")
    (line,) = errors.splitlines()
    assert said in line


def test_an_interrupt_ends_the_search_without_a_traceback(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*arguments: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(explore, "search", interrupted)
    assert explored(capfd, "Blind") == (130, "", "explore: interrupted\n")


def test_a_replay_is_the_same_in_another_process() -> None:
    """Also the order of a set of names, which Python else shuffles for each process."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONHASHSEED"} | {"PYTHONPATH": ROOT}
    command = [sys.executable, "-m", "actors.testing", "explore", f"{ODD}:Hashing", "--seconds", "2"]
    found, again = (
        subprocess.run([*command, *more], capture_output=True, text=True, timeout=60, env=environment)
        for more in ([], ["--replay", "0 fifo"])
    )
    assert (found.returncode, again.returncode) == (1, 1), found.stderr + again.stderr
    line = next(line for line in found.stdout.splitlines() if "the hash is" in line).split("Hashing.tell")[0]
    assert line.partition("the hash is ")[2].split()[0] in again.stdout


def test_what_goes_wrong_is_said_in_words(capfd: pytest.CaptureFixture[str]) -> None:
    _, found, _ = explored(capfd, "port", "--patience", "7")
    assert "  with this fault: /port dies at its await number " in found
    assert " --patience 7 --replay " in found
    assert f"flight record: {Path('explore.mcap')}" in found
    assert Path("explore.mcap").stat().st_size > 500


def test_a_failure_without_a_system_has_no_flight_record(capfd: pytest.CaptureFixture[str]) -> None:
    _, found, _ = explored(capfd, "Exits", "--seeds", "1")
    assert "flight record: none: " in found


def test_where_processes_cannot_be_copied_trials_run_in_this_one(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(multiprocessing, "get_all_start_methods", lambda: ["spawn"])
    assert explored(capfd, "made_by_a_coroutine", "--seeds", "2", "--seconds", "2")[0] == 0
    assert explored(capfd, "side_by_side", "--seeds", "2", "--seconds", "2")[0] == 0
    code, found, _ = explored(capfd, "Blind")
    assert code == 1
    assert "no camera" in found
    assert Path("explore.mcap").exists()
    assert explored(capfd, "no_tree")[0] == 2
    assert explored(capfd, "cannot_be_made")[0] == 2
    assert explored(capfd, "runs_by_itself")[0] == 2
    Path("explore.mcap").unlink()
    Path("explore.mcap").mkdir()
    monkeypatch.setattr(explore, "_check_file", lambda path: None)
    code, found, _ = explored(capfd, "Blind")
    assert code == 1
    assert "flight record: none: " in found, "what was found is told all the same"


def test_a_trial_sees_nothing_of_the_one_before() -> None:
    async def count(rig: Rig) -> None:
        odd_systems.SHARED["written"] += 1
        assert odd_systems.SHARED["written"] == 1

    played = Isolated(Scenario(count))
    assert [played.play(Trial(seed)).error for seed in range(3)] == [None] * 3
    assert odd_systems.SHARED["written"] == 0


@pytest.mark.parametrize("quiet", [True, False])
def test_a_copy_is_as_quiet_as_it_is_asked_to_be(quiet: bool, capfd: pytest.CaptureFixture[str]) -> None:
    def work(answer: Any) -> None:
        print("loud", flush=True)
        answer(7)

    answered: int = in_a_copy(work, quiet=quiet)
    assert answered == 7
    inlet, outlet = multiprocessing.Pipe(duplex=False)
    isolated._work(work, _connection(outlet), quiet)
    assert inlet.recv() == 7
    assert capfd.readouterr().out == ("" if quiet else "loud\n" * 2)
    inlet.close()
    outlet.close()


def _connection(outlet: Any) -> Connection:
    return outlet  # type: ignore[no-any-return]  # typeshed gives `Pipe` another name on each system


@pytest.mark.parametrize("computes", [True, False])
def test_a_loop_that_never_gets_its_turn_back_is_found_out(computes: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(isolated, "BLOCKED_SECONDS", 0.02)
    monkeypatch.setattr(isolated, "STARVED", 1e9 if computes else 1.0)
    told = threading.Event()
    answers: list[Outcome] = []
    ends: list[int] = []

    def end(code: int) -> None:
        ends.append(code)
        told.set()

    async def body(rig: Rig) -> None:
        await rig.start(buggy_systems.Source)
        while computes and not told.is_set():
            pass
        told.wait()

    monkeypatch.setattr(os, "_exit", end)
    Isolated(Scenario(body)).play_here(Trial(5), answers.append)
    assert set(ends) == {1}
    blocked, *_, ended = answers
    assert blocked.signature == ("Blocked", "")
    assert str(blocked.error).startswith("one step keeps the loop and does not end, at ")
    assert f"{__file__}:" in str(blocked.error)
    assert blocked.trial == ended.trial == Trial(5)
    assert ended.error is None


def test_a_loop_that_waits_for_the_real_world_is_not_taken_to_be_blocked() -> None:
    seen: list[object] = []

    async def body(rig: Rig) -> None:
        main = threading.get_ident()

        def look() -> None:
            while isolated.progress(rig.loop, main) is not None:
                pass

        seen.append(isolated.progress(rig.loop, main))
        await asyncio.sleep(0)
        seen.append(isolated.progress(rig.loop, main))
        await rig.loop.run_in_executor(None, look)  # ends when the loop waits

    assert Scenario(body).run(0).error is None
    before, after = seen
    assert None not in (before, after)
    assert before != after
    assert isolated.progress(None, threading.get_ident()) is None


def test_an_error_of_a_copy_keeps_its_text_and_its_traceback() -> None:
    async def body(rig: Rig) -> None:
        raise LookupError("not here")

    outcome = Isolated(Scenario(body)).play(Trial(1))
    assert isinstance(outcome.error, Elsewhere)
    assert str(outcome.error) == "not here"
    assert "in body" in outcome.error.report
    assert outcome.signature[0] == "LookupError"


@pytest.mark.parametrize(
    ("option", "value", "said"),
    [
        ("--seeds", "0", "argument --seeds: give a whole number, 1 or more, not '0'"),
        ("--seeds", "-5", "argument --seeds: give a whole number, 1 or more, not '-5'"),
        ("--seeds", "many", "argument --seeds: give a whole number, 1 or more, not 'many'"),
        ("--first", "-1", "argument --first: give a whole number, 0 or more, not '-1'"),
        ("--seconds", "-1", "argument --seconds: give a number of seconds above 0, not '-1'"),
        ("--seconds", "nan", "argument --seconds: give a number of seconds above 0, not 'nan'"),
        ("--seconds", "long", "argument --seconds: give a number of seconds above 0, not 'long'"),
        ("--patience", "0", "argument --patience: give a number of seconds above 0, not '0'"),
        ("--faults", "steal", "argument --faults: there is no fault 'steal'; there are: "),
        ("--sedes", "5", "unrecognized arguments: --sedes 5"),
    ],
)
def test_a_number_that_makes_no_sense_is_refused_in_one_line(
    option: str, value: str, said: str, capfd: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit, match="2"):
        main([f"{ODD}:Blind", option, value])
    out, errors = capfd.readouterr()
    (line,) = errors.splitlines()
    assert out == ""
    assert line.startswith(f"explore: {said}")


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (
            "lose:/nosuch>/valve#5",
            "lose:/nosuch>/valve#5 names nothing in this system. There is: /ticks>/listener",
        ),
        (
            "delay:/tick>/listener#5+1",
            "delay:/tick>/listener#5+1 names nothing in this system. Did you mean /ticks>/listener? There is: /ticks>/listener",
        ),
        ("kill:/listenr#5", "names nothing in this system. Did you mean /listener? There is: /listener, /source"),
        ("crash:/pump#5", "names nothing in this system. There is: /listener, /source"),
        ("slow-start:/pump#1+1", "There is: /listener, /source"),
        ("slow-handler:/pump#1+1", "There is: /listener, /source"),
        ("slow-step:/listener>take#1+1", "There is: nothing for a fault of this kind"),
        ("crash:/listener>take#1", "There is: nothing for a fault of this kind"),
        ("clock-jump:clocks#1+1", "Did you mean clock? There is: clock"),
    ],
)
def test_a_replay_whose_fault_names_nothing_is_refused(
    fault: str, said: str, capfd: pytest.CaptureFixture[str]
) -> None:
    assert main(["tests.actors.testing.buggy_systems:sound", "--seconds", "2", "--replay", f"4 {fault}"]) == 2
    out, errors = capfd.readouterr()
    (line,) = errors.splitlines()
    assert out == ""
    assert said in line


def test_of_many_names_some_are_said(capfd: pytest.CaptureFixture[str]) -> None:
    assert explored(capfd, "crowd", "--seconds", "1", "--replay", "4 kill:/pump#5")[0] == 2
    assert explored(capfd, "crowd", "--seconds", "1", "--replay", "4 kill:/pump#5")[2].count("/source_") == 12


def test_a_replay_says_which_faults_have_not_come_to_pass(capfd: pytest.CaptureFixture[str]) -> None:
    replay = "4 fifo lose:/ticks>/listener#3 lose:/ticks>/listener#500 kill:/listener#9000"
    assert main(["tests.actors.testing.buggy_systems:sound", "--seconds", "2", "--replay", replay]) == 0
    assert capfd.readouterr().out.splitlines() == [
        "this trial passes",
        "  lose:/ticks>/listener#500 has not come to pass: the count ended at 20",
        "  kill:/listener#9000 has not come to pass: the count ended at 2000",
    ]


def test_what_a_replay_names_may_be_there_in_that_trial_only(capfd: pytest.CaptureFixture[str]) -> None:
    """The way to a node's second life, say."""
    code, out, errors = explored(
        capfd, "comes_late", "--seconds", "5", "--replay", "4 kill:/source#100 lose:/late>/rarely#1"
    )
    assert (code, errors) == (0, "")
    assert out.startswith("this trial passes")


def test_a_replay_of_what_ends_its_process_is_not_refused(capfd: pytest.CaptureFixture[str]) -> None:
    code, out, _ = explored(capfd, "Exits", "--replay", "0 fifo kill:/pump#5")
    assert code == 1
    assert "with exit code 3" in out


def test_a_failure_is_shown_with_the_newest_log_lines(capfd: pytest.CaptureFixture[str]) -> None:
    _, found, _ = explored(capfd, "port", "--seeds", "200")
    lines = found.splitlines()
    at = next(number for number, line in enumerate(lines) if line.startswith("  the last "))
    assert lines[at].endswith(" log lines:")
    assert any("port" in line and "child terminated" in line for line in lines[at + 1 : at + 9])


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (OSError("no space left"), "none: no space left"),
        (ValueError("argument out of range"), "none: it could not be written: ValueError: argument out of range"),
        (SystemExit(7), "none: the system ended its own process, with exit code 7"),
    ],
)
def test_a_record_that_cannot_be_written_does_not_hide_what_was_found(
    error: BaseException, said: str, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(self: object, path: object, **more: object) -> None:
        raise error

    monkeypatch.setattr("actors.bag.flight_recorder.FlightRecorder.dump", fail)
    code, found, _ = explored(capfd, "Blind", "--seeds", "1")
    assert code == 1
    assert "no camera" in found
    assert "replay: python -m actors.testing explore " in found
    assert found.splitlines()[-1] == f"flight record: {said}"


def test_nor_does_it_where_processes_cannot_be_copied(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(self: object, path: object) -> None:
        raise ValueError("argument out of range")

    monkeypatch.setattr(multiprocessing, "get_all_start_methods", lambda: ["spawn"])
    monkeypatch.setattr("actors.bag.flight_recorder.FlightRecorder.dump", fail)
    code, found, _ = explored(capfd, "Blind", "--seeds", "1")
    assert code == 1
    assert lacks(found.splitlines()[-1], "flight record none ValueError argument out of range") == []


def test_a_clock_that_is_set_to_before_1970_is_found_and_recorded(capfd: pytest.CaptureFixture[str]) -> None:
    code, found, errors = explored(capfd, "Odometer", "--faults", "clock-jump")
    assert (code, errors) == (1, "")
    assert "s have passed since the last tick" in found
    assert "with this fault: the time of day jumps by -" in found
    assert found.splitlines()[-1] == "flight record: explore.mcap"
    assert Path("explore.mcap").stat().st_size > 500


def test_help_is_quick_and_no_failure() -> None:
    done = subprocess.run(
        [sys.executable, "-X", "importtime", "-m", "actors.testing", "--help"],
        capture_output=True, text=True, timeout=60, env=os.environ | {"PYTHONPATH": ROOT},
    )  # fmt: skip
    assert done.returncode == 0
    assert done.stdout.startswith("usage: python -m actors.testing explore MODULE:TREE [options]")
    assert "numpy" not in done.stderr
    assert "actors.testing.explore" not in done.stderr


def test_a_thread_that_a_node_leaves_which_may_not_clean_up_is_no_failure(capfd: pytest.CaptureFixture[str]) -> None:
    assert explored(capfd, "Threads", "--seconds", "5", "--replay", "1 fifo crash:/threads#8")[0] == 0
    assert explored(capfd, "Threads", "--seconds", "5", "--replay", "1 fifo kill:/threads#3000")[0] == 0
    code, found, _ = explored(capfd, "forgets_a_thread", "--seconds", "5", "--seeds", "1")
    assert code == 1
    assert "left over after the system's end: thread " in found


def test_the_log_lines_of_a_failure_end_with_it(capfd: pytest.CaptureFixture[str]) -> None:
    code, out, _ = explored(capfd, "asking_back")
    assert code == 1
    assert "log lines:" in out
    assert "was cancelled by somebody other than its supervisor" not in out
