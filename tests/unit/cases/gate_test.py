# SPDX-License-Identifier: MIT
"""Judging and drawing a run of the elastic gate, on made-up runs of known motion."""

import contextlib
import importlib.machinery
import importlib.util
import io
import json
import subprocess
import tempfile
import unittest
from pathlib import Path

import paths
import gate
import gate_strip
import numpy as np
import synthetic_gate_run
from run_folder import RunError, RunFolder


def command(name):
    """The module of a case's command, which has no .py in its name."""
    loader = importlib.machinery.SourceFileLoader(name, str(paths.CASES / "elastic-gate" / name))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(name, loader))
    loader.exec_module(module)
    return module


VALIDATE = command("validate")


class RunTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.path = Path(temporary.name) / "run"

    def write(self, **options):
        options = {"fields": False, "window": 1e-3, **options}
        return synthetic_gate_run.write_run(self.path, **options)

    def validate(self):
        """What the command does: its exit status and what it says."""
        said, complained = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(complained):
            status = VALIDATE.main([str(self.path)])
        return subprocess.CompletedProcess([], status, said.getvalue(), complained.getvalue())

    def results(self):
        return json.loads((self.path / "summary.json").read_text())["results"]


class ReferenceTest(unittest.TestCase):
    def test_experiment_has_nine_instants_after_the_start(self):
        instants = gate.read_experiment().at_instants().ux.time
        self.assertEqual(len(instants), 9)
        for expected, actual in zip(gate.INSTANTS_S, instants):
            self.assertAlmostEqual(expected, actual)

    def test_experiment_peaks_where_the_source_says(self):
        measures = gate.measure(gate.read_experiment().tip, gate.read_experiment())
        self.assertAlmostEqual(measures.peak_ux_m, 0.0462)
        self.assertAlmostEqual(measures.peak_ux_time_s, 0.16)
        self.assertEqual(measures.rms_ux_m, 0.0)

    def test_published_curves_lie_inside_the_band_of_the_literature(self):
        published = gate.read_published()
        self.assertEqual(set(published), set(gate.PUBLISHED.values()))
        for name, tip in published.items():
            peak, time = tip.ux.peak()
            print(f"{name}: peak {1e3 * peak:.1f} mm at {time:.3f} s")
            self.assertTrue(0.035 <= peak <= 0.0502 and 0.10 <= time <= 0.165, name)


class ValidateTest(RunTest):
    def test_complete_run_inside_the_bands_ends_with_0(self):
        self.write(peak=0.040)
        done = self.validate()
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("Khayyer 2018", done.stdout)
        results = self.results()
        self.assertAlmostEqual(results["peak_ux_m"], 0.0398, delta=2e-4)
        self.assertEqual(results["instants_compared"], 9)
        for key in ("peak_ux_time_s", "peak_uy_m", "rms_ux_m", "rms_uy_m"):
            self.assertIsInstance(results[key], float)
        self.assertIn("inside the band", (self.path / "summary.md").read_text())

    def test_peak_outside_the_band_ends_with_3(self):
        self.write(peak=0.055)
        done = self.validate()
        self.assertEqual(done.returncode, 3)
        self.assertIn("peak of x", done.stdout.splitlines()[-1])

    def test_lost_point_or_failed_window_ends_with_3(self):
        for key in ("lost_points", "failed_windows"):
            self.write(**{key: 1})
            self.assertEqual(self.validate().returncode, 3, key)

    def test_count_that_was_not_reported_is_not_taken_for_zero(self):
        self.write(lost_points=None)
        self.assertEqual(self.validate().returncode, 3)

    def test_run_that_stopped_early_is_incomplete(self):
        self.write(end=0.3)
        synthetic_gate_run.write_summary(self.path, ["case.end_time_s=0.4"])
        done = self.validate()
        self.assertEqual(done.returncode, 1)
        self.assertIn("INCOMPLETE: ended at 0.3 s of 0.4 s", done.stdout)

    def test_short_run_is_judged_on_what_it_contains_and_says_so(self):
        self.write(end=0.06, peak=0.060)
        done = self.validate()
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertIn("peak and minimum are not judged", done.stdout)
        self.assertEqual(self.results()["instants_compared"], 1)

    def test_imbalance_is_noted(self):
        self.write(moment_balance_max=1e-6)
        self.assertIn("moment_balance_max is 1e-06", self.validate().stdout)

    def test_command_says_the_same(self):
        self.write(peak=0.055)
        done = subprocess.run([str(paths.CASES / "elastic-gate/validate"), str(self.path)],
                              capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stdout), (3, self.validate().stdout))

    def test_folder_without_series_is_incomplete_and_the_page_names_it(self):
        self.write()
        (self.path / "tip.csv").unlink()
        done = self.validate()
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stdout, r"INCOMPLETE: .*tip\.csv: is not there")

    def test_run_without_a_row_is_refused(self):
        self.write()
        (self.path / "tip.csv").write_text("time_s,ux_m,uy_m\n")
        with self.assertRaisesRegex(RunError, "first window"):
            gate.read_tip(RunFolder(self.path))


