"""The types that vectors mention: those we ship, and those beside the vectors in `interfaces/`."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

import robot.interfaces.tutorials  # noqa: F401  # makes the types of the robot and of the tutorials known
from actors.interfaces import Field, Message, load_folder, registry

VECTORS = Path(__file__).parents[1] / "vectors"
JAZZY = VECTORS / "interfaces_jazzy"
"""Where Jazzy differs from Lyrical, whose definitions we ship."""


def load_definitions(vectors: Path) -> None:
    """Makes the definitions known that stand beside a vector file, after those of this repository."""
    for folder in (VECTORS / "interfaces", vectors.parent / "interfaces"):
        if folder.is_dir() and not _all_known(folder):
            load_folder(folder)


def _all_known(folder: Path) -> bool:
    names = ("/".join((*path.parts[-3:-1], path.stem)) for path in folder.glob("*/*/*.*"))
    return all(registry.known(name) is not None for name in names)


@contextmanager
def jazzy(vectors: Path) -> Generator[None]:
    """All types anew, loaded from their definitions, with those of Jazzy first."""
    load_definitions(vectors)
    folders = [registry.Folder(path, None) for path in (str(JAZZY), *(folder.path for folder in registry.folders()))]
    with patch.object(registry, "_types", {}), patch.object(registry, "_folders", folders):
        yield


def build(cls: type[Message], value: Mapping[str, Any]) -> Message:
    """A message from the plain data of a vector: 64-bit numbers may be strings there, octets `{"bytes": "07"}`."""
    fields = {field.name: field for field in cls.__ros_fields__}
    assert list(value) == list(fields), f"{cls.__ros_type__} has the fields {list(fields)}, the vector {list(value)}"
    return cls(**{name: _build(fields[name], item) for name, item in value.items()})


def _build(field: Field, value: Any) -> Any:
    if field.type.is_array:
        return [_element(field, item) for item in value]
    return _element(field, value)


def _element(field: Field, value: Any) -> Any:
    if field.message is not None:
        return build(field.message, value)
    if isinstance(value, dict):
        return int(value["bytes"], 16)
    return int(value) if field.type.base in {"int64", "uint64"} else value
