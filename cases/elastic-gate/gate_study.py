# SPDX-License-Identifier: MIT
"""Runs of the elastic gate over steps, coupling schemes and spacings, and their tables.

Every run is a row of plain values: how it was set, whether it ran through (or when and why not),
what it cost and what its tip did. A table is renewed after each run, so that a study which is cut
short leaves what it has.
"""

import csv
import datetime
import json
import shutil
import signal
import subprocess
import textwrap
import time
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import numpy as np

import gate
from compare import markdown_table
from run_folder import RunError, RunFolder

ROOT = Path(__file__).resolve().parents[2]
CASE_FILE = Path(__file__).resolve().parent / "case.toml"
LAUNCHER = ROOT / "build/bridge/launcher/sluice"
EARLY_S = 0.06               # until the gap opens every run should agree
OUTFLOW_INSTANT_S = 0.08
SECONDS_TO_STOP = 30         # for the launcher, after the time limit
LONGEST_CAUSE = 110          # characters in a table


@dataclass(frozen=True)
class Setting:
    """One run of a study."""

    spacing_m: float
    step_s: float
    scheme: str        # serial-explicit, or the acceleration of the implicit one
    iterate: str       # pressure, full; none for the explicit scheme
    end_s: float

    @property
    def name(self):
        return f"h{self.spacing_m:g}-dt{self.step_s:g}-{self.scheme}-{self.iterate}"

    def overrides(self):
        found = [f"fluid.spacing_m={self.spacing_m:g}", f"case.time_step_s={self.step_s:g}",
                 f"case.end_time_s={self.end_s:g}", "case.output_interval_s=0"]
        if self.scheme == "serial-explicit":
            return found + ["bridge.scheme=serial-explicit"]
        return found + ["bridge.scheme=serial-implicit", f"bridge.acceleration={self.scheme}",
                        f"bridge.iterate={self.iterate}"]


@dataclass(frozen=True)
class Outcome:
    """What is known of one run; None where it did not get that far."""

    spacing_m: float
    step_s: float
    scheme: str
    iterate: str
    end_s: float
    completed: bool
    reached_s: float
    cause: str
    wall_time_s: float
    date: str
    commit: str
    iterations_mean: float = None
    iterations_max: int = None
    failed_windows: int = None
    lost_points: int = None
    peak_ux_m: float = None
    peak_ux_time_s: float = None
    min_ux_after_peak_m: float = None
    rms_ux_m: float = None
    ux_early_m: float = None
    outflow_past_tip_m2: float = None
    energy_gain_before_opening: float = None
    energy_gain_after_opening: float = None
    volume_drift_max: float = None
    cpu_time_s: float = None  # of fluid and solid; hardly depends on what else the machine does


def stability_settings(spacing, end, steps):
    """Every step with every scheme; the explicit one repeats nothing."""
    schemes = [("serial-explicit", "none")]
    schemes += [(scheme, iterate) for scheme in ("aitken", "iqn-ils")
                for iterate in ("pressure", "full")]
    return [Setting(spacing, step, scheme, iterate, end)
            for scheme, iterate in schemes for step in steps]


def precision_settings(spacings, steps, end):
    return [Setting(spacing, step, "iqn-ils", "pressure", end)
            for spacing in spacings for step in steps]


def execute(setting, folder, limit_s, case_file=CASE_FILE, options=()):
    """Runs the case into `folder`; returns what stopped it from outside, or an empty text."""
    command = [str(LAUNCHER), "run", str(case_file), "--out", str(folder), *options]
    for text in setting.overrides():
        command += ["--set", text]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        process.wait(timeout=limit_s)
        return ""
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGTERM)
        wait_or_kill(process)
        return f"time limit of {limit_s:g} s"


