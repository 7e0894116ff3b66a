#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""What a run of the fluid alone writes; usage: history_test.py SLUICE_FLUID."""

import csv
import math
import pathlib
import subprocess
import sys
import tempfile
import unittest

PROGRAM = ""
CASE = """
[case]
name = "column"
end_time_s = 0.01
time_step_s = 1e-3
output_interval_s = 0
[fluid]
spacing_m = 0.01
dynamic_viscosity_pa_s = 1e-3
open_sides = true
water_m = [[0, 0], [0.1, 0], [0.1, 0.14], [0, 0.14]]
[[fluid.wall]]
name = "tank"
points_m = [[0, 0.3], [0, 0], [0.8, 0]]
"""


def rows_of(*overrides):
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "case.toml").write_text(CASE)
        command = [PROGRAM, folder / "case.toml", "--out", folder / "out", "--threads", "1"]
        for override in overrides:
            command += ["--set", override]
        subprocess.run(command, check=True, capture_output=True)
        with open(folder / "out" / "fluid.csv", encoding="ascii") as file:
            return list(csv.DictReader(file))


class WallForceTest(unittest.TestCase):
    def test_it_is_left_out_on_request_and_nothing_else_changes(self):
        with_force, without = rows_of(), rows_of("fluid.record_wall_force=false")
        self.assertEqual(len(with_force), len(without))
        for a, b in zip(with_force[1:], without[1:]):
            for column in ("wall_force_x_n", "wall_force_y_n"):
                self.assertTrue(math.isfinite(float(a.pop(column))))
                self.assertTrue(math.isnan(float(b.pop(column))))
            self.assertEqual(a, b)


if __name__ == "__main__":
    PROGRAM = sys.argv.pop(1)
    unittest.main()
