"""rosbag2_interfaces/srv. Generated from its definitions in share; do not edit."""

from typing import ClassVar, TypeAlias

from actors.interfaces.builtin_interfaces.msg import Duration, Time
from actors.interfaces.message import Message, ServiceType
from actors.interfaces.types import default, float64, int32, string, uint64

__all__ = [
    "Burst",
    "Burst_Request",
    "Burst_Response",
    "GetRate",
    "GetRate_Request",
    "GetRate_Response",
    "IsDiscoveryRunning",
    "IsDiscoveryRunning_Request",
    "IsDiscoveryRunning_Response",
    "IsPaused",
    "IsPaused_Request",
    "IsPaused_Response",
    "Pause",
    "Pause_Request",
    "Pause_Response",
    "Play",
    "PlayNext",
    "PlayNext_Request",
    "PlayNext_Response",
    "Play_Request",
    "Play_Response",
    "Record",
    "Record_Request",
    "Record_Response",
    "Resume",
    "Resume_Request",
    "Resume_Response",
    "Seek",
    "Seek_Request",
    "Seek_Response",
    "SetRate",
    "SetRate_Request",
    "SetRate_Response",
    "Snapshot",
    "Snapshot_Request",
    "Snapshot_Response",
    "SplitBagfile",
    "SplitBagfile_Request",
    "SplitBagfile_Response",
    "StartDiscovery",
    "StartDiscovery_Request",
    "StartDiscovery_Response",
    "Stop",
    "StopDiscovery",
    "StopDiscovery_Request",
    "StopDiscovery_Response",
    "Stop_Request",
    "Stop_Response",
    "TogglePaused",
    "TogglePaused_Request",
    "TogglePaused_Response",
]


