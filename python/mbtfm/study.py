"""All cells below a folder as one tidy frame."""

from __future__ import annotations

import csv
import io
import json
import os
import re
import subprocess
from pathlib import Path
from typing import Any, Dict, Iterable, Iterator, List, Mapping, Optional, Tuple

import pandas as pd

from .cell import PathLike, read_table
from .commands import ProgramFailed, Value, flags_of, programs

#: Tables that `study` knows by a short name.
TABLES = {
    "tensions": "4_fit/tensions.csv",
    "adhesion_forces": "4_fit/adhesion_forces.csv",
    "adhesions": "1_segment/adhesions.csv",
    "fibres": "1_segment/fibres.csv",
    "displacement": "2_track/displacement.csv",
}


def cells_below(folder: PathLike) -> List[Path]:
    """The cell folders at or below a folder, sorted: those that `mbtfm batch` would run."""
    return sorted(_walk(Path(folder)), key=lambda cell: [_by_numbers(part) for part in cell.parts])


def _by_numbers(name: str) -> List[Tuple[int, str]]:
    """Numbers in names count as numbers: t2 is before t10."""
    parts = re.split("([0-9]+)", name)
    return [(int(part), "") if k % 2 else (-1, part) for k, part in enumerate(parts)]


def _walk(folder: Path) -> Iterator[Path]:
    with os.scandir(folder) as entries:
        names = list(entries)
    if any(entry.name == "cell.toml" for entry in names):
        yield folder
        return
    for entry in names:
        if entry.is_dir(follow_symlinks=False) and not entry.name.startswith("."):
            yield from _walk(Path(entry.path))


def _listing(root: Path, parameters: Mapping[str, Value]) -> Dict[str, Tuple[str, List[int]]]:
    """By cell, in their order, why it does not enter statistics (empty: it does), and the fibres that do not. As `mbtfm stats` says.

    Without the program, what `mbtfm stats` has last written counts (statistics/cells.csv).
    """
    written = root / "statistics/cells.csv"
    try:
        program = programs("mbtfm-stats")
    except FileNotFoundError:
        if parameters or not written.is_file():
            raise
        text = written.read_text(encoding="utf-8")
    else:
        command = [program, "--cells", os.fspath(root), "--out", os.fspath(written.parent), "--list", "--quiet"]
        done = subprocess.run(command + flags_of(parameters), capture_output=True, encoding="utf-8", errors="replace")
        if done.returncode != 0:
            raise ProgramFailed("mbtfm-stats", done.returncode, done.stderr.strip())
        text = done.stdout
    return {
        row["cell"]: (row["reason"], [int(fibre) for fibre in (row.get("fibres_left_out") or "").split(";") if fibre])
        for row in csv.DictReader(io.StringIO(text, newline=""))
    }


def study(
    folder: PathLike,
    table: str = "tensions",
    conditions: Optional[PathLike] = None,
    with_left_out: bool = False,
    **parameters: Value,
) -> pd.DataFrame:
    """One table of all cells below a folder, with the cell's path (relative to the folder) in the column `cell`.

    table:       ``tensions`` (a row for each fibre and network), ``adhesion_forces``, ``adhesions``, ``fibres``,
                 ``displacement``; ``cells`` (a row for each cell: the numbers of fit.json); or a path in the cell folder.
    conditions:  a CSV file with a column `cell` and others, such as `condition` and `replicate`, which are joined; or
                 ``folder`` (the first folder below this one), ``folder2`` (the one below that): the column `condition`.

    Cells that `mbtfm stats` leaves out are left out here, too; ``frame.attrs["left_out"]`` has their paths and reasons.
    So are the fibres that the study's review.csv leaves out.
    with_left_out:  keep their rows, as far as they have any, with `included` false and the `reason`.
    parameters:     of `mbtfm stats`, for other rules: ``study("study", with_not_converged=True)``.
    """
    root = Path(folder)
    if not cells_below(root):
        raise FileNotFoundError(f"{root}: no folder with a cell.toml is in it or below it")
    level = re.fullmatch("folder([1-9]?)", os.fspath(conditions)) if conditions is not None else None
    if conditions is not None and not level:
        parameters = {"table": os.fspath(conditions), **parameters}
    listing = _listing(root, parameters)
    reasons = {name: reason for name, (reason, _) in listing.items()}
    cells = [root / name if (root / name).is_dir() else root for name in reasons]
    frame = _summaries(root, cells) if table == "cells" else _rows(root, cells, TABLES.get(table, table))
    if frame is None:
        raise FileNotFoundError(f"{root}: none of its {len(cells)} cells has {TABLES.get(table, table)}: run mbtfm batch")
    if "fibre_id" in frame:
        reviewed = {(name, fibre) for name, (_, fibres) in listing.items() for fibre in fibres}
        frame = frame[[key not in reviewed for key in zip(frame["cell"], frame["fibre_id"])]]
    if conditions is not None:
        frame = _by_folder(frame, int(level[1] or 1)) if level else _joined(frame, conditions)
    for name in set(reasons).difference(frame["cell"]):  # a table that the statistics do not need
        reasons[name] = reasons[name] or f"{TABLES.get(table, table)} is not there"
    frame["reason"] = frame["cell"].map(reasons)
    frame.insert(len(frame.columns) - 1, "included", frame["reason"] == "")
    if not with_left_out:
        frame = frame[frame["included"]].reset_index(drop=True)
    frame.attrs["left_out"] = {name: reason for name, reason in reasons.items() if reason}
    return frame


