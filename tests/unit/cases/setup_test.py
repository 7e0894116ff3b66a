# SPDX-License-Identifier: MIT
"""The installer against stand-ins for dpkg-query, apt-get, id and sudo; nothing is installed."""

import os
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

import paths

SETUP = paths.CASES / "setup"


class SetupTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.tools = Path(temporary.name)
        self.calls = self.tools / "calls"
        for tool in ("bash", "sed", "grep", "printf", "cat", "env"):
            path = subprocess.run(["/bin/sh", "-c", f"command -v {tool}"], capture_output=True,
                                  text=True).stdout.strip()
            if path.startswith("/"):
                (self.tools / tool).symlink_to(path)
        self.tool("apt-get", f'echo "apt-get $*" >> {self.calls}')

    def tool(self, name, script):
        path = self.tools / name
        path.write_text(f"#!/bin/bash\n{script}\n")
        path.chmod(0o755)

    def installed(self, packages):
        lines = "\\n".join(f"installed {p}" for p in packages)
        self.tool("dpkg-query", f"printf '{lines}\\n'; exit 1")

    def run_setup(self, *arguments):
        return subprocess.run(["/bin/bash", str(SETUP), *arguments], capture_output=True, text=True,
                              env={"PATH": str(self.tools)})

    def packages(self):
        return subprocess.run([str(SETUP), "--list"], capture_output=True, text=True,
                              env=os.environ).stdout.split()

    def test_nothing_is_done_when_everything_is_there(self):
        self.installed(self.packages())
        started = time.monotonic()
        done = self.run_setup()
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))
        self.assertLess(time.monotonic() - started, 0.5)
        self.assertFalse(self.calls.exists())

    def test_root_installs_only_what_is_missing(self):
        self.tool("id", "echo 0")
        self.installed(p for p in self.packages() if p not in ("mold", "ccache"))
        self.assertEqual(self.run_setup().returncode, 0)
        update, install = self.calls.read_text().splitlines()
        self.assertTrue(update.startswith("apt-get update"))
        self.assertEqual(install, "apt-get install -y --no-install-recommends ccache mold -qq")

    def test_user_with_sudo_uses_it(self):
        self.tool("id", "echo 1000")
        self.tool("sudo", f'echo "sudo $1" >> {self.calls}; exec "$@"')
        self.installed([])
        self.assertEqual(self.run_setup().returncode, 0)
        self.assertTrue(self.calls.read_text().startswith("sudo apt-get"))

    def test_user_without_sudo_is_told_the_exact_command(self):
        self.tool("id", "echo 1000")
        self.installed(p for p in self.packages() if p != "mold")
        done = self.run_setup()
        self.assertEqual(done.returncode, 1)
        self.assertIn("apt-get update && apt-get install -y --no-install-recommends mold",
                      done.stderr)
        self.assertFalse(self.calls.exists())

    def test_failed_installation_ends_the_command(self):
        self.tool("id", "echo 0")
        self.tool("apt-get", "exit 100")
        self.installed([])
        self.assertNotEqual(self.run_setup().returncode, 0)


if __name__ == "__main__":
    unittest.main()
