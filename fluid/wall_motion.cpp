// SPDX-License-Identifier: MIT
#include "fluid/wall_motion.hpp"

namespace sluice::fluid {

template <int dim>
void move_walls(const std::vector<PrescribedWall<dim>> &prescribed, double time, double dt,
                Walls<dim> &walls) {
  for (const PrescribedWall<dim> &wall : prescribed)
    for (std::size_t k = 0; k < wall.at_rest.size(); ++k) {
      const Vec<dim> &x = wall.at_rest[k];
      const Vec<dim> before = wall.displacement(x, time), after = wall.displacement(x, time + dt);
      walls.position[wall.first + k] = x + after;
      walls.velocity[wall.first + k] = (after - before) / dt + wall.sliding[k];
    }
}

template void move_walls(const std::vector<PrescribedWall<2>> &, double, double, Walls<2> &);
template void move_walls(const std::vector<PrescribedWall<3>> &, double, double, Walls<3> &);

} // namespace sluice::fluid
