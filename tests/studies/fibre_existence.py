#!/usr/bin/env python3
"""fibre_existence.py FOLDER FIRST LAST [--bin build/bin] [--scenario dense]: what beads add to the fibres of an image.

Simulated cells with images (30 nm, 1 bead/um2) are run with default parameters. A true fibre is found by the line that covers most of it
(product of both shares within 0.4 um and 20 degrees, .4 at least), each line once. A line on no true fibre for half of its length is false.
Printed: recall and precision of the fibres of the image, and of those with an existence (4_fit/fibres_left_out.csv) of a half or more; the
recall at one precision by either; of lines with some existence the share that is true; tensions and their 95 % intervals, where a false
line must reach the network's tension and a missed fibre above 1 nN is a miss; the error of the adhesions' forces.
"""
import argparse
import csv
import json
import math
import pathlib
import subprocess

import numpy as np


def rows(file):
    with open(file, newline="") as stream:
        return list(csv.DictReader(stream))


def lines_in(fibres, points):
    lines = {}
    for row in rows(points):
        lines.setdefault(row["fibre_id"], []).append((float(row["x_um"]), float(row["y_um"])))
    return {row["fibre_id"]: (row, sampled(np.array(lines[row["fibre_id"]]))) for row in rows(fibres)}


def sampled(points, step_um=0.2):
    s = np.r_[0, np.cumsum(np.hypot(*np.diff(points, axis=0).T))]
    t = np.linspace(0, s[-1], max(3, int(s[-1] / step_um) + 1))
    return np.c_[np.interp(t, s, points[:, 0]), np.interp(t, s, points[:, 1])]


def along(points):
    d = np.gradient(points, axis=0)
    return d / np.maximum(np.hypot(*d.T), 1e-9)[:, None]


def covered(a, b, near_um=0.4):
    d = np.hypot(a[:, None, 0] - b[None, :, 0], a[:, None, 1] - b[None, :, 1])
    j = d.argmin(1)
    return (d.min(1) < near_um) & (np.abs((along(a) * along(b)[j]).sum(1)) > math.cos(math.radians(20)))


def number(text, otherwise):
    return float(text) if text else otherwise


class Line:
    """Of the image, with what the beads say of it."""

    def __init__(self, points, confidence, existence, fit):
        self.points, self.confidence, self.existence, self.fit = points, confidence, existence, fit
        self.is_true, self.fibre = False, None


def fitted_lines(cell):
    tensions = {row["fibre_id"]: row for row in rows(cell / "4_fit/tensions.csv")}
    existence = {row["fibre_id"]: number(row.get("existence"), 1) for row in rows(cell / "4_fit/fibres_left_out.csv")}
    lines = []
    for label, (row, points) in lines_in(cell / "1_segment/fibres.csv", cell / "1_segment/fibre_points.csv").items():
        fit = tensions[label]
        low, high = number(fit["low_nN"], 0), number(fit["high_nN"], math.inf)
        lines.append(Line(points, float(row["confidence"]), existence[label], (float(fit["tension_nN"]), low, high)))
    return lines, float(tensions["0"]["tension_nN"])


def match(truth, lines):
    for line in lines:
        line.is_true = np.any([covered(line.points, p) for _, p in truth.values()], axis=0).mean() >= 0.5
    shares = sorted(((covered(p, l.points).mean() * covered(l.points, p).mean(), k, i) for k, (_, p) in truth.items()
                     for i, l in enumerate(lines)), reverse=True)
    found = {}
    for share, k, i in shares:
        if share >= 0.4 and k not in found and lines[i].fibre is None:
            found[k], lines[i].fibre = lines[i], k
    return found


