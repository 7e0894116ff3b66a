// SPDX-License-Identifier: MIT
// From nothing to a partner that is the right one: connect within the deadline, show and check
// protocol version, token and role, then compare the two case files.
#pragma once

#include "bridge/link.hpp"
#include "bridge/settings.hpp"

#include <filesystem>
#include <memory>
#include <string>

namespace sluice::bridge {

enum class Role { fluid, solid };

/// "fluid" or "solid"; throws UserError for any other name.
Role role_of(const std::string &name);
std::string name_of(Role role);
Role partner_of(Role role);

/// The token in force: SLUICE_TOKEN when set, else the case file's, else empty.
std::string token_of(const BridgeSettings &settings);

/// The fluid listens and turns away whoever does not show the token and the role "solid"; the solid
/// retries until somebody listens. Throws UserError when connect_deadline passes (at the solid: to
/// connect, and once more to be greeted) or the partner refuses, naming the address.
std::unique_ptr<Link> connect_to_partner(Role role, const BridgeSettings &settings,
                                         const std::filesystem::path &out_dir);
/// The same over a transport that is connected already.
std::unique_ptr<Link> greet_partner(Role role, const BridgeSettings &settings,
                                    std::unique_ptr<Transport> transport);

/// Exchanges the canonical case texts; throws UserError with the first line that differs.
void compare_cases(Role role, Link &link, const std::string &own_text);

} // namespace sluice::bridge
