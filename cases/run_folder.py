# SPDX-License-Identifier: MIT
"""Reading what a run left in its folder: summary, case file, time series, ParaView collections."""

import json
import os
import tomllib
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np


class RunError(Exception):
    """A run folder that cannot be used; the message says what is wrong and what to do."""


def read_columns(path):
    """A CSV file with a header as {column: array}; lines that start with '#' are comments.

    A last row that was cut short, by a program that ended while writing, is left out.
    """
    try:
        lines = [line for line in Path(path).read_text().splitlines()
                 if line and not line.startswith("#")]
    except FileNotFoundError:
        raise RunError(f"{path}: is not there; did the run start?") from None
    if not lines:
        raise RunError(f"{path}: is empty")
    names = lines[0].split(",")
    rows = [line.split(",") for line in lines[1:]]
    rows = [row for row in rows if len(row) == len(names)]
    return {name: column([row[k] for row in rows]) for k, name in enumerate(names)}


def column(cells):
    try:
        return np.array(cells, float)
    except ValueError:
        return np.array(cells)


def set_key(case, text):
    """Applies one TABLE.KEY=VALUE to a parsed case file; a bare word is a string."""
    path, _, value = text.partition("=")
    try:
        parsed = tomllib.loads("value = " + value)["value"]
    except tomllib.TOMLDecodeError:
        parsed = value.strip()
    *tables, key = path.strip().split(".")
    for table in tables:
        case = case.setdefault(table, {})
    case[key] = parsed


class RunFolder:
    """One run's output folder."""

    def __init__(self, path):
        self.path = Path(path)
        self.summary_file = self.path / "summary.json"
        try:
            self.summary = json.loads(self.summary_file.read_text())
        except FileNotFoundError:
            raise RunError(f"{self.summary_file}: is not there; "
                           "give the output folder of a run") from None
        except json.JSONDecodeError as error:
            raise RunError(f"{self.summary_file}:{error.lineno}: not JSON: {error.msg}") from None

    def case(self):
        """The case file as it was run, overrides applied."""
        file = self.path / "case.toml"
        try:
            case = tomllib.loads(file.read_text())
        except FileNotFoundError:
            raise RunError(f"{file}: is not there; `sluice run` leaves it") from None
        for text in self.summary.get("overrides", []):
            set_key(case, text)
        return case

    def series(self, name):
        """Columns of a time series; empty arrays when the run ended before its first row."""
        return read_columns(self.path / name)

    def has(self, name):
        return (self.path / name).is_file()

    def collection(self, part):
        """[(time, file)] of PART.pvd, sorted by time; empty when it was not written. PART may lie in
        a folder below, as of one of several runs."""
        file = self.path / f"{part}.pvd"
        if not file.is_file():
            return []
        try:
            root = ElementTree.parse(file).getroot()
        except ElementTree.ParseError as error:
            raise RunError(f"{file}: not XML: {error}") from None
        entries = [(float(e.get("timestep")), file.parent / e.get("file"))
                   for e in root.iter("DataSet")]
        return sorted(entry for entry in entries if entry[1].is_file())

    def write_summary(self):
        """Replaces summary.json in one step: a reader never sees half a file."""
        temporary = self.summary_file.with_suffix(".json.new")
        temporary.write_text(json.dumps(self.summary, indent=2) + "\n")
        os.replace(temporary, self.summary_file)
