"""Hostile bytes: noise, what is almost right, and what is right but for one part."""

from __future__ import annotations

from random import Random

from actors.interfaces import encode
from actors.interfaces.std_msgs.msg import String
from actors.transport.format.attachments import Attachment, write_attachment
from actors.transport.format.extensions import Extension, Waiting, write_extension
from actors.transport.format.replies import TIMED_OUT

HUGE = 2**63 - 1


def noise(rng: Random, most: int = 200) -> bytes:
    """Nothing but bytes."""
    return rng.randbytes(rng.randrange(most))


def damaged(rng: Random, data: bytes) -> bytes:
    """Cut, lengthened, or with some bytes changed."""
    changed = bytearray(data)
    for _ in range(rng.randrange(1, 4)):
        if changed:
            changed[rng.randrange(len(changed))] = rng.choice((0, 1, 0x7F, 0x80, 0xFF, rng.randrange(256)))
    match rng.randrange(3):
        case 0:
            del changed[rng.randrange(len(changed) + 1) :]
        case 1:
            changed += noise(rng, 40)
    return bytes(changed)


def broken_attachment(rng: Random) -> bytes:
    """One that nobody can read: too short, or with another length of the GID."""
    if rng.random() < 0.5:
        return rng.randbytes(rng.randrange(33))
    size = rng.choice([size for size in range(256) if size != 16])
    return rng.randbytes(16) + bytes((size,)) + rng.randbytes(rng.randrange(16, 60))


def attachment(rng: Random, gid: bytes | None = None) -> bytes:
    """One that can be read, of a sender that nobody knows if no `gid` is given; its extension is anything."""
    chain = (Waiting(session="ab", node_id=rng.randrange(9), name="/a"),) * rng.randrange(4)
    extension = write_extension(Extension(chain=chain, reason="because"))
    extra = rng.choice((b"", extension, noise(rng), b"RBA\x01" + noise(rng), damaged(rng, extension)))
    number = rng.choice((0, 1, -1, HUGE, -HUGE - 1, rng.getrandbits(32)))
    return write_attachment(Attachment(number, rng.choice((0, HUGE)), gid or rng.randbytes(16), extra))


def payload(rng: Random) -> bytes:
    """Of a message: noise, a huge length, no Unicode, cut, or right."""
    right = encode(String(data="stranger " + "x" * rng.randrange(20)))
    huge = b"\0\1\0\0" + rng.choice((b"\xff\xff\xff\xff", b"\xff\xff\xff\x7f", rng.randbytes(4))) + noise(rng, 30)
    return rng.choice((noise(rng), damaged(rng, right), huge, b"", b"\0\1\0\0", right))


def reply_error(rng: Random) -> bytes:
    """Instead of an answer."""
    return rng.choice((b"", noise(rng), TIMED_OUT, b"RBE\x01" + noise(rng)))


def token(rng: Random, known: list[str], session: str) -> str:
    """A liveliness token of the stranger: one of another with some parts changed, or nothing like it."""
    parts = rng.choice(known).split("/")
    parts[2] = session
    parts[3:5] = [str(rng.randrange(10**6)), str(rng.randrange(10**6))]
    for _ in range(rng.randrange(4)):
        odd = (
            "",
            "%",
            "%%",
            "%a%",
            "@",
            "-1",
            "1" * 5000,
            "x" * 300,
            "RIHS01_",
            "::,::",
            ":,:,:,:",
            "é",
            "\udc80",
            "٣",
        )
        parts[rng.randrange(2, len(parts))] = rng.choice(odd)
    return "/".join(parts[: rng.randrange(3, len(parts) + 2)])
