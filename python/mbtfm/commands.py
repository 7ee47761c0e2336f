"""The programs, started from Python with progress. They do the work; this reads what they say (`--json`)."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Union

from .cell import Cell, PathLike, read


@dataclass(frozen=True)
class Event:
    """One line of `mbtfm run --json` (docs/formats/json.md): ``kind`` is stage, progress, finding, effect, result or error."""

    kind: str
    content: Mapping[str, Any] = field(default_factory=dict)

    @property
    def stage(self) -> str:
        """The stage it is about: segment, track, network, fit; or empty."""
        return str(self.content.get("stage", ""))

    @property
    def fraction(self) -> Optional[float]:
        """Of progress: how much of the stage is done, from 0 to 1."""
        value = self.content.get("fraction")
        return None if value is None else float(value)


class ProgramFailed(RuntimeError):
    """A program ended with an error. ``exit_code`` as in docs/commands.md; the message is the program's own."""

    def __init__(self, program: str, exit_code: int, message: str) -> None:
        super().__init__(message or f"{program} ended with exit code {exit_code}")
        self.program = program
        self.exit_code = exit_code


def programs(name: str = "mbtfm") -> str:
    """The path of a program: in the folder that the environment names as MBTFM_BIN, else on the PATH."""
    folder = os.environ.get("MBTFM_BIN")
    found = shutil.which(name, path=folder) if folder else shutil.which(name)
    if found is None:
        where = f"in {folder} (MBTFM_BIN)" if folder else "on the PATH"
        raise FileNotFoundError(f"{name} is not {where}: install mbtfm, or set MBTFM_BIN to the folder of its programs")
    return found


Value = Union[bool, int, float, str, "os.PathLike[str]"]


def flags_of(parameters: Mapping[str, Value]) -> List[str]:
    flags = []
    for name, value in parameters.items():
        if isinstance(value, bool):
            flags.append(f"--{name}={'true' if value else 'false'}")
        else:
            flags.append(f"--{name}={os.fspath(value) if isinstance(value, os.PathLike) else value}")
    return flags


def _events(command: Sequence[str], progress: Optional[Callable[[Event], None]]) -> int:
    """Run a program that prints one JSON object a line; its exit code, 0 or 4 (not converged), is returned."""
    last_error: Dict[str, Any] = {}
    with tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") as messages:
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=messages, text=True, encoding="utf-8") as process:
            assert process.stdout is not None
            try:
                for line in process.stdout:
                    content = json.loads(line)
                    event = Event(str(content.pop("event")), content)
                    if event.kind == "error":
                        last_error = content
                    if progress is not None:
                        progress(event)
            except BaseException:
                process.terminate()  # as Ctrl-C would: nothing is left half-written
                raise
            code = process.wait()
        messages.seek(0)
        said = messages.read().strip()
    if code not in (0, 4):
        raise ProgramFailed(Path(command[0]).name, code, str(last_error.get("message", "")) or said)
    return code


def run(
    cell: PathLike,
    *,
    preset: Optional[str] = None,
    accuracy: Optional[str] = None,
    only: Sequence[str] = (),
    redo: Sequence[str] = (),
    threads: Optional[int] = None,
    progress: Optional[Callable[[Event], None]] = None,
) -> Cell:
    """All stages of a cell that are not up to date, as `mbtfm run`; then its results.

    progress: called with each event as it comes.
    A fit that did not converge is no error: `Cell.converged` is false, and the finding is among `Cell.findings`.
    """
    command = [programs(), "run", os.fspath(cell), "--json"]
    if preset is not None:
        command += ["--preset", preset]
    if accuracy is not None:
        command += ["--accuracy", accuracy]
    for stage in only:
        command += ["--only", stage]
    for stage in redo:
        command += ["--redo", stage]
    if threads is not None:
        command += ["--threads", str(threads)]
    _events(command, progress)
    return read(cell)


def simulate(
    cell: PathLike,
    *,
    scenario: str = "u2os",
    seed: int = 1,
    noise: float = 0.07,
    beads: int = 10000,
    images: bool = False,
    progress: Optional[Callable[[Event], None]] = None,
    **parameters: Value,
) -> Cell:
    """A simulated cell folder with its truth, as `mbtfm-simulate`; further parameters are its flags:
    ``simulate("trial", youngs_modulus_kPa=4)``. Without images it holds the true segmentation and the noisy displacement.
    """
    command = [programs("mbtfm-simulate"), "--out", os.fspath(cell), "--json"]
    command += flags_of({"scenario": scenario, "seed": seed, "noise": noise, "beads": beads, **parameters})
    if images:
        command.append("--images")
    _events(command, progress)
    return read(cell)
