"""`multicast receive | send`: whether UDP multicast reaches this machine.

Processes of this framework do not need it: they meet at a port of the loopback interface, or connect to each other (`--connect`).
"""

from __future__ import annotations

import argparse
import socket
import struct

from cli.command import CommandFailed, Exit
from cli.output import print_json
from cli.parsing import Parser, add_json, positive
from cli.verb import Group, Verb

GROUP, PORT = "225.0.0.1", 49150
TEXT = b"Hello World!"


def _arguments(parser: Parser) -> None:
    parser.add_argument("--group", default=GROUP, help=f"the address ({GROUP})")
    parser.add_argument("--port", type=positive, default=PORT, help=f"the port ({PORT})")
    add_json(parser)


def _send_arguments(parser: Parser) -> None:
    parser.add_argument("--ttl", type=positive, metavar="N", help="how many routers it may pass")
    _arguments(parser)


async def _receive(options: argparse.Namespace) -> Exit:
    import asyncio

    with _socket(options.group) as receiver:
        try:
            receiver.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            receiver.bind(("", options.port))
            member = struct.pack("4sl", socket.inet_aton(options.group), socket.INADDR_ANY)
            receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
        except (OSError, OverflowError) as error:
            raise CommandFailed(f"{options.group} port {options.port}: {error}") from None
        receiver.setblocking(False)
        if not options.json:
            print("Waiting for UDP multicast datagram...")
        data, (host, port) = await asyncio.get_running_loop().sock_recvfrom(receiver, 4096)
    text = data.decode(errors="backslashreplace")
    print_json({"host": host, "port": port, "text": text}) if options.json else print(
        f"Received from {host}:{port}: '{text}'"
    )
    return Exit.DONE


def _send(options: argparse.Namespace) -> Exit:
    if not options.json:
        print("Sending one UDP multicast datagram...")
    with _socket(options.group) as sender:
        try:
            if options.ttl is not None:
                sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, struct.pack("b", options.ttl))
            sender.sendto(TEXT, (options.group, options.port))
        except (OSError, OverflowError, struct.error) as error:
            raise CommandFailed(f"{options.group} port {options.port}: {error}") from None
    if options.json:
        print_json({"sent": len(TEXT)})
    return Exit.DONE


def _socket(group: str) -> socket.socket:
    try:
        socket.inet_aton(group)
    except OSError:
        raise CommandFailed(f"{group!r} is no IPv4 address, such as {GROUP}") from None
    return socket.socket(socket.AF_INET, socket.SOCK_DGRAM, socket.IPPROTO_UDP)


COMMAND = Group(
    "multicast",
    "Whether UDP multicast works. Processes of this framework do not need it.",
    Verb("receive", "Receive a single UDP multicast packet", _arguments, _receive),
    Verb("send", "Send a single UDP multicast packet", _send_arguments, _send),
)
