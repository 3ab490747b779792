"""Launch tests, as `launch_testing` of ROS 2 has them: a launch file with tests that run beside it and after its end.

::

    for test in launch_tests(Path("talker_launch_test.py")):
        assert not test.run({"rate": "5"}).failures

The file defines ``generate_test_description()``, whose description contains a ``ReadyToTest`` action, and classes of `unittest`. Its imports
of `launch`, `launch_ros` and `launch_testing` lead to what is here.
"""

from __future__ import annotations

from actors.launch.testing.runs import LaunchTest, Outcome, launch_tests

__all__ = [
    "LaunchTest",
    "Outcome",
    "launch_tests",
]
