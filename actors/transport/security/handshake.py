"""Whether a certificate would be taken: TLS with itself, in memory, as the others will do it with this process."""

from __future__ import annotations

import ssl
from pathlib import Path


def refusal_of(authority: Path, certificate: Path, key: Path) -> tuple[str, str] | None:
    """Which of ``authority``, ``certificate`` and ``key`` is wrong and why; None if others who trust `authority` take the certificate now."""
    ours, theirs = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER), ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    try:
        ours.load_cert_chain(certificate, key)
    except ssl.SSLError as error:
        if error.reason == "KEY_VALUES_MISMATCH":
            return "key", f"{key} is not the key of {certificate}"
        return "certificate", f"{certificate} and {key} cannot be loaded: {error.reason or error}"
    try:
        theirs.load_verify_locations(authority)
    except ssl.SSLError as error:
        return "authority", f"{authority} cannot be loaded: {error.reason or error}"
    theirs.check_hostname = False  # processes are known by the name in the certificate, not by that of their host
    try:
        _shake_hands(ours, theirs)
    except ssl.SSLCertVerificationError as error:
        return "certificate", f"{certificate} is not taken by those who trust {authority}: {error.verify_message}"
    return None


def _shake_hands(ours: ssl.SSLContext, theirs: ssl.SSLContext) -> None:
    to_us, to_them = ssl.MemoryBIO(), ssl.MemoryBIO()
    server = ours.wrap_bio(to_us, to_them, server_side=True)
    client = theirs.wrap_bio(to_them, to_us)
    waiting = [client, server]
    while waiting:
        side = waiting.pop(0)
        try:
            side.do_handshake()
        except ssl.SSLWantReadError:
            waiting.append(side)
