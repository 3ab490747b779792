"""The services by which a recorder is controlled, as those of `ros2 bag record`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.contracts.contracts import Service
from actors.interfaces.rosbag2_interfaces import srv
from actors.time.values import nanoseconds_of

if TYPE_CHECKING:
    from actors.bag.recorder import Recorder

LATER = "this recorder {} at once: leave {} zero"
OVER = "recording has ended already"


def serve_recorder(recorder: Recorder) -> None:
    """Let the recorder answer its services from now on."""

    async def pause(_: Any) -> Any:
        recorder.pause()
        return srv.Pause.Response()

    async def resume(request: Any) -> Any:
        if nanoseconds_of(request.resume_time) > recorder.clock.wall_ns():
            failed = srv.Resume_Response.RETURN_CODE_RESUME_FAILED
            return srv.Resume.Response(return_code=failed, error_string=LATER.format("resumes", "resume_time"))
        recorder.unpause()
        return srv.Resume.Response()

    async def toggle(_: Any) -> Any:
        recorder.paused = not recorder.paused
        return srv.TogglePaused.Response()

    async def is_paused(_: Any) -> Any:
        return srv.IsPaused.Response(paused=recorder.paused)

    async def split(request: Any) -> Any:
        codes = srv.SplitBagfile_Response
        if recorder.over:
            return srv.SplitBagfile.Response(return_code=codes.RETURN_CODE_NOT_RECORDING, error_string=OVER)
        if nanoseconds_of(request.split_time) > recorder.clock.wall_ns():
            why = LATER.format("splits", "split_time")
            return srv.SplitBagfile.Response(return_code=codes.RETURN_CODE_SPLIT_FAILED, error_string=why)
        await recorder.split()
        return srv.SplitBagfile.Response()

    async def snapshot(_: Any) -> Any:
        return srv.Snapshot.Response(success=await recorder.snapshot())

    async def stop(_: Any) -> Any:
        if recorder.over:
            return srv.Stop.Response(return_code=1, error_string=OVER)
        await recorder.finish()
        return srv.Stop.Response()

    async def is_discovery_running(_: Any) -> Any:
        return srv.IsDiscoveryRunning.Response(running=recorder.discovery)

    async def start_discovery(_: Any) -> Any:
        if recorder.discovery:
            return srv.StartDiscovery.Response(return_code=1, error_string="discovery is running already")
        recorder.discovery = True
        return srv.StartDiscovery.Response()

    async def stop_discovery(_: Any) -> Any:
        if not recorder.discovery:
            return srv.StopDiscovery.Response(return_code=1, error_string="discovery is not running")
        recorder.discovery = False
        return srv.StopDiscovery.Response()

    recorder.serve(Service(srv.Pause, "~/pause"), pause)
    recorder.serve(Service(srv.Resume, "~/resume"), resume)
    recorder.serve(Service(srv.TogglePaused, "~/toggle_paused"), toggle)
    recorder.serve(Service(srv.IsPaused, "~/is_paused"), is_paused)
    recorder.serve(Service(srv.SplitBagfile, "~/split_bagfile"), split)
    recorder.serve(Service(srv.Snapshot, "~/snapshot"), snapshot)
    recorder.serve(Service(srv.Stop, "~/stop"), stop)
    recorder.serve(Service(srv.IsDiscoveryRunning, "~/is_discovery_running"), is_discovery_running)
    recorder.serve(Service(srv.StartDiscovery, "~/start_discovery"), start_discovery)
    recorder.serve(Service(srv.StopDiscovery, "~/stop_discovery"), stop_discovery)
