"""A security file is read whole or refused with file and line, and no secret gets out of it."""

from __future__ import annotations

import logging
import shutil
import subprocess
from pathlib import Path

import pytest

from actors.transport.security import AccessRule, SecurityError, Tls, User, load_security
from actors.transport.zenoh import ZenohConfig
from tests.actors.transport.security.fleet import Fleet

TLS = "tls:\n  authority: authority.pem\n  certificate: certificate.pem\n  key: key.pem\n"
USER = "user:\n  name: desk\n  password_file: password\n  users: users\n"
RULE = "access:\n- peers: [robot]\n"


@pytest.fixture
def fleet(tmp_path: Path) -> Fleet:
    return Fleet(tmp_path / "fleet", "robot", "desk", passwords=True)


@pytest.fixture
def folder(fleet: Fleet) -> Path:
    return fleet.folder / "desk"


def refused(folder: Path, text: str) -> str:
    """Why this text in place of the desk's file is refused, with line; the file must be that one."""
    file = folder / "security.yaml"
    file.write_text(text)
    with pytest.raises(SecurityError) as error:
        load_security(file)
    assert error.value.file == str(file)
    start = str(file) if error.value.line is None else f"{file}:{error.value.line}"
    said = str(error.value)
    assert said.startswith(f"{start}: ")
    assert "\n" not in said
    return said.removeprefix(f"{file}:").replace(f"{folder}/", "")


def test_a_whole_file_gives_absolute_paths_names_and_rules(folder: Path) -> None:
    file = folder / "security.yaml"
    file.write_text(
        f"{TLS}{USER}{RULE}  publish: [/cmd_vel, /arm/*]\n- peers: ['*']\n  nodes: [/look]\n  call: [/**]\n"
    )
    read = load_security(file)
    assert read.tls == Tls(
        authority=f"{folder}/authority.pem", certificate=f"{folder}/certificate.pem", key=f"{folder}/key.pem"
    )
    assert read.tls.mutual
    assert read.user == User(name="desk", password_file=f"{folder}/password", users=f"{folder}/users")
    assert read.access == (
        AccessRule(peers=("robot",), nodes=("/**",), publish=("/cmd_vel", "/arm/*")),
        AccessRule(peers=("*",), nodes=("/look",), call=("/**",)),
    )


