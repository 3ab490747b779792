"""``python -m tests.interop.ros2 [PART ...]``: what works with the ROS 2 of this shell, as a table; with PARTs, the checks whose names have one.

Exit code 0 if no check has failed, 1 if one has, 77 if there is no ROS 2 with that middleware.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import re
import sys
import time
import traceback

from actors import Child
from tests.interop.environment import DISTRIBUTIONS, NotHere, ros2_python
from tests.interop.ros2 import security, services, tools, topics, verbs, walks
from tests.interop.ros2.bench import MIDDLEWARES, Bench, Check, NoRos, NotInstalled, Ros, bench, find_ros

SKIPPED = 77
VERDICTS = ("passed", "FAILED", "skipped")
NO_SERVICES = re.compile(
    "their (client|goal)|our (client|goal)|twenty|ros2 (param|lifecycle (nodes|set)|service call|action send)"
    "|robactor and ros2: (param|lifecycle (list|get|set)|service call|action send)"
)
"""The checks that ask or answer, which cannot be done with Fast DDS; see docs/concepts/wire.md."""


NO_COMMAND = re.compile("^ros2 |^robactor and ros2: |known from its definition|^the twenty")
"""The checks that need the command ``ros2``."""


def chosen(parts: list[str], middleware: str, with_command: bool) -> list[tuple[str, Check]]:
    every = [*topics.checks(middleware), *services.checks(), *tools.checks(), *verbs.checks(), *walks.checks()]
    if not with_command:
        every = [(name, check) for name, check in every if not NO_COMMAND.search(name)]
    if middleware == "zenoh":
        every += security.checks()
    if middleware == "fastrtps":
        every = [(name, check) for name, check in every if not NO_SERVICES.search(name)] + [*services.unanswered()]
    return [(name, check) for name, check in every if not parts or any(part in name for part in parts)]


async def one(name: str, check: Check, at: Bench, verbose: bool) -> str:
    began = time.monotonic()
    try:
        await check(at)
    except NotInstalled as error:
        verdict, why = "skipped", str(error)
    except Exception as error:
        text = (str(error).strip() or type(error).__name__).splitlines()
        verdict, why = "FAILED", f"{type(error).__name__}: {text[0]}"
        if verbose:
            traceback.print_exc()
    else:
        verdict, why = "passed", ""
    print(f"{verdict:7} {time.monotonic() - began:6.1f} s  {name}{': ' + why if why else ''}", flush=True)
    return verdict


async def every(ros: Ros, checks: list[tuple[str, Check]], verbose: bool, with_router: bool) -> int:
    nodes = (
        Child(services.Counter, name="counter", namespace="/ours"),
        Child(tools.Talker, name="talker", namespace="/ours"),
        Child(tools.Ticker, name="ticker", namespace="/ours", parameters={"enable_logger_service": True}),
    )
    async with bench(ros, *nodes, with_router=with_router) as at:
        verdicts = {name: await one(name, check, at, verbose) for name, check in checks}
    failed = [name for name, verdict in verdicts.items() if verdict == "FAILED"]
    print(", ".join(f"{[*verdicts.values()].count(verdict)} {verdict.lower()}" for verdict in VERDICTS))
    if at.unclosed:
        print(f"{at.unclosed} times ros2 did its work, but its Zenoh could not close the session within 10 s")
    for name in failed:
        print(f"  FAILED  {name}")
    return bool(failed)


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.interop.ros2", description=__doc__)
    parser.add_argument("part", nargs="*", help="only checks whose name contains it")
    parser.add_argument("--rmw", choices=MIDDLEWARES, default="zenoh", help="the middleware of ROS 2; zenoh by default")
    parser.add_argument(
        "--wheels", choices=DISTRIBUTIONS, help="with the ROS 2 that PyPI has, on Fast DDS and without its command ros2"
    )
    parser.add_argument("--list", action="store_true", help="the names of the checks")
    parser.add_argument("--router", action="store_true", help="all meet at ROS 2's own router, which is started first")
    parser.add_argument("-v", "--verbose", action="store_true", help="the traceback of each failure")
    options = parser.parse_args()
    middleware = "fastrtps" if options.wheels else options.rmw
    checks = chosen(options.part, middleware, with_command=not options.wheels)
    if options.list:
        print("\n".join(name for name, _ in checks))
        return 0
    try:
        ros = Ros("", str(ros2_python(options.wheels)), middleware) if options.wheels else find_ros(middleware)
    except (NoRos, NotHere) as missing:
        print(f"{len(checks)} skipped: {missing}")
        return SKIPPED
    distribution = options.wheels or os.environ.get("ROS_DISTRO", "(ROS_DISTRO is not set)")
    print(f"ROS 2 {distribution}, {MIDDLEWARES[middleware]}, {ros.command or ros.python}")
    return asyncio.run(every(ros, checks, options.verbose, options.router))


if __name__ == "__main__":
    sys.exit(main())
