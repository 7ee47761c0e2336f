"""ImageJ selections (RoiSet.zip): lines drawn by hand, as mbtfm reads and writes them.

Coordinates are pixels. ImageJ counts those of areas from the upper left corner of the image, those of lines from the centre of its
first pixel (LINE_ORIGIN_PX from that corner).
Source of the format: ij.io.RoiDecoder and RoiEncoder of ImageJ 1.53.
"""

from __future__ import annotations

import struct
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import List, Sequence

import numpy as np

from .cell import Array, PathLike

_POLYGON, _POLYLINE = 0, 5
_VERSION, _SUB_PIXEL = 228, 128
_HEADER, _HEADER2 = 64, 64


LINE_ORIGIN_PX = 0.5


@dataclass(frozen=True)
class Roi:
    """A polygon or a line of straight pieces. name: as "ventral 3", which fixes a fibre's type."""

    name: str
    points_px: Array  #: (points, 2) of x, y
    is_closed: bool = False
    stroke_width_px: float = 0.0


def encode(roi: Roi) -> bytes:
    """As ImageJ saves it."""
    points = np.asarray(roi.points_px, dtype=float)
    if points.ndim != 2 or points.shape[1] != 2 or not 2 <= len(points) < 65536:
        raise ValueError(f"{roi.name}: expected 2 to 65535 points of x and y, found an array {points.shape}")
    if not np.isfinite(points).all():
        raise ValueError(f"{roi.name}: expected finite coordinates")
    low, high = np.floor(points.min(axis=0)).astype(int), np.floor(points.max(axis=0)).astype(int) + 1
    if low.min() < -32768 or high.max() > 32767:
        raise ValueError(f"{roi.name}: expected coordinates between -32768 and 32767 pixels")
    header = bytearray(_HEADER)
    header[:4] = b"Iout"
    struct.pack_into(">h", header, 4, _VERSION)
    header[6] = _POLYGON if roi.is_closed else _POLYLINE
    struct.pack_into(">4hH", header, 8, low[1], low[0], high[1], high[0], len(points))
    struct.pack_into(">h", header, 34, round(roi.stroke_width_px))
    struct.pack_into(">h", header, 50, _SUB_PIXEL)
    whole = np.floor(points).astype(int) - low
    coordinates = bytes(whole.T.astype(">u2").tobytes() + points.T.astype(">f4").tobytes())
    struct.pack_into(">i", header, 60, _HEADER + len(coordinates))
    name = roi.name.encode("utf-16-be")
    header2 = bytearray(_HEADER2)
    struct.pack_into(">2i", header2, 16, _HEADER + len(coordinates) + _HEADER2, len(name) // 2)
    struct.pack_into(">f", header2, 36, roi.stroke_width_px)
    return bytes(header) + coordinates + bytes(header2) + name


def decode(data: bytes, where: str = "ROI") -> Roi:
    """A polygon or a line; other shapes are ValueErrors."""
    if data[:4] != b"Iout":
        raise ValueError(f"{where}: expected an ImageJ ROI")
    try:
        shape = data[6]
        top, left, _, _, n = struct.unpack_from(">4hH", data, 8)
        has_fractions = struct.unpack_from(">h", data, 50)[0] & _SUB_PIXEL
        kind, at_points = (">f4", _HEADER + 4 * n) if has_fractions else (">u2", _HEADER)
        points = np.frombuffer(data, kind, 2 * n, at_points).astype(float).reshape(2, n).T.copy()
        (header2,) = struct.unpack_from(">i", data, 60)
        at, length = struct.unpack_from(">2i", data, header2 + 16)
        (width,) = struct.unpack_from(">f", data, header2 + 36)
        name = data[at : at + 2 * length].decode("utf-16-be")
        if len(name.encode("utf-16-be")) != 2 * length:
            raise ValueError("its name is cut")
    except (struct.error, IndexError, ValueError) as error:
        raise ValueError(f"{where}: the file is truncated or damaged: {error}") from error
    if shape not in (_POLYGON, _POLYLINE):
        raise ValueError(f"{where}: expected a polygon or a line of straight pieces, found the ImageJ shape {shape}")
    if not has_fractions:
        points += [left, top]
    return Roi(name, points, shape == _POLYGON, float(width))


def write_rois(file: PathLike, rois: Sequence[Roi]) -> None:
    """A set of selections, as the ROI Manager of ImageJ saves it. Written whole or not at all."""
    path = Path(file)
    part = path.with_name(f".{path.name}.part")
    try:
        with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as archive:
            for number, roi in enumerate(rois, start=1):
                entry = zipfile.ZipInfo(f"{number:04d} {roi.name.replace('/', '_')}.roi")
                entry.compress_type = zipfile.ZIP_DEFLATED
                archive.writestr(entry, encode(roi))
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def read_rois(file: PathLike) -> List[Roi]:
    """The lines and polygons of a RoiSet.zip."""
    with zipfile.ZipFile(file) as archive:
        return [decode(archive.read(name), f"{file}: {name}") for name in archive.namelist() if name.endswith(".roi")]
