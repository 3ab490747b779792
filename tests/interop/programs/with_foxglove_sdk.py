"""A server of the Foxglove SDK that plays nothing, but understands how it is to be played: ``python with_foxglove_sdk.py``.

Prints its port; then, for each request, the request as it was understood, as JSON. Each is answered with a state of its own.
"""

import json
import sys
import threading

import foxglove
from foxglove.websocket import Capability, PlaybackCommand, PlaybackState, PlaybackStatus, ServerListener

BEGIN, END = 1_700_000_000_000_000_001, 1_700_000_099_000_000_000
STATES = [
    PlaybackState(PlaybackStatus.Playing, BEGIN, 2.0, True, "ask"),
    PlaybackState(PlaybackStatus.Paused, END, 0.25, False, "x"),
    PlaybackState(PlaybackStatus.Ended, END, 1.0, False, "ä"),
]


class Listener(ServerListener):
    def on_playback_control_request(self, request):  # type: ignore[no-untyped-def]
        told = {
            "play": request.playback_command == PlaybackCommand.Play,
            "rate": request.playback_speed,
            "seek": request.seek_time,
            "id": request.request_id,
        }
        print(json.dumps(told), flush=True)
        return STATES.pop(0)


server = foxglove.start_server(
    name="theirs",
    port=0,
    capabilities=[Capability.PlaybackControl, Capability.Time],
    playback_time_range=(BEGIN, END),
    server_listener=Listener(),
)
print(json.dumps({"port": server.port}), flush=True)
threading.Thread(target=lambda: sys.stdin.read(), daemon=False).start()
