"""Processes with certificates, each with a folder that `authority.create` has made."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from actors.transport.security import Security, load_security
from actors.transport.security.authority import create


class Fleet:
    """One authority, and its processes."""

    def __init__(self, folder: Path, *names: str, passwords: bool = False) -> None:
        self.folder = folder
        create(folder, names, days=2, passwords=passwords)

    def file(self, name: str) -> Path:
        return self.folder / name / "security.yaml"

    def written(self, name: str, **sections: Any) -> Path:
        """The file of a process with these sections in place of its own; None: without it."""
        values = {**yaml.safe_load(self.file(name).read_text()), **sections}
        values = {key: value for key, value in values.items() if value is not None}
        self.file(name).write_text(yaml.safe_dump(values, sort_keys=False))
        return self.file(name)

    def security(self, name: str, **sections: Any) -> Security:
        return load_security(self.written(name, **sections))
