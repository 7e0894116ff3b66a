# SPDX-License-Identifier: MIT
import unittest

import paths  # noqa: F401
import numpy as np
from compare import Curve, markdown_table, rms_difference, text_table


class CurveTest(unittest.TestCase):
    def test_samples_are_sorted_by_time(self):
        curve = Curve([0.2, 0.0, 0.1], [3.0, 1.0, 2.0])
        np.testing.assert_array_equal(curve.time, [0.0, 0.1, 0.2])
        np.testing.assert_array_equal(curve.value, [1.0, 2.0, 3.0])

    def test_peak_is_the_largest_sample_with_its_time(self):
        self.assertEqual(Curve([0.0, 0.1, 0.2], [1.0, 5.0, 2.0]).peak(), (5.0, 0.1))

    def test_minimum_after_looks_at_later_samples_only(self):
        curve = Curve([0.0, 0.1, 0.2, 0.3], [0.0, 5.0, 2.0, 3.0])
        self.assertEqual(curve.minimum_after(0.1), 2.0)
        self.assertIsNone(curve.minimum_after(0.3))

    def test_interpolation_is_exact_for_a_line(self):
        time = np.linspace(0, 1, 7)
        np.testing.assert_allclose(Curve(time, 3 * time - 1).at([0.13, 0.5]), [-0.61, 0.5])

    def test_covers_only_the_sampled_range(self):
        covered = Curve([0.1, 0.3], [0, 0]).covers([0.0, 0.1, 0.2, 0.3, 0.4])
        np.testing.assert_array_equal(covered, [False, True, True, True, False])

    def test_no_sample_is_refused(self):
        with self.assertRaises(ValueError):
            Curve([], [])


class RmsTest(unittest.TestCase):
    def test_constant_offset_is_its_own_rms(self):
        time = np.linspace(0, 1, 11)
        rms, instants = rms_difference(Curve(time, time + 0.25), Curve(time[1::2], time[1::2]))
        self.assertAlmostEqual(rms, 0.25, places=15)
        self.assertEqual(instants, 5)

    def test_instants_beyond_the_curve_do_not_count(self):
        rms, instants = rms_difference(Curve([0, 1], [0, 1]), Curve([0.5, 2.0], [0.5, 99.0]))
        self.assertEqual((rms, instants), (0.0, 1))

    def test_no_common_instant_gives_no_rms(self):
        self.assertEqual(rms_difference(Curve([0, 1], [0, 1]), Curve([2], [2])), (None, 0))


class TableTest(unittest.TestCase):
    def test_missing_value_shows_as_a_dash(self):
        self.assertEqual(text_table(["a", "b"], [["x", None]]).splitlines()[-1], "x  -")
        self.assertEqual(markdown_table(["a", "b"], [["x", None]]).splitlines()[-1], "| x | - |")


if __name__ == "__main__":
    unittest.main()
