"""The page's reader of meshes, run by node."""

from __future__ import annotations

import json
import shutil
import struct
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

NODE = shutil.which("node")
PROGRAM = Path(__file__).with_name("read_stl.mjs")
CORNERS = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.5, 0.0], [0.0, 0.0, -1.0], [1e-3, 0.0, 0.0], [0.0, 7.0, 0.5]]
"""Of two triangles; all but one exact in 32 bits."""

pytestmark = pytest.mark.skipif(NODE is None, reason="node is not installed: the page's reader of meshes is not run")


def read(*files: bytes) -> list[dict[str, Any]]:
    """What the page makes of files."""
    assert NODE is not None
    lines = "".join(f"{file.hex()}\n" for file in files)
    done = subprocess.run([NODE, PROGRAM], input=lines, capture_output=True, text=True, timeout=60, check=True)
    return [json.loads(line) for line in done.stdout.splitlines()]


def binary(head: bytes = b"made by hand") -> bytes:
    triangles = np.array(CORNERS, dtype="<f4").reshape(-1, 9)
    body = b"".join(struct.pack("<3f", 0, 0, 1) + triangle.tobytes() + b"\0\0" for triangle in triangles)
    return head.ljust(80, b"\0") + struct.pack("<I", len(triangles)) + body


def text(corners: list[list[float]]) -> bytes:
    vertices = [f"      vertex {x!r} {y!r} {z!r}" for x, y, z in corners]
    facets = [
        "\n".join(["  facet normal 0 0 1", "    outer loop", *vertices[i : i + 3], "    endloop", "  endfacet"])
        for i in range(0, len(vertices), 3)
    ]
    return "\n".join(["solid part", *facets, "endsolid part", ""]).encode()


def test_triangles_are_read_from_binary_files_and_from_texts() -> None:
    wanted = np.array(CORNERS, dtype=np.float32).reshape(-1).tolist()
    assert [one["corners"] for one in read(binary(), text(CORNERS))] == [wanted, wanted]


def test_a_binary_file_whose_header_looks_like_a_text_is_a_binary_file() -> None:
    (found,) = read(binary(b"solid part"))
    assert len(found["corners"]) == 18


def test_a_file_without_triangles_is_an_empty_mesh() -> None:
    assert read(text([]), bytes(84)) == [{"corners": []}, {"corners": []}]


@pytest.mark.parametrize(
    ("file", "why"),
    [
        (b"<COLLADA>", "no STL"),
        (binary()[:-1], "no STL"),
        (b"", "no STL"),
        (b"x" * 34, "no STL"),
        (text(CORNERS[:4]), "three corners"),
        (b"solid\nvertex 1 2 x vertex 1 2 3 vertex 1 2 3", "three corners"),
    ],
    ids=["another format", "cut off", "empty", "shorter than its head", "a corner too many", "no number"],
)
def test_what_is_no_mesh_is_refused_with_the_reason(file: bytes, why: str) -> None:
    (found,) = read(file)
    assert why in found["error"]
