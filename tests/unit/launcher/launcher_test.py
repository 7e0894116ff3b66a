# SPDX-License-Identifier: MIT
"""`sluice run` and `sluice check` with stand-ins for the solvers: small scripts that end well,
fail, hang or draw a progress bar.    launcher_test.py PATH_OF_SLUICE"""

import json
import os
import pty
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

SLUICE = ""

CASE = """[case]
name = "gate"
end_time_s = 0.1
time_step_s = 0.1
[fluid]
spacing_m = 0.01
[[fluid.wall]]
name = "gate"
coupled = true
[solid]
width_m = 0.01
"""
# What every stand-in does first: finds its output folder.
PROLOGUE = """#!/bin/bash
name=${0##*/}; part=${name#sluice-}; mode=run; arguments="$*"
while [ $# -gt 0 ]; do
  case $1 in --out) out=$2; shift;; --check) mode=check;; esac; shift
done
"""
WELL = """echo '{"steps": 3, "failed_windows": 0, "completed": true}' > $out/${part}_summary.json
"""
HANG = "while :; do sleep 0.05; done\n"


class LauncherTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = Path(temporary.name)
        self.out = self.folder / "out"
        self.case = self.folder / "gate.toml"
        self.case.write_text(CASE)
        self.program("fluid", WELL)
        self.program("solid", WELL)

    def program(self, part, script, check=""):
        """A stand-in that runs `script`, and `check` when it is asked to look at the case only."""
        path = self.folder / f"sluice-{part}"
        path.write_text(f"{PROLOGUE}if [ $mode = check ]; then :; {check}\nexit; fi\n{script}")
        path.chmod(0o755)

    def command(self, verb, *arguments):
        return [SLUICE, verb, str(self.case), "--programs", str(self.folder), *arguments]

    def run_case(self, *arguments, **options):
        return subprocess.run(self.command("run", "--out", str(self.out), *arguments),
                              capture_output=True, text=True, timeout=30, **options)

    def summary(self):
        return json.loads((self.out / "summary.json").read_text())

    def wait_for(self, *names):
        for _ in range(200):
            if all((self.out / name).exists() for name in names):
                return
            time.sleep(0.02)
        self.fail(f"{names} did not appear")


