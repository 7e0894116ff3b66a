// SPDX-License-Identifier: MIT
#include "solid-dealii/output_vtk.hpp"

#include "solid-dealii/dealii_mesh.hpp"

#include <deal.II/fe/fe_system.h>
#include <deal.II/fe/mapping_q_eulerian.h>
#include <deal.II/lac/vector.h>
#include <deal.II/numerics/data_out.h>

#include <fstream>

namespace sluice::solid {

template <int dim> struct OutputVtk<dim>::Impl {
  Impl(const Discretisation<dim> &d, std::filesystem::path into)
      : mesh(d.mesh), ranks(d.ranks), folder(std::move(into)),
        degree(static_cast<unsigned int>(d.degree)), element(mesh->element, dim),
        vectors(*mesh->triangulation) {
    vectors.distribute_dofs(element);
    number_components(d);
  }

  // position_of[dim * node + component] is the place in deal.II's numbering of the vector field.
  void number_components(const Discretisation<dim> &d) {
    position_of.resize(static_cast<std::size_t>(d.n_dofs()));
    std::vector<dealii::types::global_dof_index> vector(element.n_dofs_per_cell());
    auto nodes = d.cell_nodes.begin();
    for (const auto &cell : own_cells()) {
      cell->get_dof_indices(vector);
      for (unsigned int k = 0; k < vector.size(); ++k) {
        const auto [component, node] = element.system_to_component_index(k);
        position_of[static_cast<std::size_t>(dim * nodes[node]) + component] = vector[k];
      }
      nodes += d.nodes_per_cell;
    }
  }

  auto own_cells() const {
    return vectors.active_cell_iterators() | dealii::IteratorFilters::LocallyOwnedCell();
  }

  // Of the whole body's length: only entries of own cells are read.
  dealii::Vector<double> nodal(const Eigen::VectorXd &field) const {
    dealii::Vector<double> numbered(vectors.n_dofs());
    for (std::size_t k = 0; k < position_of.size(); ++k)
      numbered[position_of[k]] = field[static_cast<Eigen::Index>(k)];
    return numbered;
  }

  dealii::Vector<double> cellwise(const Eigen::VectorXd &field) const {
    dealii::Vector<double> all(mesh->triangulation->n_active_cells());
    Eigen::Index k = 0;
    for (const auto &cell : own_cells())
      all[cell->active_cell_index()] = field[k++];
    return all;
  }

  // The number of the sample, as all files of it begin.
  std::string stem() const { return fmt::format("solid_{:04}", written.size()); }

  std::string part_of(int rank) const {
    return ranks.is_one() ? stem() + ".vtu" : fmt::format("{}.{}.vtu", stem(), rank + 1);
  }

  void write_fields(const OutputFields &fields) const {
    using namespace dealii;
    const auto displacement = nodal(fields.displacement), velocity = nodal(fields.velocity);
    const auto pressure = cellwise(fields.pressure), von_mises = cellwise(fields.von_mises);
    const auto energy = cellwise(fields.energy);
    std::vector<Vector<double>> components;
    for (Eigen::Index k = 0; k < (dim == 2 ? 4 : 6); ++k)
      components.push_back(cellwise(fields.stress.row(k)));
    const std::vector interpretation(dim, DataComponentInterpretation::component_is_part_of_vector);
    DataOut<dim> data;
    data.add_data_vector(vectors, displacement, std::vector<std::string>(dim, "displacement_m"),
                         interpretation);
    data.add_data_vector(vectors, velocity, std::vector<std::string>(dim, "velocity_m_s"),
                         interpretation);
    data.add_data_vector(pressure, "pressure_pa", DataOut<dim>::type_cell_data);
    data.add_data_vector(von_mises, "von_mises_stress_pa", DataOut<dim>::type_cell_data);
    data.add_data_vector(energy, "strain_energy_j", DataOut<dim>::type_cell_data);
    constexpr const char *names[] = {"xx", "yy", "zz", "xy", "xz", "yz"};
    for (std::size_t k = 0; k < components.size(); ++k)
      data.add_data_vector(components[k], fmt::format("stress_{}_pa", names[k]),
                           DataOut<dim>::type_cell_data);
    data.build_patches(MappingQEulerian<dim>(degree, vectors, displacement), degree,
                       DataOut<dim>::curved_inner_cells);
    to_file(part_of(ranks.rank()), [&](std::ostream &out) { data.write_vtu(out); });
    if (ranks.is_one() || !ranks.is_root())
      return;
    std::vector<std::string> parts;
    for (int rank = 0; rank < ranks.size(); ++rank)
      parts.push_back(part_of(rank));
    to_file(stem() + ".pvtu", [&](std::ostream &out) { data.write_pvtu_record(out, parts); });
  }

  template <class Write> void to_file(const std::string &name, Write &&write) const {
    std::ofstream out(folder / name);
    write(out);
    out.flush(); // or a full disk shows in the destructor, where nobody asks
    check(out.good(), "{}: writing failed; is the disk full?", (folder / name).string());
  }

  // Renamed when it is whole: a reader, or a run that ends here, never meets half an index.
  void write_index() const {
    if (!ranks.is_root())
      return;
    const auto part = folder / "solid.pvd.part", whole = folder / "solid.pvd";
    std::ofstream index(part);
    dealii::DataOutBase::write_pvd_record(index, written);
    index.flush();
    check(index.good(), "{}: writing failed; is the disk full?", part.string());
    std::filesystem::rename(part, whole);
  }

  std::shared_ptr<const DealiiMesh<dim>> mesh;
  Ranks ranks;
  std::filesystem::path folder;
  unsigned int degree;
  dealii::FESystem<dim> element;
  dealii::DoFHandler<dim> vectors;
  std::vector<dealii::types::global_dof_index> position_of;
  std::vector<std::pair<double, std::string>> written;
};

template <int dim>
OutputVtk<dim>::OutputVtk(const Discretisation<dim> &discretisation, std::filesystem::path folder)
    : impl_(std::make_unique<Impl>(discretisation, std::move(folder))) {}

template <int dim> OutputVtk<dim>::~OutputVtk() = default;

template <int dim> void OutputVtk<dim>::write(double time, const OutputFields &fields) {
  impl_->write_fields(fields);
  impl_->written.emplace_back(time, impl_->stem() + (impl_->ranks.is_one() ? ".vtu" : ".pvtu"));
  impl_->write_index();
}

template class OutputVtk<2>;
template class OutputVtk<3>;

} // namespace sluice::solid