def wait_or_kill(process):
    try:
        process.wait(timeout=SECONDS_TO_STOP)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def first_failure(summary):
    """The message of the participant that failed by itself; of any, when all were stopped."""
    ended = [p for p in summary.get("participants", {}).values() if p["exit_status"] != 0]
    by_itself = [p for p in ended if "stopped by sluice" not in p["ended"]] or ended
    if not by_itself:
        return "" if summary.get("completed") else "ended before its end time"
    message = by_itself[0]["message"] or by_itself[0]["ended"]
    # A partner that was told why repeats it: the cause is the end of its sentence.
    return " ".join(message.split("its last message: ")[-1].split())


def tip_values(run):
    """What the tip did, as far as the run went."""
    try:
        tip = gate.read_tip(run)
    except RunError:
        return {}, 0.0
    m = gate.measure(tip, gate.read_experiment())
    early = tip.ux.covers([EARLY_S])[0]
    return {"peak_ux_m": m.peak_ux_m, "peak_ux_time_s": m.peak_ux_time_s,
            "min_ux_after_peak_m": m.min_ux_after_peak_m, "rms_ux_m": m.rms_ux_m,
            "ux_early_m": float(tip.ux.at([EARLY_S])[0]) if early else None}, float(tip.ux.end)


def fluid_values(run):
    if not run.has("fluid.csv"):
        return {}
    fluid = run.series("fluid.csv")
    before, after = gate.energy_gain(fluid)
    reached = len(fluid["time_s"]) and fluid["time_s"][-1] >= OUTFLOW_INSTANT_S
    outflow = float(np.interp(OUTFLOW_INSTANT_S, fluid["time_s"],
                              fluid["outflow_past_tip_m2"])) if reached else None
    return {"energy_gain_before_opening": before, "energy_gain_after_opening": after,
            "outflow_past_tip_m2": outflow}


def read_outcome(setting, folder, stopped_by, known):
    """`known` holds what the run's folder does not: date, commit, wall time from outside."""
    run = RunFolder(folder)
    tip, reached = tip_values(run)
    s = run.summary
    known = {**known, "wall_time_s": s.get("wall_time_s") or known["wall_time_s"]}
    return Outcome(
        **asdict(setting), completed=bool(s.get("completed")) and not stopped_by,
        reached_s=reached, cause=stopped_by or first_failure(s), **known,
        iterations_mean=s.get("coupling_iterations_mean"),
        iterations_max=s.get("coupling_iterations_max"), failed_windows=s.get("failed_windows"),
        lost_points=s.get("lost_points"), volume_drift_max=s.get("volume_drift_max"),
        cpu_time_s=s.get("cpu_time_s"),
        **tip, **fluid_values(run))


def run_anew(setting, folder, limit_s):
    shutil.rmtree(folder, ignore_errors=True)  # a run that does not start leaves nothing to read
    started = time.monotonic()
    stopped_by = execute(setting, folder, limit_s)
    known = {"wall_time_s": time.monotonic() - started, "commit": commit(),
             "date": datetime.date.today().isoformat()}
    try:
        return read_outcome(setting, folder, stopped_by, known)
    except RunError as error:
        return Outcome(**asdict(setting), completed=False, reached_s=0.0,
                       cause=stopped_by or f"did not start: {error}", **known)


def on_record(setting, record):
    """The outcome of the same run in an earlier study, or None."""
    if not record.is_file():
        return None
    outcome = Outcome(**json.loads(record.read_text()))
    same = all(getattr(outcome, f.name) == getattr(setting, f.name) for f in fields(Setting))
    return outcome if same else None


def outcome_of(setting, folder, limit_s, resume):
    record = folder / "outcome.json"
    known = on_record(setting, record) if resume else None
    if known is not None:
        return known
    outcome = run_anew(setting, folder, limit_s)
    folder.mkdir(parents=True, exist_ok=True)
    record.write_text(json.dumps(asdict(outcome), indent=2) + "\n")
    return outcome


def finest(outcomes):
    """The complete run with the smallest spacing, then the smallest step; None without one."""
    complete = [o for o in outcomes if o.completed]
    return min(complete, key=lambda o: (o.spacing_m, o.step_s), default=None)


