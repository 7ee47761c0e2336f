"""Time to read a batch of many cells into one frame: read_cells.py CELL [NUMBER]; CELL has been run."""
import pathlib
import shutil
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "python"))
import mbtfm  # noqa: E402

cell, number = pathlib.Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1000
with tempfile.TemporaryDirectory() as folder:
    for i in range(number):
        copy = pathlib.Path(folder) / f"cell_{i}"
        for name in ("cell.toml", "run.json", "1_segment/adhesions.csv", "1_segment/fibres.csv", "1_segment/outline.csv",
                     "4_fit/tensions.csv", "4_fit/adhesion_forces.csv", "4_fit/fit.json"):
            if (cell / name).exists():
                (copy / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(cell / name, copy / name)
    start = time.perf_counter()
    frame = mbtfm.study(folder)
    print(f"{number} cells, {len(frame)} rows: {time.perf_counter() - start:.2f} s")
