// SPDX-License-Identifier: MIT
// Names that a case file gives.
#pragma once

#include "bridge/base/check.hpp"

#include <algorithm>
#include <cctype>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace sluice::fluid {

/// Throws UserError on two equal names or one with other characters: names become columns and
/// groups of the output. `Named` has a member `name`; `kind` says what they name.
template <class Named> void check_names(const std::vector<Named> &all, std::string_view kind) {
  std::set<std::string> seen;
  for (const Named &one : all) {
    const bool is_plain =
        !one.name.empty() && std::all_of(one.name.begin(), one.name.end(), [](unsigned char c) {
          return std::isalnum(c) || c == '_' || c == '-';
        });
    check(is_plain, "{} '{}': a name has letters, digits, '_' and '-' only", kind, one.name);
    check(seen.insert(one.name).second, "two {}s are called '{}'", kind, one.name);
  }
}

} // namespace sluice::fluid
