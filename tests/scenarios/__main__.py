"""``python -m tests.scenarios [ROW...] [--open]``: print rows with the tests that show them; exit code 1 if a row has none."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from tests.scenarios.rows import Row, read_rows


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the rows, the command that runs the tests of each, and how many there are."""
    parser = argparse.ArgumentParser(prog="python -m tests.scenarios", description=__doc__)
    parser.add_argument("row", nargs="*", help="such as N-30, or a family such as N; all by default")
    parser.add_argument("--open", action="store_true", help="only rows that nothing shows")
    options = parser.parse_args(arguments)
    rows = read_rows()
    chosen = [row for row in rows.values() if not options.row or row.id in options.row or _family(row) in options.row]
    if not chosen:
        parser.error(f"there is no row {', '.join(options.row)}")
    for row in chosen:
        if row.open or not options.open:
            print(f"{row.id:7} {row.text}\n        {_shown(row)}")
    missing = sum(row.open for row in chosen)
    systems = [row for row in chosen if _family(row) == "Y"]
    whole = sum(all(not rows[part].open for part in row.rows) and not row.open for row in systems)
    reasons = sum(bool(row.reason) for row in chosen)
    print(
        f"\n{len(chosen)} rows: {missing} open, {reasons} with a reason instead of a test; {whole} of {len(systems)} systems whole"
    )
    return 1 if missing else 0


def _family(row: Row) -> str:
    return row.id.partition("-")[0]


def _shown(row: Row) -> str:
    if row.open:
        return "OPEN"
    if row.tests:
        return "python -m pytest -m '' " + " ".join(row.tests)
    return f"no test: {row.reason}" if row.reason else f"by {', '.join(row.rows)}"


if __name__ == "__main__":
    sys.exit(main())
