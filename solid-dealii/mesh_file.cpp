// SPDX-License-Identifier: MIT
#include "solid-dealii/mesh_file.hpp"

#include "bridge/base/check.hpp"

#include <vtkCell.h>
#include <vtkCellTypes.h>
#include <vtkDataArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLUnstructuredGridReader.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <sstream>

namespace sluice::solid {
namespace {

// Words of a text file with the line they stand on, for errors that say where.
class TextFile {
public:
  explicit TextFile(const std::filesystem::path &file) : name_(file.string()), in_(file) {
    check(in_.good(), "{}: cannot be read; is the path right (relative to the case file)?", name_);
  }
  bool next_line(std::string &line) {
    if (!std::getline(in_, line))
      return false;
    ++number_;
    if (!line.empty() && line.back() == '\r')
      line.pop_back();
    return true;
  }
  std::string line() {
    std::string text;
    check(next_line(text), "{}: ends early, after line {}", name_, number_);
    return text;
  }
  template <class T> std::vector<T> numbers() {
    std::istringstream words(line());
    std::vector<T> values;
    for (T value; words >> value;)
      values.push_back(value);
    return values;
  }
  template <class... Args> [[noreturn]] void fail_here(fmt::format_string<Args...> m, Args &&...a) {
    fail("{}:{}: {}", name_, number_, fmt::format(m, std::forward<Args>(a)...));
  }

private:
  std::string name_;
  std::ifstream in_;
  long number_ = 0;
};

std::vector<int> sorted(std::vector<int> nodes) {
  std::sort(nodes.begin(), nodes.end());
  return nodes;
}

// File numbers of points, in any order and with gaps, as indices.
class PointNumbers {
public:
  explicit PointNumbers(MeshFile &mesh) : mesh_(mesh) {}
  void add(long number, const Vec<3> &position) {
    index_[number] = static_cast<int>(mesh_.points.size());
    mesh_.points.push_back(position);
  }
  int operator()(long number) const {
    const auto found = index_.find(number);
    return found == index_.end() ? -1 : found->second;
  }

private:
  MeshFile &mesh_;
  std::map<long, int> index_;
};

// ---- Gmsh ---------------------------------------------------------------------------------------

// Corners and dimension of Gmsh's element types that a mesh here may have.
struct GmshType {
  int dim, corners;
};
GmshType gmsh_type(int type, TextFile &text) {
  switch (type) {
  case 15:
    return {0, 1};
  case 1:
  case 8:
    return {1, 2};
  case 3:
  case 10:
  case 16:
    return {2, 4};
  case 5:
  case 12:
  case 17:
    return {3, 8};
  default:
    text.fail_here("element type {} of Gmsh is no line, quadrilateral or hexahedron; recombine the "
                   "mesh (Mesh.RecombineAll = 1)",
                   type);
  }
}

class GmshReader {
public:
  GmshReader(const std::filesystem::path &file, MeshFile &mesh)
      : text_(file), mesh_(mesh), number_(mesh) {}

  void read() {
    for (std::string line; text_.next_line(line);)
      if (line == "$MeshFormat")
        read_format();
      else if (line == "$PhysicalNames")
        read_names();
      else if (line == "$Entities")
        read_entities();
      else if (line == "$Nodes")
        version_ < 4 ? read_nodes_2() : read_nodes_4();
      else if (line == "$Elements")
        version_ < 4 ? read_elements_2() : read_elements_4();
  }

private:
  void read_format() {
    std::istringstream words(text_.line());
    int binary = 0;
    words >> version_ >> binary;
    if (binary != 0 || !(std::abs(version_ - 2.2) < 0.01 || std::abs(version_ - 4.1) < 0.01))
      text_.fail_here("format {}{}; write version 2.2 or 4.1 as text (Mesh.MshFileVersion = 4.1, "
                      "Mesh.Binary = 0)",
                      version_, binary ? ", binary" : "");
  }

