# SPDX-License-Identifier: MIT
"""What every case's verdict shares: bands, the exit status, what is written and said."""

import contextlib
import io
import json
import math
import tempfile
import unittest
from pathlib import Path

import paths  # noqa: F401  (puts the modules under test on the path)
import verdict
from run_folder import RunError
from verdict import Verdict, at_most, between


class CheckTest(unittest.TestCase):
    def test_a_band_contains_its_ends_and_nothing_beyond(self):
        self.assertTrue(at_most("drift", 0.01, 0.01).holds)
        self.assertFalse(at_most("drift", 0.0101, 0.01).holds)
        self.assertTrue(between("front", 1.0, 1.0, 2.0).holds)
        self.assertFalse(between("front", 0.99, 1.0, 2.0).holds)

    def test_what_is_missing_or_not_a_number_is_outside(self):
        for value in (None, math.nan):
            self.assertFalse(at_most("drift", value, 0.01).holds)
            self.assertFalse(between("drift", value, -1, 1).holds)

    def test_a_negative_drift_is_judged_by_what_the_case_passes(self):
        self.assertEqual(at_most("drift", 0.0123, 0.02, verdict.percent).value, "1.23 %")


class ValidateTest(unittest.TestCase):
    def run_with(self, judge, **summary):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder)
            (path / "summary.json").write_text(json.dumps({"case": "tank", **summary}))
            said, complained = io.StringIO(), io.StringIO()
            with contextlib.redirect_stdout(said), contextlib.redirect_stderr(complained):
                status = verdict.main("Measures.", judge, [folder])
            page = path / "summary.md"
            return (status, said.getvalue() + complained.getvalue(),
                    page.read_text() if page.is_file() else "",
                    json.loads((path / "summary.json").read_text()))

    def test_status_0_inside_3_outside_1_incomplete(self):
        def judge_with(limit):
            return lambda run: Verdict([at_most("drift", 0.5, limit)], results={"drift": 0.5})
        status, said, page, summary = self.run_with(judge_with(1), completed=True)
        self.assertEqual((status, summary["results"]), (0, {"drift": 0.5}))
        self.assertIn("tank: complete, inside the band", said)
        self.assertIn("| drift | 0.5 | <= 1 | ok |", page)
        status, said, _, _ = self.run_with(judge_with(0.1), completed=True)
        self.assertEqual(status, 3)
        self.assertIn("outside the band: drift", said)
        status, said, _, _ = self.run_with(judge_with(1), completed=False, end_time_s=2.5)
        self.assertEqual(status, 1)
        self.assertIn("INCOMPLETE: ended at 2.5 s", said)

    def test_a_run_too_short_to_be_judged_has_a_page_that_says_why(self):
        def too_short(run):
            raise RunError("the front ends at 1.03 widths")
        status, said, page, _ = self.run_with(too_short, completed=True)
        self.assertEqual(status, 1)
        for text in (said, page):
            self.assertIn("INCOMPLETE: the front ends at 1.03 widths", text)

    def test_a_run_that_is_judged_by_nothing_does_not_claim_to_be_inside(self):
        _, said, _, _ = self.run_with(lambda run: Verdict(), completed=True)
        self.assertIn("nothing is judged", said)

    def test_a_series_that_is_missing_is_named(self):
        def judge(run):
            run.series("fluid.csv")
        status, said, _, _ = self.run_with(judge, completed=True)
        self.assertEqual(status, 1)
        self.assertRegex(said, r"INCOMPLETE: .*fluid\.csv: is not there")


if __name__ == "__main__":
    unittest.main()
