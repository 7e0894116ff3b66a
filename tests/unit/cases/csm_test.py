# SPDX-License-Identifier: MIT
"""Judging a run of Turek and Hron's structural tests: the reference against itself, made-up swings."""

import contextlib
import importlib.machinery
import importlib.util
import io
import json
import sys
import tempfile
import unittest
from pathlib import Path

import paths

sys.path.insert(0, str(paths.CASES / "turek-hron-csm"))

import csm  # noqa: E402
import numpy as np  # noqa: E402
import verdict  # noqa: E402
from compare import Curve  # noqa: E402


def command(name):
    loader = importlib.machinery.SourceFileLoader(
        f"csm_{name}", str(paths.CASES / "turek-hron-csm" / name))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(loader.name, loader))
    loader.exec_module(module)
    return module


class MeasureTest(unittest.TestCase):
    def test_featflows_history_has_featflows_published_extrema(self):
        found, wanted = csm.measure_swing(*csm.reference_history()), csm.swing_reference()
        for name in ("ux_mean_m", "ux_amplitude_m", "uy_mean_m", "uy_amplitude_m"):
            # the published digits, and the parabola between samples
            self.assertAlmostEqual(getattr(found, name) / getattr(wanted, name), 1, delta=3e-4)
        # its own crossings say 1.0948 Hz, its table 1.0995: inside the band all the same
        self.assertAlmostEqual(found.frequency_hz, 1.0948, delta=1e-4)
        self.assertTrue(all(check.holds for check in csm.swing_checks(found, wanted)))

    def test_mean_amplitude_and_frequency_of_a_known_swing(self):
        time = np.arange(0, 10, 0.005)
        uy = Curve(time, -0.06 - 0.065 * np.sin(2 * np.pi * 1.1 * time))
        ux = Curve(time, -0.014 + 0.0143 * np.cos(2 * np.pi * 1.1 * time))
        found = csm.measure_swing(ux, uy)
        self.assertAlmostEqual(found.frequency_hz, 1.1, delta=1e-5)
        self.assertAlmostEqual(found.uy_amplitude_m, 0.065, delta=1e-7)
        self.assertAlmostEqual(found.uy_mean_m, -0.06, delta=1e-7)
        self.assertAlmostEqual(found.ux_amplitude_m, 0.0143, delta=1e-7)

    def test_a_run_without_a_whole_period_has_no_swing(self):
        time = np.arange(0, 0.4, 0.005)
        flat = Curve(time, -time)
        self.assertIsNone(csm.measure_swing(flat, flat))


class ValidateTest(unittest.TestCase):
    def run_with(self, factor):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        folder = Path(temporary.name)
        (folder / "summary.json").write_text(json.dumps({"completed": True}))
        for test in ("csm1", "csm2"):
            (folder / test).mkdir()
            ux, uy = csm.static_reference(test)
            (folder / test / "probes.csv").write_text(
                f"time_s,A_ux_m,A_uy_m\n0,{factor * ux},{factor * uy}\n")
        ux, uy = csm.reference_history()
        (folder / "csm3").mkdir()
        rows = "".join(f"{t},{factor * x},{factor * y}\n"
                       for t, x, y in zip(ux.time, ux.value, uy.value))
        (folder / "csm3" / "probes.csv").write_text("time_s,A_ux_m,A_uy_m\n" + rows)
        with contextlib.redirect_stdout(io.StringIO()):
            return verdict.validate(folder, command("validate").judge), folder

    def test_the_reference_passes_and_a_percent_more_does_not(self):
        status, folder = self.run_with(1.0)
        self.assertEqual(status, 0)
        self.assertIn("csm1_ux_m", json.loads((folder / "summary.json").read_text())["results"])
        self.assertIn("inside the band", (folder / "summary.md").read_text())
        status, _ = self.run_with(1.01)
        self.assertEqual(status, 3)


if __name__ == "__main__":
    unittest.main()
