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
