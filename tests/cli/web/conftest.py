"""The tests in a browser are collected only where playwright is (`pip install --group browser`); no default run takes part in them."""

from __future__ import annotations

import re
from importlib.util import find_spec
from pathlib import Path

collect_ignore = (
    []
    if find_spec("playwright")
    else [
        path.name
        for path in Path(__file__).parent.glob("test_*.py")
        if re.search("browsing|page_time import", path.read_text())
    ]
)
