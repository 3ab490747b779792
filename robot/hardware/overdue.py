"""Samples that waited for a reader that was held up: a few of them as one, so that the reader can catch up.

A reader that takes each of them by itself needs the more time the later it is. Where its share of the processor is only just enough, it then
stays behind, by as many samples as are kept (0.2 s): a robot that is controlled so late falls.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from robot.hardware.body import ImuSample, Sample

PATIENCE: Final = 0.01
"""Seconds for which a sample may wait: a reader that is later than that is behind. Two periods of 200 Hz, for a single turn that was late."""
SPAN: Final = 0.02
"""Seconds that one sample may stand for: it is the longest step that the gait controller takes."""


def taken_together(hz: float, waited: float) -> int:
    """How many samples, at so many a second, to take as one when the oldest has waited for so many seconds."""
    return max(1, int(SPAN * hz + 1e-6)) if waited > PATIENCE else 1


def merged(samples: Sequence[Sample]) -> Sample:
    """One for samples of consecutive instants, at least one: the newest, with what the IMU measured on average.

    The average times the time since the sample before is what the gyro and the accelerometer have gathered meanwhile: no turn is lost.
    """
    newest = samples[-1]
    if len(samples) == 1:
        return newest
    gyro = np.mean([sample.imu.gyro for sample in samples], axis=0)
    accel = np.mean([sample.imu.accel for sample in samples], axis=0)
    return Sample(newest.time, ImuSample(gyro, accel), newest.joints)
