# SPDX-License-Identifier: MIT
"""Builds Sluice, runs a case, checks its results against the reference and draws them.

Exit status: 0 the run is complete and inside the case's bands, 3 complete but outside,
1 failed, 2 wrong usage, 128 + signal when it was stopped.
"""

import argparse
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CASES = ROOT / "cases"
BUILD = ROOT / "build"
EXIT_FAILED, EXIT_USAGE = 1, 2
LINES_OF_A_FAILED_BUILD = 40


def case_names():
    return sorted(file.parent.name for file in CASES.glob("*/case.toml"))


def known_case(name):
    if name not in case_names():
        raise argparse.ArgumentTypeError(
            f"there is no case '{name}'; valid cases are {', '.join(case_names())}")
    return name


def positive(text):
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"'{text}' is not a number above zero, in SI units")
    return value


def assignment(text):
    if not re.fullmatch(r"\s*[\w-]+(\.[\w-]+)+\s*=.+", text):
        raise argparse.ArgumentTypeError(
            f"'{text}' is not TABLE.KEY=VALUE, for example bridge.scheme=serial-explicit")
    return text


def read_arguments(arguments):
    parser = argparse.ArgumentParser(
        prog="cases/run", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="cases: " + ", ".join(case_names()))
    parser.add_argument("case", metavar="CASE", type=known_case)
    parser.add_argument("--spacing", metavar="METRES", type=positive,
                        help="distance between fluid points (fluid.spacing_m)")
    parser.add_argument("--end", metavar="SECONDS", type=positive,
                        help="end of the run (case.end_time_s)")
    parser.add_argument("--out", metavar="DIR", type=Path,
                        help="output folder (default: out/CASE, or out/CASE-SPACING)")
    parser.add_argument("--set", metavar="TABLE.KEY=VALUE", type=assignment, action="append",
                        default=[], dest="overrides", help="any key of the case file; repeatable")
    parser.add_argument("--threads", metavar="N", type=int,
                        help="threads of each solver (default: every core)")
    return parser.parse_args(arguments)


def overrides_of(options):
    overrides = list(options.overrides)
    if options.spacing is not None:
        overrides.append(f"fluid.spacing_m={options.spacing!r}")
    if options.end is not None:
        overrides.append(f"case.end_time_s={options.end!r}")
    return overrides


def case_file(options, folder):
    """The case file and the overrides left for the solvers.

    A case with a `prepare` script has settings of its own, in the table [parameters], from which
    that script writes the case file.
    """
    prepare = CASES / options.case / "prepare"
    if not prepare.is_file():
        return CASES / options.case / "case.toml", overrides_of(options)
    own = [text for text in options.overrides if text.strip().startswith("parameters.")]
    file = folder.with_name(folder.name + ".toml")
    file.parent.mkdir(parents=True, exist_ok=True)
    command = [str(prepare), str(file)]
    if options.spacing is not None:
        command += ["--spacing", repr(options.spacing)]
    for text in own:
        command += ["--set", text]
    status = subprocess.run(command).returncode
    if status != 0:
        sys.exit(EXIT_USAGE)
    # --spacing went into the file already; a --set of the user's goes to the programs.
    rest = [text for text in overrides_of(options)
            if text in options.overrides or not text.startswith("fluid.spacing_m=")]
    return file, [text for text in rest if text not in own]


def output_folder(options):
    if options.out is not None:
        return options.out.absolute()
    suffix = "" if options.spacing is None else f"-{options.spacing:g}"
    return ROOT / "out" / (options.case + suffix)


def show_state(text):
    """One line that is drawn over on a terminal; nothing elsewhere."""
    if sys.stderr.isatty():
        print(f"\r{text}\033[K", end="", file=sys.stderr, flush=True)


def quietly(command, title, log):
    """Runs a build command and returns its output, which goes to `log`; shown when it fails."""
    environment = dict(os.environ, NINJA_STATUS="[%f/%t] ")
    started = time.monotonic()
    process = subprocess.Popen(command, cwd=ROOT, text=True, env=environment, errors="replace",
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    lines = []
    with log.open("a", buffering=1) as file:
        for line in process.stdout:
            file.write(line)
            lines.append(line)
            step = re.match(r"\[\d+/\d+\]", line)
            if step:
                show_state(f"{title} {step.group()} {time.monotonic() - started:.0f} s")
    show_state("")
    if process.wait() != 0:
        print("".join(lines[-LINES_OF_A_FAILED_BUILD:]), end="", file=sys.stderr)
        print(f"cases/run: {title} failed; the whole output is in {log}", file=sys.stderr)
        sys.exit(EXIT_FAILED)
    return lines


def build():
    BUILD.mkdir(exist_ok=True)
    log = BUILD / "cases-run.log"
    log.write_text("")
    print("building ...", flush=True)
    started = time.monotonic()
    for line in quietly(["cmake", "--preset", "release"], "configuring", log):
        if "SKIPPED" in line:
            print(line.removeprefix("--").strip())
    quietly(["cmake", "--build", "--preset", "release", "--target", "programs",
             "-j", str(os.cpu_count() or 1)], "building", log)
    print(f"built in {time.monotonic() - started:.0f} s")


def set_options(overrides):
    return [part for text in overrides for part in ("--set", text)]


def run_solvers(options, folder):
    """The launcher runs a coupled case; a case of one solver brings its own `solve`."""
    file, overrides = case_file(options, folder)
    own = CASES / options.case / "solve"
    if own.is_file():
        return call_through_signals([str(own), str(folder)] + set_options(overrides))
    command = [str(BUILD / "bridge/launcher/sluice"), "run", str(file), "--out", str(folder)]
    command += set_options(overrides)
    if options.threads is not None:
        command += ["--threads", str(options.threads)]
    return call_through_signals(command)


def call_through_signals(command):
    """Runs `command` to its end: on a signal it is the launcher that stops the solvers and reports.

    Ctrl-C reaches the launcher from the terminal; the other signals are passed on.
    """
    process = subprocess.Popen(command)
    signal.signal(signal.SIGINT, lambda number, frame: None)
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda received, frame: process.send_signal(received))
    status = process.wait()
    return status if status >= 0 else 128 - status  # Popen says -signal


def run_script(options, script, folder, output=None):
    command = [str(CASES / options.case / script), str(folder)]
    return subprocess.run(command, stdout=output).returncode


def print_paths(options, folder):
    """Where everything is: figures, the tip's series, the ParaView file, the summaries."""
    names = sorted(path.name for path in folder.glob("*.png"))
    names += ["tip.csv", f"{options.case}.pvd", "summary.md", "summary.json"]
    print()
    for name in names:
        if (folder / name).is_file():
            print(folder / name)


def main(arguments):
    options = read_arguments(arguments)
    folder = output_folder(options)
    build()
    status = run_solvers(options, folder)
    if status != 0:
        return status
    verdict = run_script(options, "validate", folder)
    drawn = run_script(options, "plot", folder, subprocess.DEVNULL)
    print_paths(options, folder)
    return verdict if drawn == 0 else EXIT_FAILED


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except KeyboardInterrupt:
        sys.exit(130)
