"""The table of a study of many recordings, for the terminal and as JSON."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from dearig.batch.studies import StudyTable
from dearig.recording.content.fields import CONDITIONS
from dearig.report.text.numbers import NO_VALUE, interval, quoted, significant
from dearig.report.text.tables import Row, Table

__all__ = ["study_table_json", "study_table_rows", "study_table_texts"]

#: Columns that a terminal shows, where the rows have them.
_COLUMNS = (
    "film",
    "verdict",
    "effects",
    "mu_0_kPa",
    "rms_um",
    "rms_kPa",
    "rejected",
    *CONDITIONS,
)


def study_table_json(table: StudyTable) -> dict[str, Any]:
    """Return the table for ``--json``; files that are not kept are None."""
    files = {"table": table.table, "parquet": table.parquet}
    return {
        "format": "dearig-study-table/1",
        "do": table.options.do,
        "recordings": len(table.rows),
        "ok": len(table.rows) - len(table.failed),
        "failed": len(table.failed),
        "cached": table.cached,
        "moved": table.moved or None,
        **{k: str(p) if p is not None and p.exists() else None for k, p in files.items()},
        "rows": list(table.rows),
    }


def study_table_texts(table: StudyTable) -> Iterator[str]:
    """Yield what was computed, and what could not be."""
    count = len(table.rows)
    failed = f", {len(table.failed)} without a result" if table.failed else ""
    cached = f", {table.cached} of them known from before" if table.cached else ""
    yield f"{count} recording{'s' if count > 1 else ''}{cached}{failed}."
    if table.moved:
        yield f"{table.moved[0].upper()}{table.moved[1:]}."


def study_table_rows(table: StudyTable, most: int) -> Table:
    """Return the first rows of the table with its most telling columns."""
    shown = [n for n in _COLUMNS if any(row.get(n) not in (None, "") for row in table.rows)]
    rows = [
        Row(
            (row["recording"], row["state"], *(_shown(row, name) for name in shown)),
            # the reason may begin with the name, which is printed before it
            detail=row["reason"].removeprefix(f"{row['recording']}: "),
            mark=row["state"] != "ok",
        )
        for row in table.rows[:most]
    ]
    left = len(table.rows) - len(rows)
    note = f"{left} more recordings are in the table." if left > 0 else ""
    head = (("", ""), ("State", ""), *((name, "") for name in shown))
    return Table("Recordings", head, tuple(rows), note)


def _shown(row: Mapping[str, Any], name: str) -> str:
    """Return a value with its 95 % interval, where it has one."""
    value = row.get(name)
    if value is None or value == "":
        return NO_VALUE
    if isinstance(value, bool):
        return "yes" if value else "no"
    if not isinstance(value, float):
        return str(value)
    low, high = row.get(f"{name}_low95"), row.get(f"{name}_high95")
    if low is None or high is None:
        return significant(value, 5)
    return f"{quoted(value, low, high)} [{interval(low, high)}]"