class Burst_Request(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/Burst_Request"""

    num_messages: uint64 = 0
    """Number of messages to burst; zero to burst the whole bag"""


class Burst_Response(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/Burst_Response"""

    actually_burst: uint64 = 0
    """Number of messages actually burst"""


class Burst(ServiceType[Burst_Request, Burst_Response]):
    """rosbag2_interfaces/srv/Burst"""

    Request: TypeAlias = Burst_Request
    Response: TypeAlias = Burst_Response


class GetRate_Request(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/GetRate_Request"""


class GetRate_Response(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/GetRate_Response"""

    rate: float64 = 0.0


class GetRate(ServiceType[GetRate_Request, GetRate_Response]):
    """rosbag2_interfaces/srv/GetRate"""

    Request: TypeAlias = GetRate_Request
    Response: TypeAlias = GetRate_Response


class IsDiscoveryRunning_Request(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/IsDiscoveryRunning_Request"""


class IsDiscoveryRunning_Response(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/IsDiscoveryRunning_Response

    True if discovery is running, false otherwise
    """

    running: bool = False


class IsDiscoveryRunning(ServiceType[IsDiscoveryRunning_Request, IsDiscoveryRunning_Response]):
    """rosbag2_interfaces/srv/IsDiscoveryRunning"""

    Request: TypeAlias = IsDiscoveryRunning_Request
    Response: TypeAlias = IsDiscoveryRunning_Response


class IsPaused_Request(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/IsPaused_Request"""


class IsPaused_Response(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/IsPaused_Response"""

    paused: bool = False


class IsPaused(ServiceType[IsPaused_Request, IsPaused_Response]):
    """rosbag2_interfaces/srv/IsPaused"""

    Request: TypeAlias = IsPaused_Request
    Response: TypeAlias = IsPaused_Response


class Pause_Request(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/Pause_Request"""


class Pause_Response(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/Pause_Response"""


class Pause(ServiceType[Pause_Request, Pause_Response]):
    """rosbag2_interfaces/srv/Pause"""

    Request: TypeAlias = Pause_Request
    Response: TypeAlias = Pause_Response


class Play_Request(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/Play_Request

    See rosbag2_transport::PlayOptions::start_offset
    """

    start_offset: Time = default()
    playback_duration: Duration = default()
    """See rosbag2_transport::PlayOptions::playback_duration"""
    playback_until_timestamp: Time = default()
    """See rosbag2_transport::PlayOptions::playback_until_timestamp"""


class Play_Response(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/Play_Response

    returns false when another playback execution is running, otherwise true
    """

    success: bool = False


class Play(ServiceType[Play_Request, Play_Response]):
    """rosbag2_interfaces/srv/Play"""

    Request: TypeAlias = Play_Request
    Response: TypeAlias = Play_Response


class PlayNext_Request(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/PlayNext_Request"""


class PlayNext_Response(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/PlayNext_Response"""

    success: bool = False
    """can only play-next while playback is paused"""


class PlayNext(ServiceType[PlayNext_Request, PlayNext_Response]):
    """rosbag2_interfaces/srv/PlayNext"""

    Request: TypeAlias = PlayNext_Request
    Response: TypeAlias = PlayNext_Response


class Record_Request(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/Record_Request

    if provided, it will override the storage_options.uri provided during construction.
    Empty by default.
    """

    uri: string = ""


class Record_Response(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/Record_Response

    Return code. Returns 1 when recording is already running or in case of error, otherwise 0.
    """

    return_code: int32 = 0
    error_string: string = ""
    """Error string. Empty if no error occurred."""


class Record(ServiceType[Record_Request, Record_Response]):
    """rosbag2_interfaces/srv/Record"""

    Request: TypeAlias = Record_Request
    Response: TypeAlias = Record_Response


class Resume_Request(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/Resume_Request

    Resume mode to interpret resume_time:
    0 = node_time, 1 = publish_time, 2 = receive_time.
    """

    RESUME_MODE_NODE_TIME: ClassVar[int32] = 0
    RESUME_MODE_PUBLISH_TIME: ClassVar[int32] = 1
    RESUME_MODE_RECEIVE_TIME: ClassVar[int32] = 2

    resume_time: Time = default()
    """Timestamp in the future when to resume recording/playback. If empty or time in the past, resumes recording/playback immediately. Note: The resume_time is not supported by player and shall be set to zero when using Resume with player."""
    resume_mode: int32 = 0
    """Resume mode to use for the resume_time request."""
    tracking_topic_name: string = ""
    """Topic name to use for timestamp-based resume evaluation. If empty, evaluate using messages from all topics."""


class Resume_Response(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/Resume_Response

    Return codes for Resume response.
    """

    RETURN_CODE_SUCCESS: ClassVar[int32] = 0
    RETURN_CODE_INVALID_RESUME_MODE: ClassVar[int32] = 1
    RETURN_CODE_INVALID_TRACKING_TOPIC: ClassVar[int32] = 2
    RETURN_CODE_RESUME_FAILED: ClassVar[int32] = 3

    return_code: int32 = 0
    """Return code. Use RETURN_CODE_SUCCESS on success; otherwise use one of the error codes."""
    error_string: string = ""
    """Error string. Empty if no error occurred."""


class Resume(ServiceType[Resume_Request, Resume_Response]):
    """rosbag2_interfaces/srv/Resume"""

    Request: TypeAlias = Resume_Request
    Response: TypeAlias = Resume_Response


class Seek_Request(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/Seek_Request"""

    time: Time = default()


class Seek_Response(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/Seek_Response"""

    success: bool = False
    """return true if valid time in bag duration, and successful seek"""


class Seek(ServiceType[Seek_Request, Seek_Response]):
    """rosbag2_interfaces/srv/Seek"""

    Request: TypeAlias = Seek_Request
    Response: TypeAlias = Seek_Response


class SetRate_Request(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/SetRate_Request"""

    rate: float64 = 0.0


class SetRate_Response(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/SetRate_Response"""

    success: bool = False
    """true if valid rate (> 0) was set"""


class SetRate(ServiceType[SetRate_Request, SetRate_Response]):
    """rosbag2_interfaces/srv/SetRate"""

    Request: TypeAlias = SetRate_Request
    Response: TypeAlias = SetRate_Response


class Snapshot_Request(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/Snapshot_Request"""


class Snapshot_Response(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/Snapshot_Response"""

    success: bool = False


class Snapshot(ServiceType[Snapshot_Request, Snapshot_Response]):
    """rosbag2_interfaces/srv/Snapshot"""

    Request: TypeAlias = Snapshot_Request
    Response: TypeAlias = Snapshot_Response


class SplitBagfile_Request(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/SplitBagfile_Request

    Split mode to interpret split_time:
    0 = node_time, 1 = publish_time, 2 = receive_time.
    """

    SPLIT_MODE_NODE_TIME: ClassVar[int32] = 0
    SPLIT_MODE_PUBLISH_TIME: ClassVar[int32] = 1
    SPLIT_MODE_RECEIVE_TIME: ClassVar[int32] = 2

    split_time: Time = default()
    """Timestamp in the future when to split bag file. If empty or time in the past, split bag file immediately."""
    split_mode: int32 = 0
    """Split mode to use for the split_time request."""
    tracking_topic_name: string = ""
    """Topic name to use for timestamp-based split evaluation. If empty, evaluate using messages from all topics."""


class SplitBagfile_Response(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/SplitBagfile_Response

    Return codes for SplitBagfile response.
    """

    RETURN_CODE_SUCCESS: ClassVar[int32] = 0
    RETURN_CODE_NOT_RECORDING: ClassVar[int32] = 1
    RETURN_CODE_INVALID_SPLIT_MODE: ClassVar[int32] = 2
    RETURN_CODE_INVALID_TRACKING_TOPIC: ClassVar[int32] = 3
    RETURN_CODE_SPLIT_FAILED: ClassVar[int32] = 4

    return_code: int32 = 0
    """Return code. Use RETURN_CODE_SUCCESS on success; otherwise use one of the error codes."""
    error_string: string = ""
    """Error string. Empty if no error occurred."""


class SplitBagfile(ServiceType[SplitBagfile_Request, SplitBagfile_Response]):
    """rosbag2_interfaces/srv/SplitBagfile"""

    Request: TypeAlias = SplitBagfile_Request
    Response: TypeAlias = SplitBagfile_Response


class StartDiscovery_Request(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/StartDiscovery_Request"""


class StartDiscovery_Response(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/StartDiscovery_Response

    Return code. Returns 1 when discovery is already running or in case of error, otherwise 0.
    """

    return_code: int32 = 0
    error_string: string = ""
    """Error string. Empty if no error occurred."""


class StartDiscovery(ServiceType[StartDiscovery_Request, StartDiscovery_Response]):
    """rosbag2_interfaces/srv/StartDiscovery"""

    Request: TypeAlias = StartDiscovery_Request
    Response: TypeAlias = StartDiscovery_Response


class Stop_Request(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/Stop_Request"""


class Stop_Response(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/Stop_Response

    Return code. Returns 1 when recording or playback is already stopped or in case of error, otherwise 0.
    """

    return_code: int32 = 0
    error_string: string = ""
    """Error string. Empty if no error occurred."""


class Stop(ServiceType[Stop_Request, Stop_Response]):
    """rosbag2_interfaces/srv/Stop"""

    Request: TypeAlias = Stop_Request
    Response: TypeAlias = Stop_Response


class StopDiscovery_Request(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/StopDiscovery_Request"""


class StopDiscovery_Response(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/StopDiscovery_Response

    Return code. Returns 1 when discovery is not running, otherwise 0.
    """

    return_code: int32 = 0
    error_string: string = ""
    """Error string. Empty if no error occurred."""


class StopDiscovery(ServiceType[StopDiscovery_Request, StopDiscovery_Response]):
    """rosbag2_interfaces/srv/StopDiscovery"""

    Request: TypeAlias = StopDiscovery_Request
    Response: TypeAlias = StopDiscovery_Response


class TogglePaused_Request(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/TogglePaused_Request"""


class TogglePaused_Response(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/srv/TogglePaused_Response"""


class TogglePaused(ServiceType[TogglePaused_Request, TogglePaused_Response]):
    """rosbag2_interfaces/srv/TogglePaused"""

    Request: TypeAlias = TogglePaused_Request
    Response: TypeAlias = TogglePaused_Response
