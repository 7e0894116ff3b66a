// SPDX-License-Identifier: MIT
#include "bridge/calculix/restart_file.hpp"

#include "bridge/base/check.hpp"

#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>

namespace sluice::calculix {
namespace {

using Record = std::string_view;

// Places of records counted from the start of the file.
constexpr std::size_t nodes_record = 9, elements_record = 10, components_record = 13,
                      materials_record = 20;
constexpr std::size_t name_length = 80; // of a material

std::string bytes_of(const std::filesystem::path &file) {
  std::ifstream in(file, std::ios::binary);
  check(in.good(), "{}: cannot be read", file.string());
  return {std::istreambuf_iterator<char>(in), {}};
}

template <class Number> Number number_at(std::string_view bytes, std::size_t offset) {
  Number value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

std::vector<Record> records_of(std::string_view bytes, const std::string &file) {
  std::vector<Record> records;
  constexpr std::size_t mark = sizeof(std::int32_t);
  for (std::size_t at = 0; at < bytes.size();) {
    const auto length = bytes.size() - at < mark ? std::int64_t{-1}
                                                 : std::int64_t{number_at<std::int32_t>(bytes, at)};
    const auto whole = static_cast<std::size_t>(length) + 2 * mark;
    check(length >= 0 && whole <= bytes.size() - at &&
              number_at<std::int32_t>(bytes, at + whole - mark) == length,
          "{}: the record at byte {} is broken; was ccx ended while it wrote, or is the disk full?",
          file, at);
    records.push_back(bytes.substr(at + mark, static_cast<std::size_t>(length)));
    at += whole;
  }
  return records;
}

class RestartFile {
public:
  explicit RestartFile(const std::filesystem::path &file)
      : name_(file.string()), bytes_(bytes_of(file)), records_(records_of(bytes_, name_)) {}

  Motion motion() const {
    const std::size_t at = displacement_record();
    Motion motion{field(at), field(at + 1), 0};
    const Record time = records_[records_.size() - 2];
    understand(time.size() == sizeof(double));
    motion.time = number_at<double>(time, 0);
    check_finite("displacement", motion.displacement);
    check_finite("velocity", motion.velocity);
    return motion;
  }

private:
  void understand(bool condition) const {
    check(condition,
          "{}: is not laid out as the restart file of CalculiX 2.20 ('{}'); sluice-calculix reads "
          "displacements and velocities from it",
          name_, version());
  }

  std::string version() const {
    const Record record = records_.empty() ? Record() : records_[0].substr(0, name_length);
    const auto last = record.find_last_not_of(' ');
    return std::string(record.substr(0, last == Record::npos ? 0 : last + 1));
  }

  std::size_t integer(std::size_t record, std::size_t place = 0) const {
    understand(record < records_.size() &&
               records_[record].size() >= (place + 1) * sizeof(std::int32_t));
    const auto value = number_at<std::int32_t>(records_[record], place * sizeof(std::int32_t));
    understand(value >= 0);
    return static_cast<std::size_t>(value);
  }

  // Temperature, three displacements, pressure ..: one column per node.
  std::size_t values_per_node() const { return integer(components_record, 1) + 1; }

  std::size_t displacement_record() const {
    understand(records_.size() > materials_record && records_[0].starts_with("Version 2."));
    const std::size_t values = sizeof(double) * values_per_node() * integer(nodes_record);
    const std::size_t materials_of_elements =
        sizeof(std::int32_t) * integer(components_record, 2) * integer(elements_record);
    const std::size_t names = name_length * integer(materials_record);
    std::size_t found = 0, matches = 0;
    for (std::size_t k = materials_record; k + 3 < records_.size(); ++k)
      if (records_[k].size() == names && records_[k + 1].size() == materials_of_elements &&
          records_[k + 2].size() == values && records_[k + 3].size() == values) {
        found = k + 2;
        ++matches;
      }
    understand(matches == 1 && values_per_node() > 3);
    return found;
  }

  NodeField field(std::size_t record) const {
    const auto rows = static_cast<Eigen::Index>(values_per_node());
    const auto nodes = static_cast<Eigen::Index>(integer(nodes_record));
    Eigen::MatrixXd all(rows, nodes);
    std::memcpy(all.data(), records_[record].data(), records_[record].size());
    return all.middleRows<3>(1);
  }

  void check_finite(std::string_view what, const NodeField &values) const {
    for (Eigen::Index node = 0; node < values.cols(); ++node)
      check(values.col(node).allFinite(), "{}: the {} of node {} is not finite", name_, what,
            node + 1);
  }

  std::string name_;
  std::string bytes_;
  std::vector<Record> records_;
};

} // namespace

Motion read_restart_file(const std::filesystem::path &file) { return RestartFile(file).motion(); }

} // namespace sluice::calculix
