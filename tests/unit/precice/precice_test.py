#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Adapters that were written for preCICE v3 run on the bridge, with preCICE's own configuration."""
import math
import os
import signal
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

BUILD = Path(os.environ["SLUICE_PRECICE_TESTS"])
WINDOWS, STEP = 50, 1e-3
# 81 kg on a spring of 4e4 N/m, by the trapezoidal rule, from 0.01 m at rest.
EXACT = 0.01 * math.cos(WINDOWS * 2 * math.atan(STEP / 2 * math.sqrt(4e4 / 81)))
CONFIG = """<?xml version="1.0" encoding="UTF-8" ?>
<precice-configuration>
  <log><sink type="stream" output="stdout" enabled="true" /></log>
  <data:vector name="Force" />
  <data:vector name="Velocity" />
  <mesh name="Fluid-Mesh" dimensions="2">
    <use-data name="Force" />
    <use-data name="Velocity" />
  </mesh>
  <mesh name="Solid-Mesh" dimensions="2">
    <use-data name="Force" />
    <use-data name="Velocity" />
  </mesh>
  <participant name="Fluid">
    <provide-mesh name="Fluid-Mesh" />
    <receive-mesh name="Solid-Mesh" from="Solid" />
    <write-data name="Force" mesh="Fluid-Mesh" />
    <read-data name="Velocity" mesh="Fluid-Mesh" />
    <mapping:nearest-projection direction="write" from="Fluid-Mesh" to="Solid-Mesh" constraint="conservative" />
    <mapping:nearest-projection direction="read" from="Solid-Mesh" to="Fluid-Mesh" constraint="consistent" />
  </participant>
  <participant name="Solid">
    <provide-mesh name="Solid-Mesh" />
    <write-data name="Velocity" mesh="Solid-Mesh" />
    <read-data name="Force" mesh="Solid-Mesh" />
    <watch-point mesh="Solid-Mesh" name="Top" coordinate="0.1;0.9" />
  </participant>
  <m2n:sockets acceptor="Fluid" connector="Solid" exchange-directory="." />
  <coupling-scheme:serial-implicit>
    <participants first="Fluid" second="Solid" />
    <max-time-windows value="50" />
    <time-window-size value="1e-3" />
    <max-iterations value="60" />
    <exchange data="Force" mesh="Solid-Mesh" from="Fluid" to="Solid" />
    <exchange data="Velocity" mesh="Solid-Mesh" from="Solid" to="Fluid" initialize="true" />
    <relative-convergence-measure limit="1e-9" data="Velocity" mesh="Solid-Mesh" />
    <acceleration:IQN-ILS>
      <data name="Velocity" mesh="Solid-Mesh" />
      <preconditioner type="residual-sum" />
      <filter type="QR2" limit="1e-3" />
      <initial-relaxation value="0.05" />
      <max-used-iterations value="100" />
      <time-windows-reused value="8" />
    </acceleration:IQN-ILS>
  </coupling-scheme:serial-implicit>
</precice-configuration>
"""
PARALLEL = (CONFIG.replace("serial-implicit", "parallel-implicit")
            .replace('<data name="Velocity" mesh="Solid-Mesh" />\n      <pre',
                     '<data name="Velocity" mesh="Solid-Mesh" />\n'
                     '      <data name="Force" mesh="Solid-Mesh" />\n      <pre'))


class PreciceTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = Path(temporary.name)

    def start(self, program, text, *arguments, name="precice-config.xml"):
        config = self.folder / name
        config.write_text(text)
        child = subprocess.Popen([BUILD / program, config, *arguments], cwd=self.folder, text=True,
                                 stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.addCleanup(child.communicate)
        self.addCleanup(child.kill)
        return child

    def both(self, text, *arguments, other=None):
        """(status, stdout, stderr) of the fluid and of the solid."""
        fluid = self.start("fluid_adapter", text)
        solid = self.start("solid_adapter", other or text, *arguments, name="other.xml")
        return [(child.communicate(timeout=60), child.returncode)[::-1] for child in (fluid, solid)]

    def completed(self, text):
        (_, (_, error)), (status, (out, solid_error)) = self.both(text)
        self.assertEqual((status, error, solid_error), (0, "", ""))
        displacement, iterations, windows = out.split()
        rows = (self.folder / "precice-Solid-watchpoint-Top.log").read_text().splitlines()
        self.assertEqual(rows[0], "time_s,Force_0,Force_1,Velocity_0,Velocity_1")
        self.assertEqual(len(rows), 1 + WINDOWS)
        self.assertEqual(int(windows), WINDOWS)
        print(f"{int(iterations) / WINDOWS:.2f} iterations per window")
        return float(displacement), int(iterations)

    # What a window's tolerance leaves adds up over the windows; the speed reaches 0.22 m/s.
    TOLERANCE = WINDOWS * 1e-9 * 0.23 * STEP * WINDOWS

    def test_serial_implicit_follows_the_closed_form(self):
        displacement, iterations = self.completed(CONFIG)
        self.assertAlmostEqual(displacement, EXACT, delta=self.TOLERANCE)
        self.assertLess(iterations / WINDOWS, 4)

    def test_parallel_implicit_with_both_fields_accelerated_too(self):
        displacement, _ = self.completed(PARALLEL)
        self.assertAlmostEqual(displacement, EXACT, delta=self.TOLERANCE)

    def test_rbf_answers_too(self):
        text = CONFIG.replace("nearest-projection", "rbf").replace(
            'constraint="consistent" />', 'constraint="consistent">\n'
            '<basis-function:compact-polynomial-c6 support-radius="1" />\n</mapping:rbf>')
        displacement, _ = self.completed(text)
        self.assertAlmostEqual(displacement, EXACT, delta=self.TOLERANCE)

    def test_a_window_that_does_not_converge_ends_both(self):
        for status, (_, error) in self.both(CONFIG.replace('"60"', '"2"')):
            self.assertEqual(status, 1)
            self.assertIn("window 1 (t = 0 s) did not converge in 2 iterations; Velocity:", error)

    def test_a_value_that_is_not_finite_ends_both(self):
        for status, (_, error) in self.both(CONFIG, "nan"):
            self.assertEqual(status, 1)
            self.assertIn("Solid wrote nan for 'Velocity' at vertex 0", error)

    def test_a_killed_partner_is_named(self):
        fluid = self.start("fluid_adapter", CONFIG.replace('"50"', '"100000000"'))
        solid = self.start("solid_adapter", CONFIG.replace('"50"', '"100000000"'))
        time.sleep(0.5)
        solid.send_signal(signal.SIGKILL)
        error = fluid.communicate(timeout=20)[1]
        self.assertEqual(fluid.returncode, 1)
        self.assertIn("Solid ended without a word", error)

    def test_another_configuration_is_refused_with_the_line(self):
        for status, (_, error) in self.both(CONFIG, other=CONFIG.replace('"0.05"', '"0.06"')):
            self.assertEqual(status, 1)
            self.assertIn("read different configurations: line", error)
            self.assertIn('initial-relaxation value="0.06"', error)

    def refused(self, old, new, *parts):
        text = CONFIG.replace(old, new)
        self.assertNotEqual(text, CONFIG)
        line = 1 + next(k for k, (a, b) in enumerate(zip(text.splitlines(), CONFIG.splitlines()))
                        if a != b)
        child = self.start("fluid_adapter", text)
        error = child.communicate(timeout=20)[1]
        self.assertEqual(child.returncode, 1)
        for part in (f"precice-config.xml:{line}:", *parts):
            self.assertIn(part, error)

    def test_what_is_not_supported_is_refused_by_name_and_line(self):
        self.refused('  <m2n:sockets acceptor', '  <m2n:mpi acceptor', "<m2n:mpi>",
                     "not supported")
        self.refused('<mapping:nearest-projection direction="write"',
                     '<mapping:linear-cell-interpolation direction="write"',
                     "<mapping:linear-cell-interpolation> in <participant>")
        self.refused('<max-iterations value="60" />', '<max-iterations value="60" strict="1" />',
                     "'strict' of <max-iterations>")
        self.refused('limit="1e-9"', 'limit="small"', "limit = 'small', which is no number")
        self.refused('constraint="consistent"', 'constraint="scaled-consistent-surface"',
                     "scaled-consistent-surface")
        self.refused('</participant>', '</particpant>', "mismatch")


if __name__ == "__main__":
    unittest.main()
