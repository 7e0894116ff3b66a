// SPDX-License-Identifier: MIT
// How two participants of a preCICE configuration find each other: a Unix-domain socket in the
// exchange directory, greetings with the shared token, and the same configuration on both sides.
#pragma once

#include "bridge/link.hpp"
#include "bridge/precice/configuration.hpp"

#include <memory>
#include <string>

namespace sluice::precice_layer {

/// The link of `name` to `partner`, with a heartbeat. Throws UserError when the partner does not
/// come in time, or has another name or token.
std::unique_ptr<bridge::Link> meet(const Configuration &config, const std::string &name,
                                   const std::string &partner);

/// Throws UserError where the partner has read another configuration, with the first line that
/// differs.
void compare_texts(bridge::Link &link, const Configuration &config, const std::string &name,
                   const std::string &partner);

} // namespace sluice::precice_layer
