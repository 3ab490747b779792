"""TLS from the security file."""

from __future__ import annotations

import ssl
from pathlib import Path

import pytest
from websockets.asyncio.client import connect

from actors import Child
from actors.transport.security import authority, load_security
from cli.web.server.server import WebServer
from cli.web.server.settings import make_settings
from tests.cli.web.stage import serving

TOKEN = "a-token-of-some-length"


async def test_with_a_security_file_the_server_speaks_tls_with_its_certificate_and_nothing_else(tmp_path: Path) -> None:
    made = authority.create(tmp_path, ["robot"], days=2, passwords=False)
    security = load_security(made[0])
    settings = make_settings({"ROBACTOR_WEB_TOKEN": TOKEN}, port=0, security=security)
    trusting = ssl.create_default_context(cafile=security.tls.authority)
    trusting.check_hostname = False
    async with serving() as stage:
        joined = await stage.system.join(Child(WebServer, name="_tls", args=(settings,)))
        server = joined.node
        assert isinstance(server, WebServer) and server.url.startswith("https://")
        async with connect(f"wss://127.0.0.1:{server.port}/?token={TOKEN}", ssl=trusting) as socket:
            await socket.send('{"op": "call_service", "id": "t", "service": "/rosapi/nodes"}')
            assert "/talker" in str(await socket.recv())
        with pytest.raises(Exception, match="did not receive a valid HTTP response"):
            await connect(f"ws://127.0.0.1:{server.port}/?token={TOKEN}")
