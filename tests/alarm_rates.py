#!/usr/bin/env python3
"""Simulate sound cells and count the findings that the program opens on them (docs/findings.md).

    tests/alarm_rates.py FOLDER FIRST LAST [--bin build/bin] [--scenario NAME ...] [--without fibre|two-fibres|adhesions]

A seed is a cell: its scenario, network, noise (10 to 100 nm) and density of beads (.3 to 1 per um2) follow from it.
The segmentation is the true one, so each open finding is a false alarm; --without takes its strongest fibres or a fifth
of its adhesions away, and the first finding should name that. A cell whose results are there already is only counted.
"""
import argparse
import collections
import csv
import json
import math
import pathlib
import random
import subprocess

from rough_days import true_force_nN

NETWORKS = ["second-neighbours", "edges", "edges-rims", "edges-centres"]


def settings(seed, scenarios):
    draw = random.Random(seed)
    return {"scenario": scenarios[seed % len(scenarios)], "simulation_network": NETWORKS[seed // len(scenarios) % 4],
            "noise_um": round(math.exp(draw.uniform(math.log(0.01), math.log(0.1))), 4),
            "beads_per_um2": round(draw.uniform(0.3, 1), 3)}


def rewrite(file, row_of):
    with open(file, newline="") as stream:
        rows = list(csv.DictReader(stream))
    kept = [row for row in map(row_of, rows) if row]
    with open(file, "w", newline="") as stream:
        writer = csv.DictWriter(stream, rows[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows(kept)


def take_away(cell, what, seed):
    fibres, adhesions = set(), set()
    if what == "adhesions":
        draw = random.Random(seed + 77)
        with open(cell / "1_segment/adhesions.csv", newline="") as stream:
            adhesions = {row["adhesion_id"] for row in csv.DictReader(stream) if draw.random() < 0.2}
    else:
        with open(cell / "truth/tensions.csv", newline="") as stream:
            rows = [row for row in csv.DictReader(stream) if row["type"] != "network"]
        rows.sort(key=lambda row: -float(row["tension_nN"]))
        fibres = {row["fibre_id"] for row in rows[:2 if what == "two-fibres" else 1]}

    def fibre(row):
        held = {end: "" for end in ("start_adhesion_id", "end_adhesion_id") if row[end] in adhesions}
        return None if row["fibre_id"] in fibres else row | held
    rewrite(cell / "1_segment/fibres.csv", fibre)
    rewrite(cell / "1_segment/fibre_points.csv", lambda row: None if row["fibre_id"] in fibres else row)
    rewrite(cell / "1_segment/adhesions.csv", lambda row: None if row["adhesion_id"] in adhesions else row)


def results(seed, asked):
    cell, chosen = asked.folder / f"cell_{seed}", settings(seed, asked.scenario)
    if not (cell / "4_fit/fit.json").exists():
        words = [word for key, value in chosen.items() for word in (f"--{key}", str(value))]
        subprocess.run([asked.bin / "mbtfm-simulate", "--seed", str(seed), *words, "--out", cell, "--quiet", "--force"],
                       check=True)
        if asked.without:
            take_away(cell, asked.without, seed)
        subprocess.run([asked.bin / "mbtfm", "run", cell, "--quiet", "--threads", "1"], capture_output=True)
    fit = json.loads((cell / "4_fit/fit.json").read_text())
    findings = json.loads((cell / "run.json").read_text()).get("findings", [])
    return chosen, list(dict.fromkeys(f["id"] for f in findings if f["severity"] != "note")), \
        (fit["total_force_nN"] - true_force_nN(cell)) / fit["total_force_sigma_nN"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("first", type=int)
    parser.add_argument("last", type=int)
    parser.add_argument("--bin", type=pathlib.Path, default=pathlib.Path("build/bin"))
    parser.add_argument("--without", choices=["fibre", "two-fibres", "adhesions"])
    parser.add_argument("--scenario", nargs="+", default=["u2os", "dense"])
    asked = parser.parse_args()
    counts, first, n_open, squares = collections.Counter(), collections.Counter(), 0, 0
    for seed in range(asked.first, asked.last + 1):
        chosen, opened, z = results(seed, asked)
        counts.update(opened)
        first.update(opened[:1])
        n_open += bool(opened)
        squares += z * z
        print(f"{seed}: {' '.join(map(str, chosen.values()))}: z {z:+.1f}; {', '.join(opened) or 'none'}", flush=True)
    n = asked.last - asked.first + 1
    print(f"cells with an open finding: {n_open} of {n}; total force: rms z {math.sqrt(squares / n):.2f}")
    for name, count in counts.most_common():
        print(f"  {name}: {count}, the first of all in {first[name]}")


if __name__ == "__main__":
    main()
