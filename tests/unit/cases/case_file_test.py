# SPDX-License-Identifier: MIT
"""Case files that are computed from their parameters."""

import importlib
import tempfile
import tomllib
import unittest
from dataclasses import dataclass
from pathlib import Path

import paths
import case_file

TEXT = """# A case.
[parameters]
depth = 1  # metres

[fluid]
spacing_m = 0.1   # between points
water_m = [[0, 0], [1, 0], [1, 1]]

[[fluid.wall]]
name = "floor"
points_m = [[0, 0], [1, 0]]  # flat

[[fluid.wall]]
name = "side"
points_m = [[0, 1], [0, 0]]
"""

COMPUTED = {"cavity-skewed-power-law": ("cavity", "Cavity"),
            "dam-break": ("dam", "Dam"), "hydrostatic-tank": ("tank", "Tank"),
            "oscillating-drop": ("drop", "Drop"), "viscous-collapse": ("current", "Current")}


@dataclass(frozen=True)
class Basin:
    depth: float = 1.0

    def keys(self):
        return {"fluid": {"spacing_m": self.depth / 10},
                "fluid.wall.side": {"points_m": [[0, self.depth], [0, 0]]}}

    def with_spacing(self, spacing):
        return Basin(10 * spacing)


class TemplateTest(unittest.TestCase):
    def run_prepare(self, *arguments):
        with tempfile.TemporaryDirectory() as folder:
            template, out = Path(folder) / "case.toml", Path(folder) / "out.toml"
            template.write_text(TEXT)
            case_file.main("Writes.", template, Basin, [str(out), *arguments])
            return out.read_text()

    def test_only_what_follows_from_the_parameters_changes(self):
        text = self.run_prepare("--set", "parameters.depth=2")
        self.assertEqual(text, TEXT.replace("depth = 1 ", "depth = 2 ")
                         .replace("spacing_m = 0.1", "spacing_m = 0.2")
                         .replace("[[0, 1], [0, 0]]", "[[0, 2], [0, 0]]"))

    def test_spacing_is_a_matter_of_the_parameters(self):
        self.assertEqual(tomllib.loads(self.run_prepare("--spacing", "0.5"))["parameters"]["depth"], 5)

    def test_wrong_parameters_are_refused_with_the_valid_ones(self):
        for text, said in (("parameters.deep=2", "unknown key 'parameters.deep'; valid keys are depth"),
                           ("parameters.depth=deep", "parameters.depth = deep")):
            with self.assertRaises(SystemExit) as end:
                self.run_prepare("--set", text)
            self.assertIn(said, str(end.exception))

    def test_a_key_that_the_template_lacks_is_named(self):
        with self.assertRaisesRegex(KeyError, "fluid.density"):
            case_file.Template(TEXT).set("fluid", "density", 1)


class ComputedCasesTest(unittest.TestCase):
    def test_the_case_file_that_is_kept_is_the_one_for_its_own_parameters(self):
        for case, (module, name) in COMPUTED.items():
            with self.subTest(case):
                file = paths.case(case) / "case.toml"
                kept = tomllib.loads(file.read_text())
                parameters = getattr(importlib.import_module(module), name)(**kept["parameters"])
                self.assertEqual(tomllib.loads(case_file.fill(file, parameters)), kept)


if __name__ == "__main__":
    unittest.main()
