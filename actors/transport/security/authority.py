"""A small authority of one's own: it signs certificates for the processes of one fleet, in a folder for each of them.

::

    FOLDER/authority.pem        its certificate, which everybody trusts
    FOLDER/authority.key        its private key, which signs; not needed by any process
    FOLDER/NAME/security.yaml   for `load_security`: names the files beside it
    FOLDER/NAME/authority.pem, certificate.pem, key.pem
    FOLDER/NAME/password, users (if passwords are wanted)

It needs the package `cryptography`. Files are written for their owner only, and none is written over but ``users``.
"""

from __future__ import annotations

import os
import re
import secrets
from collections.abc import Iterable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from actors.transport.security.document import SecurityError

if TYPE_CHECKING:
    from cryptography import x509
    from cryptography.hazmat.primitives.asymmetric import ec

__all__ = ["Certificate", "create", "read_certificate"]

_NAME: Final = re.compile(r"[A-Za-z0-9_.-]{1,64}")
_AUTHORITY: Final = "authority"
_SKEW: Final = timedelta(hours=1)
"""Certificates are valid from so long ago, because the clocks of machines differ."""

_TEXT: Final = """\
# Who this process is, and whom it lets in. Paths count from this folder.
tls:
  authority: authority.pem
  certificate: certificate.pem
  key: key.pem
"""
_USER: Final = """\
user:
  name: {name}
  password_file: password
  users: users
"""
_ACCESS: Final = """\
# What the others may do here; without it, everything.
# access:
#   - peers: [{name}]              # names in certificates; ['*'] for all
#     nodes: [/**]                 # the nodes that they may show
#     publish: [/cmd_vel]
#     subscribe: [/battery_state, /camera/**]
#     serve: []
#     call: [/navigate_to_pose]
"""


class Certificate(NamedTuple):
    """What a certificate says."""

    name: str
    issuer: str
    begins: datetime
    ends: datetime
    fingerprint: str
    """SHA-256 of the whole certificate, in hex."""


class _Signer(NamedTuple):
    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey


def create(folder: Path, names: Iterable[str], *, days: int, passwords: bool) -> list[Path]:
    """Make the authority, unless it is there, and a certificate for each of `names`. Returns the security files that were written.

    `days` is how long the certificates are valid; that of the authority is valid for ten times as long. With `passwords` each name gets a
    password, and the file ``users`` of everybody lists all. Raises SecurityError for a name that is none or is there already, and for a
    folder that cannot be written.
    """
    names = list(dict.fromkeys(names))
    for name in names:
        if not _NAME.fullmatch(name) or name.startswith("."):
            raise SecurityError(
                f"{name!r} is no name of a process: letters, digits and _ . -, at most 64", file=str(folder)
            )
        if (folder / name).exists():
            raise SecurityError("is there already; remove it to make it anew", file=str(folder / name))
    _cryptography()  # without it no empty folder is left behind
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        signer = _authority(folder, days)
        written = [_process(folder, name, signer, days, passwords=passwords) for name in names]
        if passwords:
            _write_users(folder)
    except OSError as error:
        raise SecurityError(f"cannot be written: {error.strerror}", file=str(error.filename or folder)) from error
    return written


def read_certificate(file: str) -> Certificate:
    """What the first certificate in a PEM file says. Raises SecurityError."""
    library = _cryptography()
    try:
        found = library.x509.load_pem_x509_certificate(Path(file).read_bytes())
    except (OSError, ValueError) as error:
        raise SecurityError("holds no certificate that can be read", file=file) from error
    return Certificate(
        _common_name(found.subject),
        _common_name(found.issuer),
        found.not_valid_before_utc,
        found.not_valid_after_utc,
        found.fingerprint(library.hashes.SHA256()).hex(),
    )


def _authority(folder: Path, days: int) -> _Signer:
    library = _cryptography()
    certificate, key = folder / "authority.pem", folder / "authority.key"
    if certificate.exists():
        try:
            signer: Any = library.serialization.load_pem_private_key(key.read_bytes(), None)
            return _Signer(library.x509.load_pem_x509_certificate(certificate.read_bytes()), signer)
        except (TypeError, ValueError) as error:
            raise SecurityError("this authority cannot be read", file=str(folder)) from error
    made = library.ec.generate_private_key(library.ec.SECP256R1())
    signed = _sign(f"{_AUTHORITY} {secrets.token_hex(4)}", made.public_key(), None, made, 10 * days)
    _write(key, _pem(made))
    _write(certificate, signed.public_bytes(library.serialization.Encoding.PEM))
    return _Signer(signed, made)


