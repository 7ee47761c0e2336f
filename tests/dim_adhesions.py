#!/usr/bin/env python3
"""How far is the total force off where dim adhesions were missed?

    tests/dim_adhesions.py FOLDER SHARE FIRST LAST [--bin build/bin]

Of simulated cells FIRST to LAST (u2os, 30 nm, .6 beads/um2) the smaller adhesions are left out, SHARE of all, each size
counted with an error of 30 %. Prints a line a cell: total force, true and found, and what the fit says of it.
"""
import argparse
import csv
import json
import pathlib
import random
import subprocess


def rows(path):
    with open(path, encoding="utf-8") as file:
        return list(csv.DictReader(file))


def write(path, header, table):
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, header)
        writer.writeheader()
        writer.writerows(table)


def measured(seed, share, folder, programs):
    cell, out = folder / f"cell_{seed}", folder / f"cell_{seed}_without_{share}"
    out.mkdir(parents=True, exist_ok=True)
    run = lambda name, *words: subprocess.run([programs / name, *map(str, words), "--quiet"], check=True)
    if not cell.exists():
        run("mbtfm-simulate", "--scenario", "u2os", "--seed", seed, "--noise_um", 0.03, "--beads_per_um2", 0.6, "--out", cell)
    adhesions, fibres = rows(cell / "1_segment/adhesions.csv"), rows(cell / "1_segment/fibres.csv")
    chance = random.Random(seed)
    by_size = sorted(adhesions, key=lambda a: float(a["area_um2"]) * (1 + 0.3 * chance.random()))
    gone = {a["adhesion_id"] for a in by_size[: int(share * len(adhesions))]}
    write(out / "adhesions.csv", adhesions[0], [a for a in adhesions if a["adhesion_id"] not in gone])
    for fibre in fibres:
        for end in ("start_adhesion_id", "end_adhesion_id"):
            if fibre[end] in gone:
                fibre[end] = ""
    write(out / "fibres.csv", fibres[0], fibres)
    for name in ("fibre_points.csv", "outline.csv"):
        (out / name).write_bytes((cell / "1_segment" / name).read_bytes())
    config = ("--config", cell / "cell.toml")
    run("mbtfm-network", "--cell", out, *config, "--out", out / "network.vtu")
    run("mbtfm-fit", "--cell", out, "--network", out / "network.vtu", "--displacement", cell / "2_track/displacement.csv",
        *config, "--out", out / "fit", "--record", out / "record.json")
    fit = json.loads((out / "fit/fit.json").read_text())
    findings = json.loads((out / "record.json").read_text())["findings"]
    true = sum(float(a["force_nN"]) for a in rows(cell / "truth/adhesion_forces.csv"))
    found, sigma = fit["total_force_nN"], fit["total_force_sigma_nN"]
    is_named = any(f["id"] == "missing-adhesion" for f in findings)
    print(f"{seed}: true {true:.1f} nN, found {found:.1f} +- {sigma:.1f}, z {(found - true) / sigma:+.1f}; along the edge "
          f"{fit['edge_force_nN']:.1f} nN, probability {fit['edge_force_probability']:.3f}"
          f"{'; missing-adhesion' if is_named else ''}", flush=True)
    return (found - true) / sigma


if __name__ == "__main__":
    asked = argparse.ArgumentParser()
    asked.add_argument("folder", type=pathlib.Path)
    asked.add_argument("share", type=float)
    asked.add_argument("first", type=int)
    asked.add_argument("last", type=int)
    asked.add_argument("--bin", type=pathlib.Path, default=pathlib.Path("build/bin"))
    a = asked.parse_args()
    z = [measured(seed, a.share, a.folder, a.bin) for seed in range(a.first, a.last + 1)]
    print(f"root mean square of z: {(sum(x * x for x in z) / len(z)) ** 0.5:.2f}")