def _name(root: Path, cell: Path) -> str:
    return cell.relative_to(root).as_posix() if cell != root else root.resolve().name


def _fit(cell: Path) -> Dict[str, Any]:
    try:
        content = json.loads((cell / "4_fit/fit.json").read_bytes())
    except FileNotFoundError:
        return {}
    return content if isinstance(content, dict) else {}


def _rows(root: Path, cells: Iterable[Path], file: str) -> Optional[pd.DataFrame]:
    """The tables are put together as text, by their first lines, and parsed at once: a study has thousands of small files."""
    texts: Dict[str, List[str]] = {}
    names: Dict[str, List[str]] = {}
    converged: Dict[str, List[bool]] = {}
    for cell in cells:
        try:
            head, _, rows = (cell / file).read_text(encoding="utf-8").partition("\n")
        except FileNotFoundError:
            continue
        if rows and not rows.endswith("\n"):
            rows += "\n"
        is_converged = bool(_fit(cell).get("converged", True)) if file.startswith("4_fit/") else True
        # a line break within quotes is no row: count as the parser does
        n_rows = rows.count("\n") if '"' not in rows else len(pd.read_csv(io.StringIO(f"{head}\n{rows}")))
        texts.setdefault(head, []).append(rows)
        names.setdefault(head, []).extend([_name(root, cell)] * n_rows)
        converged.setdefault(head, []).extend([is_converged] * n_rows)
    frames = []
    for head, parts in texts.items():
        frame = read_table(io.StringIO(head + "\n" + "".join(parts)))
        frame.insert(0, "cell", names[head])
        if file.startswith("4_fit/"):
            frame["converged"] = converged[head]
        frames.append(frame)
    if not frames:
        return None
    whole = pd.concat(frames, ignore_index=True) if len(frames) > 1 else frames[0]
    order = {_name(root, cell): k for k, cell in enumerate(cells)}
    return whole.sort_values("cell", key=lambda names: names.map(order), kind="stable", ignore_index=True)


def _summaries(root: Path, cells: Iterable[Path]) -> Optional[pd.DataFrame]:
    rows = []
    for cell in cells:
        fit = _fit(cell)
        if not fit:
            continue
        numbers = {key: value for key, value in fit.items() if not isinstance(value, (dict, list))}
        rows.append({"cell": _name(root, cell), **numbers})
    return pd.DataFrame(rows) if rows else None


def _by_folder(frame: pd.DataFrame, level: int) -> pd.DataFrame:
    parts = frame["cell"].str.split("/")
    lone = frame["cell"][parts.str.len() <= level]
    if len(lone):
        raise ValueError(f"{lone.iloc[0]}: expected a folder of its condition above the cell, at level {level}")
    return frame.assign(condition=parts.str[level - 1])


def _conditions(file: PathLike) -> pd.DataFrame:
    """The table as people write it: commas, semicolons or tabs, blanks around names, rows without content, UTF-16."""
    content = Path(file).read_bytes()
    encoding = "utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        text = content.decode(encoding)
    except UnicodeDecodeError:
        text = content.decode("latin-1")
    lines = [line for line in text.splitlines() if line.strip(" \t,;\"") and not line.lower().startswith("sep=")]
    separator = max(",;\t", key=(lines or [""])[0].count)
    table = pd.read_csv(io.StringIO("\n".join(lines)), sep=separator, skipinitialspace=True, dtype={"cell": str})
    table.columns = [str(name).strip() for name in table.columns]
    for column in table.columns[table.dtypes == object]:
        table[column] = table[column].str.strip()
    return table.loc[:, [not name.startswith("Unnamed: ") for name in table.columns]]


def _joined(frame: pd.DataFrame, conditions: PathLike) -> pd.DataFrame:
    table = _conditions(conditions)
    if "cell" not in table:
        raise ValueError(f"{conditions}: expected a column 'cell', found {', '.join(map(str, table.columns))}")
    if table["cell"].duplicated().any():
        twice = table["cell"][table["cell"].duplicated()].iloc[0]
        raise ValueError(f"{conditions}: cell {twice} has several rows")
    table["cell"] = table["cell"].str.rstrip("/")
    missing = sorted(set(frame["cell"]) - set(table["cell"]))
    if missing:
        raise ValueError(f"{conditions}: no row for {missing[0]}" + (f" and {len(missing) - 1} others" if missing[1:] else ""))
    frame = frame.merge(table, on="cell", how="left", validate="many_to_one")
    for column in {"condition", "replicate", "day"} & set(frame.columns[frame.dtypes == object]):
        first = frame[column].groupby(frame[column].str.lower()).first()  # as `mbtfm stats`: capitals alone make no condition
        frame[column] = frame[column].str.lower().map(first)
    return frame
