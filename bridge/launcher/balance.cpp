// SPDX-License-Identifier: MIT
#include "bridge/launcher/balance.hpp"

#include "bridge/base/check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace sluice::launcher {

namespace fs = std::filesystem;

namespace {

struct Loads {
  double fx = 0, fy = 0, moment = 0, work = 0;
  double force_size = 0, moment_size = 0, work_size = 0; ///< sums of magnitudes
};

std::vector<std::string> split(const std::string &line) {
  std::vector<std::string> cells;
  std::stringstream in(line);
  for (std::string cell; std::getline(in, cell, ',');)
    cells.push_back(cell);
  return cells;
}

std::vector<std::size_t> columns_of(const fs::path &file, const std::string &header) {
  static constexpr std::array names{"window",
                                    "fx_n",
                                    "fy_n",
                                    "moment_nm",
                                    "work_j",
                                    "magnitude_n",
                                    "moment_magnitude_nm",
                                    "work_magnitude_j"};
  const auto cells = split(header);
  std::vector<std::size_t> columns;
  for (const std::string name : names) {
    const auto found = std::find(cells.begin(), cells.end(), name);
    check(found != cells.end(), "{}: column '{}' is missing; was it written by another version?",
          file.string(), name);
    columns.push_back(static_cast<std::size_t>(found - cells.begin()));
  }
  return columns;
}

// By window number; a window that was repeated counts with its last row. A row that was cut short
// by the end of the program is left out.
std::map<long, Loads> read_loads(const fs::path &file) {
  std::ifstream in(file);
  std::map<long, Loads> loads;
  std::string line;
  if (!std::getline(in, line))
    return loads;
  const auto columns = columns_of(file, line);
  const std::size_t width = split(line).size();
  while (std::getline(in, line)) {
    const auto cells = split(line);
    if (cells.size() != width)
      continue;
    const auto value = [&](std::size_t k) {
      return std::strtod(cells[columns[k]].c_str(), nullptr);
    };
    loads[std::lround(value(0))] = {value(1), value(2), value(3), value(4),
                                    value(5), value(6), value(7)};
  }
  return loads;
}

double relative(double difference, double size_a, double size_b) {
  const double ratio = difference == 0 ? 0 : difference / std::max(size_a, size_b);
  return std::isfinite(ratio) ? ratio : std::numeric_limits<double>::infinity();
}

void include(Balance &balance, const Loads &a, const Loads &b) {
  const double force = std::hypot(a.fx - b.fx, a.fy - b.fy);
  balance.force = std::max(balance.force, relative(force, a.force_size, b.force_size));
  balance.moment = std::max(balance.moment,
                            relative(std::abs(a.moment - b.moment), a.moment_size, b.moment_size));
  balance.work =
      std::max(balance.work, relative(std::abs(a.work - b.work), a.work_size, b.work_size));
  ++balance.windows;
}

} // namespace

std::optional<Balance> interface_balance(const fs::path &folder) {
  const fs::path fluid_file = folder / "fluid_loads.csv", solid_file = folder / "solid_loads.csv";
  if (!fs::exists(fluid_file) || !fs::exists(solid_file))
    return std::nullopt;
  const auto fluid = read_loads(fluid_file), solid = read_loads(solid_file);
  Balance balance;
  for (const auto &[window, loads] : fluid)
    if (const auto other = solid.find(window); other != solid.end())
      include(balance, loads, other->second);
  return balance;
}

} // namespace sluice::launcher
