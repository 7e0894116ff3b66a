// SPDX-License-Identifier: MIT
// The reader of restart files on files made here, record by record as restartwrite.f does. That the
// real ccx writes them so is asked in windows_test.cpp.
#include "bridge/calculix/restart_file.hpp"
#include "tests/unit/bridge/support.hpp"

#include <cstring>
#include <fstream>
#include <limits>

namespace sluice::calculix {
namespace {

using bridge::contains;
using bridge::error_of;

constexpr int n_nodes = 5, n_elements = 2, n_materials = 1;

class RestartFileTest : public testing::Test {
protected:
  // Displacement 10 node + d, velocity the negative of it, at 0.25 s.
  void SetUp() override {
    text("Version 2.20", 80);
    for (const int size : {1, 3, 4, 0, 0, 6, 9, 0, n_nodes, n_elements, 0, 16})
      integers({size});
    integers({8, 3, 1}); // integration points, displacements, materials of an element
    for (const int size : {0, 1, 1, 1, 0, 0, n_materials})
      integers({size});
    for (int filler = 0; filler < 30; ++filler)
      reals(std::vector<double>(static_cast<std::size_t>(filler), 1.0));
    text("RUBBER", 80);
    integers({1, 1});
    reals(field(1));
    reals(field(-1));
    reals({1, 2, 3});
    reals({0.25});
    integers({1, 0});
  }

  std::vector<double> field(double sign) const {
    std::vector<double> values;
    for (int node = 1; node <= n_nodes; ++node)
      for (int component = 0; component < 4; ++component)
        values.push_back(component == 0 ? 7 : sign * (10 * node + component - 1));
    return values;
  }

  void record(const void *data, std::size_t size) {
    const auto mark = static_cast<std::int32_t>(size);
    for (const auto &[from, length] :
         {std::pair<const void *, std::size_t>(&mark, 4), {data, size}, {&mark, 4}})
      bytes_.append(static_cast<const char *>(from), length);
  }
  void integers(const std::vector<std::int32_t> &v) { record(v.data(), 4 * v.size()); }
  void reals(const std::vector<double> &v) { record(v.data(), 8 * v.size()); }
  void text(std::string words, std::size_t width) {
    words.resize(width, ' ');
    record(words.data(), width);
  }

  Motion read() const {
    std::ofstream(file(), std::ios::binary) << bytes_;
    return read_restart_file(file());
  }
  std::string refusal() const {
    return error_of([&] { read(); });
  }
  std::filesystem::path file() const { return folder_.path() / "window.rout"; }
  void replace(double old, double with) {
    const auto at = bytes_.find(std::string(reinterpret_cast<const char *>(&old), sizeof old));
    ASSERT_NE(at, std::string::npos);
    std::memcpy(bytes_.data() + at, &with, sizeof with);
  }

  TemporaryFolder folder_;
  std::string bytes_;
};

TEST_F(RestartFileTest, motion_is_read_with_all_digits) {
  replace(32.0, 0.1 + 0.2); // node 3, third component
  const Motion motion = read();
  ASSERT_EQ(motion.displacement.cols(), n_nodes);
  EXPECT_EQ(motion.displacement.col(0), Vec<3>(10, 11, 12)) << "without the temperature";
  EXPECT_EQ(motion.displacement(2, 2), 0.1 + 0.2);
  EXPECT_EQ(motion.velocity.col(4), Vec<3>(-50, -51, -52));
  EXPECT_EQ(motion.time, 0.25);
}

TEST_F(RestartFileTest, a_file_cut_short_anywhere_is_refused) {
  const std::string whole = bytes_;
  for (std::size_t length = 0; length < whole.size(); length += 37) {
    bytes_ = whole.substr(0, length);
    EXPECT_FALSE(refusal().empty()) << length;
  }
  bytes_ = whole.substr(0, whole.size() - 1);
  EXPECT_TRUE(contains(refusal(), "window.rout: the record at byte"));
}

TEST_F(RestartFileTest, another_layout_is_refused_with_its_version) {
  const std::string whole = bytes_;
  reals(field(1)); // a third record of that length: which two are meant?
  text("RUBBER", 80);
  integers({1, 1});
  reals(field(1));
  reals(field(1));
  EXPECT_TRUE(contains(refusal(), "'Version 2.20'"));
  bytes_ = whole;
  bytes_.replace(bytes_.find("2.20"), 4, "3.00");
  EXPECT_TRUE(contains(refusal(), "'Version 3.00'"));
}

TEST_F(RestartFileTest, a_value_that_is_not_finite_is_refused_with_its_node) {
  replace(-41.0, std::numeric_limits<double>::quiet_NaN());
  EXPECT_TRUE(contains(refusal(), "the velocity of node 4 is not finite"));
}

TEST_F(RestartFileTest, a_file_that_is_not_there_is_named) {
  EXPECT_TRUE(
      contains(error_of([&] { read_restart_file(file()); }), "window.rout: cannot be read"));
}

} // namespace
} // namespace sluice::calculix
