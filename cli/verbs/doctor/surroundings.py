"""Where this process stands: domain, transport, security, the processes that are found, and the packages on its path."""

from __future__ import annotations

from collections.abc import Iterator

from actors.names.names import is_hidden
from actors.transport.environment import CYCLONE, FAST_DDS
from actors.transport.figures import ProcessFigures
from cli.graph.view import CLIENT, SERVER
from cli.parsing import count
from cli.verbs.doctor.observation import Finding, Observation

ZENOH = "rmw_zenoh_cpp"
FAST_DDS_GIDS = b"\x01\x0f"
"""How the GIDs of Fast DDS begin."""


def domain(seen: Observation) -> Iterator[Finding]:
    """The domain, and whether the others are in it."""
    here = len(seen.here())
    others: dict[int, int] = {}
    for node in seen.nodes:
        if node.domain_id != seen.domain:
            others[node.domain_id] = others.get(node.domain_id, 0) + 1
    elsewhere = ", ".join(f"{count(number, 'node')} in domain {each}" for each, number in sorted(others.items()))
    measured = f"ROS_DOMAIN_ID={seen.domain}: {count(here, 'node')}"
    if here:
        yield Finding("domain", f"{seen.domain}", f"{measured}; {elsewhere or 'no other domain is seen'}", level="info")
    elif others:
        first = next(iter(sorted(others)))
        yield Finding(
            "domain", "all nodes are in another domain", f"{measured}; {elsewhere}", f"export ROS_DOMAIN_ID={first}"
        )
    else:
        help = (
            "start one by spin(Node) or robactor run (the nodes of run(tree) are found only with transport=); those of ROS 2 are found only "
            "with the same RMW_IMPLEMENTATION, and with rmw_zenoh_cpp only by a router (ros2 run rmw_zenoh_cpp rmw_zenohd), "
            "those of another machine with --connect, those with security with --security, and ROBACTOR_GOSSIP_PORT must be the same"
        )
        yield Finding("domain", "no nodes are found", f"{measured}; no other domain is seen", help)


def transport(seen: Observation) -> Iterator[Finding]:
    """The transport in use."""
    if seen.implementation:
        cause, measured = seen.implementation, f"RMW_IMPLEMENTATION={seen.implementation}"
    else:
        cause, measured = f"{ZENOH}, the default transport", "RMW_IMPLEMENTATION is empty"
    yield Finding("transport", cause, measured, level="info")
    if seen.implementation in (CYCLONE, FAST_DDS):
        fast = sorted(
            {end.node for end in seen.ends if end.about.kind in (SERVER, CLIENT) and end.about.gid[:2] == FAST_DDS_GIDS}
        )
        if fast:
            yield Finding(
                "transport",
                "nodes of rmw_fastrtps share topics with this library, but no services and actions",
                f"{count(len(fast), 'node')}: {', '.join(fast[:5])}{', ...' if fast[5:] else ''}",
                "start them with RMW_IMPLEMENTATION=rmw_cyclonedds_cpp, or all with rmw_zenoh_cpp",
                level="note",
            )


def security(seen: Observation) -> Iterator[Finding]:
    """Whether security is on, and what it says."""
    cause = "on: a peer without a certificate is refused" if seen.security else "off: every peer is accepted"
    measured = (
        "; ".join(" ".join(line.split()) for line in seen.security) or "no --security, and ROBACTOR_SECURITY is empty"
    )
    yield Finding("security", cause, measured, level="info")


def processes(seen: Observation) -> Iterator[Finding]:
    """Each process that is found, with its domain and transport."""
    figures = {one.session: one for one in seen.processes}
    counted: dict[tuple[int, str], int] = {}
    for node in seen.nodes:
        place = node.domain_id, node.session
        counted[place] = counted.get(place, 0) + (not is_hidden(node.fqn))
    for (number, session), nodes in sorted(counted.items()):
        if nodes:
            name = _name_of(figures.get(session), session)
            yield Finding(name, f"domain {number}, {seen.implementation or ZENOH}", count(nodes, "node"), level="info")


def _name_of(figures: ProcessFigures | None, session: str) -> str:
    if figures is None:
        return f"process with session {session[:8]}"
    return f"process {figures.process} of {figures.host}, {figures.program}"


def leases(seen: Observation) -> Iterator[Finding]:
    """The machines to which processes give parts of their trees, and whether they can be reached."""
    for process in seen.processes:
        for one in process.leases:
            subject, of = f"host {one.host}", _name_of(process, process.session)
            if one.left:
                measured = f"{one.left:.1f} s of its lease are left; {count(one.parts, 'part')}"
                yield Finding(subject, f"works for {of}", measured, level="info")
            else:
                remedy = "start robactor agent there, or look at the network between them"
                yield Finding(subject, f"cannot be reached by {of}", "its agent holds no lease", remedy)


def packages(seen: Observation) -> Iterator[Finding]:
    """That only one package named ``robot`` is on the path: of several, the first one is used, whichever was meant."""
    if len(seen.robots) > 1:
        used, *others = seen.robots
        yield Finding(
            "package robot",
            "several packages or modules named robot are on the path, and Python uses the first",
            f"used: {used}; hidden: {', '.join(others)}",
            "rename yours, or start robactor in another folder (the console script robactor does not look into the current one)",
        )