  void read_names() {
    for (long n = text_.numbers<long>().at(0); n > 0; --n) {
      const std::string line = text_.line();
      std::istringstream words(line);
      int dim = 0, tag = 0;
      words >> dim >> tag;
      const auto first = line.find('"'), last = line.rfind('"');
      if (first == std::string::npos || last == first)
        text_.fail_here("a physical name stands in quotation marks");
      names_[{dim, tag}] = line.substr(first + 1, last - first - 1);
    }
  }

  // Physical groups of every entity.
  void read_entities() {
    const auto counts = text_.numbers<long>();
    if (counts.size() != 4)
      text_.fail_here("four counts of entities are expected");
    for (int dim = 0; dim < 4; ++dim)
      for (long k = 0; k < counts[static_cast<std::size_t>(dim)]; ++k) {
        const auto v = text_.numbers<double>();
        const std::size_t at = dim == 0 ? 4 : 7; // behind the tag and its point or bounding box
        if (v.size() <= at)
          text_.fail_here("an entity is cut short");
        auto &groups = groups_[{dim, static_cast<int>(v[0])}];
        for (std::size_t g = 0; g < static_cast<std::size_t>(v[at]) && at + 1 + g < v.size(); ++g)
          groups.push_back(static_cast<int>(v[at + 1 + g]));
      }
  }

  void add_node(long number, const std::vector<double> &v, std::size_t at) {
    if (v.size() < at + 3)
      text_.fail_here("a node needs three coordinates");
    number_.add(number, {v[at], v[at + 1], v[at + 2]});
  }

  void read_nodes_2() {
    for (long n = text_.numbers<long>().at(0); n > 0; --n) {
      const auto v = text_.numbers<double>();
      add_node(v.empty() ? 0 : static_cast<long>(v[0]), v, 1);
    }
  }
  void read_nodes_4() {
    for (long blocks = text_.numbers<long>().at(0); blocks > 0; --blocks) {
      const auto head = text_.numbers<long>();
      if (head.size() != 4)
        text_.fail_here("the head of a block of nodes has four numbers");
      std::vector<long> numbers;
      for (long k = 0; k < head[3]; ++k)
        numbers.push_back(text_.numbers<long>().at(0));
      for (const long number : numbers)
        add_node(number, text_.numbers<double>(), 0);
    }
  }

  void read_elements_2() {
    for (long n = text_.numbers<long>().at(0); n > 0; --n) {
      const auto v = text_.numbers<long>();
      if (v.size() < 3)
        text_.fail_here("an element is cut short");
      const auto tags = static_cast<std::size_t>(v[2]);
      add_element(static_cast<int>(v[1]),
                  tags > 0 ? std::vector<int>{static_cast<int>(v.at(3))} : std::vector<int>{},
                  std::vector<long>(v.begin() + static_cast<std::ptrdiff_t>(3 + tags), v.end()));
    }
  }
  void read_elements_4() {
    for (long blocks = text_.numbers<long>().at(0); blocks > 0; --blocks) {
      const auto head = text_.numbers<long>();
      if (head.size() != 4)
        text_.fail_here("the head of a block of elements has four numbers");
      const auto &groups = groups_[{static_cast<int>(head[0]), static_cast<int>(head[1])}];
      for (long k = 0; k < head[3]; ++k) {
        const auto v = text_.numbers<long>();
        add_element(static_cast<int>(head[2]), groups,
                    std::vector<long>(v.begin() + (v.empty() ? 0 : 1), v.end()));
      }
    }
  }

