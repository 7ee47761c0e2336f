"""A cell folder as data frames, arrays and outlines. Files are read when they are asked for, once."""

from __future__ import annotations

import json
import os
from functools import cached_property
from pathlib import Path
from typing import Any, Dict, List, Union

import numpy as np
import pandas as pd
from numpy.typing import NDArray

PathLike = Union[str, "os.PathLike[str]"]
Array = NDArray[np.float64]

#: Columns that are labels: whole numbers, some of them missing.
_LABELS = ("fibre_id", "adhesion_id", "start_adhesion_id", "end_adhesion_id", "frame", "point", "ring")


def read_table(source: Any) -> pd.DataFrame:
    """A table of mbtfm (file or open text): labels as whole numbers that may be missing, TRUE and FALSE as truth values."""
    table = pd.read_csv(source, float_precision="round_trip")
    labels = [column for column in table.columns if column in _LABELS]
    return table.astype({column: "Int64" for column in labels})


class Cell:
    """The results in a cell folder.

    A table whose file is not there raises FileNotFoundError, which names the file: the stage has not run.
    """

    def __init__(self, folder: PathLike) -> None:
        self.folder = Path(folder)
        if not self.folder.is_dir():
            raise FileNotFoundError(f"{self.folder}: there is no such folder")
        if not (self.folder / "cell.toml").is_file() and not (self.folder / "run.json").is_file():
            raise FileNotFoundError(f"{self.folder}: no cell folder: it has neither cell.toml nor run.json")

    def __repr__(self) -> str:
        return f"mbtfm.Cell({str(self.folder)!r})"

    @property
    def name(self) -> str:
        """The name of the folder."""
        return self.folder.resolve().name

    def table(self, file: str) -> pd.DataFrame:
        """Any table of the folder by its path: ``cell.table("4_fit/missing_adhesions.csv")``."""
        return read_table(self.folder / file)

    def _json(self, file: str) -> Dict[str, Any]:
        content = json.loads((self.folder / file).read_text(encoding="utf-8"))
        if not isinstance(content, dict):
            raise ValueError(f"{self.folder / file}: expected a JSON object")
        return content

    # --- the segmentation

    @cached_property
    def adhesions(self) -> pd.DataFrame:
        """A row for each adhesion: place, ellipse (full axes), intensity."""
        return self.table("1_segment/adhesions.csv")

    @cached_property
    def fibres(self) -> pd.DataFrame:
        """A row for each stress fibre: type, length, width, the adhesions at its ends."""
        return self.table("1_segment/fibres.csv")

    @cached_property
    def fibre_lines_um(self) -> Dict[int, Array]:
        """By fibre_id its line: an array (points, 2) of x, y."""
        points = self.table("1_segment/fibre_points.csv")
        return {
            int(label): group[["x_um", "y_um"]].to_numpy(dtype=float)
            for label, group in points.sort_values(["fibre_id", "point"], kind="stable").groupby("fibre_id")
        }

    @cached_property
    def outline_um(self) -> List[Array]:
        """The cell's outline, then its holes: arrays (corners, 2) of x, y, closed from the last corner to the first."""
        corners = self.table("1_segment/outline.csv")
        rings = corners["ring"] if "ring" in corners else pd.Series(0, index=corners.index)
        return [group[["x_um", "y_um"]].to_numpy(dtype=float) for _, group in corners.groupby(rings, sort=True)]

    # --- the beads

    @cached_property
    def displacement(self) -> pd.DataFrame:
        """A row for each bead: x_um, y_um at rest; ux_um, uy_um; sigma_um; flag (missing: a good bead)."""
        return self.table("2_track/displacement.csv")

    # --- the fit

    @cached_property
    def tensions(self) -> pd.DataFrame:
        """A row for the actin network (fibre_id 0) and for each fibre: tension, 95 % interval, whether it is identifiable."""
        return self.table("4_fit/tensions.csv")

    @cached_property
    def adhesion_forces(self) -> pd.DataFrame:
        """A row for each adhesion: the force on the gel, traction, standard error."""
        return self.table("4_fit/adhesion_forces.csv")

    @cached_property
    def fit(self) -> Dict[str, Any]:
        """fit.json: total force, noise, how well the model explains the beads, the error budget."""
        return self._json("4_fit/fit.json")

    # --- the run

    @cached_property
    def run_record(self) -> Dict[str, Any]:
        """run.json: version, parameters, hashes, times, effects, findings."""
        return self._json("run.json")

    @property
    def converged(self) -> bool:
        """Whether every stage of the last run came to an end."""
        return bool(self.run_record["converged"])

    @cached_property
    def findings(self) -> pd.DataFrame:
        """What the program noticed: a row for each finding, with its number, threshold and remedy."""
        return pd.DataFrame(self.run_record["findings"])

    @property
    def pixel_size_um(self) -> float:
        """Side of a pixel. ValueError if no run has recorded it, as in a cell without images."""
        for stage in ("segment", "track"):
            entry = self.run_record["stages"].get(stage, {})
            for figures in (entry.get("figures", {}), entry.get("parameters", {})):
                if figures.get("pixel_size_um"):
                    return float(figures["pixel_size_um"])
        raise ValueError(f"{self.folder}: no run has recorded the pixel size")

    @property
    def images(self) -> Dict[str, Path]:
        """The image files by their key in cell.toml: adhesion, actin, beads_stressed, beads_relaxed."""
        return {key: self.folder / file for key, file in self.run_record["images"].items()}

    # --- simulated cells

    @property
    def is_simulated(self) -> bool:
        """Whether the truth is known."""
        return (self.folder / "truth").is_dir()

    def truth(self, table: str = "tensions") -> pd.DataFrame:
        """A table of the truth of a simulated cell: tensions, adhesion_forces, adhesions, fibres, displacement, …"""
        return self.table(f"truth/{table}.csv")


def read(folder: PathLike) -> Cell:
    """The results in a cell folder.

    >>> read("CELL").tensions.query("type == 'ventral'").tension_nN.mean()  # doctest: +SKIP
    """
    return Cell(folder)
