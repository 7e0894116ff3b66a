// SPDX-License-Identifier: MIT
// Two classes of failure. `check` is for the user: it says what is wrong, with the numbers, and
// what to do; it throws UserError, which only `main` catches. `assert` is for broken invariants of
// ours.
#pragma once

#include <fmt/format.h>
#include <stdexcept>
#include <string>

namespace sluice {

/// A failure that the user can mend; `what()` says what happened, where, and what to do.
class UserError : public std::runtime_error {
public:
  using std::runtime_error::runtime_error;
};

/// Throws UserError with the formatted message.
template <class... Args>
[[noreturn]] void fail(fmt::format_string<Args...> message, Args &&...args) {
  throw UserError(fmt::format(message, std::forward<Args>(args)...));
}

/// Throws UserError with the formatted message unless `condition` holds.
template <class... Args>
void check(bool condition, fmt::format_string<Args...> message, Args &&...args) {
  if (!condition)
    throw UserError(fmt::format(message, std::forward<Args>(args)...));
}

} // namespace sluice
