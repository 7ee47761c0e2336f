"""Model-based traction force microscopy in Python: results as data frames, and the programs with progress.

    import mbtfm
    cell = mbtfm.read("CELL")              # a folder that `mbtfm run` has been through
    cell.tensions                          # a data frame: fibre_id, type, tension_nN, low_nN, high_nN, …
    frame = mbtfm.study("STUDY")           # all cells below a folder as one tidy frame
    mbtfm.simulate("trial", seed=7)        # a simulated cell; then
    cell = mbtfm.run("trial", preset="fast")

Units are in the names: µm, nN, kPa. x points right and y down, as in the image; the origin is its upper left corner.
"""

from .cell import Cell, read
from .commands import Event, ProgramFailed, programs, run, simulate
from .rois import Roi, read_rois, write_rois
from .study import cells_below, study

__version__ = "0.2.0"
__all__ = [
    "Cell",
    "Event",
    "ProgramFailed",
    "Roi",
    "cells_below",
    "programs",
    "read",
    "read_rois",
    "run",
    "simulate",
    "study",
    "write_rois",
]
