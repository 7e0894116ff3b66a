# SPDX-License-Identifier: MIT
import contextlib
import io
import signal
import subprocess
import tempfile
import unittest
from pathlib import Path

import paths
import run_case


def refused(*arguments):
    """What cases/run says about wrong arguments; it must end with status 2."""
    said = io.StringIO()
    with contextlib.redirect_stderr(said):
        try:
            run_case.read_arguments(arguments)
        except SystemExit as end:
            assert end.code == 2, end.code
            return said.getvalue()
    raise AssertionError("was not refused")


class ArgumentsTest(unittest.TestCase):
    def test_unknown_case_lists_the_valid_ones(self):
        self.assertIn("valid cases are cavity-skewed-power-law, dam-break, ", refused("elastic-gait"))

    def test_spacing_and_end_must_be_numbers_above_zero(self):
        for option in ("--spacing", "--end"):
            for value in ("0", "-1", "nan", "inf", "1mm"):
                self.assertIn("not a number above zero", refused("elastic-gate", option, value))

    def test_set_needs_table_key_and_value(self):
        for text in ("spacing_m=1", "fluid.spacing_m", "fluid.spacing_m="):
            self.assertIn("TABLE.KEY=VALUE", refused("elastic-gate", "--set", text))

    def test_spacing_and_end_become_overrides_of_the_case_file(self):
        options = run_case.read_arguments(["elastic-gate", "--spacing", "0.0005", "--end", "0.2",
                                           "--set", "bridge.scheme=serial-explicit"])
        self.assertEqual(run_case.overrides_of(options), [
            "bridge.scheme=serial-explicit", "fluid.spacing_m=0.0005", "case.end_time_s=0.2"])

    def test_output_folder(self):
        def folder(*arguments):
            return run_case.output_folder(run_case.read_arguments(["elastic-gate", *arguments]))
        self.assertEqual(folder(), paths.ROOT / "out/elastic-gate")
        self.assertEqual(folder("--spacing", "0.001"), paths.ROOT / "out/elastic-gate-0.001")
        self.assertEqual(folder("--out", "here"), Path.cwd() / "here")


class ScriptTest(unittest.TestCase):
    def test_launcher_that_a_signal_ends_gives_128_and_the_signal(self):
        handlers = {number: signal.getsignal(number)
                    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
        for number, handler in handlers.items():
            self.addCleanup(signal.signal, number, handler)
        self.assertEqual(run_case.call_through_signals(["sh", "-c", "kill -KILL $$"]),
                         128 + signal.SIGKILL)
        self.assertEqual(run_case.call_through_signals(["sh", "-c", "exit 3"]), 3)

    def test_command_works_from_any_folder(self):
        with tempfile.TemporaryDirectory() as elsewhere:
            done = subprocess.run([str(paths.CASES / "run"), "--help"], cwd=elsewhere,
                                  capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("--spacing", done.stdout)

    def test_every_case_has_what_the_command_calls(self):
        for name in run_case.case_names():
            for script in ("validate", "plot"):
                path = paths.CASES / name / script
                self.assertTrue(path.stat().st_mode & 0o111, f"{path} must be executable")
            self.assertTrue((paths.CASES / name / "README.md").is_file(), name)


if __name__ == "__main__":
    unittest.main()
