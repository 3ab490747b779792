"""`python -m robot run`, from the checked options to the exit code."""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from cli.command import UsageError
from cli.starting import interruptible
from robot.geometry.planar import turned
from robot.run.crashes import check_crashes, crash, with_hangs
from robot.run.disturbances import Push
from robot.run.options import Options, parse

if TYPE_CHECKING:
    import asyncio

    from actors import Supervisor, System
    from actors.hosts import Hosts
    from actors.transport import Transport
    from robot.assembly import Robot
    from robot.planning.grid import Grid
    from robot.run.judge import Score
    from robot.run.recordings import Recordings
    from robot.run.web import ServeWeb
    from robot.scenes.scene import Scene
    from robot.sim.simulation import Simulation


def main(argv: Sequence[str], serve_web: ServeWeb | None = None) -> int:
    """The exit code. `serve_web` starts the web server beside the robot, if there is to be one.

    0: ended as asked. 1: the robot fell, what `--goal` or `--fetch` asked for was not done when the run ended, or the last try of a goal of
    the patrol failed. 2: cannot be run as asked. 3: a supervisor gave up. 130 and 143: SIGINT and SIGTERM.
    """
    # One thread for BLAS: 12 x 12 matrices gain nothing from more, and the last bits of a sum would depend on their number.
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(variable, "1")
    try:
        options = parse(argv)
        if options.hardware is not None:
            from robot.run.hardware import run_hardware

            return run_hardware(options.hardware, options, serve_web)
        with _zygote() if options.processes else nullcontext():
            return Session(options, serve_web).run()
    except UsageError as error:
        print(f"robot run: {error}", file=sys.stderr)
        return 2


def _zygote() -> AbstractContextManager[object]:
    """That of this process, as long as it has one thread, with what the processes of the robot import."""
    from actors.processes.forked import forked

    return forked("robot", ("robot.assembly", "robot.link.process", "robot.sim.physics", "mujoco", "numpy.random"))