def test_without_user_and_access_all_who_have_a_certificate_may_do_everything(folder: Path) -> None:
    (folder / "security.yaml").write_text(TLS)
    read = load_security(folder / "security.yaml")
    assert (read.user, read.password, read.access) == (None, None, None)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "1: this is no mapping; it begins with tls:"),
        ("- tls", "1: this is no mapping; it begins with tls:"),
        ("tls: [", "1: expected the node content, but found '<stream end>'"),
        ("\n\ntls: {a: 1}\ntls: {}\n", "4: tls stands here twice"),
        ("tls: &a {}\nuser: *a\n", "2: an alias (*) is not understood here"),
        ("user: {}\n", "1: 'tls' is missing: without it a link can be read and changed by everybody on its way"),
        ("tsl: {}\n", "1: tsl: unknown; did you mean 'tls'?; there are tls, user, access"),
        ("tls: on\n", "1: tls: this is no mapping; it has authority, certificate, key, mutual"),
        ("tls:\n  authority: a\n  certificate: b\n", "1: tls: 'key' is missing"),
        (f"{TLS}  mutual: maybe\n", "5: tls.mutual: Expected `bool`, got `str`"),
        (f"{TLS}  mutal: true\n", "5: tls.mutal: unknown; did you mean 'mutual'?; there are authority, certificate, key, mutual"),
        (TLS.replace("key.pem", "lost.pem"), "4: tls.key: lost.pem cannot be read: No such file or directory"),
        (TLS.replace("key.pem", "certificate.pem"), "4: tls.key: certificate.pem holds no PRIVATE KEY in PEM format"),
        (TLS.replace(": certificate.pem", ": key.pem"), "3: tls.certificate: key.pem holds no CERTIFICATE in PEM format"),
        (TLS.replace("key.pem", "../robot/key.pem"), "4: tls.key: ../robot/key.pem is not the key of certificate.pem"),
        (
            TLS.replace("authority.pem", "certificate.pem"),
            "3: tls.certificate: certificate.pem is not taken by those who trust certificate.pem: unable to get local issuer certificate",
        ),
        (f"{TLS}user: desk\n", "5: user: this is no mapping; it has name, password_file, users"),
        (f"{TLS}user:\n  name: desk\n", "5: user: 'password_file' is missing"),
        (f"{TLS}{USER.replace(': desk', ': a:b')}", "6: user.name: a user's name is neither empty nor holds a colon"),
        (f"{TLS}{USER.replace('users: users', 'users: lost')}", "8: user.users: lost cannot be read: No such file or directory"),
        (f"{TLS}{USER.replace('name: desk', 'name: robot')}", "8: user.users: it has another password for robot than password_file"),
        (f"{TLS}access: all\n", "5: access: this is no list of rules; without 'access' all who are let in may do everything"),
        (f"{TLS}access: []\n", "5: access: this is no list of rules; without 'access' all who are let in may do everything"),
        (f"{TLS}  mutual: false\n{RULE}  call: [/a]\n", "6: access: rules need tls.mutual: a process without certificate has no name"),
        (f"{TLS}{RULE}", "6: access.0: the rule allows nothing: give it some of publish, subscribe, serve, call"),
        (f"{TLS}access:\n- peers: []\n  call: [/a]\n", "6: access.0.peers: it names nobody; ['*'] stands for everybody with a certificate"),
        (f"{TLS}access:\n- call: [/a]\n", "6: access.0: 'peers' is missing"),
        (f"{TLS}{RULE}  publish: /a\n", "7: access.0.publish: Expected `array`, got `str`"),
        (f"{TLS}{RULE}  publish: [1]\n", "7: access.0.publish: Expected `str`, got `int`"),
        (f"{TLS}{RULE}  publish: [cmd]\n", "7: access.0.publish: 'cmd' is no absolute name such as /cmd_vel; a whole part of it may be * or **"),
        (f"{TLS}{RULE}  call: [/a]\n  nodes: [/a*]\n", "8: access.0.nodes: '/a*' is no absolute name such as /cmd_vel; a whole part of it may be * or **"),
        (f"{TLS}{RULE}  serve: [/]\n", "7: access.0.serve: '/' is no absolute name such as /cmd_vel; a whole part of it may be * or **"),
    ],
)  # fmt: skip
def test_what_is_wrong_or_half_configured_is_refused_at_its_line(folder: Path, text: str, said: str) -> None:
    assert refused(folder, text) == said


def test_a_file_that_is_not_there_or_no_text_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SecurityError, match=r"lost\.yaml: the security file cannot be read: No such file or directory"):
        load_security(tmp_path / "lost.yaml")
    (tmp_path / "binary.yaml").write_bytes(b"\xff")
    with pytest.raises(SecurityError, match=r"binary\.yaml: the security file is no text"):
        load_security(tmp_path / "binary.yaml")


@pytest.mark.parametrize("name", ["key.pem", "password", "users"])
def test_a_secret_that_others_can_read_is_refused_with_the_remedy(folder: Path, name: str) -> None:
    (folder / name).chmod(0o640)
    assert f"{name} can be read by others than its owner: chmod 600 {name}" in refused(folder, TLS + USER)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("password", "\n", "7: user.password_file: password must hold one line, the password"),
        ("password", "a\nb\n", "7: user.password_file: password must hold one line, the password"),
        ("users", "\n", "8: user.users: users names no user"),
        ("users", "desk:x\n\nrobot\n", "8: user.users: users:3 does not read name:password"),
        ("users", "a:x\na:y\n", "8: user.users: users:2 names a once more"),
    ],
)
def test_a_file_of_passwords_that_cannot_be_used_is_refused_without_what_is_in_it(
    folder: Path, name: str, content: str, said: str
) -> None:
    (folder / name).write_text(content)
    assert refused(folder, TLS + USER) == said