def shown(value, scale=1.0, digits=1):
    return None if value is None else f"{scale * value:.{digits}f}"


def result(outcome):
    """For the tables; the CSV has the whole cause."""
    if outcome.completed:
        return "ran through"
    cause = textwrap.shorten(outcome.cause, LONGEST_CAUSE, placeholder=" ...")
    return f"stopped at {outcome.reached_s:.4f} s: {cause}"


COMMON_HEADER = ["iterations mean (max)", "peak x mm", "at s", "then min mm", "x at 0.06 s mm",
                 "outflow to 0.08 s mm2", "energy gain %, before / after opening",
                 "failed windows / lost points", "run time s", "CPU time s"]


def common_cells(o):
    iterations = None if o.iterations_mean is None \
        else f"{o.iterations_mean:.1f} ({o.iterations_max})"
    gains = [shown(g, 100, 2) or "-" for g in (o.energy_gain_before_opening,
                                               o.energy_gain_after_opening)]
    counts = ["-" if n is None else str(n) for n in (o.failed_windows, o.lost_points)]
    return [iterations, shown(o.peak_ux_m, 1e3), shown(o.peak_ux_time_s, 1, 3),
            shown(o.min_ux_after_peak_m, 1e3), shown(o.ux_early_m, 1e3, 2),
            shown(o.outflow_past_tip_m2, 1e6, 0), " / ".join(gains), " / ".join(counts),
            shown(o.wall_time_s), shown(o.cpu_time_s)]


def stability_table(outcomes):
    return markdown_table(["coupling", "repeats", "step s", "result"] + COMMON_HEADER,
                          [[o.scheme, o.iterate, f"{o.step_s:g}", result(o)] + common_cells(o)
                           for o in outcomes])


def precision_table(outcomes):
    """Sorted by run time; errors against the finest run."""
    best = finest(outcomes)

    def against(o, key, scale, digits=2):
        mine, reference = getattr(o, key), best and getattr(best, key)
        if mine is None or not reference:
            return None
        return "(reference)" if o is best else shown(mine - reference, scale / reference, digits)
    rows = [[f"{1e3 * o.spacing_m:g}", f"{o.step_s:g}", result(o),
             against(o, "peak_ux_m", 1e3 * (best.peak_ux_m if best else 1)),
             against(o, "ux_early_m", 100), shown(o.rms_ux_m, 1e3)] + common_cells(o)
            for o in sorted(outcomes, key=lambda o: o.wall_time_s)]
    return markdown_table(["spacing mm", "step s", "result", "peak x error mm",
                           "x at 0.06 s error %", "rms x to experiment mm"] + COMMON_HEADER, rows)


def commit():
    def git(*arguments):
        return subprocess.run(["git", "-C", str(ROOT), *arguments], capture_output=True,
                              text=True).stdout.strip()
    name = git("rev-parse", "--short", "HEAD") or "unknown"
    return name + (" with changes" if git("status", "--porcelain", "--untracked-files=no") else "")


def origin(outcomes):
    """Dates, commits and machine: what a number needs to be quoted."""
    models = [line.split(":", 1)[1].strip()
              for line in Path("/proc/cpuinfo").read_text().splitlines()
              if line.startswith("model name")]
    dates = sorted({o.date for o in outcomes})
    commits = sorted({o.commit for o in outcomes})
    machine = f"{len(models)} x {models[0] if models else 'unknown processor'}"
    return f"Measured on {', '.join(dates)}; {machine}; commit {', '.join(commits)}."


def write_tables(name, outcomes, table, folder):
    """FOLDER/NAME.csv with every value and FOLDER/NAME.md to read."""
    with (folder / f"{name}.csv").open("w", newline="") as file:
        file.write(f"# {origin(outcomes)}\n")
        writer = csv.DictWriter(file, [f.name for f in fields(Outcome)])
        writer.writeheader()
        writer.writerows(asdict(o) for o in outcomes)
    (folder / f"{name}.md").write_text(f"{origin(outcomes)}\n\n{table(outcomes)}\n")
