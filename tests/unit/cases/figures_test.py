# SPDX-License-Identifier: MIT
import unittest

import paths  # noqa: F401
import numpy as np
from figures import spread


class SpreadTest(unittest.TestCase):
    def test_labels_apart_stay_where_they_are(self):
        self.assertEqual(spread([3.0, 1.0, 2.0], 0.5), [3.0, 1.0, 2.0])

    def test_labels_keep_their_order_and_distance(self):
        rng = np.random.default_rng(1)
        for _ in range(100):
            values = list(rng.uniform(0, 10, 8))
            placed = spread(values, 0.9)
            order = np.argsort(values)
            gaps = np.diff(np.array(placed)[order])
            self.assertGreaterEqual(gaps.min(), 0.9 - 1e-9)

    def test_two_equal_values_are_moved_by_the_same_amount(self):
        self.assertEqual(sorted(spread([5.0, 5.0], 2.0)), [4.0, 6.0])


if __name__ == "__main__":
    unittest.main()
