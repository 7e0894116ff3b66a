// SPDX-License-Identifier: MIT
// Shared memory of two processes on one host: a ring of bytes each way in a block without a name
// (memfd), which the listening side passes over a Unix-domain socket. The socket stays open: its
// end is how either side learns at once that the other has died, and nothing is left behind. A wait
// looks for some microseconds, where the partner has another core, and then sleeps in the kernel
// (futex).
#pragma once

#include "bridge/transport.hpp"
#include "bridge/transport_socket.hpp"

#include <memory>

namespace sluice::bridge {

/// The listening side: makes the block and sends it over `socket`. Throws ConnectionLost.
std::unique_ptr<Transport> offer_shared_memory(SocketHandle socket);
/// The connecting side: receives it. Throws ConnectionLost, also when `deadline` passes.
std::unique_ptr<Transport> accept_shared_memory(SocketHandle socket, Deadline deadline);

} // namespace sluice::bridge
