"""A machine of `tests.stories.hosts`: a network namespace with one interface, which leads to the test that has made it.

``python -m tests.stories.machine SOCKET ADDRESS MTU``, started in a new namespace, makes the interface and hands its other end over by SOCKET.
Then it holds the namespace until its standard input ends.
"""

from __future__ import annotations

import array
import fcntl
import os
import socket
import struct
import sys

__all__: list[str] = []

TUNSETIFF, IFF_TUN, IFF_NO_PI = 0x400454CA, 0x0001, 0x1000
SIOCSIFADDR, SIOCSIFNETMASK, SIOCSIFFLAGS, SIOCSIFMTU, SIOCSIFTXQLEN = 0x8916, 0x891C, 0x8914, 0x8922, 0x8943
IFF_UP = 0x1


def interface(address: str, mtu: int) -> int:
    """Make the interface; its other end."""
    end = os.open("/dev/net/tun", os.O_RDWR)
    fcntl.ioctl(end, TUNSETIFF, struct.pack("16sH22x", b"wire", IFF_TUN | IFF_NO_PI))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as control:

        def ask(request: int, name: bytes, value: bytes) -> None:
            fcntl.ioctl(control, request, struct.pack("16s24s", name, value))

        def internet(text: str) -> bytes:
            return struct.pack("HH4s", socket.AF_INET, 0, socket.inet_aton(text))

        ask(SIOCSIFFLAGS, b"lo", struct.pack("H", IFF_UP))
        ask(SIOCSIFADDR, b"wire", internet(address))
        ask(SIOCSIFNETMASK, b"wire", internet("255.255.255.0"))
        ask(SIOCSIFMTU, b"wire", struct.pack("i", mtu))
        ask(SIOCSIFTXQLEN, b"wire", struct.pack("i", 1000))
        ask(SIOCSIFFLAGS, b"wire", struct.pack("H", IFF_UP))
    return end


def main(path: str, address: str, mtu: str) -> None:
    end = interface(address, int(mtu))
    with socket.socket(socket.AF_UNIX) as way:
        way.connect(path)
        way.sendmsg([b"."], [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", [end]))])
    os.close(end)
    sys.stdin.read()


if __name__ == "__main__":
    main(*sys.argv[1:])
