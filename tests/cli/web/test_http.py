"""Plain HTTP on the port, and who is let in."""

from __future__ import annotations

import asyncio
import gzip
import json
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from websockets.asyncio.client import connect
from websockets.datastructures import Headers
from websockets.exceptions import InvalidHandshake, InvalidStatus
from websockets.http11 import Request

from actors import Child
from cli.web.server.admission import host_refusal, origin_refusal
from cli.web.server.http import Files
from cli.web.server.server import WebServer
from cli.web.server.settings import WebSettings, WebUnavailable, make_settings
from tests.cli.web.stage import request, serving

TOKEN = "a-token-of-some-length"


@pytest.fixture
def files(tmp_path: Path) -> Files:
    page = tmp_path / "page"
    (page / "lib").mkdir(parents=True)
    (page / "index.html").write_text("<p>hello</p>" * 100)
    (page / "lib" / "a.js").write_text("let a")
    (page / ".hidden.js").write_text("hidden")
    (page / "notes.py").write_text("no type of a page")
    (tmp_path / "outside.js").write_text("outside")
    (page / "link.js").symlink_to(tmp_path / "outside.js")
    return Files(page)


def asked(path: str, *headers: tuple[str, str]) -> Request:
    return Request(path, Headers(headers))


@pytest.mark.parametrize("path", ["/", "/index.html", "/?token=x", "/index.html#top"])
async def test_the_page_is_served_with_type_and_safe_headers(files: Files, path: str) -> None:
    answer = await files.get(asked(path))
    assert (answer.status_code, answer.body) == (200, b"<p>hello</p>" * 100)
    assert answer.headers["Content-Type"] == "text/html; charset=utf-8"
    assert answer.headers["X-Content-Type-Options"] == "nosniff"
    policy = answer.headers["Content-Security-Policy"]
    assert "script-src 'self';" in policy and "frame-ancestors 'none'" in policy


async def test_scripts_have_the_type_that_modules_need(files: Files) -> None:
    assert (await files.get(asked("/lib/a.js"))).headers["Content-Type"] == "text/javascript; charset=utf-8"


@pytest.mark.parametrize(
    "path",
    ["/../outside.js", "/%2e%2e/outside.js", "/lib/../../outside.js", "/lib%2f..%2f..%2foutside.js", "/link.js", "/.hidden.js", "/notes.py",
     "/lib", "/lib/", "/a%00.js", "/%ff.js", "/..%5coutside.js", "/none.js", "/" + "a" * 5000],
)  # fmt: skip
async def test_nothing_else_is_served(files: Files, path: str) -> None:
    assert (await files.get(asked(path))).status_code == 404


async def test_a_browser_gets_a_packed_file_once_and_then_hears_that_it_has_not_changed(
    files: Files, tmp_path: Path
) -> None:
    packed = await files.get(asked("/", ("Accept-Encoding", "gzip, br")))
    assert packed.headers["Content-Encoding"] == "gzip" and gzip.decompress(packed.body) == b"<p>hello</p>" * 100
    tag = packed.headers["ETag"]
    again = await files.get(asked("/", ("If-None-Match", tag)))
    assert (again.status_code, again.body) == (304, b"")
    (tmp_path / "page" / "index.html").write_text("new")
    assert (await files.get(asked("/", ("If-None-Match", tag)))).body == b"new"


async def test_health_and_figures_are_told_on_the_same_port() -> None:
    async with serving() as stage, stage.foxglove():
        status, headers, body = await stage.get("/healthz")
        assert (status, headers["content-type"]) == (200, "application/json")
        assert json.loads(body)["status"] == "ok" and json.loads(body)["clients"] == 1
        status, headers, body = await stage.get("/metrics")
        assert (status, headers["content-type"]) == (200, "text/plain; version=0.0.4; charset=utf-8")
        lines = body.decode().splitlines()
        assert 'robactor_node_up{node="/talker",state="running"} 1' in lines
        assert 'robactor_web_clients{protocol="foxglove"} 1' in lines
        sample = re.compile(r'[a-z_]+(\{[a-z]+="[^"]*"(,[a-z]+="[^"]*")*\})? [-+0-9.e]+')
        assert all(line.startswith("#") or sample.fullmatch(line) for line in lines)


