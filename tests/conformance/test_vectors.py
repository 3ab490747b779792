"""Every vector file of the repository, one test a file; `python -m tests.conformance FOLDER` tells it case by case.

`ROBACTOR_SHARED` may name a folder whose `conformance` subfolder holds further vectors.
"""

from __future__ import annotations

import io
import json
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.conformance.decisions import DECISIONS
from tests.conformance.runner import run_file, run_folder

VECTORS = Path(__file__).parent / "vectors"


def vector_files() -> Iterator[Path]:
    yield from sorted(VECTORS.glob("*.json"))
    elsewhere = Path(os.environ.get("ROBACTOR_SHARED", Path(__file__).parents[3] / "shared"), "conformance")
    for path in sorted(elsewhere.glob("*.json")):
        copy = VECTORS / path.name
        if not copy.exists() or copy.read_bytes() != path.read_bytes():
            yield path


@pytest.mark.parametrize("path", [pytest.param(path, id=f"{path.parent.name}/{path.stem}") for path in vector_files()])
def test_vectors(path: Path) -> None:
    outcome = run_file(path)

    if outcome.skipped_file and path.parent != VECTORS:
        pytest.skip(outcome.skipped_file)
    assert not outcome.skipped_file
    assert not outcome.failures
    assert {case for case, _ in outcome.edges} <= DECISIONS.keys()
    assert outcome.passed


def write_case(folder: Path, tier: str, expect: object) -> None:
    vector = {"id": "node_names/x", "tier": tier, "input": {"kind": "name", "name": "a"}, "expect": expect}
    (folder / "node_names.json").write_text(json.dumps({"cases": [vector]}))


def test_the_runner_reports_a_file_without_checks_by_name_and_a_failure_by_id(tmp_path: Path) -> None:
    (tmp_path / "unheard_of.json").write_text("{}")
    write_case(tmp_path, "core", {"valid": False})
    out = io.StringIO()

    status = run_folder(tmp_path, out)

    assert status == 1
    assert "unheard_of" in out.getvalue()
    assert "no check module checks/unheard_of.py" in out.getvalue()
    assert "FAILED node_names/x: valid: True, wanted False" in out.getvalue()


def test_the_runner_does_not_count_an_edge_case_as_a_failure(tmp_path: Path) -> None:
    write_case(tmp_path, "edge", {"valid": False})
    out = io.StringIO()

    assert run_folder(tmp_path, out) == 0
    assert "edge node_names/x" in out.getvalue()


def test_a_broken_vector_is_a_failure_and_does_not_stop_the_others(tmp_path: Path) -> None:
    write_case(tmp_path, "core", {"valid": True})
    (tmp_path / "namespaces.json").write_text("not json")
    out = io.StringIO()

    assert run_folder(tmp_path, out) == 1
    assert "FAILED namespaces.json: cannot be run" in out.getvalue()
    assert "1 passed, 1 failed" in out.getvalue()


def test_a_folder_without_vectors_is_not_a_success(tmp_path: Path) -> None:
    assert run_folder(tmp_path, io.StringIO()) == 1


@pytest.mark.parametrize(
    ("name", "vector", "what"),
    [
        ("node_names", {"input": {"kind": "nickname", "name": "a"}, "expect": {}}, "kind 'nickname'"),
        (
            "node_names",
            {"input": {"kind": "name", "name": "a", "loud": True}, "expect": {"valid": True}},
            "field input.loud",
        ),
        (
            "node_names",
            {"input": {"kind": "name", "name": "a"}, "expect": {"valid": True, "colour": 1}},
            "field expect.colour",
        ),
        (
            "namespaces",
            {"input": {"kind": "validate", "namespace": "/"}, "expect": {"valid": True}, "when": 1},
            "field when",
        ),
        (
            "timers",
            {"input": {"kind": "sim_timer", "period_ns": 1, "start_time_ns": 0}, "steps": [{"op": "wind"}]},
            "step 'wind'",
        ),
        (
            "time_jumps",
            {"input": {"kind": "threshold", "min_forward_ns": 0}, "expect": {"ok": False, "error": "odd"}},
            "error code 'odd'",
        ),
        ("parameters", {"input": {"kind": "steps"}, "steps": [{"op": "freeze"}]}, "step 'freeze'"),
        (
            "parameters",
            {"input": {"kind": "steps"}, "steps": [{"op": "has", "name": "a", "twice": 1}]},
            "field steps[0].twice",
        ),
        (
            "parameters",
            {"input": {"kind": "steps"}, "steps": [{"op": "add_on_set_callback", "behavior": "dance"}]},
            "behavior 'dance'",
        ),
        (
            "qos_compatibility",
            {
                "input": {"kind": "event_sequence", "event": "matched", "steps": ["wait_two_deadlines_in_vain"]},
                "expect": {},
            },
            "step 'wait_two_deadlines_in_vain'",
        ),
        (
            "qos_compatibility",
            {"input": {"kind": "construct", "args": {"speed": 1}}, "expect": {"ok": True}},
            "policy 'speed'",
        ),
        (
            "time_values",
            {"input": {"kind": "operator", "op": "**", "left": 1, "right": 1}, "expect": {"ok": True}},
            "operator '**'",
        ),
        (
            "lifecycle_transitions",
            {"input": {"kind": "lifecycle_publisher", "steps": ["sing"]}, "expect": {}},
            "step 'sing'",
        ),
        (
            "param_yaml",
            {"input": {"kind": "file", "sources": [{"url": "x"}]}, "expect": {"ok": True}},
            "source {'url': 'x'}",
        ),
    ],
)
def test_what_no_check_knows_is_a_failure_and_never_a_silent_pass(
    tmp_path: Path, name: str, vector: dict[str, object], what: str
) -> None:
    path = tmp_path / f"{name}.json"
    path.write_text(json.dumps({"cases": [{"id": "x", **vector}]}))

    outcome = run_file(path)

    assert [reason.partition(":")[0] for _, reason in outcome.failures] == [f"unsupported {what}".partition(":")[0]]
    assert not outcome.passed


def test_an_edge_case_that_is_met_otherwise_by_decision_is_printed_with_its_reason() -> None:
    out = io.StringIO()
    run_folder(VECTORS, out)
    assert "decided: a NUL is an unallowed character" in out.getvalue()
    assert " 0 failed, 0 skipped, 4 edge cases not met" in out.getvalue()
