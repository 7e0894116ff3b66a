# SPDX-License-Identifier: MIT
"""The real programs on the real case, coarse and short.

    elastic_gate_test.py SLUICE SLUICE_FLUID SLUICE_SOLID [test ...]
"""

import csv
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CASE = ROOT / "cases/elastic-gate/case.toml"
SLUICE = FLUID = SOLID = ""
COARSE = ["fluid.spacing_m=0.004", "case.end_time_s=0.02", "case.time_step_s=5e-4"]
LONGEST_RUN_S = 60
# Rows of a window's loads are sums of some hundred terms; a map adds a few more roundings.
BALANCE = 1e-12


def overrides(settings):
    return [word for text in settings for word in ("--set", text)]


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class GateTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = Path(temporary.name)

    def run_gate(self, *settings, name="out", case=CASE, arguments=()):
        out = self.folder / name
        command = [SLUICE, "run", str(case), "--out", str(out), *overrides(COARSE),
                   *overrides(settings), *arguments]
        done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST_RUN_S)
        return done, out

    def completed(self, *settings, **options):
        done, out = self.run_gate(*settings, **options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return out

    def column(self, out, file, name):
        with (out / file).open() as rows:
            return [float(row[name]) for row in csv.DictReader(rows)]


class CompleteRunTest(GateTest):
    def test_what_is_promised_of_a_run_holds_in_every_window(self):
        out = self.completed()
        summary = json.loads((out / "summary.json").read_text())
        self.assertEqual(summary["windows"], 40)
        self.assertEqual((summary["lost_points"], summary["failed_windows"]), (0, 0))
        for quantity in ("force", "moment", "work"):
            self.assertEqual(len(self.column(out, "balance.csv", f"{quantity}_imbalance")), 40)
            self.assertLess(summary[f"{quantity}_balance_max"], BALANCE)
        energy = [sum(values) for values in zip(*(self.column(out, "fluid.csv", name) for name in (
            "kinetic_j", "potential_j", "work_on_walls_j", "outlet_energy_j")))]
        self.assertLess(max(energy) / energy[0] - 1, 3e-3)
        tip = self.column(out, "tip.csv", "ux_m")
        self.assertEqual(tip, sorted(tip), "the tip moves outwards while the tank is full")
        # The load grows at the scale of the gate's first period, 0.068 s: far from its static 36 mm.
        self.assertTrue(1e-3 < tip[-1] < 10e-3, tip[-1])

    def test_transport_and_threads_change_no_bit(self):
        first = self.completed(name="unix", arguments=("--threads", "1"))
        other = self.completed("bridge.transport=tcp", f"bridge.address=127.0.0.1:{free_port()}",
                               name="tcp", arguments=("--threads", "2"))
        self.assertEqual((first / "tip.csv").read_bytes(), (other / "tip.csv").read_bytes())

    def test_ways_to_iterate_agree(self):
        """A window is converged to 1e-4 of its increment, and the increments add up."""
        tip = {}
        for name, settings in {"pressure": [], "full": ["bridge.iterate=full"],
                               "aitken": ["bridge.acceleration=aitken"]}.items():
            tip[name] = self.column(self.completed(*settings, name=name), "tip.csv", "ux_m")[-1]
        self.assertAlmostEqual(tip["aitken"] / tip["pressure"], 1, delta=2e-3)
        # Positions of the wall at the end of a window are predicted for pressure-only iterations.
        self.assertAlmostEqual(tip["full"] / tip["pressure"], 1, delta=5e-3)

    def test_explicit_coupling_fails_and_says_so(self):
        """The water's added mass exceeds the gate's: unstable at any step (Causin et al. 2005)."""
        done, out = self.run_gate("bridge.scheme=serial-explicit", "case.time_step_s=2e-4")
        self.assertNotIn(done.returncode, (0, 3))
        self.assertIn("elastic-gate failed", done.stderr)
        self.assertTrue((out / "tip.csv").exists() and (out / "fluid.csv").exists())


class UnknownTableTest(GateTest):
    def test_table_that_nobody_reads_is_refused_by_either_program(self):
        for table in ("solid.geometry", "fluid.gague", "brigde"):
            for program in (FLUID, SOLID):
                done = subprocess.run([program, str(CASE), "--check", "--set", f"{table}.x_m=3"],
                                      capture_output=True, text=True, timeout=LONGEST_RUN_S)
                self.assertEqual(done.returncode, 1)
                self.assertIn(f"unknown table [{table}]", done.stderr)


class FluidAloneTest(GateTest):
    def alone(self, name, *settings):
        out = self.folder / name
        command = [FLUID, str(CASE), "--out", str(out), *overrides(COARSE),
                   *overrides(["fluid.coupled_walls=stay", *settings])]
        done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST_RUN_S)
        return done, out

    def test_a_run_goes_on_from_its_state_as_if_it_had_not_stopped(self):
        whole, at_once = self.alone("whole")
        first, half = self.alone("half", "case.end_time_s=0.01")
        second, rest = self.alone("rest", f"fluid.start_state={half}/fluid_state.h5")
        for done in (whole, first, second):
            self.assertEqual(done.returncode, 0, done.stderr)
        rows = {out: (out / "fluid_loads.csv").read_text().splitlines() for out in (at_once, rest)}
        self.assertEqual(len(rows[rest]), 1 + 20)
        self.assertEqual(rows[rest][1:], rows[at_once][21:])

    def test_the_state_lies_beside_the_case_and_is_all_the_water_there_is(self):
        _, half = self.alone("half", "case.end_time_s=0.002")
        case = self.folder / "dry.toml"
        text = CASE.read_text().replace("water_m", 'start_state = "half/fluid_state.h5"\n# water_m')
        case.write_text(text)
        out = self.folder / "rest"
        done = subprocess.run([FLUID, str(case), "--out", str(out), *overrides(COARSE),
                               *overrides(["fluid.coupled_walls=stay"])], cwd="/",
                              capture_output=True, text=True, timeout=LONGEST_RUN_S)
        self.assertEqual(done.returncode, 0, done.stderr)
        points = [json.loads((run / "fluid_summary.json").read_text())["points"] for run in (half, out)]
        self.assertEqual(*points)

    def test_a_state_of_another_spacing_is_refused_with_both(self):
        _, half = self.alone("half", "case.end_time_s=0.002")
        done, _ = self.alone("rest", f"fluid.start_state={half}/fluid_state.h5",
                             "fluid.spacing_m=0.005")
        self.assertEqual(done.returncode, 1)
        self.assertIn("0.004 m apart", done.stderr)
        self.assertIn("0.005 m", done.stderr)

    def test_a_coupled_run_from_a_state_is_refused(self):
        _, half = self.alone("half", "case.end_time_s=0.002")
        done, _ = self.run_gate(f"fluid.start_state={half}/fluid_state.h5", "case.output_interval_s=0")
        self.assertNotIn(done.returncode, (0, 3))
        self.assertIn("fluid.start_state is for the fluid alone", done.stderr)


