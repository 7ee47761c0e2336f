"""The Python package on cells that the programs make. Needs Debian's python3-numpy and python3-pandas, no napari, no window.

MBTFM_BIN: the folder of the programs.
"""

import contextlib
import io
import os
import re
import shutil
import sys
import tempfile
import types
import unittest
from importlib import import_module
from pathlib import Path
from unittest import mock

import numpy as np
import pandas as pd

import mbtfm
from mbtfm import napari, rois


class Cells(unittest.TestCase):
    """One small cell, simulated and fitted once."""

    @classmethod
    def add(cls, cell):
        """The same results from beads of its own: one bead less, so that it is no copy."""
        shutil.copytree(cls.first, cell)
        field = cell / "2_track/displacement.csv"
        beads = field.read_text().splitlines(keepends=True)
        cls.n_left_out = getattr(cls, "n_left_out", 0) + 1
        field.write_text("".join(beads[: -cls.n_left_out]))

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="mbtfm-python-")
        cls.study = Path(cls.folder.name) / "study"
        cls.events = []
        cls.first = cls.study / "a" / "cell 1"
        mbtfm.simulate(cls.first, scenario="ring", seed=3, beads=1500, noise=0.02)
        cls.cell = mbtfm.run(cls.first, preset="fast", progress=cls.events.append)
        for name in ("b/cell 2", "b/cell 3"):
            cls.add(cls.study / name)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_tables_have_labels_as_whole_numbers_and_truth_values(self):
        cell = self.cell
        self.assertEqual(len(cell.tensions), len(cell.fibres) + 1)
        self.assertEqual(str(cell.fibres.start_adhesion_id.dtype), "Int64")
        ends = cell.fibres[["start_adhesion_id", "end_adhesion_id"]]
        self.assertTrue(ends.isna().any(axis=None), "a dorsal fibre has a free end")
        self.assertEqual(cell.tensions.identifiable.dtype, bool)
        self.assertEqual(set(cell.tensions.fibre_id), {0} | set(cell.fibre_lines_um))
        for line in cell.fibre_lines_um.values():
            self.assertEqual(line.shape[1], 2)
        self.assertGreater(len(cell.outline_um[0]), 3)
        self.assertTrue(cell.converged)

    def test_numbers_are_read_to_the_last_digit(self):
        text = (self.first / "2_track/displacement.csv").read_text().splitlines()
        column = text[0].split(",").index("ux_um")
        self.assertEqual(list(self.cell.displacement.ux_um[:50]), [float(row.split(",")[column]) for row in text[1:51]])

    def test_forces_of_the_fit_are_those_of_its_table(self):
        # fit.json corrects the sum for noise, which makes it smaller; by how much is the noise's share, some per cent here
        total = self.cell.adhesion_forces.force_nN.sum()
        self.assertAlmostEqual(self.cell.fit["total_force_nN"] / total, 1, delta=0.1)

    def test_tensions_are_the_truth_within_their_intervals(self):
        both = self.cell.tensions.merge(self.cell.truth(), on="fibre_id", suffixes=("", "_true")).query("fibre_id > 0")
        high = both.high_nN.fillna(np.inf)
        inside = (both.low_nN <= both.tension_nN_true) & (both.tension_nN_true <= high)
        # of n intervals of 95 % at least 60 % hold the truth but in one study of 1e5 (binomial, n >= 8)
        self.assertGreaterEqual(inside.mean(), 0.6)

    def test_a_run_tells_of_each_stage_and_of_the_result(self):
        kinds = {event.kind for event in self.events}
        self.assertTrue({"stage", "progress", "result"} <= kinds, kinds)
        self.assertIn("fit", {event.stage for event in self.events if event.kind == "stage"})
        fractions = [event.fraction for event in self.events if event.kind == "progress" and event.stage == "fit"]
        self.assertEqual(fractions, sorted(fractions))
        result = next(event for event in self.events if event.kind == "result")
        self.assertAlmostEqual(result.content["total_force_nN"], self.cell.fit["total_force_nN"])
        self.assertTrue(Path(result.content["report"]).is_file())

    def test_an_error_has_the_programs_message_and_exit_code(self):
        with self.assertRaises(mbtfm.ProgramFailed) as caught:
            mbtfm.run(self.study / "nowhere")
        self.assertEqual(caught.exception.exit_code, 3)
        self.assertIn("nowhere", str(caught.exception))
        with self.assertRaises(mbtfm.ProgramFailed) as caught:
            mbtfm.simulate(self.study / "c", scenario="ring", no_such_flag=1)
        self.assertEqual(caught.exception.exit_code, 2)

    def test_a_study_is_the_cells_one_after_the_other(self):
        frame = mbtfm.study(self.study)
        self.assertEqual(list(frame.cell.unique()), ["a/cell 1", "b/cell 2", "b/cell 3"])
        part = frame[frame.cell == "b/cell 3"].drop(columns=["cell", "converged", "included", "reason"]).reset_index(drop=True)
        pd.testing.assert_frame_equal(part, self.cell.tensions)
        self.assertEqual(len(mbtfm.study(self.study, "cells")), 3)
        self.assertEqual(frame.attrs["left_out"], {})
        self.assertTrue(frame.included.all())

    def test_conditions_are_joined_and_a_missing_one_is_an_error(self):
        table = self.study.parent / "conditions.csv"
        table.write_text("cell,condition\na/cell 1,control\nb/cell 2,drug\nb/cell 3/,drug\n")
        frame = mbtfm.study(self.study, conditions=table)
        self.assertEqual(set(frame[frame.condition == "drug"].cell), {"b/cell 2", "b/cell 3"})
        table.write_text("cell,condition\na/cell 1,control\n")
        with self.assertRaisesRegex(ValueError, "no row for b/cell 2"):
            mbtfm.study(self.study, conditions=table)

    def test_conditions_are_read_as_people_write_them_or_come_from_folders(self):
        plain = self.study.parent / "plain.csv"
        plain.write_text("cell,condition\na/cell 1,ctrl\nb/cell 2,drug\nb/cell 3,drug\n")
        expected = mbtfm.study(self.study, conditions=plain)
        written = self.study.parent / "written.csv"
        for text, encoding in [
            ("sep=;\r\ncell ;condition;;\r\na/cell 1;ctrl ;;\r\nb/cell 2;drug;;\r\nb/cell 3; Drug;;\r\n;;;\r\n\r\n", "utf-8-sig"),
            ("cell\tcondition\na/cell 1\tctrl\nb/cell 2\tdrug\nb/cell 3\tDRUG\n", "utf-16"),
        ]:
            written.write_bytes(text.encode(encoding))
            pd.testing.assert_frame_equal(mbtfm.study(self.study, conditions=written), expected)
        self.assertEqual(set(mbtfm.study(self.study, conditions="folder").condition), {"a", "b"})
        with self.assertRaisesRegex(ValueError, "a/cell 1: expected a folder"):
            mbtfm.study(self.study, conditions="folder2")

    def test_cells_that_have_not_run_are_left_out_and_named(self):
        other = self.study.parent / "other"
        shutil.copytree(self.first, other / "done")
        (other / "new").mkdir()
        (other / "new/cell.toml").write_text("pixel_size_um = 0.1\n")
        shutil.copytree(self.first, other / "copy")
        frame = mbtfm.study(other)
        self.assertEqual(list(frame.cell.unique()), ["copy"])
        self.assertIn("the same cell as copy", frame.attrs["left_out"]["done"])
        self.assertIn("no fit", frame.attrs["left_out"]["new"])
        whole = mbtfm.study(other, with_left_out=True)
        self.assertEqual(list(whole.cell.unique()), ["copy", "done"])
        self.assertEqual(set(whole[~whole.included].reason), {frame.attrs["left_out"]["done"]})

    def test_without_the_program_what_it_wrote_last_counts(self):
        other = self.study.parent / "elsewhere"
        for name in ("t1", "t2", "t10"):
            self.add(other / name)
        with mock.patch.dict(os.environ, {"MBTFM_BIN": str(other)}):
            with self.assertRaises(FileNotFoundError):
                mbtfm.study(other)
            (other / "statistics").mkdir()
            (other / "statistics/cells.csv").write_text(
                "cell,condition,included,reason\nt1,,TRUE,\nt10,,TRUE,\nt2,,FALSE,dividing\n")
            self.assertEqual(list(mbtfm.study(other).cell.unique()), ["t1", "t10"])
        self.assertEqual(list(mbtfm.study(other).cell.unique()), ["t1", "t2", "t10"])

    def test_older_tables_with_fewer_columns_stand_beside_new_ones(self):
        other = self.study.parent / "older"
        self.add(other / "new")
        self.add(other / "old")
        old = mbtfm.read(other / "old").tensions[["fibre_id", "type", "tension_nN"]]
        old.to_csv(other / "old/4_fit/tensions.csv", index=False)
        frame = mbtfm.study(other)
        self.assertEqual(len(frame), 2 * len(old))
        self.assertTrue(frame[frame.cell == "old"].low_nN.isna().all())

    # --- napari, without napari

    def layers(self):
        return {layer[1]["name"]: layer for layer in napari.layers(str(self.first))}

    def test_the_reader_takes_cell_folders_alone(self):
        self.assertIsNone(napari.reader(str(self.study)))
        self.assertIsNone(napari.reader([str(self.first)]))
        self.assertIs(napari.reader(str(self.first)), napari.layers)

    def test_layers_are_rows_and_columns_in_um(self):
        layers = self.layers()
        fibres, settings, kind = layers["fibres"]
        self.assertEqual(kind, "shapes")
        for line, label in zip(fibres, settings["features"]["fibre_id"]):
            np.testing.assert_array_equal(line[:, ::-1], self.cell.fibre_lines_um[int(label)])
        self.assertIn("tension_nN", settings["features"])
        vectors, _, kind = layers["displacement"]
        self.assertEqual((kind, vectors.shape[1:]), ("vectors", (2, 2)))
        self.assertEqual(len(vectors), self.cell.displacement.flag.isna().sum() if "flag" in self.cell.displacement else len(self.cell.displacement))

    def test_the_corners_around_an_ellipse_give_back_its_axes_centre_and_angle(self):
        corners = self.layers()["adhesions"][0]
        for box, row in zip(corners, self.cell.adhesions.itertuples()):
            np.testing.assert_allclose(box.mean(axis=0), [row.y_um, row.x_um])
            major = box[1] - box[0]
            self.assertAlmostEqual(np.hypot(*major), row.major_axis_um)
            self.assertAlmostEqual(np.hypot(*(box[3] - box[0])), row.minor_axis_um)
            self.assertAlmostEqual(np.sin(np.arctan2(*major) - np.deg2rad(row.angle_deg)), 0)

    def test_images_lie_with_the_centre_of_their_first_pixel_half_a_pixel_from_the_origin(self):
        cell = self.study.parent / "with-images"
        mbtfm.simulate(cell, scenario="two-adhesions", beads=800, images=True)
        mbtfm.run(cell, only=["segment"])
        reader = types.SimpleNamespace(imread=lambda file: np.zeros((2, 2)))
        with mock.patch.dict(sys.modules, tifffile=reader):
            layers = {layer[1]["name"]: layer[1] for layer in napari.layers(str(cell))}
        size = mbtfm.read(cell).pixel_size_um
        self.assertEqual(layers["actin"]["scale"], (size, size))
        self.assertEqual(layers["actin"]["translate"], (size / 2, size / 2))
        # what is drawn in napari is what mbtfm then uses
        features = pd.DataFrame({"type": ["ventral", "arc"]})
        x, y = mbtfm.read(cell).outline_um[0].mean(axis=0)
        lines_um = [np.array([[y, x - 4], [y, x + 4]]), np.array([[y - 1, x - 3], [y - 1.5, x], [y - 1, x + 3]])]
        meta = {"shape_type": ["path", "path"], "features": features, "scale": (1, 1), "translate": (0, 0)}
        self.assertEqual(napari.write_fibres(str(cell / "fibres.zip"), lines_um, meta), [str(cell / "fibres.zip")])
        told = []
        redone = mbtfm.run(cell, only=["segment"], progress=told.append)
        self.assertEqual(list(redone.fibres.type), ["ventral", "arc"])
        np.testing.assert_allclose(redone.fibre_lines_um[2][0], lines_um[1][0][::-1], atol=1e-4)  # float32 of some 250 pixels
        drawn = mbtfm.read_rois(cell / "fibres.zip")
        np.testing.assert_allclose((drawn[0].points_px + rois.LINE_ORIGIN_PX) * size, lines_um[0][:, ::-1], atol=1e-4)
        self.assertIn("drawn by hand", next(e for e in told if e.kind == "stage" and e.stage == "segment").content["summary"])

    def test_the_relaxed_beads_lie_where_the_stage_moved_them(self):
        # by 3 um to the right and 1 um down, turned by 90 degrees about the middle of a field of 20 by 20 um
        figures = {"cell_with": "stressed", "stage_shift_x_um": 3.0, "stage_shift_y_um": 1.0, "stage_turn_deg": 90.0}
        for cell_with, moved, still in (("stressed", "beads_relaxed", "beads_stressed"), ("relaxed", "beads_stressed", "beads_relaxed")):
            record = {"stages": {"track": {"figures": {**figures, "cell_with": cell_with}}}}
            cell = types.SimpleNamespace(run_record=record)
            size = np.array([20.0, 20.0])
            np.testing.assert_array_equal(napari._stage_motion(cell, still, size), np.eye(3))
            place = napari._stage_motion(cell, moved, size)
            # +x turns to +y: (x, y) = (15, 10) goes to (10, 15), then to (13, 16)
            relaxed, stressed = np.array([10.0, 15.0, 1.0]), np.array([16.0, 13.0, 1.0])
            start, end = (relaxed, stressed) if cell_with == "stressed" else (stressed, relaxed)
            np.testing.assert_allclose(place @ start, end)

    def test_nothing_but_lines_is_written_and_nothing_half(self):
        target = self.first / "fibres.zip"
        meta = {"shape_type": "polygon", "metadata": {}}
        with mock.patch.object(mbtfm.Cell, "pixel_size_um", 0.1), self.assertRaisesRegex(ValueError, "polygon"):
            napari.write_fibres(str(target), [np.zeros((3, 2))], meta)
        with mock.patch.object(mbtfm.Cell, "pixel_size_um", 0.1), self.assertRaises(ValueError):
            napari.write_fibres(str(target), [np.full((3, 2), np.nan)], {"shape_type": "path"})
        self.assertEqual(list(self.first.glob("*fibres.zip*")), [])


