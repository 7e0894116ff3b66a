# SPDX-License-Identifier: MIT
"""The fluid's validation cases: their exact solutions and references, and what they measure on made-up runs."""

import math
import unittest

import numpy as np

import paths
from compare import Curve

for name in ("dam-break", "hydrostatic-tank", "taylor-green", "rotating-square", "oscillating-drop",
             "viscous-collapse", "poiseuille-power-law", "elastic-gate-power-law"):
    paths.case(name)

import channel  # noqa: E402
import current  # noqa: E402
import dam  # noqa: E402
import fluid_runs  # noqa: E402
import drop  # noqa: E402
import square  # noqa: E402
import surface  # noqa: E402
import tank  # noqa: E402
from transient import PowerLawFlow  # noqa: E402
import vortex  # noqa: E402
from run_folder import read_columns  # noqa: E402
from vtk_files import Cloud  # noqa: E402


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


class MadeUpRun:
    def __init__(self, series):
        self.columns = series

    def series(self, _):
        return self.columns


class EnergySplitTest(unittest.TestCase):
    def test_the_parts_sum_to_the_whole_change_up_to_the_time_asked_for(self):
        run = MadeUpRun({"time_s": np.array([0.0, 1.0, 2.0]), "kinetic_j": np.array([0.0, 3.0, 5.0]),
                         "potential_j": np.array([10.0, 8.0, 9.0]),
                         "by_correction_j": np.array([0.0, 0.2, 9.0]),
                         "by_projection_j": np.array([0.0, 0.5, 9.0]),
                         "by_damping_j": np.array([0.0, -0.1, 9.0])})
        split = dam.energy_split(run, 1.5)
        self.assertAlmostEqual(split["whole"], 0.1)
        self.assertAlmostEqual(split["motion"], 0.04)


class TransientChannelTest(unittest.TestCase):
    def test_it_ends_in_the_steady_profile(self):
        for exponent in (0.5, 1):
            flow = PowerLawFlow(exponent, 10.0, cells=60)
            error = np.abs(flow.velocity(1.0, steps=40)
                           - channel.exact_velocity(exponent, flow.height)).max()
            print(f"n = {exponent:g}: {error:.1e}")
            self.assertLess(error, 2e-3)  # second order of 60 cells that are half as wide at plates

    def test_at_first_a_plate_drags_a_layer_along(self):
        flow = PowerLawFlow(1, 1.0)
        end = 1e-4  # Stokes' first problem: erfc(d / sqrt(4 nu t)), 0.01 thick
        d = 1 - flow.height
        layer = np.array([math.erfc(x / math.sqrt(4 * end)) for x in d])
        error = np.abs(flow.velocity(end) - layer).max()
        print(f"first layer: {error:.1e}")
        self.assertLess(error, 0.03)  # the counterflow is of the layer's own thickness


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


class SquareTest(unittest.TestCase):
    def test_the_start_pressure_is_that_of_the_reference(self):
        data = read_columns(paths.CASES / "rotating-square/reference"
                            / "rotating_square_initial_pressure.csv")
        x = data["x"] - 0.5
        for y, name in ((0 * x, "p_midline"), (x, "p_diagonal")):
            # the series here ends sooner; its terms fall with the fourth power
            np.testing.assert_allclose(square.start_pressure(x, y), data[name], atol=1e-6)

    def test_a_rigid_rotation_about_a_moving_centre_has_its_own_angular_momentum(self):
        x = np.random.default_rng(1).random((50, 2))
        centred = x - x.mean(axis=0)
        u = np.column_stack([-centred[:, 1], centred[:, 0]]) + [3, -2]
        self.assertAlmostEqual(square.angular_momentum(x, u), float((centred**2).sum()))


class DropTest(unittest.TestCase):
    def test_the_exact_ellipse_keeps_its_area_and_its_energy(self):
        a, b, rate = drop.exact_ellipse(np.linspace(0, 0.76, 20))
        # linear between samples 0.02 apart, curvature about one
        np.testing.assert_allclose(a * b, 1, atol=2e-4)
        np.testing.assert_allclose(rate**2 * (a**2 + b**2), 2, atol=4e-4)

    def test_a_filled_ellipse_has_its_semi_axes_and_its_rate(self):
        n = np.arange(40000)
        radius, angle = np.sqrt((n + 0.5) / len(n)), n * math.pi * (3 - math.sqrt(5))
        x = radius[:, None] * np.column_stack([0.5 * np.cos(angle), 2 * np.sin(angle)])
        found = drop.measure(0.0, x, x * [-0.7, 0.7])
        self.assertAlmostEqual(found.a, 0.5, delta=1e-3)
        self.assertAlmostEqual(found.b, 2.0, delta=4e-3)
        self.assertAlmostEqual(found.rate, 0.7)


