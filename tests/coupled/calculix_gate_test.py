# SPDX-License-Identifier: MIT
"""The gate with ccx as the solid, coarse and short.

    calculix_gate_test.py SLUICE SLUICE_CALCULIX [test ...]
"""

import csv
import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CASE = ROOT / "cases/elastic-gate/case.toml"
SLUICE = CALCULIX = ""
COARSE = ["fluid.spacing_m=0.004", "case.end_time_s=0.02", "case.time_step_s=5e-4"]
SHORT = COARSE + ["case.end_time_s=0.0025"]
CCX = ["solid.program=sluice-calculix", "solid.material=st-venant-kirchhoff"]
LONGEST_RUN_S = 200  # two hundred starts of ccx on a loaded machine
BALANCE = 1e-12      # sums of some hundred terms, forces handed over with 14 digits


def overrides(settings):
    return [word for text in settings for word in ("--set", text)]


class CalculixGateTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = Path(temporary.name)

    def run_gate(self, settings, name="out", case=CASE, arguments=()):
        out = self.folder / name
        command = [SLUICE, "run", str(case), "--out", str(out), *overrides(settings), *arguments]
        done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST_RUN_S)
        return done, out

    def completed(self, settings, **options):
        done, out = self.run_gate(settings, **options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return out

    def tip(self, out):
        with (out / "tip.csv").open() as rows:
            return [float(row["ux_m"]) for row in csv.DictReader(rows)]

    def refused(self, settings, *parts, case=CASE):
        done, out = self.run_gate(settings, case=case)
        self.assertNotIn(done.returncode, (0, 3))
        for part in parts:
            self.assertIn(part, done.stderr)
        return out

    def test_ccx_and_the_deal_ii_solver_move_alike(self):
        """Same element and law; windows are converged to 1e-4 of their increment and the time
        integrators differ in their damping and in the acceleration that they start from."""
        for element, end in (("q1", 0.01), ("incompatible-modes", 0.02)):
            with self.subTest(element=element):
                settings = COARSE + [f"case.end_time_s={end}", f"solid.element={element}",
                                     "solid.material=st-venant-kirchhoff"]
                ours = self.tip(self.completed(settings, name=f"deal.II-{element}"))
                out = self.completed(settings + CCX, name=f"ccx-{element}")
                theirs = self.tip(out)
                self.assertEqual(len(theirs), len(ours))
                difference = max(abs(a - b) for a, b in zip(ours, theirs)) / ours[-1]
                print(f"{element}: largest difference of the tip {difference:.1e} of "
                      f"{1e3 * ours[-1]:.2f} mm")
                self.assertLess(difference, 2e-3)
                self.check_promises(out, windows=len(ours) - 1)

    def check_promises(self, out, windows):
        summary = json.loads((out / "summary.json").read_text())
        self.assertEqual((summary["windows"], summary["failed_windows"]), (windows, 0))
        self.assertEqual(summary["ccx_runs"],
                         round(windows * summary["coupling_iterations_mean"]), "one per iteration")
        for quantity in ("force", "moment", "work"):
            self.assertLess(summary[f"{quantity}_balance_max"], BALANCE)
        self.assertIn("ccx", summary["phases_ms"]["solid"])
        self.assertEqual(len(list(out.glob("solid_*.vtu"))), 1 + windows // 20, "every 0.01 s")

    def log(self, out):
        return (out / "coupling.csv").read_text().splitlines()[1:]

    def test_cut_in_two_at_three_instants_it_leaves_the_same_bits(self):
        """The fastest point may move 0.02 spacings per window, too little in all but halves: a
        window is tried whole at 0, 1, 2 ms and cut."""
        settings = COARSE + CCX + ["fluid.courant=0.02", "bridge.max_halvings=2",
                                   "bridge.restart_every_windows=1", "case.output_interval_s=0"]
        end = ["case.end_time_s=0.003"]
        whole = self.completed(settings + end, name="whole")
        rows = [row.split(",") for row in self.log(whole)]
        cuts = [row[2] for row, after in zip(rows, rows[1:])
                if row[0] == after[0] and after[1] == "1"]
        self.assertEqual(cuts, ["0.0005", "0.0015", "0.0025"], "ends of the windows that were cut")
        for instant in ("0.001", "0.0015", "0.002"):
            half = self.completed(settings + [f"case.end_time_s={instant}"], name=f"half{instant}")
            rest = self.completed(settings + end, name=f"rest{instant}",
                                  arguments=["--restart", str(half)])
            self.assertEqual(self.log(half) + self.log(rest), self.log(whole), instant)
            self.assertEqual(self.tip(rest)[-1], self.tip(whole)[-1])

    def own_model(self, *changes):
        """The box as a user's own file: printed, then edited."""
        text = subprocess.run([CALCULIX, str(CASE), "--print-box", *overrides(CCX)],
                              capture_output=True, text=True, check=True).stdout
        for old, new in changes:
            self.assertIn(old, text)
            text = text.replace(old, new)
        (self.folder / "my.inp").write_text(text)
        scene = CASE.read_text()
        solid = scene.index("[solid]")
        case = self.folder / "my-gate.toml"
        case.write_text(scene[:solid] + '[solid]\nprogram = "sluice-calculix"\ninput = "my.inp"\n'
                        'interface_set = "Rubber-Skin"\nprobe_set = "TIP"\n')
        return case

    def test_a_users_own_model_gives_what_the_box_gives(self):
        case = self.own_model(("NSET=WETTED", "NSET=RUBBER-SKIN"))
        own = self.tip(self.completed(SHORT, name="own", case=case))
        self.assertEqual(own, self.tip(self.completed(SHORT + CCX, name="box")))

    def test_a_set_that_is_not_there_is_named_before_the_run(self):
        case = self.own_model(("NSET=WETTED", "NSET=RUBBER-SKINS"))
        self.refused(SHORT, "my.inp", "no node set 'Rubber-Skin'", "RUBBER-SKINS", case=case)

    def test_a_program_that_is_not_there_is_named_before_the_run(self):
        self.refused(SHORT + CCX + ["solid.ccx=/no/ccx"], "'/no/ccx'", "calculix-ccx")

    def test_ccx_that_is_killed_ends_the_run_with_its_window(self):
        script = self.folder / "ccx-that-dies"
        script.write_text("#!/bin/sh\necho >> calls\n"
                          "[ $(wc -l < calls) -gt 9 ] && kill -9 $$\nexec ccx $1\n")
        script.chmod(0o755)
        out = self.refused(COARSE + CCX + [f"solid.ccx={script}"], "ended by signal 9", "window ",
                           "window.log")
        self.assertGreater(len(self.tip(out)), 1, "what was computed is there")
        self.assertIn("signal 9", (out / "fluid.log").read_text(), "its partner knows why")


if __name__ == "__main__":
    SLUICE, CALCULIX = sys.argv[1:3]
    del sys.argv[1:3]
    unittest.main()
