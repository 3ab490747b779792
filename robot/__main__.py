"""`python -m robot`: the same as `robactor`."""

from __future__ import annotations

from cli.entry import console

if __name__ == "__main__":
    console()
