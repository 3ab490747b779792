"""What every test of this repository shares: the plugin, also where the package is not installed, and one thread for BLAS."""

from __future__ import annotations

import os
from importlib.metadata import entry_points

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

if not any(entry.value == "actors.testing.plugin" for entry in entry_points(group="pytest11")):
    pytest_plugins = ["actors.testing.plugin"]
