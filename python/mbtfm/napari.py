"""A cell folder in napari: the images, adhesions as ellipses, fibres as paths with type and tension, beads as vectors.

All layers are in µm. napari's axes are (row, column), which is (y, x) here. Fibres that were corrected by hand are saved as
``fibres.zip`` in the cell folder: the next `mbtfm run` uses them instead of its own.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np
import pandas as pd

from .cell import Array, Cell, read
from .rois import LINE_ORIGIN_PX, Roi, write_rois

Layer = Tuple[Any, Dict[str, Any], str]
ReaderFunction = Callable[[Union[str, Sequence[str]]], List[Layer]]

#: By type of fibre, as the report has them on images.
COLOURS = {"dorsal": "#56b4ff", "arc": "#ffb728", "ventral": "#00d68f", "edge": "#ff7a52", "unclassified": "#b8b8b8"}
_CHANNELS = {"adhesion": "green", "actin": "gray", "beads_stressed": "red", "beads_relaxed": "cyan"}


def reader(path: Union[str, Sequence[str]]) -> Optional[ReaderFunction]:
    """For a cell folder the function that reads it; None for anything else, which is other readers' business."""
    if not isinstance(path, str):
        return None
    folder = Path(path)
    return layers if folder.is_dir() and (folder / "cell.toml").is_file() else None


def layers(path: Union[str, Sequence[str]]) -> List[Layer]:
    """The layers of a cell folder, as far as its stages have run."""
    if not isinstance(path, str):
        raise ValueError("expected one cell folder")
    cell = read(path)
    found: List[Layer] = _images(cell)
    for part in (_displacement, _adhesions, _fibres):
        try:
            found.append(part(cell))
        except FileNotFoundError:
            continue  # that stage has not run yet
    return found


def _images(cell: Cell) -> List[Layer]:
    if not (cell.folder / "run.json").is_file():
        return []
    files = {key: file for key, file in cell.images.items() if key in _CHANNELS and file.is_file()}
    if not files:
        return []
    import tifffile  # napari brings it

    size = cell.pixel_size_um
    found: List[Layer] = []
    for key, file in files.items():
        image = tifffile.imread(file)
        settings: Dict[str, Any] = {"scale": (size, size), "translate": (size / 2, size / 2), "blending": "additive"}
        settings.update(name=key, colormap=_CHANNELS[key], visible="beads" not in key)
        if "beads" in key:
            settings["affine"] = _stage_motion(cell, key, size * np.array(image.shape[-2:]))
        found.append((image, settings, "image"))
    return found


