"""Fencing tokens grow over the lives of a node, the places of a part and the runs of a tree; the runs are counted in a file."""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors import Child, DeclarationError, Node, Supervisor, Topic, every, publishes, run
from actors.checks import create
from actors.hosts import TlsHosts
from actors.hosts.run_counter import count_run
from actors.hosts.simulated import SimulatedHosts
from actors.interfaces.std_msgs.msg import UInt64
from actors.runtime.placement import HERE, Placement
from actors.time.virtual_loop import VirtualLoop
from actors.transport.simulated.network import Network
from robot.link.fence import Fence
from tests.actors.supervision.kit import virtual
from tests.actors.transport.security.fleet import Fleet

HAPPENINGS = st.sampled_from(["the node fails", "its machine is lost", "another part moves", "the tree begins anew"])


def tokens(history: list[str], *, counted: bool = True) -> list[int]:
    """Those of the lives of one node, in their true order. Without `counted`, each run is taken for the first."""
    number = incarnation = 1
    ended = 0
    lives = [Placement(1, 1).token(1)]
    for what in history:
        if what == "the tree begins anew":
            ended, number, incarnation = ended + 1, 1, 1
        elif what == "another part moves":
            number += 1
            continue
        else:
            number, incarnation = number + 1, incarnation + 1
        lives.append(Placement(1 + ended if counted else 1, number).token(incarnation))
    return lives


def followed(lives: list[int], arrivals: list[int]) -> list[int]:
    """Of the commands of these lives, in the order in which they arrive: which a fence lets pass, by the place of their life among all."""
    fence = Fence()
    return [life for life in arrivals if fence.admits(lives[life])]


@given(st.lists(HAPPENINGS, max_size=40), st.data())
def test_whatever_begins_anew_no_command_of_an_older_life_is_followed_after_one_of_a_newer(
    history: list[str], data: st.DataObject
) -> None:
    lives = tokens(history)
    arrivals = data.draw(st.lists(st.integers(0, len(lives) - 1)))

    obeyed = followed(lives, arrivals)

    assert obeyed == [life for at, life in enumerate(arrivals) if life >= max(arrivals[: at + 1])]


def test_without_a_count_of_the_runs_a_former_run_outranks_its_successor() -> None:
    history = ["its machine is lost", "the tree begins anew"]

    assert followed(tokens(history, counted=False), [2, 1, 2]) == [2, 1]
    assert followed(tokens(history), [2, 1, 2]) == [2, 2]


def test_a_token_of_the_last_run_of_a_long_history_fits_into_64_bits_and_a_tree_without_machines_is_older() -> None:
    last = Placement(2**24 - 1, 2**20 - 1).token(2**20 - 1)

    assert UInt64(data=last).data == last
    assert HERE.token(7) == 7 < Placement(1).token(1) < Placement(1, 1).token(1)


# -- the file ------------------------------------------------------------------------------------------------------------------


def test_each_run_has_the_next_number(tmp_path: Path) -> None:
    path = tmp_path / "runs"

    assert [count_run(path) for _ in range(3)] == [1, 2, 3]
    assert path.read_text(encoding="utf-8") == "1\n2\n3\n"


def test_runs_that_begin_at_once_have_different_numbers(tmp_path: Path) -> None:
    with ThreadPoolExecutor(8) as threads:
        numbers = list(threads.map(lambda _: count_run(tmp_path / "runs"), range(64)))

    assert sorted(numbers) == list(range(1, 65))


@pytest.mark.parametrize("written", range(3))
def test_a_number_that_was_cut_short_by_the_loss_of_power_is_given_again(tmp_path: Path, written: int) -> None:
    path = tmp_path / "runs"
    path.write_text("9\n10\n" + "11"[:written], encoding="utf-8")

    assert count_run(path) == 11
    assert path.read_text(encoding="utf-8") == "9\n10\n11\n"


def test_a_file_of_something_else_is_refused_and_left_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "runs"
    path.write_text("twelve\n", encoding="utf-8")

    with pytest.raises(DeclarationError, match=r"runs: its last line should be the number of the last run of the tree"):
        count_run(path)
    assert path.read_text(encoding="utf-8") == "twelve\n"


def test_a_place_where_nothing_can_be_written_is_refused(tmp_path: Path) -> None:
    with pytest.raises(
        DeclarationError, match=r"runs: the runs of the tree are counted here, which failed: No such file or directory"
    ):
        count_run(tmp_path / "nowhere" / "runs")


def test_the_file_lies_beside_the_security_file_unless_it_is_said_otherwise(tmp_path: Path) -> None:
    security = Fleet(tmp_path, "robot").security("robot")

    assert TlsHosts({}, security=security).count_run() == 1
    assert Path(security.file).with_name("runs").read_text(encoding="utf-8") == "1\n"
    assert TlsHosts({}, security=security).count_run() == 2
    assert TlsHosts({}, security=security, runs=tmp_path / "own").count_run() == 1


def test_a_program_that_is_killed_at_its_start_and_begins_again_goes_on_with_the_count(tmp_path: Path) -> None:
    program = "import os, sys, pathlib; from actors.hosts.run_counter import count_run; print(count_run(pathlib.Path(sys.argv[1])), flush=True); os.abort()"

    said = [
        subprocess.run(
            [sys.executable, "-c", program, str(tmp_path / "runs")], capture_output=True, env=os.environ, check=False
        ).stdout
        for _ in range(2)
    ]

    assert said == [b"1\n", b"2\n"]


# -- a tree ----------------------------------------------------------------------------------------------------------------------

SAID = Topic(UInt64, "said")


class Talker(Node):
    """Says its token."""

    out = publishes(SAID)

    @every(hz=10)
    def tick(self) -> None:
        self.out(UInt64(data=self.fencing_token))


@virtual
async def test_each_run_of_a_tree_has_larger_tokens_here_and_on_its_machines() -> None:
    network = Network(0)
    for name in ("robot", "base"):
        network.add_host(name)
    hosts = create(SimulatedHosts, network, "robot", ("base",))
    tree = Supervisor("top", children=[Child(Talker, name="near"), Child(Talker, name="far", host="base")])
    heard: list[int] = []

    for _ in range(2):
        async with run(tree, sinks=(), transport=network.transport("robot"), hosts=hosts) as system:
            near = system.node("near")
            async with near.subscribe(SAID) as said:
                while (far := (await said.next(timeout=5.0)).data) == near.fencing_token:
                    pass
            heard += [near.fencing_token, far]

    assert heard == [
        Placement(1, 0).token(1),
        Placement(1, 1).token(1),
        Placement(2, 0).token(1),
        Placement(2, 1).token(1),
    ]


def test_a_run_that_cannot_be_counted_does_not_begin(tmp_path: Path) -> None:
    started: list[str] = []

    class Started(Node):
        async def on_start(self) -> None:
            started.append(self.name)

    async def begin() -> None:
        network = Network(0)
        network.add_host("robot")
        hosts = TlsHosts({}, security=Fleet(tmp_path, "robot").security("robot"), runs=tmp_path)
        async with run(Started, sinks=(), transport=network.transport("robot"), hosts=hosts):
            raise AssertionError("it runs")

    loop = VirtualLoop()
    with pytest.raises(DeclarationError, match="Is a directory"):
        loop.run_until_complete(begin())
    loop.close()
    assert started == []
