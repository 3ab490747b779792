"""Edge cases of ROS 2 that are met otherwise here, each by decision. An edge case that is not met and not named here is a failure."""

from __future__ import annotations

from typing import Final

DECISIONS: Final = {
    "expand_topic_name/045": "`~x` is refused as `~xy` is; upstream lets exactly this length through by an error of one",
    "lyrical_names/14": "`~x` is refused as `~xy` is; upstream lets exactly this length through by an error of one",
    "lyrical_names/115": "a NUL is an unallowed character; upstream cuts the name there, because it becomes a C string",
    "param_yaml/file-probe-top-level-scalar": "a parameter file of plain text is surely a mistake, so it is refused with what to write",
}
"""Why, by the id of the case."""
