# SPDX-License-Identifier: MIT
"""Case files that are computed: a template, its table [parameters], and the keys that follow from it.

A case's `prepare` gives a dataclass of its parameters, with a method `keys()` that returns
{table: {key: value}}; a table that occurs several times is named "fluid.wall.NAME".
"""

import argparse
import dataclasses
import re
import tomllib
from pathlib import Path


class Template:
    """The text of a case file whose keys get other values; comments and order stay."""

    def __init__(self, text):
        self.blocks = re.split(r"(?=^\[)", text, flags=re.MULTILINE)

    def set(self, table, key, value):
        """Replaces one key; KeyError when the template has no such key in that table."""
        for k, block in enumerate(self.blocks):
            if table in names_of(block):
                self.blocks[k], n = re.subn(
                    rf"^({re.escape(key)} = )(?:\[.*\]|\"[^\"\n]*\"|[^\s#]+)",
                    lambda match: match.group(1) + written(value), block, count=1,
                    flags=re.MULTILINE)
                if n == 1:
                    return
        raise KeyError(f"{table}.{key}")

    def text(self):
        return "".join(self.blocks)


def names_of(block):
    """How a block may be called: by its table and, where it has a name, with that behind."""
    table = re.match(r"\[+([\w.-]+)\]+", block)
    if table is None:
        return []
    name = re.search(r'^name = "([^"]*)"', block, flags=re.MULTILINE)
    return [table.group(1)] + ([f"{table.group(1)}.{name.group(1)}"] if name else [])


def written(value):
    """A value as TOML: numbers to twelve digits, lists, words."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(written(x) for x in value) + "]"
    return f"{value:.12g}"


def with_override(parameters, text):
    """The parameters with one parameters.KEY=VALUE applied; SystemExit on what cannot be."""
    key, _, value = text.partition("=")
    key = key.strip().removeprefix("parameters.")
    valid = {field.name: field.type for field in dataclasses.fields(parameters)}
    if key not in valid:
        raise SystemExit(f"prepare: unknown key 'parameters.{key}'; valid keys are "
                         + ", ".join(sorted(valid)))
    try:
        return dataclasses.replace(parameters, **{key: valid[key](value.strip().strip('"'))})
    except ValueError as error:
        raise SystemExit(f"prepare: parameters.{key} = {value.strip()}: {error}") from None


def fill(case, parameters):
    """The text of the case file `case` with the parameters and all keys that follow from them."""
    template = Template(case.read_text())
    tables = {"parameters": dataclasses.asdict(parameters), **parameters.keys()}
    for table, keys in tables.items():
        for key, value in keys.items():
            template.set(table, key, value)
    return template.text()


def read_arguments(documentation, arguments):
    parser = argparse.ArgumentParser(description=documentation.split("\n\n")[0])
    parser.add_argument("out", type=Path, metavar="OUT_FILE")
    parser.add_argument("--set", dest="overrides", action="append", default=[],
                        metavar="parameters.KEY=VALUE")
    parser.add_argument("--spacing", type=float, metavar="METRES", help="between the points")
    return parser.parse_args(arguments)


def main(documentation, case, parameters_type, arguments=None):
    """The command `prepare`: `parameters_type` has a method with_spacing(metres)."""
    options = read_arguments(documentation, arguments)
    try:
        parameters = parameters_type(**tomllib.loads(case.read_text())["parameters"])
        for text in options.overrides:
            parameters = with_override(parameters, text)
        if options.spacing is not None:
            parameters = parameters.with_spacing(options.spacing)
    except ValueError as error:
        raise SystemExit(f"prepare: {error}") from None
    options.out.write_text(fill(case, parameters))
