#!/usr/bin/env python3
"""Simulate and run acquisitions as laboratories make them, and count what came of them (notes/validation.md).

    tests/rough_days.py FOLDER FIRST LAST [--bin build/bin]

A line for each day; a day that is there already is not simulated again. What is tuned on some days is judged on others:
days above 9000 are left for that.
"""
import argparse
import csv
import json
import math
import pathlib
import subprocess
import tomllib

FAULTS = ["turn_deg", "neighbour_x_um", "n_specks", "n_dead_cells", "relaxed_defocus", "stressed_defocus", "light_lost",
          "saturated", "padding_px", "scale_bar_px", "n_hot_pixels", "scan_phase_px", "blurred_bead_fraction"]


def true_force_nN(cell):
    with open(cell / "truth/adhesion_forces.csv", newline="") as file:
        return sum(math.hypot(float(row["fx_nN"]), float(row["fy_nN"])) for row in csv.DictReader(file))


def faults_of(cell):
    with open(cell / "truth/scenario.toml", "rb") as file:
        scenario = tomllib.load(file)
    values = {key: value for table in scenario.values() if isinstance(table, dict) for key, value in table.items()}
    drift = math.hypot(values.get("drift_x_um", 0), values.get("drift_y_um", 0))
    usual = {"relaxed_defocus": 1, "stressed_defocus": 1, "blurred_bead_fraction": 0.1}
    named = [f"{key} {values[key]:.3g}" for key in FAULTS if values.get(key, 0) not in (0, usual.get(key))]
    return [f"drift {drift:.2g} um", *named]


def day(number, folder, bin):
    cell = folder / f"day_{number}"
    if not (cell / "truth/scenario.toml").exists():
        subprocess.run([bin / "mbtfm-simulate", "--rough", str(number), "--out", cell, "--quiet"], check=True)
    run = subprocess.run([bin / "mbtfm", "run", cell, "--quiet"], capture_output=True, text=True)
    truth = true_force_nN(cell)
    if run.returncode not in (0, 4) or not (cell / "4_fit/fit.json").exists():
        return {"state": "refused", "line": f"refused ({run.stderr.strip().splitlines()[0][:120]})", "cell": cell}
    fit = json.loads((cell / "4_fit/fit.json").read_text())
    findings = json.loads((cell / "run.json").read_text()).get("findings", [])
    opened = sorted({f["id"] for f in findings if f["severity"] != "note"})
    found, sigma = fit["total_force_nN"], fit["total_force_sigma_nN"]
    z = (found - truth) / sigma
    state = "right" if abs(z) <= 3 else "wrong, with a caution" if opened else "wrong, green tick"
    line = f"{found:.0f} +- {sigma:.1f} nN, truth {truth:.0f} ({100 * (found / truth - 1):+.1f} %, z {z:+.1f})"
    return {"state": state, "line": f"{line}; {', '.join(opened) or 'no caution'}", "cell": cell, "open": bool(opened)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("first", type=int)
    parser.add_argument("last", type=int)
    parser.add_argument("--bin", type=pathlib.Path, default=pathlib.Path("build/bin"))
    asked = parser.parse_args()
    days = []
    for number in range(asked.first, asked.last + 1):
        result = day(number, asked.folder, asked.bin)
        days.append(result)
        print(f"{number}: {result['state']}: {result['line']} [{'; '.join(faults_of(result['cell']))}]", flush=True)
    for state in ("right", "wrong, with a caution", "wrong, green tick", "refused"):
        print(f"{state}: {sum(d['state'] == state for d in days)} of {len(days)}")
    print(f"right and without a caution: {sum(d['state'] == 'right' and not d['open'] for d in days)} of {len(days)}")


if __name__ == "__main__":
    main()