class Readme(unittest.TestCase):
    def test_its_example_runs(self):
        text = (Path(__file__).parents[2] / "python/README.md").read_text()
        (block,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
        before = os.getcwd()
        with tempfile.TemporaryDirectory(prefix="mbtfm-python-") as folder, contextlib.redirect_stdout(io.StringIO()) as said:
            try:
                os.chdir(folder)
                exec(compile(block, "python/README.md", "exec"), {})
            finally:
                os.chdir(before)
        self.assertIn("tension_nN", said.getvalue())


class Manifest(unittest.TestCase):
    def test_every_command_of_the_manifest_is_a_function_of_the_package(self):
        text = (Path(mbtfm.__file__).parent / "napari.yaml").read_text()
        ids = set(re.findall(r"- id: (\S+)", text))
        for name in re.findall(r"python_name: (\S+)", text):
            module, function = name.split(":")
            self.assertTrue(callable(getattr(import_module(module), function)), name)
        self.assertEqual(set(re.findall(r"command: (\S+)", text)), ids)


class Rois(unittest.TestCase):
    def test_a_selection_is_read_as_it_was_written(self):
        for points in ([[0.5, 1.25], [3, 4]], [[-2.5, 7], [100.125, 3.5], [9, 9]]):
            roi = rois.Roi("ventral 1 µ", np.array(points), is_closed=len(points) > 2, stroke_width_px=2.5)
            back = rois.decode(rois.encode(roi))
            np.testing.assert_array_equal(back.points_px, roi.points_px)
            self.assertEqual((back.name, back.is_closed, back.stroke_width_px), (roi.name, roi.is_closed, 2.5))

    def test_every_truncation_is_an_error_that_names_the_file(self):
        data = rois.encode(rois.Roi("arc 1", np.array([[1.0, 2.0], [3.0, 4.0]])))
        for length in range(len(data)):
            with self.assertRaisesRegex(ValueError, "mine"):
                rois.decode(data[:length], "mine")


if __name__ == "__main__":
    unittest.main()
