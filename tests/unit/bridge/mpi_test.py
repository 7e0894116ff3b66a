#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Two programs in one mpirun, each on any number of ranks: the same answer whatever the numbers."""
import math
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

PROGRAM = os.environ["SLUICE_MPI_PISTON"]
WINDOWS, STEP = 6, 1e-3
CASE = f"""
[case]
name = "piston"
end_time_s = {WINDOWS * STEP}
time_step_s = {STEP}
[bridge]
transport = "TRANSPORT"
displacement_tolerance = 1e-10
force_tolerance = 1e-10
connect_deadline_s = 20
restart_every_windows = 3
"""
ROOT = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
        "OMPI_MCA_btl_vader_single_copy_mechanism": "none"}
MPIRUN = ["mpirun", "--oversubscribe", "--bind-to", "none"]
# A mass of 1 kg with 5 kg of water on a spring, both by the trapezoidal rule, from 0.01 m at rest.
HALF = STEP / 2 * math.sqrt(4e4 / 6)
EXACT = [0.01 * math.cos(n * 2 * math.atan(HALF)) for n in range(1, WINDOWS + 1)]


class TwoPrograms(unittest.TestCase):
    def run_both(self, n_fluid, n_solid, windows=WINDOWS, out=None, **environment):
        with tempfile.TemporaryDirectory() as folder:
            case = Path(folder) / "case.toml"
            case.write_text(CASE.replace("TRANSPORT", "mpi")
                            .replace(str(WINDOWS * STEP), str(windows * STEP)))
            folder = out or folder
            return subprocess.run(
                MPIRUN + ["-n", str(n_fluid), PROGRAM, "fluid", case, folder, ":",
                          "-n", str(n_solid), PROGRAM, "solid", case, folder],
                capture_output=True, text=True, timeout=120, env=os.environ | ROOT | environment)

    def history(self, answer):
        self.assertEqual(answer.returncode, 0, answer.stderr)
        return [float(line) for line in answer.stdout.split()]

    def test_three_to_two_uneven_ranks_give_what_one_to_one_gives(self):
        one, many = (self.history(self.run_both(*n)) for n in ((1, 1), (3, 2)))
        self.assertEqual(len(one), WINDOWS)
        difference = max(abs(a - b) for a, b in zip(one, many)) / max(map(abs, one))
        print(f"3 to 2 ranks differ from 1 to 1 by {difference:.1e}")
        # Sums over the ranks round differently: 4 terms, times the added mass, times the windows.
        self.assertLess(difference, 1e-13)
        # The tolerance of a window adds up over the windows.
        for d, exact in zip(one, EXACT):
            self.assertAlmostEqual(d, exact, delta=0.01 * WINDOWS * 1e-10)

    def test_ranks_that_go_on_from_a_restart_give_the_same_bits(self):
        """Once from the end of a shorter run, once from where one rank alone was told to stop."""
        whole = self.history(self.run_both(3, 2))
        for windows, stop in ((3, {}), (WINDOWS, {"STOPPED_RANK": "solid:1"})):
            with tempfile.TemporaryDirectory() as left:
                half = self.history(self.run_both(3, 2, windows, left, **stop))
                rest = self.history(self.run_both(3, 2, FROM=left))
            self.assertEqual(len(half), 3)
            self.assertEqual(half + rest, whole)

    def test_a_message_later_than_its_deadline_goes_to_memory_of_its_own(self):
        answer = self.run_both(1, 1, STALL="1")
        self.assertEqual(answer.returncode, 0, answer.stderr)
        self.assertEqual(answer.stdout, f"{8 << 20} bytes\n")

    def test_a_program_with_too_few_threads_is_named_by_both(self):
        for low in ("fluid", "solid"):
            answer = self.run_both(2, 1, LOW_LEVEL=low)
            self.assertNotEqual(answer.returncode, 0)
            for program in ("fluid", "solid"):
                said = [line for line in answer.stderr.splitlines()
                        if line.startswith(f"[{program}]") and f"of the {low}, has level 1" in line]
                self.assertTrue(said, answer.stderr)

    def test_a_rank_that_fails_ends_all_with_its_message(self):
        for rank in ("fluid:1", "solid:1", "solid:0"):
            answer = self.run_both(2, 2, BAD_RANK=rank)
            self.assertNotEqual(answer.returncode, 0)
            number = rank.split(":")[1]
            said = [line for line in answer.stderr.splitlines()
                    if f"the solver of rank {number} broke down" in line and line.startswith("[")]
            self.assertEqual(len(said), 4, answer.stderr)  # every rank of both programs

    def test_one_program_alone_is_told_what_is_missing(self):
        with tempfile.TemporaryDirectory() as folder:
            case = Path(folder) / "case.toml"
            case.write_text(CASE.replace("TRANSPORT", "mpi"))
            answer = subprocess.run(MPIRUN + ["-n", "2", PROGRAM, "fluid", case, folder],
                                    capture_output=True, text=True, timeout=60,
                                    env=os.environ | ROOT)
        self.assertNotEqual(answer.returncode, 0)
        self.assertIn("has 2 ranks and none of them is the solid", answer.stderr)

    def test_ranks_may_meet_the_partner_over_a_socket_too(self):
        with tempfile.TemporaryDirectory() as folder:
            case = Path(folder) / "case.toml"
            case.write_text(CASE.replace("TRANSPORT", "unix"))
            environment = os.environ | ROOT | {"SPLIT": "0"}
            fluid = subprocess.Popen(MPIRUN + ["-n", "2", PROGRAM, "fluid", case, folder],
                                     env=environment)
            try:
                answer = subprocess.run(MPIRUN + ["-n", "3", PROGRAM, "solid", case, folder],
                                        capture_output=True, text=True, timeout=60,
                                        env=environment)
                self.assertEqual(len(self.history(answer)), WINDOWS)
                self.assertEqual(fluid.wait(20), 0)
            finally:
                fluid.kill()
                fluid.wait()


unittest.main()
