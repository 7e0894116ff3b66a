// SPDX-License-Identifier: MIT
#include "bridge/calculix/output_vtu.hpp"

#include "bridge/base/check.hpp"

#include <fstream>
#include <iterator>

namespace sluice::calculix {
namespace {

// VTK's cell types, by the number of corners; corners come in the order of CalculiX.
int vtk_type(std::size_t corners) { return corners == 4 ? 10 : corners == 6 ? 13 : 12; }

std::string cells_of(const Deck &deck, const std::map<int, std::size_t> &place) {
  std::string connectivity, offsets, types;
  std::size_t offset = 0;
  for (const Element &element : deck.elements) {
    for (const int node : element.nodes)
      fmt::format_to(std::back_inserter(connectivity), "{} ", place.at(node));
    offset += element.nodes.size();
    fmt::format_to(std::back_inserter(offsets), "{} ", offset);
    fmt::format_to(std::back_inserter(types), "{} ", vtk_type(element.nodes.size()));
  }
  return fmt::format("<Cells>\n<DataArray type=\"Int64\" Name=\"connectivity\">{}</DataArray>\n"
                     "<DataArray type=\"Int64\" Name=\"offsets\">{}</DataArray>\n"
                     "<DataArray type=\"UInt8\" Name=\"types\">{}</DataArray>\n</Cells>\n",
                     connectivity, offsets, types);
}

void write_file(const std::filesystem::path &file, const std::string &text) {
  std::ofstream out(file, std::ios::binary);
  out << text << std::flush;
  check(out.good(), "{}: writing failed; is the disk full?", file.string());
}

} // namespace

OutputVtu::OutputVtu(const Deck &deck, std::filesystem::path folder)
    : folder_(std::move(folder)), n_cells_(deck.elements.size()) {
  std::map<int, std::size_t> place;
  positions_ = NodeField::Zero(3, deck.nodes.rbegin()->first);
  for (const auto &[number, x] : deck.nodes) {
    place[number] = numbers_.size();
    numbers_.push_back(number);
    positions_.col(number - 1) = x;
  }
  cells_ = cells_of(deck, place);
}

void OutputVtu::write(double time, const Motion &motion) {
  const std::string name = fmt::format("solid_{:04}.vtu", written_.size());
  write_file(folder_ / name, text_of(motion));
  written_.emplace_back(time, name);
  write_index();
}

std::string OutputVtu::vectors(std::string_view name, const NodeField &field) const {
  std::string text =
      fmt::format("<DataArray type=\"Float64\" Name=\"{}\" NumberOfComponents=\"3\">\n", name);
  for (const int number : numbers_) {
    const auto v = field.col(number - 1);
    fmt::format_to(std::back_inserter(text), "{:.9g} {:.9g} {:.9g}\n", v[0], v[1], v[2]);
  }
  return text + "</DataArray>\n";
}

std::string OutputVtu::text_of(const Motion &motion) const {
  const auto columns = positions_.cols();
  return fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\">\n"
      "<UnstructuredGrid>\n<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n"
      "<Points>\n{}</Points>\n{}<PointData>\n{}{}</PointData>\n"
      "</Piece>\n</UnstructuredGrid>\n</VTKFile>\n",
      numbers_.size(), n_cells_,
      vectors("position_m", positions_ + motion.displacement.leftCols(columns)), cells_,
      vectors("displacement_m", motion.displacement), vectors("velocity_m_s", motion.velocity));
}

// Renamed when it is whole: a reader, or a run that ends here, never meets half an index.
void OutputVtu::write_index() const {
  std::string text = "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n"
                     "<Collection>\n";
  for (const auto &[time, name] : written_)
    text += fmt::format("<DataSet timestep=\"{:.17g}\" part=\"0\" file=\"{}\"/>\n", time, name);
  const auto part = folder_ / "solid.pvd.part";
  write_file(part, text + "</Collection>\n</VTKFile>\n");
  std::filesystem::rename(part, folder_ / "solid.pvd");
}

} // namespace sluice::calculix
