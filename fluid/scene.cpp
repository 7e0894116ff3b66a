// SPDX-License-Identifier: MIT
#include "fluid/scene.hpp"

#include "bridge/base/check.hpp"
#include "fluid/coordinates.hpp"
#include "fluid/filling.hpp"
#include "fluid/names.hpp"
#include "fluid/wall_table.hpp"

#include <cmath>

namespace sluice::fluid {

template <int dim> double volume_error(const Scene<dim> &scene) {
  const double outlined = outlined_volume(scene.params);
  const double filled = scene.initial.points.size() * volume_of_point<dim>(scene.params.spacing);
  return outlined > 0 ? filled / outlined - 1 : 0;
}

template <int dim> void check_clear_of_walls(const Scene<dim> &scene, double tolerance) {
  const double spacing = scene.params.spacing;
  const auto &position = scene.initial.points.position;
  FaceTree<dim> tree;
  tree.update(scene.walls);
  for (const Vec<dim> &x : position)
    for (const Projection<dim> &p : project_on_walls(scene.walls, tree, x, spacing))
      check(p.distance > -tolerance,
            "the water overlaps wall '{}': a point at {} m lies {:.3g} m behind it; "
            "correct water_m or the wall (the fluid lies on the left of its points_m)",
            scene.walls.names[scene.walls.faces[p.face].wall], text_of(x), -p.distance);
}

namespace {

struct Dimension {
  int value = 2;
  template <class Reader> void describe(Reader &read) {
    read("dimension", value, "2: per metre of depth; 3: in space")
        .check(value == 2 || value == 3, "must be 2 or 3");
  }
};

} // namespace

int dimension_of(const Config &config) { return config.peek<Dimension>("fluid").value; }

template <int dim> Scene<dim> read_scene(const Config &config, const SurfaceReader &read_surface) {
  Scene<dim> scene;
  scene.params = config.read<FluidParams<dim>>("fluid");
  scene.params.rheology =
      Rheology(config.read<RheologyParams>("fluid.rheology"), scene.params.viscosity);
  scene.walls = read_walls<dim>(config, {scene.params.depth, scene.params.side_walls}, read_surface,
                                scene.prescribed);
  scene.gauges = config.read_all<GaugeParams<dim>>("fluid.gauge");
  check_names(scene.gauges, "gauge");
  for (GaugeParams<dim> &gauge : scene.gauges)
    if (std::isnan(gauge.z))
      gauge.z = 0.5 * scene.params.depth;
  scene.probes = config.read_all<ProbeParams<dim>>("fluid.probe");
  check_names(scene.probes, "probe");
  if (!scene.params.start_state.empty())
    return scene; // its water is in that file
  scene.initial.points = fill(scene.params, scene.walls);
  check_clear_of_walls(scene, 0);
  if (!scene.params.open_sides && scene.params.gravity.norm() > 0 && !scene.params.is_flooded())
    check_holes(scene.params, scene.walls, scene.initial.points);
  return scene;
}

template double volume_error(const Scene<2> &);
template void check_clear_of_walls(const Scene<2> &, double);
template Scene<2> read_scene(const Config &, const SurfaceReader &);
template double volume_error(const Scene<3> &);
template void check_clear_of_walls(const Scene<3> &, double);
template Scene<3> read_scene(const Config &, const SurfaceReader &);

} // namespace sluice::fluid
