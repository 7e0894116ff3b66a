# SPDX-License-Identifier: MIT
"""A case of several runs of the fluid alone: its `solve` gives {name: overrides}, each a folder OUT_DIR/name."""

import argparse
import json
import os
import platform
import shutil
import subprocess
import time
import tomllib
from pathlib import Path

from run_folder import set_key

PROGRAM = Path(__file__).resolve().parents[1] / "build/fluid/sluice-fluid"


def read_arguments(documentation, arguments):
    parser = argparse.ArgumentParser(description=documentation.split("\n\n")[0])
    parser.add_argument("out", metavar="OUT_DIR", type=Path)
    parser.add_argument("--set", metavar="TABLE.KEY=VALUE", action="append", default=[],
                        dest="overrides")
    parser.add_argument("--program", type=Path, default=PROGRAM, help="sluice-fluid")
    return parser.parse_args(arguments)


def processor():
    """Model of the processor, as the launcher reports it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if "model name" in line)
    except (OSError, StopIteration):
        return platform.processor() or "unknown"


def main(documentation, case_file, runs_of, arguments=None):
    """The command `solve`: `runs_of(case)` takes the parsed case file, overrides applied."""
    options = read_arguments(documentation, arguments)
    case = tomllib.loads(case_file.read_text())
    for text in options.overrides:
        set_key(case, text)
    runs = runs_of(case)
    refuse_what_follows(options.overrides, runs)
    options.out.mkdir(parents=True, exist_ok=True)
    shutil.copy(case_file, options.out / "case.toml")
    summary = {"case": case["case"]["name"], "case_file": str(case_file),
               "overrides": options.overrides, "processor": processor(),
               "started": time.strftime("%Y-%m-%dT%H:%M:%S%z"),
               "threads": int(os.environ.get("OMP_NUM_THREADS", os.cpu_count() or 1))}
    started, status = time.monotonic(), 0
    for name, overrides in runs.items():
        print(f"{name}:", flush=True)
        status = run_one(options, case_file, name, overrides)
        if status != 0:
            summary["message"] = f"{name} ended with status {status}"
            break
    summary |= {"completed": status == 0, "wall_time_s": time.monotonic() - started}
    (options.out / "summary.json").write_text(json.dumps(summary, indent=2) + "\n")
    return status


def key_of(override):
    return override.partition("=")[0].strip()


def refuse_what_follows(overrides, runs):
    """SystemExit when an override is a key that every run sets for itself."""
    own = {key_of(text) for texts in runs.values() for text in texts}
    for text in overrides:
        if key_of(text) in own:
            raise SystemExit(f"solve: {key_of(text)} follows from [parameters] in this case; "
                             "set those instead")


def run_one(options, case_file, name, overrides):
    command = [str(options.program), str(case_file), "--out", str(options.out / name)]
    for text in overrides + options.overrides:
        command += ["--set", text]
    return subprocess.run(command).returncode
