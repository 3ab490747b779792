"""The diagnostics of all nodes, sorted by analyzers that parameters declare."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from actors import Child, StartFailed
from actors.diagnostics import DIAGNOSTICS, DIAGNOSTICS_AGG, Aggregator
from actors.diagnostics.analyzers import TOPLEVEL
from actors.interfaces.diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from actors.testing import Probe, Rig

OK, WARN, ERROR, STALE = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR, DiagnosticStatus.STALE
GENERIC = "diagnostic_aggregator/GenericAnalyzer"


def status(name: str, level: int = OK, message: str = "") -> DiagnosticStatus:
    return DiagnosticStatus(name=name, level=level, message=message)


async def started(rig: Rig, **parameters: Any) -> tuple[Probe[DiagnosticArray], Probe[DiagnosticStatus]]:
    named = {name.replace("__", "."): value for name, value in parameters.items()}
    await rig.start(Child(Aggregator, parameters=named))
    return rig.probe(DIAGNOSTICS_AGG), rig.probe(TOPLEVEL)


def tree(message: DiagnosticArray) -> dict[str, tuple[int, str]]:
    return {one.name: (one.level, one.message) for one in message.status}


async def test_statuses_are_sorted_by_their_analyzers_and_the_rest_is_other(rig: Rig) -> None:
    seen, top = await started(
        rig, path="spot", analyzers__legs__type=GENERIC, analyzers__legs__path="Legs", analyzers__legs__startswith=["motor", "gait: "],
        analyzers__eyes__type=GENERIC, analyzers__eyes__contains="camera", analyzers__eyes__regex=[".*lidar[0-9]"],
        analyzers__eyes__find_and_remove_prefix=["eyes"],
    )  # fmt: skip
    names = ["motor: front/left", "gait: cycle", "the camera", "a lidar7", "eyes: depth", "battery"]
    rig.publish(DIAGNOSTICS, DiagnosticArray(status=[status(name, message="fine") for name in names]))
    await rig.advance(1.0)
    assert tree(seen.newest) == {
        "/spot/Legs": (OK, "OK"), "/spot/Legs/motor: front left": (OK, "fine"), "/spot/Legs/gait: cycle": (OK, "fine"),
        "/spot/eyes": (OK, "OK"), "/spot/eyes/the camera": (OK, "fine"), "/spot/eyes/a lidar7": (OK, "fine"), "/spot/eyes/depth": (OK, "fine"),
        "/spot/Other": (OK, "OK"), "/spot/Other/battery": (OK, "fine"),
    }  # fmt: skip
    header = seen.newest.status[0]
    assert {one.key: one.value for one in header.values} == {"motor: front left": "fine", "gait: cycle": "fine"}
    assert (top.newest.level, top.newest.name, top.newest.message) == (OK, "toplevel_state", "OK")


async def test_a_header_has_the_worst_level_of_its_items(rig: Rig) -> None:
    seen, top = await started(rig, analyzers__a__type=GENERIC, analyzers__a__startswith="a", pub_rate=2.0)
    for level, word in ((WARN, "Warning"), (ERROR, "Error")):
        rig.publish(DIAGNOSTICS, DiagnosticArray(status=[status("a1"), status("a2", level)]))
        await rig.advance(0.5)
        assert tree(seen.newest)["/a"] == (level, word) and (top.newest.level, top.newest.message) == (level, word)


async def test_what_is_not_renewed_is_stale_and_an_error_beside_what_is(rig: Rig) -> None:
    seen, top = await started(rig, analyzers__a__type=GENERIC, analyzers__a__startswith="a", analyzers__a__timeout=2.5)
    rig.publish(DIAGNOSTICS, DiagnosticArray(status=[status("a1"), status("a2")]))
    await rig.advance(2.0)
    rig.publish(DIAGNOSTICS, DiagnosticArray(status=[status("a2")]))
    assert tree(seen.newest)["/a"] == (OK, "OK")
    await rig.advance(1.0)
    assert tree(seen.newest) == {"/a": (ERROR, "Error"), "/a/a1": (STALE, ""), "/a/a2": (OK, "")}
    await rig.advance(3.0)
    assert tree(seen.newest)["/a"] == (STALE, "Stale") and top.newest.level == STALE


async def test_what_is_expected_is_missing_until_it_comes(rig: Rig) -> None:
    seen, _ = await started(
        rig, analyzers__a__type=GENERIC, analyzers__a__expected=["arm: grip"], analyzers__a__timeout=-1.0
    )
    await rig.advance(1.0)
    assert tree(seen.newest) == {"/a": (STALE, "Stale"), "/a/arm: grip": (STALE, "Missing")}
    rig.publish(DIAGNOSTICS, DiagnosticArray(status=[status("arm: grip", message="shut")]))
    await rig.advance(60.0)
    assert tree(seen.newest)["/a/arm: grip"] == (OK, "shut")


async def test_stale_items_may_be_discarded_and_others_be_errors(rig: Rig) -> None:
    seen, top = await started(
        rig, other_as_errors=True, analyzers__a__type=GENERIC, analyzers__a__startswith="a", analyzers__a__discard_stale=True,
        analyzers__a__timeout=1.5,
    )  # fmt: skip
    rig.publish(DIAGNOSTICS, DiagnosticArray(status=[status("a1"), status("b")]))
    await rig.advance(1.0)
    assert (
        tree(seen.newest)["/Other/b"] == (ERROR, "")
        and tree(seen.newest)["/a/a1"] == (OK, "")
        and top.newest.level == ERROR
    )
    await rig.advance(5.0)
    assert tree(seen.newest) == {"/a": (OK, "OK")}


async def test_a_number_of_items_may_be_demanded(rig: Rig) -> None:
    seen, top = await started(rig, analyzers__a__type=GENERIC, analyzers__a__startswith="a", analyzers__a__num_items=2)
    rig.publish(DIAGNOSTICS, DiagnosticArray(status=[status("a1")]))
    await rig.advance(1.0)
    assert tree(seen.newest)["/a"] == (ERROR, "Expected 2, found 1")
    rig.publish(DIAGNOSTICS, DiagnosticArray(status=[status("a2")]))
    await rig.advance(1.0)
    assert tree(seen.newest)["/a"] == (OK, "OK") and top.newest.level == OK


async def test_stale_and_well_together_are_an_error_at_the_top(rig: Rig) -> None:
    _, top = await started(
        rig, analyzers__a__type=GENERIC, analyzers__a__expected="never", analyzers__b__type=GENERIC, analyzers__b__startswith="b",
    )  # fmt: skip
    rig.publish(DIAGNOSTICS, DiagnosticArray(status=[status("b")]))
    await rig.advance(1.0)
    assert top.newest.level == ERROR


async def test_without_analyzers_all_is_other_and_without_statuses_nothing(rig: Rig) -> None:
    seen, top = await started(rig)
    await rig.advance(1.0)
    assert len(seen.newest.status) == 0 and top.newest.level == OK
    rig.publish(DIAGNOSTICS, DiagnosticArray(status=[status("motor: a", WARN, "hot")]))
    await rig.advance(1.0)
    assert tree(seen.newest) == {"/Other": (WARN, "Warning"), "/Other/motor: a": (WARN, "hot")}


async def test_a_parameter_file_of_ros_2_declares_them(rig: Rig, tmp_path: Path) -> None:
    file = tmp_path / "analyzers.yaml"
    file.write_text(
        "/diagnostic_aggregator:\n  ros__parameters:\n    path: Robot\n    analyzers:\n      motors:\n"
        "        type: diagnostic_aggregator/GenericAnalyzer\n        path: Motors\n        contains: ['motor']\n"
    )
    await rig.start(Child(Aggregator), parameters=file)
    seen = rig.probe(DIAGNOSTICS_AGG)
    rig.publish(DIAGNOSTICS, DiagnosticArray(status=[status("left motor")]))
    await rig.advance(1.0)
    assert list(tree(seen.newest)) == ["/Robot/Motors", "/Robot/Motors/left motor"]


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({"analyzers.a.type": "other/Analyzer"}, "analyzers.a.type is 'other/Analyzer'; the one that is known here is"),
        ({"analyzers.a.path": "x"}, "analyzers.a.type is ''"),
        ({"analyzers.a": GENERIC}, "analyzers.a must be analyzers.<name>.<option>"),
        (
            {"analyzers.a.type": GENERIC, "analyzers.a.startwith": "x"},
            "no option 'startwith'; did you mean 'startswith'",
        ),
    ],
)
async def test_what_declares_no_analyzer_is_refused_at_the_start(
    rig: Rig, parameters: dict[str, Any], said: str
) -> None:
    with pytest.raises(StartFailed) as failed:
        await rig.start(Child(Aggregator, parameters=parameters))
    assert said in str(failed.value)