class FailedStepTest(GateTest):
    def test_points_that_fly_apart_cost_a_window_and_not_the_run(self):
        done, out = self.run_gate('fluid.start_velocity_m_s=["0", "1e10 * x"]',
                                  "bridge.max_halvings=2", "case.output_interval_s=0")
        self.assertEqual(done.returncode, 1)
        for part in ("could not be computed by the fluid", "the points spread over",
                     "it was halved 2 times already"):
            self.assertIn(part, done.stderr)
        self.assertEqual(self.column(out, "coupling.csv", "time_s"), [5e-4, 2.5e-4, 1.25e-4])
        self.assertEqual(json.loads((out / "summary.json").read_text())["halved_windows"], 2)


class RestartTest(GateTest):
    """Windows that the fluid refuses are cut; a run that stops goes on as if it had not."""

    # The fastest point may move 0.025 spacings per window: too little from the 20th window on.
    CUT = ["fluid.courant=0.025", "bridge.max_halvings=4", "bridge.restart_every_windows=1",
           "case.output_interval_s=0"]

    def log(self, out):
        return (out / "coupling.csv").read_text().splitlines()[1:]

    def whole(self, end):
        out = self.completed(f"case.end_time_s={end}", *self.CUT, name="whole")
        summary = json.loads((out / "summary.json").read_text())
        self.assertGreater(summary["halved_windows"], 0)
        self.assertEqual(summary["failed_windows"], 0)
        for name in ("force_imbalance", "moment_imbalance", "work_imbalance"):
            self.assertLess(max(self.column(out, "balance.csv", name)), BALANCE)
        return out

    def first_cut(self, out):
        """Start of the first window that was tried again [s]."""
        windows, iterations, ends = (self.column(out, "coupling.csv", name)
                                     for name in ("window", "iteration", "time_s"))
        for k in range(1, len(windows)):
            if windows[k] == windows[k - 1] and iterations[k] == 1:
                return ends[k - 1] - 5e-4
        self.fail("no window was cut")

    def test_cut_in_two_at_three_instants_it_leaves_the_same_bits(self):
        whole = self.whole(0.016)
        cut = self.first_cut(whole)
        instants = {"before": 0.005, "right after a cut window": cut + 5e-4, "later": 0.0145}
        for number, (name, end) in enumerate(instants.items()):
            half = self.completed(f"case.end_time_s={end}", *self.CUT, name=f"half{number}")
            rest = self.completed("case.end_time_s=0.016", *self.CUT, name=f"rest{number}",
                                  arguments=["--restart", str(half)])
            self.assertEqual(self.log(half) + self.log(rest), self.log(whole), name)

    def children(self, number):
        return map(int, Path(f"/proc/{number}/task/{number}/children").read_text().split())

    def test_told_to_stop_it_writes_its_state_and_goes_on_from_there(self):
        whole = self.whole(0.016)
        out = self.folder / "stopped"
        program = subprocess.Popen(
            [SLUICE, "run", str(CASE), "--out", str(out), *overrides(COARSE),
             *overrides(["case.end_time_s=0.016", *self.CUT])],
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        while not (out / "coupling.csv").exists() or len(self.log(out)) < 30:
            self.assertIsNone(program.poll())
            time.sleep(0.005)
        for number in (program.pid, *self.children(program.pid), program.pid):  # twice, as batch
            os.kill(number, signal.SIGTERM)                                     # systems may do
        message = program.communicate(timeout=LONGEST_RUN_S)[1]
        self.assertEqual(program.returncode, 128 + signal.SIGTERM)
        self.assertIn("--restart", message)
        rest = self.completed("case.end_time_s=0.016", *self.CUT, name="rest",
                              arguments=["--restart", str(out)])
        self.assertEqual(self.log(out) + self.log(rest), self.log(whole))

    def test_a_folder_without_restart_files_is_refused(self):
        done, _ = self.run_gate(arguments=["--restart", str(self.folder)])
        self.assertEqual(done.returncode, 1)
        self.assertIn("restart_every_windows", done.stderr)


class BadInputTest(GateTest):
    """Both programs end, soon, with a message that says what and where."""

    def refused(self, *parts, settings=(), case=CASE):
        started = time.monotonic()
        done, _ = self.run_gate(*settings, case=case)
        self.assertNotIn(done.returncode, (0, 3))
        self.assertLess(time.monotonic() - started, 20)
        for part in parts:
            self.assertIn(part, done.stderr)

    def edited(self, old, new):
        text = CASE.read_text()
        self.assertIn(old, text)
        case = self.folder / "edited.toml"
        case.write_text(text.replace(old, new))
        return case

    def test_misspelt_key(self):
        self.refused("edited.toml:", "dynamic_viscosity_pa_s",
                     case=self.edited("dynamic_viscosity_pa_s", "dynamic_viscosty_pa_s"))

    def test_missing_key(self):
        self.refused("width_m", case=self.edited("width_m = 0.005\n", ""))

    def test_wrong_type(self):
        self.refused("edited.toml:", "youngs_modulus_pa",
                     case=self.edited("youngs_modulus_pa = 12e6", 'youngs_modulus_pa = "12 MPa"'))

    def test_hole_in_the_walls_below_the_water_line(self):
        self.refused("hole", case=self.edited("[0.1, 0.079], [0.1, 0.3]", "[0.1, 0.09], [0.1, 0.3]"))

    def test_water_inside_a_wall(self):
        self.refused("wall", case=self.edited("[0.1, 0.14], [0, 0.14]]", "[0.12, 0.14], [0, 0.14]]"))

    def test_gate_that_overlaps_the_floor_by_a_tenth_of_a_millimetre_is_no_error(self):
        case = self.edited("[0.105, 0], [0.1, 0], [0.1, 0.079]]",
                           "[0.105, -1e-4], [0.1, -1e-4], [0.1, 0.079]]")
        case.write_text(case.read_text().replace("corner_m = [0.1, 0]", "corner_m = [0.1, -1e-4]")
                        .replace("height_m = 0.079", "height_m = 0.0791"))
        self.completed("case.end_time_s=0.005", case=case)

    def start(self, program, name, *settings):
        command = [program, str(CASE), "--out", str(self.folder / name), *overrides(COARSE),
                   *overrides([f"bridge.address={self.folder}/s", "bridge.connect_deadline_s=3",
                               *settings])]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                   text=True)
        self.addCleanup(process.stderr.close)
        self.addCleanup(process.kill)
        return process

    def message(self, process):
        _, error = process.communicate(timeout=20)
        self.assertNotEqual(process.returncode, 0)
        return error

    def test_partner_that_never_starts(self):
        self.assertIn("solid", self.message(self.start(FLUID, "fluid")))
        self.assertIn("fluid", self.message(self.start(SOLID, "solid")))

    def test_partner_with_another_case(self):
        fluid = self.start(FLUID, "fluid")
        solid = self.start(SOLID, "solid", "solid.density_kg_m3=1200")
        for process in (fluid, solid):
            self.assertIn("density_kg_m3", self.message(process))

    def test_partner_that_dies(self):
        for victim in (0, 1):
            with self.subTest(victim=("fluid", "solid")[victim]):
                both = [self.start(program, f"{name}-{victim}", "case.end_time_s=100")
                        for program, name in ((FLUID, "fluid"), (SOLID, "solid"))]
                series = self.folder / f"fluid-{victim}/fluid.csv"
                self.wait_for_rows(series, 3)
                both[victim].send_signal(signal.SIGKILL)
                both[victim].wait()
                self.assertIn(("fluid", "solid")[victim], self.message(both[1 - victim]))
                rows = series.read_text().splitlines()
                whole = [row for row in rows if row.count(",") == rows[0].count(",")]
                self.assertGreater(len(whole), 3, "output so far is intact")

    def wait_for_rows(self, path, count):
        deadline = time.monotonic() + 20
        while time.monotonic() < deadline:
            if path.exists() and len(path.read_text().splitlines()) > count:
                return
            time.sleep(0.02)
        self.fail(f"{path} has no {count} rows")


if __name__ == "__main__":
    SLUICE, FLUID, SOLID = sys.argv[1:4]
    del sys.argv[1:4]
    os.environ.pop("OMP_NUM_THREADS", None)
    unittest.main()