class BalanceTest(RunTest):
    def fluid_in_free_fall(self, wall_force):
        """1.4e-2 m2 of water that falls for 0.1 s while the walls get `wall_force` [N/m]."""
        time = np.linspace(0.01, 0.1, 10)
        mass = 1000 * 0.014
        zero = 0 * time
        return {"time_s": time, "momentum_x_n_s": zero, "momentum_y_n_s": -mass * 9.81 * time,
                "outlet_momentum_x_n_s": zero, "outlet_momentum_y_n_s": zero,
                "wall_force_x_n": zero, "wall_force_y_n": zero + wall_force,
                "point_volume_m2": zero + 0.014, "outflow_m2": zero}

    def test_free_fall_keeps_the_momentum_balance(self):
        run = RunFolder(self.write())
        largest, mean = gate.momentum_balance(run, self.fluid_in_free_fall(0.0))
        self.assertLess(max(largest, mean), 1e-13)

    def test_momentum_that_left_through_the_outlet_counts(self):
        run = RunFolder(self.write())
        fluid = self.fluid_in_free_fall(0.0)
        fluid["momentum_y_n_s"] = fluid["momentum_y_n_s"] + 3.0
        fluid["outlet_momentum_y_n_s"] = fluid["outlet_momentum_y_n_s"] - 3.0
        fluid["momentum_y_n_s"][5:] += 2.0
        fluid["outlet_momentum_y_n_s"][5:] -= 2.0
        largest, mean = gate.momentum_balance(run, fluid)
        self.assertLess(max(largest, mean), 1e-12)

    def test_force_on_a_wall_that_no_momentum_answers_is_seen(self):
        run = RunFolder(self.write())
        scale = 0.5 * 1000 * 9.81 * 0.14**2
        largest, mean = gate.momentum_balance(run, self.fluid_in_free_fall(-0.02 * scale))
        self.assertAlmostEqual(largest, 0.02)
        self.assertAlmostEqual(mean, 0.02)

    def test_run_without_the_columns_has_no_balance(self):
        run = RunFolder(self.write())
        self.assertEqual(gate.momentum_balance(run, run.series("fluid.csv")), (None, None))

    def test_energy_that_left_through_the_outlet_counts(self):
        one = np.ones(3)
        fluid = {"kinetic_j": 0 * one, "potential_j": np.array([1.0, 0.9, 0.8]),
                 "work_on_walls_j": 0 * one, "outlet_energy_j": np.array([0.0, 0.1, 0.3]),
                 "outflow_past_tip_m2": np.array([0.0, 0.0, 0.1])}
        before, after = gate.energy_gain(fluid)
        self.assertAlmostEqual(before, 0.0)
        self.assertAlmostEqual(after, 0.1)


class PlotTest(RunTest):
    def plot(self):
        return subprocess.run([str(paths.CASES / "elastic-gate/plot"), str(self.path)],
                              capture_output=True, text=True)

    def test_figures_of_a_complete_run(self):
        self.write(fields=True, spacing=0.008)
        done = self.plot()
        self.assertEqual(done.returncode, 0, done.stderr)
        for name in ("tip", "levels", "energy", "strip"):
            self.assertTrue((self.path / f"{name}.png").stat().st_size > 10_000, name)

    def test_strip_has_a_picture_every_0_04_s_as_far_as_the_run_went(self):
        self.write(end=0.13, interval=0.01, fields=True, spacing=0.008)
        times = [time for time, _, _ in gate_strip.frames(RunFolder(self.path))]
        self.assertEqual([round(t, 6) for t in times], [0.0, 0.04, 0.08, 0.12])

    def test_strip_ends_with_the_last_picture_of_a_run_that_ended_between_two(self):
        self.write(end=0.03, interval=0.01, fields=True, spacing=0.008)
        times = [time for time, _, _ in gate_strip.frames(RunFolder(self.path))]
        self.assertEqual([round(t, 6) for t in times], [0.0, 0.03])

    def test_run_cut_short_before_any_field_still_gives_the_curves(self):
        self.write(end=0.01)
        done = self.plot()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertFalse((self.path / "strip.png").exists())


if __name__ == "__main__":
    unittest.main()
