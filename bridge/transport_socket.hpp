// SPDX-License-Identifier: MIT
// Stream sockets: Unix-domain on one host, TCP otherwise; with shared memory (transport_shared.hpp)
// the Unix-domain socket is where the two meet. The fluid listens, the solid connects and retries
// until its deadline, so that either program may start first. Every wait blocks in the kernel.
#pragma once

#include "bridge/settings.hpp"
#include "bridge/transport.hpp"

#include <filesystem>
#include <memory>
#include <string>

namespace sluice::bridge {

/// Where the two programs meet.
struct Address {
  enum class Family { unix_domain, tcp, shared_memory };
  Family family = Family::unix_domain;
  std::string path;       ///< of the socket; not for TCP
  std::string host, port; ///< TCP only
  std::string text() const;
};

/// The address of the case file or, when it gives none, one that both programs derive from the
/// output folder: out_dir/bridge.sock, or a name made from its hash where that is longer than a
/// socket's path may be (107 characters); for TCP a port of 127.0.0.1 between 20000 and 29999.
/// Throws UserError for a malformed address.
Address address_of(const BridgeSettings &settings, const std::filesystem::path &out_dir);

/// An open socket; closes itself.
class SocketHandle {
public:
  explicit SocketHandle(int descriptor = -1) : descriptor_(descriptor) {}
  ~SocketHandle();
  SocketHandle(SocketHandle &&other) noexcept;
  SocketHandle &operator=(SocketHandle &&other) noexcept;
  int get() const { return descriptor_; }
  bool is_open() const { return descriptor_ >= 0; }

private:
  int descriptor_;
};

/// The listening side. Removes a stale socket file when it opens and its own when it closes.
class Listener {
public:
  /// Throws UserError when the address is in use by a living program or cannot be bound, and when
  /// a TCP address is reachable from other hosts without `token`.
  Listener(const Address &address, const std::string &token);
  ~Listener();
  Listener(const Listener &) = delete;
  Listener &operator=(const Listener &) = delete;
  /// The next connection, or nothing when `deadline` passed first. A Unix-domain connection of
  /// another user is closed at once.
  std::unique_ptr<Transport> accept(Deadline deadline);

private:
  SocketHandle socket_;
  Address::Family family_;
  std::string path_; // to unlink
};

/// One attempt to connect: nothing when nobody listens there (yet). Throws UserError for a name
/// that does not resolve or an error that waiting does not mend.
std::unique_ptr<Transport> try_connect(const Address &address, Deadline deadline);

} // namespace sluice::bridge