class Session:
    """One run: what it needs is made and checked first, then the tree is started."""

    def __init__(self, options: Options, serve_web: ServeWeb | None = None) -> None:
        self.options = options
        self._serve_web = serve_web
        self.robot = self._robot()
        self.body: Simulation = self.robot.body

    def run(self) -> int:
        from actors import DeclarationError, StartFailed, SupervisorGaveUp, execute
        from robot.hardware.body import BodySilent
        from robot.link.time_slices import short_turns

        if self.options.clock == "real" and not self.options.processes:
            short_turns()  # its control loop shares this process
        if self.options.clock == "virtual":
            interruptible()
        try:
            return execute(self._main, clock=self.options.clock)
        except DeclarationError as error:  # of the machines: they are looked at when the run begins
            raise UsageError(str(error)) from error
        except (SupervisorGaveUp, StartFailed, BodySilent) as error:
            print(f"robot run: {self._cause(error)}", file=sys.stderr)
            return 3
        except KeyboardInterrupt:  # before the first await, or on a platform without signal handlers
            return 130
        finally:
            self.robot.close()

    def _cause(self, error: Exception) -> Exception:
        """That the body's process has ended, by which all else fails; or else the error itself."""
        from robot.hardware.body import BodySilent

        if self.robot.process is not None:
            try:
                self.robot.process.check()
            except BodySilent as ended:
                return ended
        return error

    # -- what can be wrong with it, found before anything runs --------------------------------------------------------------

    def _robot(self) -> Robot:
        from robot.assembly import Robot
        from robot.hardware.sensors import Sensors
        from robot.link.segment import SharedMemoryMissing
        from robot.model.actuators import ActuatorDesign
        from robot.model.bodies import BODIES
        from robot.model.robot import ModelError
        from robot.run.mission import get_mission
        from robot.scenes.worlds import UnknownWorld, get_world
        from robot.sim.model_file import find_model
        from robot.sim.physics import BackendMissing, check_engine

        options = self.options
        try:
            scene = get_world(options.world)
        except UnknownWorld as error:
            raise UsageError(f"--world {options.world}: {error.args[0]}") from None
        grid = _grid(options.map, scene)
        try:
            if options.robot not in BODIES:
                check_engine()
            model = find_model(options.robot)
            drives = ActuatorDesign.of(model) if options.real_drives else None
            return Robot(
                scene, map=grid, body=options.backend, mission=get_mission(options.goal, options.fetch, scene, grid, model), seed=options.seed,
                battery=options.battery, arm=options.arm, motor_delay=options.motor_delay, ground=options.ground, actuators=drives,
                sight=options.sight, sensors=Sensors.of(options.sensors), publish_clock=options.publish_clock, processes=options.processes,
                hosts=None if options.machines is None else options.machines.hosts, model=model,
            )  # fmt: skip
        except ModelError as error:
            raise UsageError(f"--robot: {error}") from None
        except (BackendMissing, SharedMemoryMissing) as error:
            raise UsageError(str(error)) from None

    def _parameters(self, chosen: Supervisor) -> dict[str, dict[str, Any]] | None:
        """What `--params` says of the nodes that run; what is wrong about another one of the robot is a mistake, too."""
        if self.options.params is None:
            return None
        from actors.parameters.files import InvalidParams
        from actors.running.options import parameters_by_node
        from robot.run.tree_nodes import nodes_of

        try:
            taken = parameters_by_node("--params", self.robot.tree, self.options.params)
        except InvalidParams as error:
            raise UsageError(f"--params: {error}") from None
        return {f"/{child.name}": taken.get(f"/{child.name}", {}) for child in nodes_of(chosen)}

    def _transport(self) -> Transport | None:
        """The connection with other processes; none on the virtual clock, which they do not share."""
        from actors.transport import WireUnavailable, transport_from_environment

        if self.options.clock == "virtual":
            return None
        try:
            return transport_from_environment(
                os.environ, listen=self.options.listen, connect=self.options.connect, security=self.options.security
            )
        except WireUnavailable as error:
            raise UsageError(str(error)) from None

    def _hosts(self) -> Hosts | None:
        """The way to the other machines; None without any."""
        from robot.run.machines import tls_hosts

        return None if self.options.machines is None else tls_hosts(self.options.machines, self.options.security)

    # -- the run ------------------------------------------------------------------------------------------------------------

    async def _main(self) -> int:
        import asyncio

        from actors import Child, run
        from actors.logs import Level, console_sink, json_sink
        from robot.hardware.body import BodySilent
        from robot.run.judge import Judge, Score
        from robot.run.mission import failure
        from robot.run.recordings import Recordings
        from robot.run.report import last_sample, make_report
        from robot.run.status import Part, Status, StatusLine, final_parts
        from robot.run.web import start

        options, began = self.options, time.monotonic()
        line, score = StatusLine(), Score()
        transport = self._transport()
        flight = Recordings(options, score, reachable=transport is not None)
        sink = json_sink() if options.log_format == "json" else console_sink()
        line.live = line.live and options.log_format == "console"
        tree = self._chosen(self.robot.tree)
        check_crashes(tree, options.crashes)
        check_crashes(tree, options.hangs, "--hang")
        _check_replay(tree, options.replay)
        if self.robot.process is not None:
            self.robot.process.ready()
            tree = with_hangs(tree, options.hangs)
        report: dict[str, Any] = {}
        context = run(
            tree, seed=options.seed, sinks=(line.above(sink),), level=Level.parse(options.log_level), observers=flight.observers,
            parameters=self._parameters(tree), transport=transport, hosts=self._hosts(),
        )  # fmt: skip
        try:
            async with context as system:
                await system.join(Child(Judge, args=(self.body, score)))
                await system.join(Child(Status, args=(line, self.body.backend)))
                self._announce(system)
                web = asyncio.ensure_future(start(system, options, self._serve_web))
                try:
                    await self._until_over(system, flight, score, web)
                finally:
                    web.cancel()
                    report = make_report(system, self.body, score, self._header())
        finally:
            parts: list[Part] = []
            last: dict[str, Any] | None = None
            try:
                parts = final_parts(self.body.truth(), score, report.get("simulated_seconds", 0.0))
                last, failed = last_sample(self.body), failure(options, score, self.body)
            except BodySilent as error:
                failed = str(self._cause(error))
            line.end(parts)
            report |= flight.conclude(quiet=options.log_format == "json")
            report |= {"last": last, "wall_seconds": round(time.monotonic() - began, 3), "failure": failed}
            self._conclude(score, report)
            failed = self._write(report) or failed
        if failed is None or system.exit_code != 0:
            return system.exit_code
        print(f"robot run: {failed}", file=sys.stderr)
        return 1

    def _chosen(self, tree: Supervisor) -> Supervisor:
        """The tree, or what `--only` leaves of it."""
        from robot.run.tree_nodes import UnknownNode, nodes_of, only

        names = self.options.only
        if not names:
            return tree
        try:
            chosen = only(tree, names)
            if self.options.processes:  # and what looks after their processes
                cares = {child.name for child in nodes_of(tree)} & {f"{one.name}_process" for one in chosen.children}
                chosen = only(tree, (*names, *cares))
        except UnknownNode as error:
            hint = "" if self.options.arm else " (those of the arm come with --arm)"
            raise UsageError(f"--only: {error}{hint}") from None
        left = [child.name for child in nodes_of(chosen)]
        if self.options.goal is not None and "patrol" not in left:
            raise UsageError("--goal: it is the patrol who walks there, and --only leaves it out")
        if self.options.fetch is not None and "carrier" not in left:
            raise UsageError("--fetch: it is the carrier who fetches, and --only leaves it out")
        return chosen

    async def _until_over(self, system: System, flight: Recordings, score: Score, web: asyncio.Future[None]) -> None:
        """Let the time pass: crashes that were ordered, the end of the mission, the end of the duration, or the end of the tree.

        Raises what `web`, the start of the web server, raises.
        """
        import asyncio

        from robot.nodes.carrier import Carrier
        from robot.nodes.patrol import Patrol

        duration, clock = self.options.duration, system.clock
        began = clock.now()  # a start takes time on the real clock
        seconds = clock.now if clock.virtual else time.monotonic  # however slow the machine is, it ends
        end = None if duration is None else seconds() + duration
        pushes = [
            system.loop.call_at(clock.loop_time(began + push.at), self._push, push) for push in self.options.pushes
        ]
        crashes = {
            one: system.loop.call_at(clock.loop_time(began + one.at), crash, system, one.node)
            for one in self.options.crashes
        }
        ended = asyncio.ensure_future(system.wait())
        try:
            while not ended.done():
                left = 0.1 if end is None else min(0.1, end - seconds())
                if left <= 0.0:
                    break
                await asyncio.wait([ended], timeout=left)
                flight.look()
                if web.done():
                    web.result()
                if self.robot.process is not None:
                    self.robot.process.check()
                missions = (record.node for record in system.nodes.values())
                if self._done(score) or any(isinstance(node, (Patrol, Carrier)) and node.finished for node in missions):
                    await asyncio.wait([ended], timeout=3.0)  # the sit that ends the mission takes about two seconds
                    break
            if ended.done():
                ended.result()
        finally:
            ended.cancel()
            for timer in pushes:
                timer.cancel()
            for one, timer in crashes.items():
                timer.cancel()  # later it would hit a robot that is sitting down
                if clock.now() < began + one.at:
                    system.log.warning("crash not made: the run had ended", asked=f"{one.node}@{one.at:g}")

    def _push(self, push: Push) -> None:
        """Push the body along its heading, level."""
        self.body.push((*turned(self.body.truth().yaw, push.forward, push.left), 0.0))

    def _done(self, score: Score) -> bool:
        """Whether the last report of a mission in another process was the one that ends it."""
        from robot.run.mission import DOCK_GOAL

        tasks = [goal for goal in score.goals if goal.name != DOCK_GOAL]
        if not (self.options.processes or self.options.machines) or not tasks:
            return False
        return self.options.fetch is not None or (self.options.goal is not None and tasks[-1].succeeded)

    def _announce(self, system: System) -> None:
        more: dict[str, Any] = {"only": ", ".join(self.options.only)} if self.options.only else {}
        if self.body.model.assumed:
            more["assumed"] = (
                f"{', '.join(self.body.model.assumed)}: its file has none that can be; those of spot, scaled"
            )
        if self.body.backend == "kinematic":
            more["note"] = "the kinematic body has no physics: it cannot fall, and nothing here counts as walking"
        system.log.info(
            "robot running", world=self.robot.scene.name, backend=self.body.backend, clock=self.options.clock, seed=self.options.seed, **more
        )  # fmt: skip

    def _header(self) -> dict[str, Any]:
        options = self.options
        return {
            "backend": self.body.backend, "world": self.robot.scene.name, "clock": options.clock, "seed": options.seed,
            "motor_delay": options.motor_delay, "actuators": "real" if options.real_drives else "ideal",
            "ground": None if options.ground is None else asdict(options.ground),
            "sensors": options.sensors, "battery_percent": options.battery, "only": list(options.only),
            "arm": options.arm,
        }  # fmt: skip

    def _conclude(self, score: Score, report: dict[str, Any]) -> None:
        from robot.run.mission import DOCK_GOAL

        reached = sum(goal.succeeded and goal.name != DOCK_GOAL for goal in score.goals)
        docked = ", docked" if any(goal.succeeded and goal.name == DOCK_GOAL for goal in score.goals) else ""
        if self.options.log_format == "console":  # lines of JSON stay lines of JSON; the report has it all
            print(
                f"{self.body.backend} body: {report.get('simulated_seconds', 0.0):.1f} s, {score.walked:.1f} m walked, "
                f"{reached} goals reached{docked}, {score.falls} falls, {len(score.contacts)} contacts",
                file=sys.stderr,
            )

    def _write(self, report: dict[str, Any]) -> str | None:
        """Write the report, if one is wanted; returns what went wrong."""
        if self.options.report is None:
            return None
        try:
            with open(self.options.report, "w", encoding="utf-8") as file:
                json.dump(report, file, indent=1, sort_keys=True)
                file.write("\n")
        except OSError as error:
            return f"--report {self.options.report}: not written: {error.strerror}"
        return None


def _grid(path: str | None, scene: Scene) -> Grid | None:
    """The map of `--map`; None without it. Raises `UsageError` for a file that is no map, or none of this world."""
    if path is None:
        return None
    from robot.nodes.map_files import InvalidMap, read_map

    try:
        grid = read_map(path).grid()
    except OSError as error:
        raise UsageError(f"--map {path}: {error.filename or path}: {error.strerror}") from None
    except (InvalidMap, ImportError) as error:
        raise UsageError(f"--map: {error}") from None
    x, y = scene.start.x, scene.start.y
    if grid.cell(x, y) is None:
        raise UsageError(f"--map {path}: the start ({x:g}, {y:g}) of the world {scene.name!r} is not on it: {grid!r}")
    return grid


def _check_replay(tree: Supervisor, names: Sequence[str]) -> None:
    """Refuse to keep journals of what is not there. Raises `UsageError`."""
    from robot.run.tree_nodes import UnknownNode, check_journals

    try:
        check_journals(tree, names)
    except UnknownNode as error:
        raise UsageError(f"--replay: {error}") from None