class CurrentTest(unittest.TestCase):
    def test_the_starting_shape_has_the_law_s_area_and_front(self):
        for n in (0.5, 1.0, 2.0):
            film = current.Current(exponent=n)
            x, h = film.profile(film.front_start_m).T
            self.assertAlmostEqual(float(-np.trapz(h, x)), current.AREA)
            self.assertAlmostEqual(x[0], film.front_start_m)

    def test_the_law_gives_back_its_own_exponent(self):
        film = current.Current(exponent=1.5)
        time = np.linspace(0, film.end_time, 200)
        self.assertAlmostEqual(current.fitted_exponent(film, Curve(time, film.front(time))), 0.25)

    def test_points_ahead_of_a_gap_are_not_the_front(self):
        self.assertAlmostEqual(current.farthest_connected(np.array([0.2, 0, 0.1, 0.5]), 0.1), 0.25)

    def test_the_newtonian_law_is_huppert_s(self):
        film = current.Current()   # x = 1.411 (g q^3 / (3 nu))^(1/5) t^(1/5)
        nu = film.consistency / current.DENSITY
        front = 1.411 * (current.GRAVITY * current.AREA**3 / (3 * nu) * current.FIRST_TIME)**0.2
        self.assertAlmostEqual(front, film.front_start_m, delta=1e-3 * film.front_start_m)


class ChannelTest(unittest.TestCase):
    def test_the_exact_profile_holds_its_walls_and_lets_nothing_through(self):
        for n in (0.5, 1, 1.5, 2):
            y = np.linspace(0, 1, 20001)
            u = channel.exact_velocity(n, y)
            self.assertAlmostEqual(u[0], 0, delta=1e-10)
            self.assertAlmostEqual(u[-1], 1, delta=1e-10)
            self.assertAlmostEqual(float(np.trapz(u, y)), 0, delta=1e-7)   # of the trapezoids

    def test_a_plug_slides_as_a_whole_and_as_wide_as_the_yield_stress_allows(self):
        y, viscosity, yield_stress = np.linspace(0, 1, 20001), 1, 2
        u = channel.exact_velocity(1, y, yield_stress)
        wall_stress, gradient = channel.stresses(1, yield_stress)
        stress = wall_stress + gradient * y
        plug = np.abs(stress) < yield_stress
        self.assertAlmostEqual(plug.mean(), 2 * yield_stress / gradient, delta=1e-4)   # two spacings
        np.testing.assert_allclose(u[plug], u.min(), atol=1e-12)
        self.assertAlmostEqual(u[-1], 1, delta=1e-10)
        self.assertAlmostEqual(float(np.trapz(u, y)), 0, delta=1e-7)   # of the trapezoids
        shear = np.gradient(u, y)
        away = (y > 0) & (y < 1) & (np.abs(np.abs(stress) - yield_stress) > 1e-2)
        expected = np.where(plug, 0, (stress - np.sign(stress) * yield_stress) / viscosity)
        np.testing.assert_allclose(shear[away], expected[away], atol=1e-7)   # central: exact for parabolas

    def test_a_newtonian_profile_is_a_parabola(self):
        y = np.linspace(0, 1, 11)
        np.testing.assert_allclose(channel.exact_velocity(1, y), 3 * y**2 - 2 * y, atol=1e-12)


class RunsTest(unittest.TestCase):
    RUNS = {"n20": ["fluid.spacing_m=0.05"], "n40": ["fluid.spacing_m=0.025"]}

    def test_what_every_run_sets_for_itself_cannot_be_overridden(self):
        fluid_runs.refuse_what_follows(["fluid.time_order=1"], self.RUNS)
        with self.assertRaisesRegex(SystemExit, r"fluid.spacing_m follows from \[parameters\]"):
            fluid_runs.refuse_what_follows(["fluid.spacing_m = 0.1"], self.RUNS)


class SurfaceTest(unittest.TestCase):
    def test_a_surface_that_is_pulled_at_by_viscosity_has_its_traction(self):
        x, y = np.meshgrid(np.arange(10) + 0.5, np.arange(10) + 0.5)
        position = np.column_stack([x.ravel(), y.ravel()])
        top = position[:, 1] > 9
        viscosity = np.where(top, 5.0, 3.0)
        cloud = Cloud(position, {"kind": top.astype(int), "viscosity": viscosity,
                                 "pressure": np.full(100, 0.7),
                                 "velocity": position * [-0.2, 0.2]})
        found = surface.measure(cloud, 1.0)
        self.assertEqual(len(found.traction), 10)
        # in the middle the normal is (0, 1): -p + 2 mu dv/dy
        np.testing.assert_allclose(found.traction[4:6], -0.7 + 2 * 5 * 0.2, rtol=1e-12)
        self.assertEqual((found.viscosity_near, found.viscosity_inside), (5.0, 3.0))

    def test_pairs_are_those_within_reach(self):
        rng = np.random.default_rng(3)
        position = rng.random((60, 2))
        i, j = surface.neighbours(position, 0.3)
        distance = np.linalg.norm(position[:, None] - position[None], axis=2)
        self.assertEqual(len(i), ((distance < 0.3) & ~np.eye(60, dtype=bool)).sum())
        self.assertTrue((distance[i, j] < 0.3).all())


if __name__ == "__main__":
    unittest.main()
