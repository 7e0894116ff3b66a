# SPDX-License-Identifier: MIT
"""The study's bookkeeping, with a stand-in for the launcher that makes up each run."""

import csv
import tempfile
import unittest
from pathlib import Path

import paths
import gate_study as study

# Makes up a run as --set asks for it: peaks depend on the spacing; explicit runs fail, steps of
# 4e-4 never end.
LAUNCHER = f"""#!/usr/bin/python3 -B
import json, sys, time
sys.path.insert(0, {str(paths.ROOT / 'tests/support')!r})
import synthetic_gate_run as made_up
out = sys.argv[sys.argv.index("--out") + 1]
keys = dict(text.split("=") for text in sys.argv if "=" in text)
end, step, spacing = (float(keys[k]) for k in
                      ("case.end_time_s", "case.time_step_s", "fluid.spacing_m"))
failed = keys["bridge.scheme"] == "serial-explicit"
message = "sluice-fluid: solid gave up; its last message: it\\n  diverged"
participants = {{"fluid": {{"exit_status": 1, "ended": "exit status 1",
                           "message": message}}}} if failed else {{}}
made_up.write_run(out, end=0.002 if failed else end, window=step, spacing=spacing, fields=False,
                  peak=0.036 + spacing, completed=not failed, participants=participants,
                  wall_time_s=1 / spacing)
if step == 4e-4:
    time.sleep(60)
"""


class StudyTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = Path(temporary.name)
        launcher = self.folder / "sluice"
        launcher.write_text(LAUNCHER)
        launcher.chmod(0o755)
        self.addCleanup(setattr, study, "LAUNCHER", study.LAUNCHER)
        study.LAUNCHER = launcher

    def outcome(self, setting, limit_s=30, resume=False):
        return study.outcome_of(setting, self.folder / setting.name, limit_s, resume)

    def test_stability_has_every_step_with_every_scheme(self):
        settings = study.stability_settings(0.002, 0.4, (1e-4, 2e-4))
        self.assertEqual(len(settings), 2 * (1 + 2 * 2))
        self.assertEqual(len({s.name for s in settings}), len(settings))

    def test_run_that_goes_through_is_measured(self):
        o = self.outcome(study.Setting(0.004, 1e-3, "iqn-ils", "pressure", 0.1))
        self.assertTrue(o.completed, o.cause)
        self.assertAlmostEqual(o.reached_s, 0.1)
        self.assertGreater(o.ux_early_m, 0.02)
        self.assertGreater(o.outflow_past_tip_m2, 0)
        self.assertEqual((o.iterations_mean, o.iterations_max), (3.4, 7))

    def test_failure_is_a_row_with_its_time_and_cause(self):
        o = self.outcome(study.Setting(0.004, 1e-3, "serial-explicit", "none", 0.1))
        self.assertEqual((o.completed, o.cause), (False, "it diverged"))
        self.assertAlmostEqual(o.reached_s, 0.002)
        self.assertIn("stopped at 0.0020 s: it diverged", study.stability_table([o]))

    def test_run_beyond_its_limit_is_stopped_and_says_so(self):
        o = self.outcome(study.Setting(0.004, 4e-4, "aitken", "full", 0.1), limit_s=1.5)
        self.assertEqual((o.completed, o.cause), (False, "time limit of 1.5 s"))

    def test_launcher_that_does_not_start_a_run_is_a_row_too(self):
        study.LAUNCHER.write_text("#!/bin/sh\nexit 1\n")
        o = self.outcome(study.Setting(0.004, 1e-3, "aitken", "full", 0.1))
        self.assertTrue(o.cause.startswith("did not start"))

    def test_resumed_study_does_not_repeat_a_run(self):
        setting = study.Setting(0.004, 1e-3, "iqn-ils", "pressure", 0.01)
        first = self.outcome(setting)
        study.LAUNCHER.write_text("#!/bin/sh\nexit 1\n")
        self.assertEqual(self.outcome(setting, resume=True), first)
        self.assertNotEqual(self.outcome(setting, resume=False), first)

    def test_precision_is_measured_against_the_finest_run(self):
        outcomes = [self.outcome(s) for s in study.precision_settings((0.004, 0.002), (1e-3,), 0.2)]
        self.assertEqual(study.finest(outcomes).spacing_m, 0.002)
        coarse, fine = study.precision_table(outcomes).splitlines()[2:]
        self.assertIn("(reference)", fine)
        self.assertIn("| 4 | 0.001 | ran through | 1.99 |", coarse)  # the peaks differ by 2 mm

    def test_tables_are_written_with_date_machine_and_commit(self):
        o = self.outcome(study.Setting(0.004, 1e-3, "iqn-ils", "pressure", 0.01))
        study.write_tables("stability", [o], study.stability_table, self.folder)
        first, header, row = (self.folder / "stability.csv").read_text().splitlines()
        self.assertRegex(first, r"^# Measured on \d{4}-\d\d-\d\d; \d+ x .*; commit \w+")
        self.assertEqual(dict(zip(header.split(","), next(csv.reader([row]))))["step_s"], "0.001")


if __name__ == "__main__":
    unittest.main()