def _stage_motion(cell: Cell, key: str, size_um: Array) -> Array:
    """From um (y, x, 1) in a bead picture to um in the cell's pictures: the stage moved between the two bead pictures, and one of
    them lies aside."""
    figures = cell.run_record["stages"].get("track", {}).get("figures", {})
    with_relaxed = figures.get("cell_with") == "relaxed"
    place = np.eye(3)
    if key != ("beads_stressed" if with_relaxed else "beads_relaxed"):
        return place
    angle = np.deg2rad(figures.get("stage_turn_deg", 0.0))  # about the middle, from +x towards +y
    place[:2, :2] = [[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]
    place[:2, 2] = size_um / 2 - place[:2, :2] @ (size_um / 2)
    place[:2, 2] += [figures.get("stage_shift_y_um", 0.0), figures.get("stage_shift_x_um", 0.0)]
    return np.linalg.inv(place) if with_relaxed else place


def _ellipse(row: Any) -> Array:
    """The corners of the rectangle around an ellipse, as napari draws one: (4, 2) of y, x."""
    angle = np.deg2rad(row.angle_deg)
    major = 0.5 * row.major_axis_um * np.array([np.sin(angle), np.cos(angle)])
    minor = 0.5 * row.minor_axis_um * np.array([np.cos(angle), -np.sin(angle)])
    centre = np.array([row.y_um, row.x_um])
    return np.array([centre - major - minor, centre + major - minor, centre + major + minor, centre - major + minor])


def _adhesions(cell: Cell) -> Layer:
    table = cell.adhesions
    try:
        forces = cell.adhesion_forces[["adhesion_id", "force_nN", "sigma_nN", "traction_kPa"]]
        table = table.merge(forces, on="adhesion_id", how="left")
    except FileNotFoundError:
        pass  # not fitted yet
    settings = {
        "name": "adhesions",
        "shape_type": "ellipse",
        "features": _plain(table),
        "edge_color": "white",
        "face_color": "transparent",
        "edge_width": 0.1,
    }
    return [_ellipse(row) for row in table.itertuples()], settings, "shapes"


def _fibres(cell: Cell) -> Layer:
    table = cell.fibres
    try:
        columns = ["fibre_id", "tension_nN", "low_nN", "high_nN", "identifiable"]
        table = table.merge(cell.tensions[columns], on="fibre_id", how="left")
    except FileNotFoundError:
        pass
    lines = cell.fibre_lines_um
    settings = {
        "name": "fibres",
        "shape_type": "path",
        "features": _plain(table),
        "edge_color": [COLOURS.get(kind, "white") for kind in table["type"]],
        "edge_width": [max(0.2, width / 2) for width in table["width_um"]],
        "face_color": "transparent",
        "text": {"string": "{tension_nN:.2f}" if "tension_nN" in table else "{fibre_id}", "color": "white", "size": 8},
        "metadata": {"mbtfm_cell": str(cell.folder.resolve())},
    }
    return [lines[int(label)][:, ::-1] for label in table["fibre_id"]], settings, "shapes"


def _displacement(cell: Cell) -> Layer:
    table = cell.displacement
    if "flag" in table:
        table = table[table["flag"].isna()]
    vectors = np.stack([table[["y_um", "x_um"]].to_numpy(dtype=float), table[["uy_um", "ux_um"]].to_numpy(dtype=float)], axis=1)
    length = np.hypot(vectors[:, 1, 0], vectors[:, 1, 1])
    settings = {
        "name": "displacement",
        "features": {"displacement_um": length},
        "length": 5.0,  # times as long as they are: a bead moves a fraction of a micrometre
        "edge_width": 0.2,
        "edge_color": "displacement_um",
        "visible": False,
    }
    return vectors, settings, "vectors"


def _plain(table: pd.DataFrame) -> pd.DataFrame:
    """Without missing whole numbers, which napari does not show: they become empty fractions."""
    return table.astype({c: float for c in table.columns if str(table[c].dtype) == "Int64" and table[c].isna().any()})


def write_fibres(path: str, data: Any, meta: Dict[str, Any]) -> List[str]:
    """Save a layer of lines as fibres.zip for mbtfm. The feature `type` (ventral, dorsal, arc, edge) fixes how an end is held;
    a line without it gets its type from where it ends. An `unclassified` one stays so, held where it ends.

    The pixel size is that of the cell folder that the file is written to, or that the layer was read from.
    """
    metadata = meta.get("metadata", {})
    size_um = _pixel_size_um(Path(path).parent, metadata.get("mbtfm_cell"))
    scale = np.asarray(meta.get("scale", (1.0, 1.0)), dtype=float)[-2:]
    translate = np.asarray(meta.get("translate", (0.0, 0.0)), dtype=float)[-2:]
    kinds = meta.get("shape_type", "path")
    kinds = [kinds] * len(data) if isinstance(kinds, str) else list(kinds)
    features = pd.DataFrame(meta.get("features", meta.get("properties", {})))
    rois = []
    for index, (shape, kind) in enumerate(zip(data, kinds)):
        if kind not in ("path", "line"):
            raise ValueError(f"shape {index + 1} is a {kind}: fibres are paths or lines")
        points_um = np.asarray(shape, dtype=float)[:, -2:] * scale + translate
        rois.append(Roi(_name_of(index + 1, features, index), points_um[:, ::-1] / size_um - LINE_ORIGIN_PX))
    if not rois:
        raise ValueError("the layer has no lines: nothing was written")
    write_rois(path, rois)
    return [path]


def _name_of(number: int, features: pd.DataFrame, index: int) -> str:
    kind = str(features["type"].iloc[index]) if "type" in features and index < len(features) else ""
    return f"{kind} {number}" if kind in COLOURS else f"fibre {number}"


def _pixel_size_um(*folders: Any) -> float:
    tried = []
    for folder in folders:
        if folder is None:
            continue
        try:
            return read(folder).pixel_size_um
        except (OSError, ValueError, KeyError) as error:
            tried.append(str(error))
    raise ValueError("the pixel size is not known: save the file in its cell folder, after a run (" + "; ".join(tried) + ")")
