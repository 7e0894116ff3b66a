#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""The dummy solvers of every language, as separate programs: all follow the closed form."""
import math
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

BUILD, SOURCES = Path(os.environ["SLUICE_BRIDGE_BUILD"]), Path(os.environ["SLUICE_DUMMIES"])
LIBRARY = os.environ | {"SLUICE_LIBRARY": str(BUILD / "libsluice.so")}
WINDOWS, STEP = 50, 1e-3
CASE = f"""
[case]
name = "piston"
end_time_s = {WINDOWS * STEP}
time_step_s = {STEP}
[bridge]
displacement_tolerance = 1e-8
force_tolerance = 1e-8
connect_deadline_s = 20
"""
# A mass of 1 kg with 80 kg of water on a spring, both by the trapezoidal rule, from 0.01 m at rest.
EXACT = 0.01 * math.cos(WINDOWS * 2 * math.atan(STEP / 2 * math.sqrt(4e4 / 81)))


class Dummies(unittest.TestCase):
    def follow_the_closed_form(self, *solid):
        with tempfile.TemporaryDirectory() as folder:
            case = Path(folder) / "case.toml"
            case.write_text(CASE)
            fluid = subprocess.Popen([BUILD / "dummy_fluid", case, "--out", folder])
            try:
                answer = subprocess.run([*map(str, solid), str(case), "--out", folder],
                                        capture_output=True, text=True, timeout=60, env=LIBRARY)
                self.assertEqual(answer.returncode, 0, answer.stderr)
                self.assertEqual(fluid.wait(20), 0)
            finally:
                fluid.kill()
                fluid.wait()
        # The tolerance of a window adds up over the windows.
        self.assertAlmostEqual(float(answer.stdout), EXACT, delta=0.01 * WINDOWS * 1e-8)

    def test_c(self):
        self.follow_the_closed_form(BUILD / "dummy_solid_c")

    def test_fortran(self):
        program = BUILD / "dummy_solid_fortran"
        if not program.exists():
            self.fail("cases/setup installs gfortran, and the build skipped its dummy")
        self.follow_the_closed_form(program)

    def test_python(self):
        self.follow_the_closed_form(sys.executable, SOURCES / "solid.py")

    def every_one(self):
        yield from ([BUILD / name] for name in ("dummy_fluid", "dummy_solid_c", "dummy_solid_fortran"))
        yield [sys.executable, SOURCES / "solid.py"]

    def test_a_case_file_that_is_missing_is_named_in_one_line(self):
        for program in self.every_one():
            answer = subprocess.run([*program, "no-such.toml", "--out", "."], capture_output=True,
                                    text=True, env=LIBRARY)
            self.assertEqual(answer.returncode, 1, program)
            self.assertRegex(answer.stderr, r"\A[\w.]+: no-such\.toml: .*\n\Z")
            self.assertEqual(answer.stdout, "")

    def test_they_are_called_as_the_launcher_calls_and_leave_nothing_when_asked_to_check(self):
        with tempfile.TemporaryDirectory() as folder:
            for program in self.every_one():
                for arguments, status in ((["c.toml", "--check"], 0), (["c.toml"], 1), ([], 1),
                                          (["c.toml", "--set", "case.end_time_s=1", "--out", "x"], 1)):
                    answer = subprocess.run([*program, *arguments], capture_output=True, text=True,
                                            cwd=folder, env=LIBRARY)
                    self.assertEqual(answer.returncode, status, (program, arguments))
                    self.assertEqual("usage" in answer.stderr, status == 1)
                    self.assertNotIn("Traceback", answer.stderr)
            self.assertEqual(list(Path(folder).iterdir()), [])

    def test_the_launcher_checks_and_runs_them(self):
        sluice, case = BUILD / "launcher/sluice", SOURCES / "piston.toml"
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([sluice, "check", case], check=True, cwd=folder, stdout=subprocess.DEVNULL)
            self.assertEqual(list(Path(folder).iterdir()), [])
            subprocess.run([sluice, "run", case], check=True, cwd=folder, stdout=subprocess.DEVNULL)
            said = (Path(folder) / "out/piston/solid.log").read_text()
        self.assertAlmostEqual(float(said), EXACT, delta=0.01 * WINDOWS * 1e-8)

    def test_each_is_under_60_lines(self):
        for name in ("fluid.cpp", "solid.c", "solid.f90", "solid.py"):
            self.assertLess(len((SOURCES / name).read_text().splitlines()), 60, name)


class PartnersEnd(unittest.TestCase):
    """The exit status of whole programs; what each says is in failure_test and protocol_fault_test."""

    def survivor_of(self, deadly_signal, victim):
        with tempfile.TemporaryDirectory() as folder:
            case = Path(folder) / "case.toml"
            case.write_text(CASE.replace(str(WINDOWS * STEP), "1e6") + "silence_deadline_s = 1\n")
            programs = {name: subprocess.Popen([BUILD / program, case, "--out", folder], text=True,
                                               stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
                        for name, program in (("fluid", "dummy_fluid"), ("solid", "dummy_solid_c"))}
            try:
                log = Path(folder) / "coupling.csv"
                while not log.exists() or log.stat().st_size < 200:
                    for name, program in programs.items():
                        self.assertIsNone(program.poll(), f"the {name} ended by itself")
                    time.sleep(0.01)
                programs[victim].send_signal(deadly_signal)
                survivor = programs["solid" if victim == "fluid" else "fluid"]
                message = survivor.communicate(timeout=10)[1]
                return survivor.returncode, message
            finally:
                for program in programs.values():
                    program.kill()
                    program.communicate()

    def test_a_killed_partner(self):
        for victim in ("fluid", "solid"):
            status, message = self.survivor_of(signal.SIGKILL, victim)
            self.assertEqual(status, 1)
            self.assertIn(f"the {victim} ended without a word", message)

    def test_a_stopped_partner(self):
        for victim in ("fluid", "solid"):
            status, message = self.survivor_of(signal.SIGSTOP, victim)
            self.assertEqual(status, 1)
            self.assertIn(f"the {victim} was silent for 1 s", message)

    def test_a_partner_with_another_case(self):
        with tempfile.TemporaryDirectory() as folder:
            cases = [Path(folder) / name for name in ("a.toml", "b.toml")]
            cases[0].write_text(CASE)
            cases[1].write_text(CASE.replace("_tolerance = 1e-8", "_tolerance = 0.125", 1))
            programs = [subprocess.Popen([BUILD / program, case, "--out", folder], text=True,
                                         stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
                        for program, case in zip(("dummy_fluid", "dummy_solid_c"), cases)]
            for program in programs:
                message = program.communicate(timeout=20)[1]
                self.assertEqual(program.returncode, 1)
                self.assertIn("displacement_tolerance = 0.125", message)


if __name__ == "__main__":
    unittest.main()
