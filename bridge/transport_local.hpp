// SPDX-License-Identifier: MIT
// Two ends in one process: for tests, and for two participants as threads of one program.
#pragma once

#include "bridge/transport.hpp"

#include <memory>
#include <utility>

namespace sluice::bridge {

/// Two connected ends; each may be used by another thread. Destroying one ends the other's stream.
std::pair<std::unique_ptr<Transport>, std::unique_ptr<Transport>> local_transports();

} // namespace sluice::bridge
