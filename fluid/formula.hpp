// SPDX-License-Identifier: MIT
// Vector fields that a case file gives as text.
#pragma once

#include "bridge/base/vec.hpp"

#include <memory>
#include <string>
#include <vector>

namespace sluice::fluid {

/// A vector with one formula per component, in the coordinates x, y (and z) and the time t:
/// "0.1*sin(2*_pi*t)". The syntax is muParser's; its constants are _pi and _e.
template <int dim> class Formula {
public:
  /// Zero everywhere.
  Formula() = default;
  /// Throws UserError, with the text and the place in it, on a formula that cannot be read.
  explicit Formula(const std::vector<std::string> &components);

  bool is_zero() const { return !parsers_; }
  /// Throws UserError when a component is not a finite number there.
  Vec<dim> operator()(const Vec<dim> &x, double t) const;

private:
  struct Parsers;
  std::shared_ptr<const Parsers> parsers_;
};

/// What is wrong with the formulas of a key, "" if nothing is.
template <int dim> std::string problem_of(const std::vector<std::string> &components);

} // namespace sluice::fluid
