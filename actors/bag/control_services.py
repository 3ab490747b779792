"""The services by which a player and a recorder are controlled, as those of `ros2 bag play` and `ros2 bag record`."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import TYPE_CHECKING, Never

from actors.contracts.contracts import Service
from actors.interfaces.rosbag2_interfaces import srv
from actors.time.values import nanoseconds_of

if TYPE_CHECKING:
    from actors.bag.player import Player
    from actors.bag.recorder import Recorder
    from actors.interfaces.message import Message
    from actors.runtime.node import Node

LATER = "this recorder {} at once: leave {} zero"
OVER = "recording has ended already"


def _serve(node: Node, *handlers: Callable[[Never], Coroutine[object, None, Message]]) -> None:
    """Let each handler answer the service of its name: `is_paused` answers ``~/is_paused``, of the type `IsPaused`."""
    for handler in handlers:
        name = handler.__name__
        node.serve(Service(getattr(srv, name.title().replace("_", "")), f"~/{name}"), handler)


def serve_player(player: Player) -> None:
    """Let the player answer its services from now on."""

    async def pause(_: srv.Pause_Request) -> srv.Pause_Response:
        player.pause()
        return srv.Pause.Response()

    async def resume(request: srv.Resume_Request) -> srv.Resume_Response:
        if nanoseconds_of(request.resume_time):
            failed = srv.Resume_Response.RETURN_CODE_RESUME_FAILED
            return srv.Resume.Response(
                return_code=failed, error_string="a player resumes at once: leave resume_time zero"
            )
        player.unpause()
        return srv.Resume.Response()

    async def toggle_paused(_: srv.TogglePaused_Request) -> srv.TogglePaused_Response:
        if player.paused:
            player.unpause()
        else:
            player.pause()
        return srv.TogglePaused.Response()

    async def is_paused(_: srv.IsPaused_Request) -> srv.IsPaused_Response:
        return srv.IsPaused.Response(paused=player.paused)

    async def set_rate(request: srv.SetRate_Request) -> srv.SetRate_Response:
        valid = 0 < request.rate < float("inf")
        if valid:
            player.rate = request.rate
        return srv.SetRate.Response(success=valid)

    async def get_rate(_: srv.GetRate_Request) -> srv.GetRate_Response:
        return srv.GetRate.Response(rate=player.rate)

    async def play_next(_: srv.PlayNext_Request) -> srv.PlayNext_Response:
        return srv.PlayNext.Response(success=await player.play_next())

    async def burst(request: srv.Burst_Request) -> srv.Burst_Response:
        return srv.Burst.Response(actually_burst=await player.burst(request.num_messages))

    async def seek(request: srv.Seek_Request) -> srv.Seek_Response:
        return srv.Seek.Response(success=player.seek(nanoseconds_of(request.time)))

    async def stop(_: srv.Stop_Request) -> srv.Stop_Response:
        if player.over:
            return srv.Stop.Response(return_code=1, error_string="playing has ended already")
        player.finish()
        return srv.Stop.Response()

    _serve(player, pause, resume, toggle_paused, is_paused, set_rate, get_rate, play_next, burst, seek, stop)


def serve_recorder(recorder: Recorder) -> None:
    """Let the recorder answer its services from now on."""

    async def pause(_: srv.Pause_Request) -> srv.Pause_Response:
        recorder.pause()
        return srv.Pause.Response()

    async def resume(request: srv.Resume_Request) -> srv.Resume_Response:
        if nanoseconds_of(request.resume_time) > recorder.clock.wall_ns():
            failed = srv.Resume_Response.RETURN_CODE_RESUME_FAILED
            return srv.Resume.Response(return_code=failed, error_string=LATER.format("resumes", "resume_time"))
        recorder.unpause()
        return srv.Resume.Response()

    async def toggle_paused(_: srv.TogglePaused_Request) -> srv.TogglePaused_Response:
        recorder.paused = not recorder.paused
        return srv.TogglePaused.Response()

    async def is_paused(_: srv.IsPaused_Request) -> srv.IsPaused_Response:
        return srv.IsPaused.Response(paused=recorder.paused)

    async def split_bagfile(request: srv.SplitBagfile_Request) -> srv.SplitBagfile_Response:
        codes = srv.SplitBagfile_Response
        if recorder.over:
            return srv.SplitBagfile.Response(return_code=codes.RETURN_CODE_NOT_RECORDING, error_string=OVER)
        if nanoseconds_of(request.split_time) > recorder.clock.wall_ns():
            why = LATER.format("splits", "split_time")
            return srv.SplitBagfile.Response(return_code=codes.RETURN_CODE_SPLIT_FAILED, error_string=why)
        await recorder.split()
        return srv.SplitBagfile.Response()

    async def snapshot(_: srv.Snapshot_Request) -> srv.Snapshot_Response:
        return srv.Snapshot.Response(success=await recorder.snapshot())

    async def stop(_: srv.Stop_Request) -> srv.Stop_Response:
        if recorder.over:
            return srv.Stop.Response(return_code=1, error_string=OVER)
        await recorder.finish()
        return srv.Stop.Response()

    async def is_discovery_running(_: srv.IsDiscoveryRunning_Request) -> srv.IsDiscoveryRunning_Response:
        return srv.IsDiscoveryRunning.Response(running=recorder.discovery)

    async def start_discovery(_: srv.StartDiscovery_Request) -> srv.StartDiscovery_Response:
        if recorder.discovery:
            return srv.StartDiscovery.Response(return_code=1, error_string="discovery is running already")
        recorder.discovery = True
        return srv.StartDiscovery.Response()

    async def stop_discovery(_: srv.StopDiscovery_Request) -> srv.StopDiscovery_Response:
        if not recorder.discovery:
            return srv.StopDiscovery.Response(return_code=1, error_string="discovery is not running")
        recorder.discovery = False
        return srv.StopDiscovery.Response()

    _serve(
        recorder,
        pause,
        resume,
        toggle_paused,
        is_paused,
        split_bagfile,
        snapshot,
        stop,
        is_discovery_running,
        start_discovery,
        stop_discovery,
    )
