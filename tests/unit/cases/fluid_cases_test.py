# SPDX-License-Identifier: MIT
"""The fluid's validation cases: their exact solutions and references, and what they measure on made-up runs."""

import math
import unittest

import numpy as np

import paths
from compare import Curve

for name in ("dam-break", "hydrostatic-tank", "taylor-green"):
    paths.case(name)

import dam  # noqa: E402
import tank  # noqa: E402
import vortex  # noqa: E402


class DamBreakTest(unittest.TestCase):
    def test_the_experiments_columns_cross_the_marked_stretch(self):
        for name, curve in dam.measured_fronts().items():
            print(f"{name}: {dam.crossing(curve):.2f}")
            self.assertTrue(1.5 < dam.crossing(curve) < 1.9, name)

    def test_a_front_at_constant_speed_takes_the_distance_over_the_speed(self):
        front = Curve(np.array([0.0, 1.0, 3.0]), np.array([1.0, 2.0, 4.0]))
        self.assertAlmostEqual(dam.crossing(front), 2.0)

    def test_the_measured_wave_arrives_later_the_higher_the_sensor(self):
        arrivals = [dam.arrival(dam.measured_pressure(s)) for s in dam.SENSOR_HEIGHT_M]
        self.assertEqual(arrivals, sorted(arrivals))
        self.assertTrue(2.3 < arrivals[0] < 2.5)


class TankTest(unittest.TestCase):
    def test_a_tilted_tank_holds_water_up_to_the_same_level(self):
        keys = tank.Tank(tilt_deg=10).keys()["fluid"]
        water = np.array(keys["water_m"])
        self.assertAlmostEqual(water[2, 1], tank.DEPTH)
        self.assertAlmostEqual(water[3, 1], tank.DEPTH)
        self.assertAlmostEqual(math.dist(water[0], water[1]), tank.WIDTH)

    def test_the_end_counts_and_not_the_start(self):
        u = math.sqrt(tank.GRAVITY * tank.DEPTH)
        series = {"time_s": np.linspace(0, 1, 101),
                  "max_speed_m_s": np.where(np.linspace(0, 1, 101) < 0.5, 0.3 * u, 0.01 * u)}
        whole, late = tank.speed(series)
        self.assertAlmostEqual(whole, 0.3)
        self.assertAlmostEqual(late, 0.01)


class VortexTest(unittest.TestCase):
    CASE = {"fluid": {"dynamic_viscosity_pa_s": 0.01, "density_kg_m3": 1}}

    def test_the_exact_flow_has_no_divergence_and_decays_by_its_viscosity(self):
        h, nu, t = 1e-4, 0.01, 0.7
        here = np.array([[0.3, 0.2]])

        def u(dx, dy, dt=0.0):
            return vortex.exact_velocity(self.CASE, here + [dx, dy], t + dt)[0]
        divergence = (u(h, 0) - u(-h, 0))[0] / (2 * h) + (u(0, h) - u(0, -h))[1] / (2 * h)
        self.assertAlmostEqual(divergence, 0, delta=1e-6)   # h^2 times third derivatives
        laplacian = (u(h, 0) + u(-h, 0) + u(0, h) + u(0, -h) - 4 * u(0, 0)) / h**2
        rate = (u(0, 0, h) - u(0, 0, -h)) / (2 * h)
        np.testing.assert_allclose(rate, nu * laplacian, atol=1e-6)

    def test_order_of_errors_that_fall_with_the_square(self):
        self.assertAlmostEqual(vortex.order([20, 40, 80], [16, 4, 1]), 2)


if __name__ == "__main__":
    unittest.main()
