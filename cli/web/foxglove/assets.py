"""Files of packages that viewers ask for by `package://PACKAGE/path`, such as the meshes of a robot's description."""

from __future__ import annotations

import importlib
import os
from pathlib import Path
from urllib.parse import unquote, urlsplit

from cli.web.clients.errors import Refused
from cli.web.clients.inside import file_inside

MOST_BYTES = 64 * 1024 * 1024
SUFFIXES = frozenset(
    f".{suffix}"
    for suffix in (
        "stl", "dae", "obj", "mtl", "glb", "gltf", "bin", "ply", "png", "jpg", "jpeg", "tga", "bmp", "tif", "tiff", "svg", "urdf",
        "xacro", "sdf", "xml", "material",
    )
)  # fmt: skip
"""What a description may refer to. Nothing else is given out: a share folder may also hold keys and configurations."""


def read_asset(uri: object) -> bytes:
    """The content of a file. Raises `Refused` for anything that is no file of a package, such as a path that leads out of it."""
    if not isinstance(uri, str) or len(uri) > 1000:
        raise Refused("an asset is asked for by a text, package://PACKAGE/path")
    try:
        parts = urlsplit(uri)
    except ValueError as error:
        raise Refused(f"{uri!r:.80}: {error}") from None
    if parts.scheme != "package" or not parts.netloc:
        raise Refused(f"{uri!r:.80}: only package://PACKAGE/path is served")
    inside = unquote(parts.path).lstrip("/")
    for share in _shares(parts.netloc):
        path = file_inside(share, inside)
        if path is not None:
            return _read(path, uri)
    raise Refused(f"{uri!r:.200}: there is no such file in the package {parts.netloc!r:.60}")


def _read(path: Path, uri: str) -> bytes:
    if path.suffix.lower() not in SUFFIXES:
        raise Refused(f"{uri!r:.200}: files that end in {path.suffix or 'nothing'} are not given out")
    if path.stat().st_size > MOST_BYTES:
        raise Refused(f"{uri!r:.200}: {path.stat().st_size} bytes are too many")
    try:
        return path.read_bytes()
    except OSError as error:
        raise Refused(f"{uri!r:.200}: {error.strerror}") from None


def _shares(package: str) -> list[Path]:
    """The folders of a package: in the prefixes of ROS 2, or beside the module of that name that is an entry point of robactor."""
    if not package.isidentifier():
        return []
    prefixes = [prefix for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if prefix]
    found = [Path(prefix, "share", package) for prefix in prefixes]
    from importlib.metadata import entry_points

    for entry in entry_points(group="robactor.nodes"):
        if entry.name == package:
            module = importlib.import_module(entry.value.partition(":")[0])
            file = getattr(module, "__file__", None)
            found += [Path(file).parent / "share", Path(file).parent] if file else []
    return found