class CompleteRunTest(LauncherTest):
    def test_both_participants_run_and_the_summaries_are_merged(self):
        self.program("fluid", WELL.replace("steps", "points") + "sleep 0.05\n")
        done = self.run_case()
        self.assertEqual(done.returncode, 0, done.stderr)
        summary = self.summary()
        self.assertEqual((summary["points"], summary["steps"], summary["completed"]), (3, 3, True))
        self.assertGreater(summary["wall_time_s"], 0.05)
        self.assertIsNone(summary["force_balance_max"])

    def test_every_promised_key_is_there(self):
        self.run_case()
        promised = """points steps windows failed_windows lost_points outflow_points wall_returns
            wall_time_s cpu_time_s ms_per_step_fluid ms_per_step_solid ms_per_step_bridge phases_ms
            coupling_iterations_mean coupling_iterations_max force_balance_max moment_balance_max
            work_balance_max volume_drift_max energy_drift guarded_rows_per_step outflow_m2"""
        self.assertEqual(set(promised.split()) - set(self.summary()), set())

    def test_counts_of_failure_take_the_worse_side_and_phases_keep_their_side(self):
        for part, failed in (("fluid", 1), ("solid", 2)):
            text = json.dumps({"failed_windows": failed, "phases_ms": {"solve": failed}})
            self.program(part, f"echo '{text}' > $out/{part}_summary.json\n")
        self.run_case()
        self.assertEqual(self.summary()["failed_windows"], 2)
        self.assertEqual(self.summary()["phases_ms"],
                         {"fluid": {"solve": 1}, "solid": {"solve": 2}})

    def test_a_participant_that_says_it_is_not_complete_fails_the_run(self):
        self.program("fluid", "echo '{\"completed\": false}' > $out/fluid_summary.json\n")
        self.assertEqual(self.run_case().returncode, 1)
        self.assertFalse(self.summary()["completed"])

    def test_arguments_and_overrides_reach_both(self):
        for part in ("fluid", "solid"):
            self.program(part, WELL + 'echo "$arguments"\n')
        self.run_case("--set", "fluid.spacing_m=0.02", "--set", "case.end_time_s=0.3")
        for part in ("fluid", "solid"):
            said = (self.out / f"{part}.log").read_text()
            self.assertIn(f"{self.case} --set fluid.spacing_m=0.02 --set case.end_time_s=0.3", said)
            self.assertIn(f"--out {self.out}", said)
        self.assertEqual(self.summary()["overrides"],
                         ["fluid.spacing_m=0.02", "case.end_time_s=0.3"])

    def test_threads_sleep_while_they_wait(self):
        self.program("fluid", WELL + "env\n")
        environment = {k: v for k, v in os.environ.items() if not k.startswith(("OMP", "GOMP"))}
        self.run_case("--threads", "3", env=environment)
        said = (self.out / "fluid.log").read_text()
        for line in ("OMP_NUM_THREADS=3", "OMP_WAIT_POLICY=passive", "GOMP_SPINCOUNT=3000",
                     "OMPI_ALLOW_RUN_AS_ROOT=1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1"):
            self.assertIn(line, said)

    def test_a_table_may_name_another_program(self):
        self.program("calculix", WELL.replace("${part}", "solid") + "echo calculix speaks\n")
        done = self.run_case("--set", "solid.program=sluice-calculix")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("calculix speaks", (self.out / "solid.log").read_text())
        self.assertEqual(self.summary()["steps"], 3)
        done = self.run_case("--set", "solid.program=sluice-nobody")
        self.assertIn("[solid] needs the program sluice-nobody", done.stderr)
        self.assertIn(str(self.folder), done.stderr)
        self.assertIn("must be a name", self.run_case("--set", "solid.program=/bin/true").stderr)

    def test_case_with_one_participant_starts_that_one_only(self):
        self.case.write_text(CASE[:CASE.index("[solid]")].replace("coupled = true\n", ""))
        self.assertEqual(self.run_case().returncode, 0)
        self.assertFalse((self.out / "solid.log").exists())

    def test_solid_is_not_started_where_the_fluid_moves_no_wall(self):
        self.assertEqual(self.run_case("--set", "fluid.coupled_walls=stay").returncode, 0)
        self.assertFalse((self.out / "solid.log").exists())

    def test_a_coupled_wall_without_a_solid_and_a_solid_without_one_are_refused(self):
        self.case.write_text(CASE[:CASE.index("[solid]")])
        self.assertIn("a wall is coupled, but there is no [solid]", self.run_case().stderr)
        self.case.write_text(CASE.replace("coupled = true\n", ""))
        self.assertIn("no [[fluid.wall]] has coupled = true", self.run_case().stderr)

    def test_a_folder_with_other_peoples_files_is_refused_untouched(self):
        self.out.mkdir()
        (self.out / "thesis.tex").write_text("mine")
        self.assertIn("holds files that no run has made ('thesis.tex')", self.run_case().stderr)
        self.assertEqual([path.name for path in self.out.iterdir()], ["thesis.tex"])

    def test_token_is_not_shown_in_the_summary(self):
        self.run_case("--set", "bridge.token=sesame")
        self.assertEqual(self.summary()["overrides"], ["bridge.token=(not shown)"])

    def test_output_of_an_earlier_run_is_removed_and_other_files_stay(self):
        theirs = {"mine.csv", "notes.txt", "fluid_state.h5"}  # a run may start from the last one
        self.run_case()
        for name in {"tip.csv", "fluid_000010.vtp"} | theirs:
            (self.out / name).write_text("old")
        self.assertEqual(self.run_case().returncode, 0)
        left = {p.name for p in self.out.iterdir()}
        self.assertTrue(theirs | {"case.toml"} <= left)
        self.assertTrue({"tip.csv", "fluid_000010.vtp"}.isdisjoint(left))

    def test_folder_that_no_run_has_made_keeps_its_files_and_is_refused(self):
        self.out.mkdir()
        (self.out / "tip.csv").write_text("mine")
        done = self.run_case()
        self.assertEqual(done.returncode, 1)
        self.assertIn(f"{self.out}/tip.csv: has the name of a run's file", done.stderr)
        self.assertEqual([p.name for p in self.out.iterdir()], ["tip.csv"])

    def test_case_file_in_the_run_folder_stays_as_it_is(self):
        self.out.mkdir()
        self.case = self.out / "case.toml"
        for text in (CASE, CASE + "# edited between the runs\n"):
            self.case.write_text(text)
            self.assertEqual(self.run_case().returncode, 0)
            self.assertEqual(self.case.read_text(), text)

    def test_second_run_into_the_same_folder_is_refused_and_the_first_completes(self):
        self.program("fluid", WELL + "touch $out/started; while [ ! -e $out/go ]; do sleep 0.02; done\n")
        first = subprocess.Popen(self.command("run", "--out", str(self.out)),
                                 stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        self.wait_for("started")
        second = self.run_case()
        (self.out / "go").touch()
        _, said = first.communicate(timeout=20)
        self.assertEqual(second.returncode, 1)
        self.assertIn("another sluice run writes into this folder", second.stderr)
        self.assertEqual(first.returncode, 0, said)
        self.assertTrue(self.summary()["completed"])

    def test_reader_of_the_messages_may_leave(self):
        for script, status in ((WELL, 0), ("exit 1\n", 1)):
            self.program("fluid", "for k in $(seq 100); do echo noise >&2; done\n" + script)
            running = subprocess.Popen(self.command("run", "--out", str(self.out)),
                                       stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            running.stdout.close()
            running.stderr.close()
            self.assertEqual(running.wait(timeout=20), status)
            self.assertEqual(self.summary()["completed"], status == 0)

    def test_participants_get_the_usual_end_of_a_broken_pipe(self):
        self.program("fluid", WELL + "yes | head -1 > /dev/null; echo ${PIPESTATUS[0]} >&2\n")
        self.run_case()
        self.assertEqual((self.out / "fluid.log").read_text(), f"{128 + signal.SIGPIPE}\n")

    def test_children_are_awaited_where_their_end_was_ignored_before(self):
        ignored = lambda: signal.signal(signal.SIGCHLD, signal.SIG_IGN)
        self.assertEqual(self.run_case(preexec_fn=ignored).returncode, 0)

    def test_collections_become_one_with_a_part_each(self):
        for part, instant in (("fluid", "0.5"), ("solid", "0.50000000000000011")):
            entry = f'<DataSet timestep="{instant}" part="0" file="{part}_1.vtp"/>'
            self.program(part, WELL +
                         f"echo '<Collection>{entry}</Collection>' > $out/{part}.pvd\n")
        self.run_case()
        text = (self.out / "gate.pvd").read_text()
        self.assertIn('<DataSet timestep="0.5" part="0" name="fluid" file="fluid_1.vtp"/>', text)
        self.assertIn('<DataSet timestep="0.5" part="2" name="solid" file="solid_1.vtp"/>', text)


class FailedRunTest(LauncherTest):
    def test_message_and_name_of_the_failed_participant_are_shown(self):
        self.program("solid", "echo noise >&2\n"
                     "echo 'sluice-solid: element 7 is inverted' >&2; exit 4\n")
        done = self.run_case()
        self.assertEqual(done.returncode, 1)
        self.assertIn("solid: exit status 4\n    sluice-solid: element 7 is inverted", done.stderr)
        self.assertEqual(self.summary()["participants"]["solid"]["exit_status"], 4)
        self.assertFalse(self.summary()["completed"])

    def test_partner_may_end_with_its_own_message_within_the_grace(self):
        self.program("fluid", "sleep 0.3; echo 'sluice-fluid: partner solid is gone' >&2; exit 1\n")
        self.program("solid", "exit 1\n")
        done = self.run_case("--grace", "20")
        self.assertIn("sluice-fluid: partner solid is gone", done.stderr)
        self.assertNotIn("stopped by sluice", done.stderr)

    def test_partner_that_hangs_is_stopped_after_the_grace(self):
        self.program("fluid", HANG)
        self.program("solid", "exit 1\n")
        started = time.monotonic()
        done = self.run_case("--grace", "0.2")
        self.assertEqual(done.returncode, 1)
        self.assertIn("fluid: ended by signal 15 (Terminated), stopped by sluice", done.stderr)
        self.assertLess(time.monotonic() - started, 4)

    def test_very_long_grace_is_waited_for_without_spinning(self):
        self.program("fluid", "sleep 0.5; echo 'sluice-fluid: partner solid is gone' >&2; exit 1\n")
        self.program("solid", "exit 1\n")
        before = os.times()
        done = self.run_case("--grace", "3000000")
        self.assertIn("sluice-fluid: partner solid is gone", done.stderr)
        # Half a second of waiting: a loop without poll's sleep would take it all.
        after = os.times()
        cpu = after.children_user + after.children_system \
            - before.children_user - before.children_system
        self.assertLess(cpu, 0.4)

    def test_exit_status_255_is_no_signal(self):
        self.program("solid", "exit 255\n")
        self.assertIn("solid: exit status 255", self.run_case("--grace", "5").stderr)

    def test_half_written_summary_does_not_hide_the_failure(self):
        self.program("solid", "echo '{\"steps\": ' > $out/solid_summary.json\n"
                     "echo 'sluice-solid: element 7 is inverted' >&2; exit 4\n")
        done = self.run_case()
        self.assertEqual(done.returncode, 1)
        self.assertIn("sluice-solid: element 7 is inverted", done.stderr)
        solid = self.summary()["participants"]["solid"]
        self.assertEqual(solid["exit_status"], 4)
        self.assertIn("solid_summary.json: is not a JSON object", solid["note"])

    def test_run_with_a_half_written_summary_is_not_complete(self):
        self.program("solid", "echo '{' > $out/solid_summary.json\n")
        self.assertEqual(self.run_case().returncode, 1)
        self.assertFalse(self.summary()["completed"])

    def test_crash_is_named_by_its_signal(self):
        self.program("solid", "kill -SEGV $$\n")
        done = self.run_case("--grace", "5")
        self.assertIn("solid: ended by signal 11 (Segmentation fault)", done.stderr)

    def test_failed_run_is_not_judged_by_the_summary_of_the_one_before(self):
        self.run_case()
        self.assertEqual(self.summary()["steps"], 3)
        for part in ("fluid", "solid"):
            self.program(part, "exit 1\n")
        self.run_case()
        self.assertFalse(self.summary()["completed"])
        self.assertIsNone(self.summary()["steps"])

    def test_signal_reaches_both_and_what_they_started(self):
        for part in ("fluid", "solid"):
            self.program(part, f"sleep 60 & echo $! > $out/{part}_number; "
                         f"mv $out/{part}_number $out/{part}_started; wait\n")
        running = subprocess.Popen(self.command("run", "--out", str(self.out)),
                                   stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        self.wait_for("fluid_started", "solid_started")
        running.send_signal(signal.SIGINT)
        _, said = running.communicate(timeout=20)
        self.assertEqual(running.returncode, 128 + signal.SIGINT)
        self.assertIn("was stopped by signal 2", said)
        self.assertFalse(self.summary()["completed"])
        for part in ("fluid", "solid"):
            self.assertTrue(self.ends(int((self.out / f"{part}_started").read_text())))

    def test_a_second_request_to_stop_does_not_cost_what_the_first_one_was_for(self):
        for part in ("fluid", "solid"):
            self.program(part, f"trap 'asked=1' TERM; touch $out/{part}_started\n"
                         "until [ $asked ]; do sleep 0.05; done\n"
                         f"for k in $(seq 10); do sleep 0.05; done; touch $out/{part}_state; exit 1\n")
        running = subprocess.Popen(self.command("run", "--out", str(self.out)),
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.wait_for("fluid_started", "solid_started")
        for _ in range(3):
            running.send_signal(signal.SIGTERM)
            time.sleep(0.1)
        self.assertEqual(running.wait(timeout=20), 128 + signal.SIGTERM)
        for part in ("fluid", "solid"):
            self.assertTrue((self.out / f"{part}_state").exists())

    def test_participants_do_not_outlive_a_killed_launcher(self):
        self.program("fluid", "echo $$ > $out/number; mv $out/number $out/started; exec sleep 60\n")
        running = subprocess.Popen(self.command("run", "--out", str(self.out)),
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.wait_for("started")
        number = int((self.out / "started").read_text())
        running.kill()
        running.wait()
        self.assertTrue(self.ends(number))

    def ends(self, number):
        for _ in range(100):
            try:
                state = Path(f"/proc/{number}/stat").read_text().split(") ")[1][0]
            except FileNotFoundError:
                return True
            if state == "Z":
                return True
            time.sleep(0.02)
        return False


class BadInputTest(LauncherTest):
    def refused(self, pattern, *arguments):
        done = self.run_case(*arguments)
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, pattern)
        self.assertFalse(self.out.exists(), "nothing may be written for a case that cannot run")

    def test_missing_file(self):
        self.case.unlink()
        self.refused("gate.toml: cannot open the case file")

    def test_syntax_error_has_line_and_column(self):
        self.case.write_text("[case]\nname = \n")
        self.refused(r"gate\.toml:2:\d+: ")

    def test_misspelt_table_names_the_nearest(self):
        self.case.write_text(CASE.replace("[solid]", "[sold]"))
        self.refused(r"gate\.toml:\d+:\d+: unknown table \[sold\]; did you mean \[solid\]")

    def test_misspelt_key_of_the_case_names_the_nearest(self):
        self.case.write_text(CASE.replace("end_time_s", "end_tme_s"))
        self.refused(r"gate\.toml:3:\d+: unknown key 'end_tme_s' in \[case\]; "
                     r"did you mean 'end_time_s'\?")

    def test_case_without_a_fluid(self):
        self.case.write_text(CASE[:CASE.index("[fluid]")])
        self.refused(r"has no \[fluid\] table")
        self.case.write_text(CASE[:CASE.index("[fluid]")] + CASE[CASE.index("[solid]"):])
        self.refused(r"has no \[fluid\] table")

    def test_malformed_override(self):
        self.refused("--set spacing: expected TABLE.KEY=VALUE", "--set", "spacing")

    def test_missing_program_says_where_it_was_looked_for(self):
        (self.folder / "sluice-solid").unlink()
        self.refused(rf"\[solid\] needs the program sluice-solid.*{self.folder}")

    def test_folder_that_cannot_be_made(self):
        self.out = self.case / "below-a-file"
        done = self.run_case()
        self.assertEqual(done.returncode, 1)
        self.assertIn("give another --out folder", done.stderr)

    def test_program_that_cannot_be_executed(self):
        (self.folder / "sluice-solid").write_bytes(b"\0not a program")
        done = self.run_case()
        self.assertEqual(done.returncode, 1)
        self.assertIn("sluice-solid: cannot be started", done.stderr)

    def test_wrong_usage_ends_with_2(self):
        self.assertEqual(subprocess.run([SLUICE, "run"], capture_output=True).returncode, 2)
        self.assertEqual(self.run_case("--threads", "0").returncode, 2)


class CheckTest(LauncherTest):
    def check(self):
        return subprocess.run(self.command("check"), capture_output=True, text=True, timeout=30)

    def test_good_case(self):
        done = self.check()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stdout.splitlines()[-1], f"{self.case}: OK")

    def test_error_of_a_participant_is_shown(self):
        self.program("fluid", WELL, check="echo 'sluice-fluid: gate.toml:6:1: spacing' >&2; exit 1")
        done = self.check()
        self.assertEqual(done.returncode, 1)
        self.assertIn("gate.toml:6:1: spacing", done.stderr)

    def test_case_that_a_participant_refuses_is_not_started_and_costs_no_output(self):
        self.assertEqual(self.run_case().returncode, 0)
        before = self.summary()
        self.program("fluid", WELL, check="echo 'sluice-fluid: gate.toml:6:1: spacing' >&2; exit 1")
        started = time.monotonic()
        done = self.run_case()
        self.assertEqual(done.returncode, 1)
        self.assertIn("gate.toml:6:1: spacing", done.stderr)
        self.assertLess(time.monotonic() - started, 5, "the partner is not waited for")
        self.assertEqual(self.summary(), before)


class TerminalTest(LauncherTest):
    def test_progress_bar_is_drawn_on_a_terminal_and_the_log_keeps_its_last_state(self):
        self.program("fluid", WELL + "[ -t 2 ] && echo 'on a terminal' >&2\n"
                     "printf '\\rfluid 10 %%\\033[K\\rfluid 100 %%\\033[K\\n' >&2\n")
        master, slave = pty.openpty()
        running = subprocess.Popen(self.command("run", "--out", str(self.out)), stdout=slave,
                                   stderr=slave, stdin=slave)
        os.close(slave)
        shown = b""
        try:
            while chunk := os.read(master, 4096):
                shown += chunk
        except OSError:  # the other end is closed
            pass
        os.close(master)
        self.assertEqual(running.wait(timeout=20), 0)
        self.assertIn(b"\rfluid 10 %\033[K\rfluid 100 %", shown)
        self.assertEqual((self.out / "fluid.log").read_text(), "on a terminal\nfluid 100 %\n")


if __name__ == "__main__":
    SLUICE = os.path.abspath(sys.argv.pop(1))
    unittest.main()
