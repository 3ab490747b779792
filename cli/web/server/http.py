"""What is answered to plain HTTP: the files of the page, with the headers that keep a browser safe."""

from __future__ import annotations

import asyncio
import gzip
import hashlib
from http import HTTPStatus
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple
from urllib.parse import unquote, urlsplit

from cli.web.clients.inside import file_inside

if TYPE_CHECKING:
    from websockets.http11 import Request, Response

PAGE: Final = Path(__file__).parents[1] / "page"

TYPES: Final = {
    ".css": "text/css; charset=utf-8", ".glb": "model/gltf-binary", ".html": "text/html; charset=utf-8", ".ico": "image/x-icon",
    ".jpg": "image/jpeg", ".js": "text/javascript; charset=utf-8", ".json": "application/json", ".map": "application/json",
    ".md": "text/plain; charset=utf-8", ".mjs": "text/javascript; charset=utf-8", ".obj": "text/plain; charset=utf-8",
    ".png": "image/png", ".stl": "model/stl", ".svg": "image/svg+xml", ".txt": "text/plain; charset=utf-8", ".wasm": "application/wasm",
    ".webmanifest": "application/manifest+json", ".webp": "image/webp", ".woff2": "font/woff2",
}  # fmt: skip
PACKED: Final = frozenset((".png", ".jpg", ".webp", ".woff2", ".glb"))
"""What gzip does not make smaller."""

SAFE: Final = {
    "Content-Security-Policy": (
        "default-src 'self'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
        "connect-src 'self' ws: wss:; worker-src 'self' blob:; object-src 'none'; frame-ancestors 'none'; base-uri 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
}
"""The headers of every answer."""


def answer(status: HTTPStatus, body: bytes = b"", kind: str = "text/plain; charset=utf-8", **headers: str) -> Response:
    """An answer. Header names are written with underscores."""
    from websockets.datastructures import Headers
    from websockets.http11 import Response

    given = {name.replace("_", "-"): value for name, value in headers.items()}
    whole = Headers(
        {
            **SAFE,
            "Content-Type": kind,
            "Content-Length": str(len(body)),
            "Cache-Control": "no-cache",
            "Connection": "close",
            **given,
        }
    )
    return Response(status.value, status.phrase, whole, body)


def refusal(status: HTTPStatus, why: str) -> Response:
    """An answer that says why there is no other."""
    return answer(status, f"{why}\n".encode())


class _File(NamedTuple):
    """A file of the page as it is sent."""

    modified: tuple[int, int]
    tag: str
    kind: str
    body: bytes
    packed: bytes | None


class Files:
    """The files of a folder, which are served by their names. Nothing outside of it is, and nothing hidden.

    Invariant: what is kept of a file is its content at the time and size in `modified`.
    """

    def __init__(self, folder: Path = PAGE) -> None:
        self._folder = folder.resolve()
        self._kept: dict[Path, _File] = {}

    async def get(self, request: Request) -> Response:
        """The file that is asked for; 404 if there is none, 304 if the client has it already."""
        path = self._path(request.path)
        if path is None:
            return refusal(HTTPStatus.NOT_FOUND, "there is no such file")
        file = await self._read(path)
        if file.tag in ", ".join(request.headers.get_all("If-None-Match")):
            return answer(HTTPStatus.NOT_MODIFIED, ETag=file.tag)
        if file.packed is not None and "gzip" in ", ".join(request.headers.get_all("Accept-Encoding")):
            return answer(
                HTTPStatus.OK, file.packed, file.kind, ETag=file.tag, Vary="Accept-Encoding", Content_Encoding="gzip"
            )
        return answer(HTTPStatus.OK, file.body, file.kind, ETag=file.tag, Vary="Accept-Encoding")

    def _path(self, target: str) -> Path | None:
        try:
            parts = unquote(urlsplit(target).path, errors="strict").strip("/").split("/")
        except (ValueError, UnicodeDecodeError):
            return None
        if parts == [""]:
            parts = ["index.html"]
        if any(not part or part.startswith(".") or "\\" in part for part in parts):
            return None
        path = file_inside(self._folder, "/".join(parts))
        return path if path is not None and path.suffix.lower() in TYPES else None

    async def _read(self, path: Path) -> _File:
        file, modified = self._kept.get(path), _modified(path)
        if file is None or file.modified != modified:
            # In a thread: to pack the largest script takes 20 ms, and the loop may be that of a robot that walks.
            file = self._kept[path] = await asyncio.to_thread(_load, path, modified)
        return file


def _modified(path: Path) -> tuple[int, int]:
    stat = path.stat()
    return stat.st_mtime_ns, stat.st_size


def _load(path: Path, modified: tuple[int, int]) -> _File:
    body, suffix = path.read_bytes(), path.suffix.lower()
    packed = gzip.compress(body, mtime=0) if suffix not in PACKED else None
    return _File(modified, f'"{hashlib.sha256(body).hexdigest()[:32]}"', TYPES[suffix], body, packed)
