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
      : mesh(d.mesh), folder(std::move(into)), degree(static_cast<unsigned int>(d.degree)),
        element(mesh->element, dim), vectors(mesh->triangulation) {
    vectors.distribute_dofs(element);
    number_components();
  }

  // position_of[dim * node + component] is the place in deal.II's numbering of the vector field.
  void number_components() {
    using namespace dealii;
    position_of.resize(vectors.n_dofs());
    std::vector<types::global_dof_index> scalar(mesh->element.n_dofs_per_cell());
    std::vector<types::global_dof_index> vector(element.n_dofs_per_cell());
    for (const auto &cell : vectors.active_cell_iterators()) {
      cell->get_dof_indices(vector);
      typename DoFHandler<dim>::active_cell_iterator(&mesh->triangulation, cell->level(),
                                                     cell->index(), &mesh->nodes)
          ->get_dof_indices(scalar);
      for (unsigned int k = 0; k < vector.size(); ++k) {
        const auto [component, node] = element.system_to_component_index(k);
        position_of[dim * scalar[node] + component] = vector[k];
      }
    }
  }

  dealii::Vector<double> nodal(const Eigen::VectorXd &field) const {
    dealii::Vector<double> numbered(vectors.n_dofs());
    for (std::size_t k = 0; k < position_of.size(); ++k)
      numbered[position_of[k]] = field[static_cast<Eigen::Index>(k)];
    return numbered;
  }

  static dealii::Vector<double> cellwise(const Eigen::VectorXd &field) {
    return dealii::Vector<double>(field.data(), field.data() + field.size());
  }

  void write_fields(std::ostream &out, const OutputFields &fields) const {
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
    data.write_vtu(out);
  }

  // Renamed when it is whole: a reader, or a run that ends here, never meets half an index.
  void write_index() const {
    const auto part = folder / "solid.pvd.part", whole = folder / "solid.pvd";
    std::ofstream index(part);
    dealii::DataOutBase::write_pvd_record(index, written);
    index.flush();
    check(index.good(), "{}: writing failed; is the disk full?", part.string());
    std::filesystem::rename(part, whole);
  }

  std::shared_ptr<const DealiiMesh<dim>> mesh;
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
  const std::string name = fmt::format("solid_{:04}.vtu", impl_->written.size());
  std::ofstream out(impl_->folder / name);
  impl_->write_fields(out, fields);
  out.flush(); // or a full disk shows in the destructor, where nobody asks
  check(out.good(), "{}: writing failed; is the disk full?", (impl_->folder / name).string());
  impl_->written.emplace_back(time, name);
  impl_->write_index();
}

template class OutputVtk<2>;
template class OutputVtk<3>;

} // namespace sluice::solid