def test_a_secret_file_that_is_no_text_is_refused(folder: Path) -> None:
    (folder / "password").write_bytes(b"\xff\xfe")
    assert refused(folder, TLS + USER) == "7: user.password_file: password is no text"


def test_an_encrypted_key_is_refused_because_nobody_is_asked_for_its_password(folder: Path) -> None:
    key = folder / "key.pem"
    key.write_text(key.read_text().replace("BEGIN PRIVATE", "BEGIN ENCRYPTED PRIVATE"))
    said = refused(folder, TLS)
    assert said.startswith("4: tls.key: key.pem is encrypted")
    assert said.endswith("decrypt it")


@pytest.mark.parametrize(("name", "line"), [("certificate.pem", 3), ("authority.pem", 2)])
def test_a_broken_certificate_is_refused_at_its_own_line(folder: Path, name: str, line: int) -> None:
    (folder / name).write_text("-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n")
    assert refused(folder, TLS).startswith(f"{line}: tls.{name.removesuffix('.pem')}: {name} ")


@pytest.mark.skipif(shutil.which("openssl") is None, reason="it makes the certificate that is over")
def test_a_certificate_that_is_over_is_refused(folder: Path, fleet: Fleet) -> None:
    """Signed by OpenSSL with the authority's own key, for a time that has passed."""
    request, over = folder / "request", folder / "certificate.pem"
    words = ("openssl", "req", "-new", "-key", folder / "key.pem", "-subj", "/CN=desk", "-out", request)
    subprocess.run(words, check=True, capture_output=True)
    authority = ("-CA", fleet.folder / "authority.pem", "-CAkey", fleet.folder / "authority.key")
    words = ("openssl", "x509", "-req", "-in", request, *authority, "-CAcreateserial", "-days", "-1", "-out", over)
    subprocess.run(words, check=True, capture_output=True)
    assert refused(folder, TLS) == (
        "3: tls.certificate: certificate.pem is not taken by those who trust authority.pem: certificate has expired"
    )


def test_a_peer_with_a_user_must_say_whom_it_lets_in_and_a_client_need_not(folder: Path) -> None:
    (folder / "security.yaml").write_text(TLS + USER.replace("  users: users\n", ""))
    security = load_security(folder / "security.yaml")
    with pytest.raises(SecurityError, match=r"security\.yaml:5: user: others connect to this process, and 'users' is"):
        ZenohConfig(security=security)
    assert ZenohConfig(security=security, mode="client").security is security


# Secrets -------------------------------------------------------------------------------------------------------------------


def test_a_secret_is_printed_by_nothing_but_reveal(folder: Path, caplog: pytest.LogCaptureFixture) -> None:
    password = (folder / "password").read_text().strip()
    key = (folder / "key.pem").read_text().splitlines()[1]
    config = ZenohConfig(security=load_security(folder / "security.yaml"))
    assert config.security is not None
    assert config.security.password is not None
    assert config.security.password.reveal() == password
    logging.getLogger().warning("%s %r", config, config)
    shown = [repr(config), str(config), repr(config.security), f"{config.security.password}", caplog.text]
    for text in shown:
        assert "<secret>" in text
        assert password not in text
        assert key not in text


def test_no_secret_of_a_file_is_in_the_error_about_it(folder: Path) -> None:
    """Each line of the files in turn is damaged; whatever is said then, no password and no line of the key is in it."""
    secrets = [(folder / "password").read_text().strip(), *(folder / "key.pem").read_text().splitlines()[1:-1]]
    secrets += [line.partition(":")[2] for line in (folder / "users").read_text().splitlines()]
    for name in ("password", "users", "key.pem", "security.yaml"):
        whole = (folder / name).read_text()
        for number in range(len(whole.splitlines())):
            lines = whole.splitlines()
            lines[number] = lines[number][1:].replace(":", "")
            (folder / name).write_text("\n".join(lines))
            said = ""
            try:
                load_security(folder / "security.yaml")
            except SecurityError as error:
                said = str(error)
            assert not any(secret in said for secret in secrets)
        (folder / name).write_text(whole)
    assert load_security(folder / "security.yaml").user is not None