def force_error(cell):
    truth = rows(cell / "truth/adhesion_forces.csv")
    xy = lambda row, *names: np.array([float(row[n]) for n in names])
    places, left = np.array([xy(r, "x_um", "y_um") for r in truth]), np.array([xy(r, "fx_nN", "fy_nN") for r in truth])
    size, stray = (left ** 2).sum(), 0
    for row in rows(cell / "4_fit/adhesion_forces.csv"):
        d = np.hypot(*(places - xy(row, "x_um", "y_um")).T)
        if d.min() < 1:
            left[d.argmin()] -= xy(row, "fx_nN", "fy_nN")
        else:
            stray += (xy(row, "fx_nN", "fy_nN") ** 2).sum()
    return ((left ** 2).sum() + stray) / size


def main():
    p = argparse.ArgumentParser()
    p.add_argument("folder", type=pathlib.Path)
    p.add_argument("first", type=int)
    p.add_argument("last", type=int)
    p.add_argument("--bin", type=pathlib.Path, default=pathlib.Path("build/bin"))
    p.add_argument("--scenario", default="dense")
    a = p.parse_args()
    n_true, calls, holds, misfit, squares, forces, cautions = 0, [], [], 0, 0, [], 0
    for seed in range(a.first, a.last + 1):
        cell = a.folder / f"{a.scenario}_{seed}"
        if not (cell / "truth").exists():
            subprocess.run([a.bin / "mbtfm-simulate", "--scenario", a.scenario, "--seed", str(seed), "--noise_um", "0.03", "--beads_per_um2", "1",
                            "--images", "--out", cell, "--quiet"], check=True)
        if not (cell / "4_fit/fit.json").exists():
            subprocess.run([a.bin / "mbtfm", "run", cell, "--quiet"])
        tension = {row["fibre_id"]: float(row["tension_nN"]) for row in rows(cell / "truth/tensions.csv")}
        truth = lines_in(cell / "truth/fibres.csv", cell / "truth/fibre_points.csv")
        lines, network_nN = fitted_lines(cell)
        found = match(truth, lines)
        n_true += len(truth)
        calls += lines
        forces.append(force_error(cell))
        cautions += sum(f["severity"] != "note" for f in json.load(open(cell / "run.json"))["findings"])
        for k in truth:
            line = found.get(k)
            t, low, high = line.fit if line else (0, 0, 0)
            misfit, squares = misfit + (t - tension[k]) ** 2, squares + tension[k] ** 2
            if line or tension[k] > 1:
                holds.append(low <= tension[k] <= high)
        for line in lines:
            if line.is_true:
                continue
            misfit += line.fit[0] ** 2
            holds.append(line.fit[1] <= network_nN)

    def score(taken):
        return sum(l.fibre is not None for l in taken) / n_true, sum(l.is_true for l in taken) / max(1, len(taken))
    together = [line for line in calls if line.existence >= 0.5]
    print(f"{n_true} true fibres; recall, precision: image {score(calls)[0]:.3f} {score(calls)[1]:.3f}, ", end="")
    print(f"existence of a half {score(together)[0]:.3f} {score(together)[1]:.3f}")
    for least in (0.94, 0.95, 0.96, 0.97, 0.98, 0.99):
        best = []
        for key in ("confidence", "existence"):
            ranked = sorted(calls, key=lambda line: -getattr(line, key))
            scores = [score(ranked[:n]) for n in range(1, len(ranked) + 1)]
            best.append(max((recall for recall, precision in scores if precision >= least), default=0))
        print(f"  precision {least}: recall of the image {best[0]:.3f}, with beads {best[1]:.3f}")
    for low, high in ((0, 0.3), (0.3, 0.6), (0.6, 0.9), (0.9, 0.99), (0.99, 1.01)):
        some = [line for line in calls if low <= line.existence < high]
        if some:
            print(f"  existence {np.mean([line.existence for line in some]):.2f}: true {np.mean([line.is_true for line in some]):.2f} of {len(some)}")
    print(f"tensions: error {math.sqrt(misfit / squares):.3f}, 95 % hold {np.mean(holds):.3f} of {len(holds)}; ", end="")
    print(f"forces: error {math.sqrt(np.mean(forces)):.3f}; cautions {cautions}")


main()
