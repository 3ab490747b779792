"""The services by which a player is controlled, as those of `ros2 bag play`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.contracts.contracts import Service
from actors.interfaces.rosbag2_interfaces import srv
from actors.time.values import nanoseconds_of

if TYPE_CHECKING:
    from actors.bag.player import Player


def serve_player(player: Player) -> None:
    """Let the player answer its services from now on."""

    async def pause(_: Any) -> Any:
        player.pause()
        return srv.Pause.Response()

    async def resume(request: Any) -> Any:
        if nanoseconds_of(request.resume_time):
            failed = srv.Resume_Response.RETURN_CODE_RESUME_FAILED
            return srv.Resume.Response(
                return_code=failed, error_string="a player resumes at once: leave resume_time zero"
            )
        player.unpause()
        return srv.Resume.Response()

    async def toggle(_: Any) -> Any:
        if player.paused:
            player.unpause()
        else:
            player.pause()
        return srv.TogglePaused.Response()

    async def is_paused(_: Any) -> Any:
        return srv.IsPaused.Response(paused=player.paused)

    async def set_rate(request: Any) -> Any:
        valid = 0 < request.rate < float("inf")
        if valid:
            player.rate = request.rate
        return srv.SetRate.Response(success=valid)

    async def get_rate(_: Any) -> Any:
        return srv.GetRate.Response(rate=player.rate)

    async def play_next(_: Any) -> Any:
        return srv.PlayNext.Response(success=await player.play_next())

    async def burst(request: Any) -> Any:
        return srv.Burst.Response(actually_burst=await player.burst(request.num_messages))

    async def seek(request: Any) -> Any:
        return srv.Seek.Response(success=player.seek(nanoseconds_of(request.time)))

    async def stop(_: Any) -> Any:
        if player.over:
            return srv.Stop.Response(return_code=1, error_string="playing has ended already")
        player.finish()
        return srv.Stop.Response()

    player.serve(Service(srv.Pause, "~/pause"), pause)
    player.serve(Service(srv.Resume, "~/resume"), resume)
    player.serve(Service(srv.TogglePaused, "~/toggle_paused"), toggle)
    player.serve(Service(srv.IsPaused, "~/is_paused"), is_paused)
    player.serve(Service(srv.SetRate, "~/set_rate"), set_rate)
    player.serve(Service(srv.GetRate, "~/get_rate"), get_rate)
    player.serve(Service(srv.PlayNext, "~/play_next"), play_next)
    player.serve(Service(srv.Burst, "~/burst"), burst)
    player.serve(Service(srv.Seek, "~/seek"), seek)
    player.serve(Service(srv.Stop, "~/stop"), stop)
