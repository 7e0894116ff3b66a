# SPDX-License-Identifier: MIT
"""The verdict on a run: checks against bands, notes, tables; summary.json, summary.md, exit status.

A case's `validate` is a function that takes the run's folder and returns a Verdict:

    if __name__ == "__main__":
        sys.exit(verdict.main(__doc__, judge))

and its `plot` one that draws it, behind `verdict.draw_main`.
Exit status: 0 complete and inside the bands, 3 complete but outside, 1 incomplete or unreadable.
"""

import argparse
import sys
from dataclasses import dataclass, field

import run_report
from compare import text_table
from run_folder import RunError, RunFolder

EXIT_INSIDE, EXIT_INCOMPLETE, EXIT_OUTSIDE = 0, 1, 3


@dataclass(frozen=True)
class Check:
    """One demand: what is measured, its value and its band as they are shown, and the outcome."""

    what: str
    value: str
    band: str
    holds: bool


def percent(x, digits=3):
    return f"{100 * x:.{digits}g} %"


def plain(x):
    return f"{x:.4g}"


def at_most(what, value, limit, show=plain):
    """Holds when value <= limit; a value that is missing or not a number does not."""
    return Check(what, "none" if value is None else show(value), f"<= {show(limit)}",
                 value is not None and bool(value <= limit))


def between(what, value, low, high, show=plain):
    return Check(what, "none" if value is None else show(value), f"{show(low)} to {show(high)}",
                 value is not None and bool(low <= value <= high))


def count_of(run, key, what):
    """A count of the run report that must be zero."""
    value = run.summary.get(key)
    return Check(what, "not reported" if value is None else str(value), "0", value == 0)


@dataclass
class Verdict:
    """What `judge` found on one run; None as `incomplete` means that the run reached its end."""

    checks: list = field(default_factory=list)
    notes: list = field(default_factory=list)
    results: dict = field(default_factory=dict)   # for summary.json
    tables: list = field(default_factory=list)    # of (header, rows)
    incomplete: str | None = None
    remark: str = ""                              # behind "inside the band"

    def add(self, *checks):
        self.checks += checks

    def outcome(self):
        outside = [check.what for check in self.checks if not check.holds]
        if self.incomplete is not None:
            return f"INCOMPLETE: {self.incomplete}"
        if outside:
            return "complete, outside the band: " + ", ".join(outside)
        if not self.checks:
            return "complete, nothing is judged"
        return "complete, inside the band" + self.remark

    def status(self):
        if self.incomplete is not None:
            return EXIT_INCOMPLETE
        return EXIT_INSIDE if all(check.holds for check in self.checks) else EXIT_OUTSIDE

    def write(self, run):
        run.summary["results"] = self.results
        run.write_summary()
        run_report.write(run, self)

    def show(self, case):
        tables = self.tables + [(["check", "value", "band", ""], check_rows(self.checks, "OUTSIDE"))]
        print("\n\n".join(text_table(header, rows) for header, rows in tables if rows))
        for note in self.notes:
            print(f"note: {note}")
        print(f"{case}: {self.outcome()}")


def check_rows(checks, outside="outside"):
    return [[c.what, c.value, c.band, "ok" if c.holds else outside] for c in checks]


def validate(folder, judge):
    """Judges one run, writes and prints what was found; returns the exit status."""
    run = RunFolder(folder)
    try:
        found = judge(run)
    except RunError as error:  # too short for what is to be measured, say
        found = Verdict(incomplete=str(error))
    if found.incomplete is None and not run.summary.get("completed"):
        found.incomplete = f"ended at {run.summary.get('end_time_s', 0):.4g} s"
    found.write(run)
    found.show(run.summary.get("case", run.path.name))
    return found.status()


def read_folder(documentation, arguments):
    """The one argument of the commands `validate` and `plot`."""
    parser = argparse.ArgumentParser(description=documentation.split("\n\n")[0])
    parser.add_argument("out", metavar="OUT_DIR", help="folder that a run has left")
    return parser.parse_args(arguments).out


def main(documentation, judge, arguments=None):
    """The command `validate`."""
    folder = read_folder(documentation, arguments)
    return guarded("validate", lambda: validate(folder, judge))


def draw_main(documentation, draw, arguments=None):
    """The command `plot`: `draw` takes the run and returns the figures' paths."""
    folder = read_folder(documentation, arguments)

    def draw_all():
        for path in draw(RunFolder(folder)):
            print(path)
        return EXIT_INSIDE
    return guarded("plot", draw_all)


def guarded(command, call):
    try:
        return call()
    except RunError as error:
        print(f"{command}: {error}", file=sys.stderr)
        return EXIT_INCOMPLETE
