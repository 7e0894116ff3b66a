// SPDX-License-Identifier: MIT
#include "bridge/side.hpp"

#include "bridge/base/check.hpp"

namespace sluice::bridge {

namespace {
constexpr std::size_t largest_mesh = std::size_t{1} << 30; // [bytes]
}

void write_mesh(PayloadWriter &write, const InterfaceMesh &mesh) {
  write.number(static_cast<std::uint64_t>(mesh.dim));
  write.number(static_cast<std::uint64_t>(mesh.nodes_per_face));
  write.reals(mesh.positions).integers(mesh.faces);
}

InterfaceMesh read_mesh(PayloadReader &read) {
  InterfaceMesh mesh;
  mesh.dim = static_cast<int>(read.number());
  mesh.nodes_per_face = static_cast<int>(read.number());
  mesh.positions = read.reals();
  mesh.faces = read.integers();
  return mesh;
}

void send_mesh(Link &link, const InterfaceMesh &mesh) {
  PayloadWriter payload;
  write_mesh(payload, mesh);
  link.send(FrameType::mesh, std::move(payload));
}

InterfaceMesh receive_mesh(Link &link) {
  InterfaceMesh mesh =
      link.receive(FrameType::mesh, largest_mesh,
                   fmt::format("the {}'s interface mesh", link.partner()), read_mesh);
  check_mesh(mesh, link.partner());
  return mesh;
}

void write_position(PayloadWriter &write, const Exchange &exchange) {
  write.number(static_cast<std::uint64_t>(exchange.clock.window()));
  write.number(static_cast<std::uint64_t>(exchange.iteration));
}

void check_position(PayloadReader &read, long window, int iteration) {
  const auto there = read.number(), there_iteration = read.number();
  if (there != static_cast<std::uint64_t>(window) ||
      there_iteration != static_cast<std::uint64_t>(iteration))
    throw MalformedMessage(
        fmt::format("window {}, iteration {} there; window {}, iteration {} here", there,
                    there_iteration, window, iteration));
}

// Fields are read in place and mapped in place: every one of them must fit.
void check_restored(const WindowField &field, std::size_t n_needed) {
  for (const std::vector<double> *values : {&field.start, &field.end, &field.before})
    check(values->size() == n_needed || (values == &field.before && values->empty()),
          "bridge: the restart file holds {} values on the interface, its mesh now needs {}; mesh "
          "and spacing must be those of the run that wrote it",
          values->size(), n_needed);
}

void write_report(PayloadWriter &write, const MapReport &report) {
  for (const auto count : {report.fluid_nodes, report.solid_nodes, report.fluid_nodes_beyond,
                           report.solid_nodes_reached, report.farthest_node})
    write.number(count);
  write.real(report.largest_distance).real(report.row_sum_error);
  write.real(report.largest_offset).real(report.area_covered);
}

MapReport read_report(PayloadReader &read) {
  MapReport report;
  for (std::size_t *count : {&report.fluid_nodes, &report.solid_nodes, &report.fluid_nodes_beyond,
                             &report.solid_nodes_reached, &report.farthest_node})
    *count = read.number();
  report.largest_distance = read.real();
  report.row_sum_error = read.real();
  report.largest_offset = read.real();
  report.area_covered = read.real();
  return report;
}

std::size_t record_limit(std::size_t n_values) { return 8 * n_values + 1024; }

} // namespace sluice::bridge
