"""The authority makes what TLS takes; its certificates are compared with what OpenSSL's own reader says."""

from __future__ import annotations

import builtins
import ssl
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from actors.transport.security import SecurityError, load_security
from actors.transport.security.authority import create, read_certificate


def seen_by_openssl(file: Path) -> dict[str, Any]:
    return ssl._ssl._test_decode_cert(str(file))  # type: ignore[attr-defined, no-any-return]


def test_each_process_gets_a_file_that_can_be_used_and_is_its_owners_only(tmp_path: Path) -> None:
    written = create(tmp_path / "fleet", ["robot", "desk", "robot"], days=2, passwords=True)
    assert written == [tmp_path / "fleet" / name / "security.yaml" for name in ("robot", "desk")]
    for file in written:
        security = load_security(file)
        assert security.user is not None
        assert security.user.name == file.parent.name
    modes = {path.stat().st_mode & 0o777 for path in tmp_path.rglob("*") if path.is_file()}
    assert modes == {0o600}
    assert {path.stat().st_mode & 0o777 for path in tmp_path.rglob("*") if path.is_dir()} == {0o700}


def test_a_certificate_says_its_name_its_issuer_and_its_time(tmp_path: Path) -> None:
    create(tmp_path, ["robot"], days=2, passwords=False)
    read, seen = (
        read_certificate(str(tmp_path / "robot/certificate.pem")),
        seen_by_openssl(tmp_path / "robot/certificate.pem"),
    )
    assert (read.name, seen["subject"]) == ("robot", ((("commonName", "robot"),),))
    assert seen["issuer"] == ((("commonName", read.issuer),),)
    assert seen["subjectAltName"] == (("DNS", "robot"),)
    assert ssl.cert_time_to_seconds(seen["notAfter"]) == read.ends.timestamp()
    assert timedelta(days=2, minutes=-1) < read.ends - datetime.now(UTC) <= timedelta(days=2)
    assert read.begins < datetime.now(UTC), "clocks of other machines may be behind"
    der = ssl.PEM_cert_to_DER_cert((tmp_path / "robot/certificate.pem").read_text())
    import hashlib

    assert read.fingerprint == hashlib.sha256(der).hexdigest()


def test_names_that_come_later_are_signed_by_the_same_authority_and_let_in_by_all(tmp_path: Path) -> None:
    create(tmp_path, ["robot"], days=2, passwords=True)
    first = (tmp_path / "authority.pem").read_bytes()
    create(tmp_path, ["desk"], days=2, passwords=True)
    assert (tmp_path / "authority.pem").read_bytes() == first == (tmp_path / "desk/authority.pem").read_bytes()
    users = [(tmp_path / name / "users").read_text() for name in ("robot", "desk")]
    assert users[0] == users[1]
    assert [line.split(":")[0] for line in users[0].splitlines()] == ["desk", "robot"]


def test_the_commented_rules_can_be_switched_on(tmp_path: Path) -> None:
    (file,) = create(tmp_path, ["robot"], days=2, passwords=False)
    begin, _, rules = file.read_text().partition("# access:")
    file.write_text(begin + "access:" + rules.replace("\n# ", "\n"))
    (rule,) = load_security(file).access or ()
    assert (rule.peers, rule.publish, rule.call) == (("robot",), ("/cmd_vel",), ("/navigate_to_pose",))


@pytest.mark.parametrize("name", ["", "a/b", "..", ".hidden", "a b", "ü", "x" * 65])
def test_a_name_that_is_none_is_refused_before_anything_is_written(tmp_path: Path, name: str) -> None:
    with pytest.raises(SecurityError, match=r"is no name of a process: letters, digits and _ \. -, at most 64"):
        create(tmp_path / "fleet", ["robot", name], days=2, passwords=False)
    assert not (tmp_path / "fleet").exists()


def test_nothing_is_written_over(tmp_path: Path) -> None:
    create(tmp_path, ["robot"], days=2, passwords=False)
    with pytest.raises(SecurityError, match=r"robot: is there already; remove it to make it anew"):
        create(tmp_path, ["desk", "robot"], days=2, passwords=False)
    assert not (tmp_path / "desk").exists()


def test_a_folder_that_cannot_be_made_and_an_authority_that_cannot_be_read_are_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(SecurityError, match=r"file/fleet: cannot be written: Not a directory"):
        create(tmp_path / "file" / "fleet", ["robot"], days=2, passwords=False)
    create(tmp_path / "fleet", ["robot"], days=2, passwords=False)
    (tmp_path / "fleet" / "authority.key").write_text("no key")
    with pytest.raises(SecurityError, match=r"fleet: this authority cannot be read"):
        create(tmp_path / "fleet", ["desk"], days=2, passwords=False)


def test_a_file_without_a_certificate_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.pem").write_text("nothing")
    with pytest.raises(SecurityError, match=r"a\.pem: holds no certificate that can be read"):
        read_certificate(str(tmp_path / "a.pem"))


def test_a_certificate_without_common_name_has_none(tmp_path: Path) -> None:
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes, serialization
    from cryptography.hazmat.primitives.asymmetric import ec

    key, now = ec.generate_private_key(ec.SECP256R1()), datetime.now(UTC)
    builder = (
        x509.CertificateBuilder().subject_name(x509.Name([])).issuer_name(x509.Name([])).public_key(key.public_key())
    )
    builder = builder.serial_number(1).not_valid_before(now).not_valid_after(now + timedelta(days=1))
    (tmp_path / "a.pem").write_bytes(builder.sign(key, hashes.SHA256()).public_bytes(serialization.Encoding.PEM))
    assert read_certificate(str(tmp_path / "a.pem")).name == ""


def test_without_the_package_the_remedy_is_named_and_nothing_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = builtins.__import__

    def without(name: str, *rest: Any, **more: Any) -> Any:
        if name.startswith("cryptography"):
            raise ImportError("No module named 'cryptography'")
        return real(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(SecurityError, match=r"cryptography.*pip install 'robactor\[security\]'"):
        create(tmp_path / "fleet", ["robot"], days=2, passwords=False)
    assert not (tmp_path / "fleet").exists()
