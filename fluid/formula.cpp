// SPDX-License-Identifier: MIT
#include "fluid/formula.hpp"

#include "bridge/base/check.hpp"
#include "fluid/coordinates.hpp"

#include <array>
#include <muParser.h>

namespace sluice::fluid {

// The parsers read the place where their variables live; one caller at a time.
template <int dim> struct Formula<dim>::Parsers {
  mutable std::array<double, dim + 1> variable{}; // x, y (, z), t
  std::array<mu::Parser, dim> component;
};

template <int dim> Formula<dim>::Formula(const std::vector<std::string> &components) {
  if (components.empty())
    return;
  check(components.size() == dim, "{} formulas are given for {} components", components.size(),
        dim);
  auto parsers = std::make_shared<Parsers>();
  constexpr std::array names{"x", "y", "z"};
  for (int d = 0; d < dim; ++d)
    try {
      mu::Parser &parser = parsers->component[d];
      for (int k = 0; k < dim; ++k)
        parser.DefineVar(names[k], &parsers->variable[k]);
      parser.DefineVar("t", &parsers->variable[dim]);
      parser.SetExpr(components[d]);
      parser.Eval();
    } catch (const mu::ParserError &error) {
      fail("the formula \"{}\" cannot be read: {}", components[d], error.GetMsg());
    }
  parsers_ = std::move(parsers);
}

template <int dim> Vec<dim> Formula<dim>::operator()(const Vec<dim> &x, double t) const {
  Vec<dim> value = Vec<dim>::Zero();
  if (!parsers_)
    return value;
  for (int d = 0; d < dim; ++d)
    parsers_->variable[d] = x[d];
  parsers_->variable[dim] = t;
  for (int d = 0; d < dim; ++d)
    value[d] = parsers_->component[d].Eval();
  if (!value.allFinite())
    fail("the formula \"{}\" and those beside it are not finite at {} m, t = {} s",
         parsers_->component[0].GetExpr(), text_of(x), t);
  return value;
}

template <int dim> std::string problem_of(const std::vector<std::string> &components) {
  try {
    Formula<dim>{components};
    return "";
  } catch (const UserError &error) {
    return error.what();
  }
}

template class Formula<2>;
template class Formula<3>;
template std::string problem_of<2>(const std::vector<std::string> &);
template std::string problem_of<3>(const std::vector<std::string> &);

} // namespace sluice::fluid
