# SPDX-License-Identifier: MIT
import json
import tempfile
import unittest
from pathlib import Path

import paths  # noqa: F401
import numpy as np
from run_folder import RunError, RunFolder, read_columns, set_key


class FolderTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.path = Path(temporary.name)

    def write(self, name, text):
        (self.path / name).write_text(text)
        return self.path / name


class ColumnsTest(FolderTest):
    def test_comments_and_text_columns(self):
        data = read_columns(self.write("a.csv", "# source\nname,v\nx,1\ny,2\n"))
        np.testing.assert_array_equal(data["v"], [1.0, 2.0])
        self.assertEqual(list(data["name"]), ["x", "y"])

    def test_row_cut_short_by_a_crash_is_left_out(self):
        data = read_columns(self.write("a.csv", "t,v\n0,1\n1,2\n2"))
        np.testing.assert_array_equal(data["t"], [0.0, 1.0])

    def test_header_only_gives_empty_columns(self):
        self.assertEqual(len(read_columns(self.write("a.csv", "t,v\n"))["t"]), 0)

    def test_missing_and_empty_files_are_named(self):
        for path in (self.path / "none.csv", self.write("empty.csv", "")):
            with self.assertRaisesRegex(RunError, path.name):
                read_columns(path)


class CaseTest(FolderTest):
    def test_overrides_are_applied(self):
        self.write("case.toml", "[fluid]\nspacing_m = 0.002\n")
        self.write("summary.json", json.dumps({"overrides": [
            "fluid.spacing_m=1e-3", "bridge.scheme=serial-explicit", "solid.extra = [1, 2]"]}))
        case = RunFolder(self.path).case()
        self.assertEqual(case["fluid"]["spacing_m"], 1e-3)
        self.assertEqual(case["bridge"]["scheme"], "serial-explicit")
        self.assertEqual(case["solid"]["extra"], [1, 2])

    def test_later_override_wins(self):
        case = {}
        set_key(case, "a.b=1")
        set_key(case, "a.b=2")
        self.assertEqual(case, {"a": {"b": 2}})

    def test_folder_without_a_summary_is_no_run(self):
        with self.assertRaisesRegex(RunError, "output folder of a run"):
            RunFolder(self.path)

    def test_broken_summary_is_named_with_its_line(self):
        self.write("summary.json", "{\n  oops\n}")
        with self.assertRaisesRegex(RunError, r"summary\.json:2"):
            RunFolder(self.path)


class CollectionTest(FolderTest):
    def test_files_come_in_time_order_and_missing_ones_are_left_out(self):
        self.write("summary.json", "{}")
        self.write("b.vtp", "")
        self.write("a.vtp", "")
        self.write("fluid.pvd", '<VTKFile><Collection>'
                   '<DataSet timestep="0.2" file="b.vtp"/><DataSet timestep="0.1" file="a.vtp"/>'
                   '<DataSet timestep="0.3" file="gone.vtp"/></Collection></VTKFile>')
        run = RunFolder(self.path)
        self.assertEqual([(t, f.name) for t, f in run.collection("fluid")],
                         [(0.1, "a.vtp"), (0.2, "b.vtp")])
        self.assertEqual(run.collection("solid"), [])


if __name__ == "__main__":
    unittest.main()
