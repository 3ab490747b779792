"""The services by which a recorder is controlled, as those of `ros2 bag record`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.contracts.contracts import Service
from actors.interfaces.rosbag2_interfaces import srv

if TYPE_CHECKING:
    from actors.bag.recording import Recorder

__all__ = ["serve_recorder"]


def serve_recorder(recorder: Recorder) -> None:
    """Let the recorder answer its services from now on."""

    async def pause(_: Any) -> Any:
        recorder.pause()
        return srv.Pause.Response()

    async def resume(_: Any) -> Any:
        recorder.unpause()
        return srv.Resume.Response()

    async def toggle(_: Any) -> Any:
        recorder.paused = not recorder.paused
        return srv.TogglePaused.Response()

    async def is_paused(_: Any) -> Any:
        return srv.IsPaused.Response(paused=recorder.paused)

    async def split(_: Any) -> Any:
        await recorder.split()
        return srv.SplitBagfile.Response()

    async def snapshot(_: Any) -> Any:
        return srv.Snapshot.Response(success=await recorder.snapshot())

    async def stop(_: Any) -> Any:
        await recorder.finish()
        return srv.Stop.Response()

    recorder.serve(Service(srv.Pause, "~/pause"), pause)
    recorder.serve(Service(srv.Resume, "~/resume"), resume)
    recorder.serve(Service(srv.TogglePaused, "~/toggle_paused"), toggle)
    recorder.serve(Service(srv.IsPaused, "~/is_paused"), is_paused)
    recorder.serve(Service(srv.SplitBagfile, "~/split_bagfile"), split)
    recorder.serve(Service(srv.Snapshot, "~/snapshot"), snapshot)
    recorder.serve(Service(srv.Stop, "~/stop"), stop)
