# SPDX-License-Identifier: MIT
"""The rows of the study of laws, and its bookkeeping with a stand-in for the launcher."""

import csv
import tempfile
import tomllib
import unittest
from pathlib import Path

import paths
import gate_laws as laws
import gate_study as study
from run_folder import set_key

# Makes up a run whose peak depends on the element.
LAUNCHER = f"""#!/usr/bin/python3 -B
import sys
sys.path.insert(0, {str(paths.ROOT / 'tests/support')!r})
import synthetic_gate_run as made_up
out = sys.argv[sys.argv.index("--out") + 1]
made_up.write_run(out, end=0.4, window=1e-3, spacing=0.002, fields=False,
                  peak=0.030 if "solid.element=q1" in sys.argv else 0.040, completed=True,
                  participants={{}}, wall_time_s=1)
"""


def solid_of(row):
    case = tomllib.loads(row.case_text())
    for text in row.overrides():
        set_key(case, text)
    return case["solid"]


class RowsTest(unittest.TestCase):
    def test_laws_of_the_same_modulus_have_it(self):
        for row in laws.ROWS:
            solid = solid_of(row)
            nu = solid["poisson_ratio"]
            modulus = solid.get("youngs_modulus_pa") or \
                4 * (1 + nu) * (solid["c10_pa"] + solid["c01_pa"])
            self.assertAlmostEqual(modulus / (1 - nu**2) / row.bending_modulus_pa, 1, delta=1e-5)
            if row.name not in ("svk-7.8", "shore-70"):
                self.assertAlmostEqual(modulus / 12e6, 1, delta=1e-5)

    def test_no_row_has_a_key_that_its_law_has_no_use_for(self):
        for row in laws.ROWS:
            solid = solid_of(row)
            self.assertNotEqual("youngs_modulus_pa" in solid, "c10_pa" in solid, row.name)

    def test_names_are_unique(self):
        self.assertEqual(len({row.name for row in laws.ROWS}), len(laws.ROWS))


class BookkeepingTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = Path(temporary.name)
        launcher = self.folder / "sluice"
        launcher.write_text(LAUNCHER)
        launcher.chmod(0o755)
        self.addCleanup(setattr, study, "LAUNCHER", study.LAUNCHER)
        study.LAUNCHER = launcher

    def test_every_run_is_a_row_and_none_is_repeated(self):
        rows = [row for row in laws.ROWS if row.name in ("neo-hookean", "q1")]
        outcomes = [laws.run_row(row, self.folder / row.name, 30) for row in rows]
        self.assertAlmostEqual(outcomes[1].peak_ux_m / outcomes[0].peak_ux_m, 0.75)
        study.LAUNCHER.unlink()
        again = [laws.run_row(row, self.folder / row.name, 30) for row in rows]
        self.assertEqual(again, outcomes)
        self.assertTrue(laws.write(outcomes, self.folder).is_file())
        table = (self.folder / "laws.md").read_text()
        self.assertEqual(table.count("ran through"), 2)
        with (self.folder / "laws.csv").open() as file:
            self.assertTrue(next(file).startswith("# Measured on"))
            self.assertEqual([row["name"] for row in csv.DictReader(file)], ["neo-hookean", "q1"])
        # The made-up curves are proportional: their difference is a quarter of the first.
        self.assertGreater(laws.difference(self.folder, "q1", "neo-hookean"), 5e-3)


if __name__ == "__main__":
    unittest.main()
