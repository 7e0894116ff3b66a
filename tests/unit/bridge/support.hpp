// SPDX-License-Identifier: MIT
// What several tests of the bridge share.
#pragma once

#include "bridge/base/check.hpp"
#include "bridge/base/config.hpp"
#include "bridge/interface_mesh.hpp"
#include "tests/support/temporary_folder.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <random>
#include <string>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include <vector>

namespace sluice::bridge {

inline bool contains(const std::string &text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

/// The message of the UserError that `action` throws; "" when it throws none.
template <class Action> std::string error_of(Action &&action) {
  try {
    action();
  } catch (const UserError &error) {
    return error.what();
  }
  return "";
}

inline void expect_message(const std::string &message,
                           std::initializer_list<std::string_view> parts) {
  for (const auto part : parts)
    EXPECT_TRUE(contains(message, part)) << "'" << part << "' is not in: " << message;
}

inline std::vector<double> random_values(std::size_t n, unsigned seed, double size = 1) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> uniform(-size, size);
  std::vector<double> values(n);
  for (double &v : values)
    v = uniform(engine);
  return values;
}

/// The segments of a polyline through `points`.
inline InterfaceMesh polyline(const std::vector<Vec<2>> &points) {
  InterfaceMesh mesh;
  for (std::size_t k = 0; k < points.size(); ++k) {
    mesh.positions.insert(mesh.positions.end(), {points[k].x(), points[k].y()});
    if (k > 0)
      mesh.faces.insert(mesh.faces.end(), {static_cast<int>(k) - 1, static_cast<int>(k)});
  }
  return mesh;
}

/// Corner points `a` and `b` of a straight line with `n` segments of unequal length.
inline std::vector<Vec<2>> uneven_line(const Vec<2> &a, const Vec<2> &b, int n, double unevenness) {
  std::vector<Vec<2>> points;
  for (int k = 0; k <= n; ++k) {
    const double s = static_cast<double>(k) / n;
    points.push_back(a + (s + unevenness * s * (1 - s)) * (b - a));
  }
  return points;
}

/// The socket file of a run that was killed: bound once, nobody listens.
inline void leave_stale_socket(const std::filesystem::path &path) {
  const int leftover = ::socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un name{};
  name.sun_family = AF_UNIX;
  path.string().copy(name.sun_path, sizeof name.sun_path - 1);
  ASSERT_EQ(::bind(leftover, reinterpret_cast<const sockaddr *>(&name), sizeof name), 0);
  ::close(leftover);
}

} // namespace sluice::bridge