def _process(folder: Path, name: str, signer: _Signer, days: int, *, passwords: bool) -> Path:
    library = _cryptography()
    own = folder / name
    own.mkdir(mode=0o700)
    key = library.ec.generate_private_key(library.ec.SECP256R1())
    certificate = _sign(name, key.public_key(), signer.certificate, signer.key, days)
    encoding = library.serialization.Encoding.PEM
    _write(own / "authority.pem", signer.certificate.public_bytes(encoding))
    _write(own / "certificate.pem", certificate.public_bytes(encoding))
    _write(own / "key.pem", _pem(key))
    if passwords:
        _write(own / "password", f"{secrets.token_urlsafe(24)}\n".encode())
    text = _TEXT + (_USER.format(name=name) if passwords else "") + _ACCESS.format(name=name)
    _write(own / "security.yaml", text.encode())
    return own / "security.yaml"


def _write_users(folder: Path) -> None:
    known = sorted(folder.glob("*/password"))
    lines = "".join(f"{one.parent.name}:{one.read_text(encoding='utf-8').strip()}\n" for one in known)
    for one in known:
        (one.parent / "users").unlink(missing_ok=True)
        _write(one.parent / "users", lines.encode())


def _sign(
    name: str,
    public: ec.EllipticCurvePublicKey,
    issuer: x509.Certificate | None,
    key: ec.EllipticCurvePrivateKey,
    days: int,
) -> x509.Certificate:
    library = _cryptography()
    x5 = library.x509
    subject = x5.Name([x5.NameAttribute(x5.oid.NameOID.COMMON_NAME, name)])
    now = datetime.now(UTC)
    own = issuer is None
    usages = dict.fromkeys(
        (
            "content_commitment",
            "key_encipherment",
            "data_encipherment",
            "key_agreement",
            "encipher_only",
            "decipher_only",
        ),
        False,
    )
    builder = (
        x5.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(subject if issuer is None else issuer.subject)
        .public_key(public)
        .serial_number(x5.random_serial_number())
        .not_valid_before(now - _SKEW)
        .not_valid_after(now + timedelta(days=days))
        .add_extension(x5.BasicConstraints(ca=own, path_length=0 if own else None), critical=True)
        .add_extension(x5.KeyUsage(digital_signature=not own, key_cert_sign=own, crl_sign=own, **usages), critical=True)
        .add_extension(x5.SubjectKeyIdentifier.from_public_key(public), critical=False)
        .add_extension(x5.AuthorityKeyIdentifier.from_issuer_public_key(key.public_key()), critical=False)
    )
    if not own:
        both = [x5.oid.ExtendedKeyUsageOID.SERVER_AUTH, x5.oid.ExtendedKeyUsageOID.CLIENT_AUTH]
        builder = builder.add_extension(x5.ExtendedKeyUsage(both), critical=False)
        builder = builder.add_extension(x5.SubjectAlternativeName([x5.DNSName(name)]), critical=False)
    signed: x509.Certificate = builder.sign(key, library.hashes.SHA256())
    return signed


def _pem(key: ec.EllipticCurvePrivateKey) -> bytes:
    kinds = _cryptography().serialization
    return key.private_bytes(kinds.Encoding.PEM, kinds.PrivateFormat.PKCS8, kinds.NoEncryption())


def _write(path: Path, content: bytes) -> None:
    """A new file, for its owner only from its first moment."""
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
        file.write(content)


def _common_name(name: x509.Name) -> str:
    found = name.get_attributes_for_oid(_cryptography().x509.oid.NameOID.COMMON_NAME)
    return str(found[0].value) if found else ""


class _Cryptography(NamedTuple):
    """The parts of the package that are used here."""

    x509: Any
    hashes: Any
    serialization: Any
    ec: Any


def _cryptography() -> _Cryptography:
    """Import the package. Raises SecurityError if it is not installed."""
    try:
        from cryptography import x509
        from cryptography.hazmat.primitives import hashes, serialization
        from cryptography.hazmat.primitives.asymmetric import ec
    except ImportError as error:
        raise SecurityError(f"{error}; install it by: pip install 'robactor[security]'", file="cryptography") from error
    return _Cryptography(x509, hashes, serialization, ec)
