"""`security create | show | check`, and programs that only meet with the files that it makes."""

from __future__ import annotations

from pathlib import Path

import pytest

from actors import Child, Node, run
from actors.transport.security import load_security
from actors.transport.security.authority import create
from actors.transport.zenoh import ZenohConfig, ZenohTransport
from cli.command import CommandFailed, UsageError
from cli.verbs.security import COMMAND
from tests.cli.conftest import Command

ACCESS = """
access:
  - peers: [robot]
    nodes: [/arm]
    publish: [/joint_states]
    call: [/stop, /move/*]
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    create(tmp_path / "fleet", ["robot", "desk"], days=100, passwords=True)
    return tmp_path / "fleet"


def test_create_prints_the_files_and_show_says_what_is_on_without_secrets(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "fleet"
    assert COMMAND.main(["create", str(folder), "robot", "--passwords", "--days", "7"]) == 0
    assert capsys.readouterr().out == f"{folder}/robot/security.yaml\n"

    with (folder / "robot/security.yaml").open("a") as file:
        file.write(ACCESS)
    assert COMMAND.main(["show", str(folder / "robot/security.yaml")]) == 0
    shown = capsys.readouterr().out
    assert shown.splitlines()[0] == "name         robot"
    assert "TLS          mutual: who connects needs a certificate" in shown
    assert f"user         robot\nlets in      {folder}/robot/users\naccess       only this:\n" in shown
    assert shown.endswith("  robot, as /arm\n    publish    /joint_states\n    call       /stop, /move/*\n")
    secrets = [(folder / "robot/password").read_text().strip()]
    secrets += (folder / "robot/key.pem").read_text().splitlines()[1:-1]
    assert not any(secret in shown for secret in secrets)


def test_show_says_what_is_not_on(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = folder / "desk/security.yaml"
    text = file.read_text()
    file.write_text(text.replace("  users: users\n", ""))
    COMMAND.main(["show", str(file)])
    assert "lets in      nobody: it can only connect" in capsys.readouterr().out
    file.write_text(text.split("user:")[0] + "  mutual: false\n")
    COMMAND.main(["show", str(file)])
    shown = capsys.readouterr().out
    assert (
        "TLS          of the listening side only\nuser         none\naccess       everything, for all who are let in\n"
        in shown
    )


def test_check_warns_of_a_certificate_that_ends_soon_and_fails_for_a_file_that_cannot_be_used(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROBACTOR_SECURITY", str(folder / "desk/security.yaml"))
    assert COMMAND.main(["check"]) == 0
    assert capsys.readouterr().out == f"{folder}/desk/security.yaml: can be used\n"
    create(tmp_path / "short", ["desk"], days=3, passwords=False)
    assert COMMAND.main(["check", str(tmp_path / "short/desk/security.yaml")]) == 0
    assert f"{tmp_path}/short/desk/certificate.pem: ends in 2 days\n" in capsys.readouterr().out
    (folder / "desk/key.pem").unlink()
    with pytest.raises(CommandFailed, match=r"security\.yaml:5: tls\.key: .*key\.pem cannot be read"):
        COMMAND.main(["check"])
    monkeypatch.delenv("ROBACTOR_SECURITY")
    with pytest.raises(CommandFailed, match="name a security file, or set ROBACTOR_SECURITY"):
        COMMAND.main(["show"])


@pytest.mark.parametrize("days", ["0", "4000", "x"])
def test_a_number_of_days_that_is_none_is_not_understood(days: str) -> None:
    with pytest.raises(UsageError, match="is no number of days from 1 to 3650"):
        COMMAND.main(["create", "folder", "robot", "--days", days])


async def test_a_command_sees_a_secured_graph_only_with_a_certificate(
    folder: Path, robot: Command, port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    config = ZenohConfig(gossip_port=port, security=load_security(folder / "robot/security.yaml"))
    async with run(Child(Node, name="arm"), transport=ZenohTransport(config), signals=False, sinks=()):
        own = await robot("node", "list", "--security", str(folder / "desk/security.yaml"))
        nobody = await robot("node", "list")
    assert (own.code, own.out) == (0, "/arm\n")
    assert (nobody.code, nobody.out) == (0, "")


async def test_a_half_configured_file_is_refused_before_anything_starts(folder: Path, robot: Command) -> None:
    file = folder / "desk/security.yaml"
    file.write_text(file.read_text().replace("key: key.pem", "key: other.pem"))
    said = f"{file}:5: tls.key: {folder}/desk/other.pem cannot be read: No such file or directory\n"
    for words in (("node", "list"), ("router",), ("run", "--duration", "1")):
        ended = await robot(*words, "--security", str(file))
        assert (ended.code, ended.out) == (2 if words[0] == "run" else 1, "")
        assert ended.err == (f"robot run: {said}" if words[0] == "run" else said)
