"""The Dockerfile of docs/howto/docker.md, without Docker: its commands run in a folder, and its program starts, serves and stops as a container would."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
import tomllib
import urllib.error
import urllib.request
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "howto" / "docker.md").read_text(encoding="utf-8")
TOKEN = "a-secret-of-16-or-more"


def instructions() -> list[tuple[str, str]]:
    """Each instruction of the file, and what follows it."""
    found = re.search(r"```dockerfile\n(.*?)```", PAGE, re.DOTALL)
    assert found is not None
    return [(line.partition(" ")[0], line.partition(" ")[2]) for line in found[1].splitlines()]


def test_it_has_ten_lines_at_most_and_a_python_that_the_project_takes() -> None:
    (base,) = (text for name, text in instructions() if name == "FROM")
    assert len(instructions()) <= 10
    lowest = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["requires-python"]
    of_image, least = (tuple(map(int, re.findall(r"\d+", text)[:2])) for text in (base, lowest))
    assert of_image >= least


@pytest.mark.slow(reason="installs the project into a new environment")
def test_its_commands_install_and_its_program_serves_until_it_is_stopped(tmp_path: Path) -> None:
    places = {"/venv": str(tmp_path / "venv"), "/app": str(ROOT)}

    def here(text: str) -> str:
        return re.sub(r"(?<![\w/])/(?:venv|app)\b", lambda place: places[place[0]], text)

    environment = {**os.environ, "ROBACTOR_WEB_TOKEN": TOKEN, "RMW_IMPLEMENTATION": "in_process"}
    command: list[str] = []
    for name, text in instructions():
        if name == "RUN":
            done = subprocess.run(["sh", "-c", here(text)], capture_output=True, text=True, cwd=ROOT, check=False)
            if "No matching distribution" in done.stderr or "Connection" in done.stderr:
                pytest.skip("there is no package index here")
            assert done.returncode == 0, done.stderr
        elif name == "ENV":
            for pair in here(text).split():
                key, _, value = pair.partition("=")
                environment[key] = value.replace("$PATH", environment.get("PATH", ""))
        elif name in ("ENTRYPOINT", "CMD"):
            command += json.loads(text)
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    program = str(tmp_path / "venv" / "bin" / command[0])
    run = subprocess.Popen([program, *command[1:], "--web", str(port)], env=environment, cwd=tmp_path)
    try:
        assert answer(f"http://127.0.0.1:{port}/?token={TOKEN}") == 200
        assert answer(f"http://127.0.0.1:{port}/metrics") == 401  # the token is asked for
        run.send_signal(signal.SIGTERM)
        assert run.wait(30) == 143
    finally:
        run.kill()


def answer(address: str) -> int:
    """The status of a page, once its server is up."""
    end = time.monotonic() + 60.0
    while True:
        try:
            return int(urllib.request.urlopen(address, timeout=10.0).status)
        except urllib.error.HTTPError as error:
            return error.code
        except (urllib.error.URLError, ConnectionError):
            if time.monotonic() > end or sys.platform == "win32":
                raise
            time.sleep(0.1)