  void add_element(int type, const std::vector<int> &groups, const std::vector<long> &numbers) {
    const auto [dim, corners] = gmsh_type(type, text_);
    if (numbers.size() < static_cast<std::size_t>(corners))
      text_.fail_here("an element of type {} has {} nodes", type, numbers.size());
    std::vector<int> nodes;
    for (int k = 0; k < corners; ++k)
      nodes.push_back(number_(numbers[static_cast<std::size_t>(k)]));
    if (std::count(nodes.begin(), nodes.end(), -1))
      text_.fail_here("an element names a node that the file does not have");
    if (dim == mesh_.dim)
      mesh_.cells.push_back(std::move(nodes));
    else if (dim == mesh_.dim - 1)
      for (const int group : groups)
        if (const auto name = names_.find({dim, group}); name != names_.end())
          mesh_.face_sets[name->second].insert(sorted(nodes));
  }

  TextFile text_;
  MeshFile &mesh_;
  PointNumbers number_;
  double version_ = 0;
  std::map<std::pair<int, int>, std::string> names_;       // (dim, group)
  std::map<std::pair<int, int>, std::vector<int>> groups_; // (dim, entity)
};

// ---- Abaqus -------------------------------------------------------------------------------------

std::string upper(std::string text) {
  for (char &c : text)
    c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

std::vector<std::string> split_at_commas(const std::string &line) {
  std::vector<std::string> words;
  std::istringstream in(line);
  for (std::string word; std::getline(in, word, ',');) {
    const auto first = word.find_first_not_of(" \t"), last = word.find_last_not_of(" \t");
    words.push_back(first == std::string::npos ? "" : word.substr(first, last - first + 1));
  }
  while (!words.empty() && words.back().empty())
    words.pop_back();
  return words;
}

// Corners of face S1, S2, ... of an element, in Abaqus' order.
const std::vector<std::vector<int>> &abaqus_faces(int dim) {
  static const std::vector<std::vector<int>> plane{{0, 1}, {1, 2}, {2, 3}, {3, 0}};
  static const std::vector<std::vector<int>> space{{0, 1, 2, 3}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                                   {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
  return dim == 2 ? plane : space;
}

class AbaqusReader {
public:
  AbaqusReader(const std::filesystem::path &file, MeshFile &mesh)
      : text_(file), mesh_(mesh), number_(mesh) {}

  void read() {
    for (std::string line; text_.next_line(line);) {
      if (line.starts_with("**") || line.find_first_not_of(" \t") == std::string::npos)
        continue;
      line[0] == '*' ? start(split_at_commas(line)) : add(split_at_commas(line));
    }
    finish_element();
    resolve_sets();
  }

private:
  // A keyword line: the word, then KEY=VALUE options.
  void start(const std::vector<std::string> &words) {
    finish_element();
    keyword_ = upper(words[0]);
    options_.clear();
    for (std::size_t k = 1; k < words.size(); ++k) {
      const auto equals = words[k].find('=');
      const auto key = upper(split_at_commas(words[k].substr(0, equals)).at(0));
      options_[key] =
          equals == std::string::npos ? "" : split_at_commas(words[k].substr(equals + 1)).at(0);
    }
    if (keyword_ == "*ELEMENT")
      check_type();
    if (keyword_ == "*INCLUDE")
      text_.fail_here("*INCLUDE is not followed; put the mesh into one file");
  }

  void check_type() {
    const std::string type = upper(options_["TYPE"]);
    const bool is_plane = type.starts_with("CPE") || type.starts_with("CPS") ||
                          type.starts_with("S4") || type.starts_with("S8");
    n_nodes_ = type.find("20") != std::string::npos              ? 20
               : type.starts_with("C3D8")                        ? 8
               : is_plane && type.find('8') != std::string::npos ? 8
               : is_plane && type.find('4') != std::string::npos ? 4
                                                                 : 0;
    if (n_nodes_ == 0 || is_plane != (mesh_.dim == 2))
      text_.fail_here("element type {} in a mesh for dimension = {}; use {}", type, mesh_.dim,
                      mesh_.dim == 2 ? "CPE4, CPS4 or S4 (or their 8-node forms)"
                                     : "C3D8 or C3D20 in any form");
  }

  void add(const std::vector<std::string> &words) {
    if (keyword_ == "*NODE")
      add_node(words);
    else if (keyword_ == "*ELEMENT")
      element_.insert(element_.end(), words.begin(), words.end()), take_elements();
    else if (keyword_ == "*NSET")
      add_numbers(words, node_sets_[options_["NSET"]]);
    else if (keyword_ == "*ELSET")
      add_numbers(words, element_sets_[options_["ELSET"]]);
    else if (keyword_ == "*SURFACE")
      surfaces_.push_back({options_["NAME"], words});
  }

  double real(const std::string &word) {
    std::istringstream in(word);
    double value = 0;
    if (!(in >> value))
      text_.fail_here("'{}' is not a number", word);
    return value;
  }
  long integer(const std::string &word) { return static_cast<long>(real(word)); }

  void add_node(const std::vector<std::string> &words) {
    Vec<3> x = Vec<3>::Zero();
    for (std::size_t k = 1; k < std::min<std::size_t>(4, words.size()); ++k)
      x[static_cast<Eigen::Index>(k) - 1] = real(words[k]);
    number_.add(integer(words.at(0)), x);
    if (const auto set = options_.find("NSET"); set != options_.end())
      node_sets_[set->second].push_back(integer(words[0]));
  }

  // An element may go on over lines.
  void take_elements() {
    if (element_.size() < n_nodes_ + 1)
      return;
    std::vector<int> nodes;
    for (std::size_t k = 0; k < static_cast<std::size_t>(1 << mesh_.dim); ++k) {
      nodes.push_back(number_(integer(element_[k + 1])));
      if (nodes.back() < 0)
        text_.fail_here("an element names node {}, which does not stand before it",
                        element_[k + 1]);
    }
    element_index_[integer(element_[0])] = static_cast<int>(mesh_.cells.size());
    if (const auto set = options_.find("ELSET"); set != options_.end())
      element_sets_[set->second].push_back(integer(element_[0]));
    mesh_.cells.push_back(std::move(nodes));
    element_.clear();
  }
  void finish_element() {
    if (!element_.empty())
      text_.fail_here("an element is cut short: {} of {} nodes", element_.size() - 1, n_nodes_);
  }

  void add_numbers(const std::vector<std::string> &words, std::vector<long> &set) {
    if (options_.contains("GENERATE")) {
      const long last = integer(words.at(1)), step = words.size() > 2 ? integer(words[2]) : 1;
      for (long k = integer(words.at(0)); k <= last; k += std::max(1L, step))
        set.push_back(k);
      return;
    }
    for (const auto &word : words)
      if (!word.empty() && (std::isdigit(static_cast<unsigned char>(word[0])) != 0))
        set.push_back(integer(word));
      else { // another set
        auto &sets = keyword_ == "*NSET" ? node_sets_ : element_sets_;
        const std::vector<long> other = sets[word];
        set.insert(set.end(), other.begin(), other.end());
      }
  }

  void resolve_sets() {
    for (const auto &[name, numbers] : node_sets_)
      for (const long number : numbers)
        if (const int node = number_(number); node >= 0)
          mesh_.node_sets[name].insert(node);
    for (const auto &[name, words] : surfaces_) {
      if (words.size() < 2 || upper(words[1])[0] != 'S')
        continue; // a surface of nodes
      const auto face = static_cast<std::size_t>(integer(words[1].substr(1))) - 1;
      const auto set = element_sets_.find(words[0]);
      const std::vector<long> elements =
          set != element_sets_.end() ? set->second : std::vector<long>{integer(words[0])};
      for (const long element : elements)
        add_face(name, element, face);
    }
  }

  void add_face(const std::string &name, long element, std::size_t face) {
    const auto cell = element_index_.find(element);
    const auto &faces = abaqus_faces(mesh_.dim);
    if (cell == element_index_.end() || face >= faces.size())
      text_.fail_here("surface {} names face S{} of element {}, which is not there", name, face + 1,
                      element);
    std::vector<int> nodes;
    for (const int corner : faces[face])
      nodes.push_back(
          mesh_.cells[static_cast<std::size_t>(cell->second)][static_cast<std::size_t>(corner)]);
    mesh_.face_sets[name].insert(sorted(std::move(nodes)));
  }

  TextFile text_;
  MeshFile &mesh_;
  PointNumbers number_;
  std::string keyword_;
  std::map<std::string, std::string> options_;
  std::size_t n_nodes_ = 0; // of the present element type
  std::vector<std::string> element_;
  std::map<long, int> element_index_;
  std::map<std::string, std::vector<long>> node_sets_, element_sets_;
  std::vector<std::pair<std::string, std::vector<std::string>>> surfaces_;
};

// ---- VTK ----------------------------------------------------------------------------------------

void read_vtu(const std::filesystem::path &file, MeshFile &mesh) {
  check(std::filesystem::exists(file),
        "{}: cannot be read; is the path right (relative to the case file)?", file.string());
  vtkNew<vtkXMLUnstructuredGridReader> reader;
  reader->SetFileName(file.c_str());
  reader->Update();
  vtkUnstructuredGrid *cells = reader->GetOutput();
  check(reader->GetErrorCode() == 0 && cells->GetPoints() != nullptr,
        "{}: is no VTK file of an unstructured grid", file.string());
  for (vtkIdType k = 0; k < cells->GetNumberOfPoints(); ++k) {
    const double *x = cells->GetPoint(k);
    mesh.points.emplace_back(x[0], x[1], x[2]);
  }
  const std::size_t corners = static_cast<std::size_t>(1) << mesh.dim;
  for (vtkIdType k = 0; k < cells->GetNumberOfCells(); ++k) {
    vtkCell *cell = cells->GetCell(k);
    if (cell->GetCellDimension() < mesh.dim)
      continue;
    const int type = cell->GetCellType();
    check(type == VTK_QUAD || type == VTK_QUADRATIC_QUAD || type == VTK_BIQUADRATIC_QUAD ||
              type == VTK_HEXAHEDRON || type == VTK_QUADRATIC_HEXAHEDRON ||
              type == VTK_TRIQUADRATIC_HEXAHEDRON,
          "{}: cell {} is of VTK type {}, no quadrilateral or hexahedron", file.string(), k, type);
    std::vector<int> nodes;
    for (std::size_t c = 0; c < corners; ++c)
      nodes.push_back(static_cast<int>(cell->GetPointId(static_cast<int>(c))));
    mesh.cells.push_back(std::move(nodes));
  }
  vtkPointData *fields = cells->GetPointData();
  for (int k = 0; k < fields->GetNumberOfArrays(); ++k) {
    vtkDataArray *field = fields->GetArray(k);
    if (field == nullptr || field->GetNumberOfComponents() != 1)
      continue;
    auto &set = mesh.node_sets[field->GetName()];
    for (vtkIdType a = 0; a < field->GetNumberOfTuples(); ++a)
      if (field->GetComponent(a, 0) != 0)
        set.insert(static_cast<int>(a));
  }
}

} // namespace

MeshFile read_mesh(const std::filesystem::path &file, int dim) {
  MeshFile mesh;
  mesh.dim = dim;
  const std::string extension = file.extension().string();
  if (extension == ".msh")
    GmshReader(file, mesh).read();
  else if (extension == ".inp")
    AbaqusReader(file, mesh).read();
  else {
    check(extension == ".vtu", "{}: meshes are read from .msh (Gmsh), .inp (Abaqus) and .vtu (VTK)",
          file.string());
    read_vtu(file, mesh);
  }
  check(!mesh.cells.empty(), "{}: has no {}; is dimension = {} right?", file.string(),
        dim == 2 ? "quadrilaterals" : "hexahedra", dim);
  return mesh;
}

} // namespace sluice::solid