async def test_a_request_with_another_method_or_a_body_gets_no_page() -> None:
    async with serving() as stage:
        host = f"Host: localhost:{stage.server.port}"
        for lines in (
            ["DELETE / HTTP/1.1", host],
            ["POST / HTTP/1.1", host, "Content-Length: 3"],
            ["GET / HTTP/1.1", host, "Content-Length: 3"],
        ):
            reader, writer = await asyncio.open_connection("127.0.0.1", stage.server.port)
            writer.write("".join(f"{line}\r\n" for line in (*lines, "")).encode())
            answer = await reader.read()
            assert b"200" not in answer.split(b"\r\n")[0]
            writer.close()
        assert (await stage.get("/healthz"))[0] == 200


async def test_a_page_whose_name_was_led_to_this_machine_is_not_served() -> None:
    async with serving() as stage:
        assert (await request(stage.server.port, "GET / HTTP/1.1", "Host: evil.example"))[0] == 421
        assert (await request(stage.server.port, "GET / HTTP/1.1"))[0] == 421


@pytest.mark.parametrize(
    ("origin", "open"),
    [
        (None, True), ("http://localhost:3000", True), ("http://127.0.0.1:8765", True), ("https://evil.example", False), ("null", False),
        ("http://localhost.evil.example", False), ("https://viewer.example", True),
    ],
)  # fmt: skip
async def test_only_pages_of_this_machine_and_named_ones_may_connect(origin: str | None, open: bool) -> None:
    async with serving(WebSettings(port=0, origins=("https://viewer.example",))) as stage:
        headers = {} if origin is None else {"Origin": origin}
        if open:
            async with connect(stage.url, additional_headers=headers) as socket:
                assert socket.response is not None and socket.response.status_code == 101
        else:
            with pytest.raises(InvalidStatus) as refused:
                await connect(stage.url, additional_headers=headers)
            assert refused.value.response.status_code == 403


def test_a_server_for_others_lets_its_own_page_connect_and_no_other_one() -> None:
    settings = WebSettings(host="0.0.0.0", token=TOKEN)
    own = asked("/", ("Host", "robot:8765"), ("Origin", "http://robot:8765"))
    other = asked("/", ("Host", "robot:8765"), ("Origin", "http://localhost:8765"))
    assert host_refusal(settings, own) is None and origin_refusal(settings, own) is None
    assert origin_refusal(settings, other) is not None


async def test_with_a_token_only_those_who_show_it_may_connect_or_read_figures() -> None:
    async with serving(WebSettings(port=0, token=TOKEN)) as stage:
        for query, headers in ((f"?token={TOKEN}", {}), ("", {"Authorization": f"Bearer {TOKEN}"})):
            async with connect(stage.url + query, additional_headers=headers):
                pass
        for query in ("", "?token=", f"?token={TOKEN}x", "?token=%ff"):
            with pytest.raises(InvalidStatus) as refused:
                await connect(stage.url + query)
            assert refused.value.response.status_code == 401
            assert (await stage.get(f"/metrics{query}"))[0] == 401
        assert (await stage.get(f"/metrics?token={TOKEN}"))[0] == 200
        assert (await stage.get("/"))[0] == 200  # the page itself says nothing of the robot


async def test_an_unknown_subprotocol_is_refused() -> None:
    async with serving() as stage:
        with pytest.raises(InvalidHandshake):
            await connect(stage.url, subprotocols=["soap"])  # type: ignore[list-item]


def test_another_interface_needs_a_token() -> None:
    with pytest.raises(WebUnavailable, match="set ROBACTOR_WEB_TOKEN"):
        make_settings({}, host="0.0.0.0")
    with pytest.raises(WebUnavailable, match="at least 16"):
        make_settings({"ROBACTOR_WEB_TOKEN": "short"}, host="0.0.0.0")
    assert make_settings({"ROBACTOR_WEB_TOKEN": TOKEN}, host="0.0.0.0").token == TOKEN
    for host in ("localhost", "127.0.0.1", "::1"):
        assert make_settings({}, host=host).local


def test_beside_a_security_file_a_token_is_needed_even_on_this_machine() -> None:
    security: Any = SimpleNamespace()
    with pytest.raises(WebUnavailable, match="security file"):
        make_settings({}, security=security)


async def test_a_port_in_use_is_passed_over() -> None:
    async with serving() as stage:
        used = stage.server.port
        joined = await stage.system.join(Child(WebServer, name="_second", args=(WebSettings(port=used),)))
        second = joined.node
        assert isinstance(second, WebServer)
        assert used < second.port < used + 10
        with pytest.raises(WebUnavailable, match="all in use"):
            await stage.system.join(Child(WebServer, name="_third", args=(WebSettings(port=used, tries=1),)))
