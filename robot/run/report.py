"""The report of a run: plain data for JSON, the same for the same seed but for `wall_seconds`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from math import isfinite
from typing import Any

from actors import System
from robot.run.judge import Score
from robot.sim.simulation import Simulation


def make_report(system: System, body: Simulation, score: Score, run: Mapping[str, Any]) -> dict[str, Any]:
    """Everything worth knowing of a run. Call it while the system still runs."""
    return {
        **run,
        "simulated_seconds": round(system.clock.now(), 6),
        "topics": _topics(system),
        "nodes": _nodes(system),
        "timers": _timers(system),
        "distance_walked": round(score.walked, 4),
        "falls": score.falls,
        "contacts": score.contacts,
        "smallest_clearance": round(score.clearance, 4) if isfinite(score.clearance) else None,
        "goals": [asdict(goal) for goal in score.goals],
        "drove": {source: round(seconds, 2) for source, seconds in score.drove.items()},
        "safety_stops": [asdict(stop) for stop in score.stops],
        "battery": {
            "start_percent": run["battery_percent"],
            "end_percent": round(100.0 * score.charge, 4) if score.charge is not None else None,
            "charging": score.charging,
        },
    }


def last_sample(body: Simulation) -> dict[str, Any]:
    """The true body when all is over."""
    truth = body.truth()
    x, y, z = (round(float(value), 4) for value in truth.position)
    carried: dict[str, Any] = {}
    if body.arm is not None:
        things = {thing.name: _rounded(thing.shape.x, thing.shape.y, thing.z) for thing in body.things()}
        carried = {"held": body.arm.held, "things": things}
    return {"x": x, "y": y, "body_height": z, "fallen": truth.fallen, **carried}


def _rounded(*values: float) -> list[float]:
    return [round(float(value), 4) for value in values]


def _topics(system: System) -> list[dict[str, Any]]:
    now = system.clock.now()
    rows: list[dict[str, Any]] = []
    for name, topic in sorted(system.graph.topics.items()):
        seconds = now - topic.opened if topic.opened is not None else 0.0
        rows.append(
            {
                "name": name,
                "type": ", ".join(topic.type_names),
                "messages": topic.message_count,
                "rate": round(topic.message_count / seconds, 4) if seconds > 0.0 else 0.0,
                "drops": topic.dropped,
                "publishers": len(topic.publishers),
                "subscriptions": len(topic.subscriptions),
            }
        )
    return rows


def _nodes(system: System) -> list[dict[str, Any]]:
    return [
        {
            "name": state.identity.fqn,
            "path": "/".join(state.path),
            "state": state.state,
            "incarnation": state.incarnation,
            "restarts": [{"at": round(at, 6), "reason": reason} for at, reason in state.restarts],
        }
        for state in system.nodes.values()
    ]


def _timers(system: System) -> list[dict[str, Any]]:
    now = system.loop.time()
    rows: list[dict[str, Any]] = []
    for state in system.nodes.values():
        for name, timer in state.timers.items():
            p50, p99, most = timer.lateness.quantiles()
            rows.append(
                {
                    "node": state.identity.fqn,
                    "timer": name,
                    "hz": timer.hz,
                    "ticks": timer.fired,
                    "overdue": timer.overdue,
                    "missed": timer.missed,
                    "rate": round(timer.rate(now), 4),
                    "late_p50_ms": round(p50 * 1e3, 4),
                    "late_p99_ms": round(p99 * 1e3, 4),
                    "late_max_ms": round(most * 1e3, 4),
                }
            )
    return rows
