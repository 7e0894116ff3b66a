// SPDX-License-Identifier: MIT
#include "bridge/transport_socket.hpp"

#include "bridge/base/check.hpp"
#include "bridge/transport_shared.hpp"

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <utility>

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

namespace sluice::bridge {

namespace {

std::string system_text(int error) { return std::strerror(error); }

// ---- addresses ----------------------------------------------------------------------------------

constexpr std::size_t longest_path = sizeof(sockaddr_un{}.sun_path) - 1;

std::uint64_t hash_of(const std::string &text) { // FNV-1a
  std::uint64_t h = 0xcbf29ce484222325u;
  for (const char c : text)
    h = (h ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return h;
}

std::string absolute_text(const std::filesystem::path &out_dir) {
  const auto path = std::filesystem::weakly_canonical(std::filesystem::absolute(out_dir));
  return (path.has_filename() ? path : path.parent_path()).string(); // "out/" is "out"
}

std::string derived_path(const std::string &folder) {
  const std::string path = folder + "/bridge.sock";
  if (path.size() <= longest_path)
    return path;
  const char *runtime = std::getenv("XDG_RUNTIME_DIR");
  const std::string name = fmt::format("/sluice-{:016x}.sock", hash_of(folder));
  if (runtime && *runtime && std::strlen(runtime) + name.size() <= longest_path)
    return runtime + name;
  return "/tmp" + name;
}

Address unix_address(const BridgeSettings &settings, const std::filesystem::path &out_dir) {
  Address address;
  if (settings.transport == "shared")
    address.family = Address::Family::shared_memory;
  address.path = settings.address.empty() ? derived_path(absolute_text(out_dir)) : settings.address;
  check(address.path.size() <= longest_path,
        "bridge.address '{}' has {} characters; a Unix-domain socket's path may have {}",
        address.path, address.path.size(), longest_path);
  return address;
}

Address tcp_address(const BridgeSettings &settings, const std::filesystem::path &out_dir) {
  if (settings.address.empty())
    return {Address::Family::tcp, "", "127.0.0.1",
            std::to_string(20000 + hash_of(absolute_text(out_dir)) % 10000)};
  const auto colon = settings.address.rfind(':');
  check(colon != std::string::npos && colon > 0 && colon + 1 < settings.address.size(),
        "bridge.address '{}': expected host:port, for example 127.0.0.1:20500", settings.address);
  const std::string port = settings.address.substr(colon + 1);
  const bool is_number = port.find_first_not_of("0123456789") == std::string::npos;
  check(!is_number || (port.size() <= 5 && std::stoi(port) >= 1 && std::stoi(port) <= 65535),
        "bridge.address '{}': a port lies between 1 and 65535", settings.address);
  std::string host = settings.address.substr(0, colon);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']')
    host = host.substr(1, host.size() - 2);
  return {Address::Family::tcp, "", host, port};
}

// ---- sockets ------------------------------------------------------------------------------------

// Waits until `events` is possible; false when the deadline passed first.
bool wait_for(int descriptor, short events, Deadline deadline) {
  while (true) {
    const auto left =
        std::chrono::duration_cast<std::chrono::microseconds>(deadline - Clock::now()).count();
    const auto milliseconds = left <= 0 ? 0 : std::min<long long>(left / 1000 + 1, 1'000'000);
    pollfd entry{descriptor, events, 0};
    const int ready = ::poll(&entry, 1, static_cast<int>(milliseconds));
    if (ready > 0)
      return true;
    if (ready < 0 && errno != EINTR)
      throw ConnectionLost(system_text(errno));
    if (ready == 0 && left <= 0)
      return false;
  }
}

bool is_temporary(int error) { return error == EAGAIN || error == EWOULDBLOCK || error == EINTR; }

// Blocks in the kernel, which wakes the thread when there is something to do: looking again and
// again would take the core from the partner where the two share one.
class SocketTransport final : public Transport {
public:
  explicit SocketTransport(SocketHandle socket) : socket_(std::move(socket)) {
    ::fcntl(socket_.get(), F_SETFL, ::fcntl(socket_.get(), F_GETFL) & ~O_NONBLOCK);
    for (const int direction : {SO_RCVTIMEO, SO_SNDTIMEO})
      ::setsockopt(socket_.get(), SOL_SOCKET, direction, &slice, sizeof slice);
  }

  std::size_t write_some(Pieces pieces, Deadline deadline) override {
    std::array<iovec, 16> list;
    msghdr message{};
    message.msg_iov = list.data();
    message.msg_iovlen = std::min(pieces.size(), list.size());
    std::transform(pieces.begin(), pieces.begin() + static_cast<std::ptrdiff_t>(message.msg_iovlen),
                   list.begin(), [](std::span<const std::byte> piece) {
                     return iovec{const_cast<std::byte *>(piece.data()), piece.size()};
                   });
    return repeat(deadline, [&] { return ::sendmsg(socket_.get(), &message, MSG_NOSIGNAL); });
  }
  std::size_t read_some(std::span<std::byte> bytes, Deadline deadline) override {
    return repeat(deadline, [&] {
      const auto n = ::recv(socket_.get(), bytes.data(), bytes.size(), 0);
      if (n == 0)
        throw ConnectionLost("end of stream");
      return n;
    });
  }
  bool can_write() override { return wait_for(socket_.get(), POLLOUT, Clock::now()); }

private:
  static constexpr timeval slice{0, 50'000}; // [us] of one attempt, how late a deadline may be

  template <class Attempt> std::size_t repeat(Deadline deadline, Attempt &&attempt) {
    while (true) {
      if (const auto n = attempt(); n > 0)
        return static_cast<std::size_t>(n);
      if (!is_temporary(errno))
        throw ConnectionLost(system_text(errno));
      if (Clock::now() >= deadline)
        return 0;
    }
  }
  SocketHandle socket_;
};

constexpr int socket_type = SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK;

SocketHandle open_socket(int family) {
  SocketHandle socket(::socket(family, socket_type, 0));
  check(socket.is_open(), "a socket cannot be opened: {}", system_text(errno));
  return socket;
}

sockaddr_un unix_name(const std::string &path) {
  sockaddr_un name{};
  name.sun_family = AF_UNIX;
  std::memcpy(name.sun_path, path.data(), path.size());
  return name;
}

template <class Name> const sockaddr *generic(const Name &name) {
  return reinterpret_cast<const sockaddr *>(&name);
}

using AddressList = std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)>;

AddressList resolve(const Address &address) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo *list = nullptr;
  const int error = ::getaddrinfo(address.host.c_str(), address.port.c_str(), &hints, &list);
  check(error == 0, "bridge.address {}: {}", address.text(), ::gai_strerror(error));
  return {list, &::freeaddrinfo};
}

bool is_loopback(const addrinfo &entry) {
  if (entry.ai_family == AF_INET)
    return (ntohl(reinterpret_cast<const sockaddr_in *>(entry.ai_addr)->sin_addr.s_addr) >> 24) ==
           127;
  if (entry.ai_family == AF_INET6)
    return IN6_IS_ADDR_LOOPBACK(&reinterpret_cast<const sockaddr_in6 *>(entry.ai_addr)->sin6_addr);
  return false;
}

// Small frames both ways, each awaited: never wait to fill a packet.
void send_at_once(int descriptor) {
  const int on = 1;
  ::setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
}

// A sender that the buffer cannot take in is woken for every part of its frame; the kernel's default
// is 200 kB. TCP's buffers grow by themselves.
void take_much_at_once(int descriptor) {
  const int size = 1 << 20; // [bytes], as far as net.core.wmem_max allows
  ::setsockopt(descriptor, SOL_SOCKET, SO_SNDBUF, &size, sizeof size);
}

// The other end of a Unix-domain connection must run under this user (or root).
bool is_own_user(int descriptor) {
  ucred peer{};
  socklen_t size = sizeof peer;
  if (::getsockopt(descriptor, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0)
    return false;
  return peer.uid == ::geteuid() || peer.uid == 0;
}

// ---- listening ----------------------------------------------------------------------------------

// A socket file that nobody listens to any more is the leftover of a killed run.
void remove_stale_file(const std::string &path) {
  struct stat status {};
  if (::lstat(path.c_str(), &status) != 0)
    return;
  check(S_ISSOCK(status.st_mode),
        "bridge.address {}: a file that is no socket is in the way; remove it or give another path",
        path);
  const SocketHandle probe = open_socket(AF_UNIX);
  const auto name = unix_name(path);
  check(::connect(probe.get(), generic(name), sizeof name) != 0 && errno == ECONNREFUSED,
        "bridge.address {}: another run listens there; end it or give another --out folder", path);
  ::unlink(path.c_str());
}

SocketHandle listen_unix(const std::string &path) {
  remove_stale_file(path);
  if (const auto folder = std::filesystem::path(path).parent_path(); !folder.empty())
    std::filesystem::create_directories(folder);
  SocketHandle socket = open_socket(AF_UNIX);
  ::fchmod(socket.get(), S_IRUSR | S_IWUSR); // taken over by the file that bind makes
  const auto name = unix_name(path);
  check(::bind(socket.get(), generic(name), sizeof name) == 0,
        "bridge.address {}: cannot listen there: {}", path, system_text(errno));
  return socket;
}

// A name may stand for several addresses (localhost: ::1 and 127.0.0.1): the first that this host
// has; whoever connects tries them all, and must not meet another run at an earlier one.
SocketHandle listen_tcp(const Address &address, const std::string &token) {
  const auto list = resolve(address);
  int error = 0;
  for (const addrinfo *entry = list.get(); entry && error != EADDRINUSE; entry = entry->ai_next) {
    check(!token.empty() || is_loopback(*entry),
          "bridge.address {} can be reached from other hosts; set bridge.token (or SLUICE_TOKEN on "
          "both hosts) so that only the partner is let in",
          address.text());
    SocketHandle socket(::socket(entry->ai_family, socket_type, 0));
    const int on = 1;
    ::setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (socket.is_open() && ::bind(socket.get(), entry->ai_addr, entry->ai_addrlen) == 0)
      return socket;
    error = errno;
  }
  fail("bridge.address {}: cannot listen there: {}; end the other run or give another address",
       address.text(), system_text(error));
}

} // namespace

std::string Address::text() const {
  return family == Family::tcp ? fmt::format("{}:{}", host, port) : path;
}

Address address_of(const BridgeSettings &settings, const std::filesystem::path &out_dir) {
  return settings.transport == "tcp" ? tcp_address(settings, out_dir)
                                     : unix_address(settings, out_dir);
}

SocketHandle::~SocketHandle() {
  if (is_open())
    ::close(descriptor_);
}
SocketHandle::SocketHandle(SocketHandle &&other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)) {}
SocketHandle &SocketHandle::operator=(SocketHandle &&other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

Listener::Listener(const Address &address, const std::string &token)
    : socket_(address.family == Address::Family::tcp ? listen_tcp(address, token)
                                                     : listen_unix(address.path)),
      family_(address.family), path_(address.path) {
  check(::listen(socket_.get(), 4) == 0, "bridge.address {}: {}", address.text(),
        system_text(errno));
}

Listener::~Listener() {
  if (!path_.empty())
    ::unlink(path_.c_str());
}

namespace {

// What the two speak over once they have met; nothing when the other end is gone already.
std::unique_ptr<Transport> transport_over(SocketHandle socket, Address::Family family,
                                          bool is_listener, Deadline deadline) {
  if (family == Address::Family::unix_domain)
    take_much_at_once(socket.get());
  if (family != Address::Family::shared_memory)
    return std::make_unique<SocketTransport>(std::move(socket));
  try {
    return is_listener ? offer_shared_memory(std::move(socket))
                       : accept_shared_memory(std::move(socket), deadline);
  } catch (const ConnectionLost &) {
    return nullptr;
  }
}

} // namespace

std::unique_ptr<Transport> Listener::accept(Deadline deadline) {
  while (wait_for(socket_.get(), POLLIN, deadline)) {
    SocketHandle peer(::accept4(socket_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!peer.is_open() || (!path_.empty() && !is_own_user(peer.get())))
      continue;
    if (path_.empty())
      send_at_once(peer.get());
    if (auto transport = transport_over(std::move(peer), family_, true, deadline))
      return transport;
  }
  return nullptr;
}

namespace {

// Nobody there yet, or a full queue: worth another attempt.
bool may_mend(int error) {
  return error == ENOENT || error == ECONNREFUSED || error == EAGAIN || error == ETIMEDOUT ||
         error == EHOSTUNREACH || error == ENETUNREACH;
}

// 0, or the error of a connection attempt that ends by the deadline.
int connect_error(int descriptor, const sockaddr *name, socklen_t size, Deadline deadline) {
  if (::connect(descriptor, name, size) == 0)
    return 0;
  if (errno != EINPROGRESS)
    return errno;
  if (!wait_for(descriptor, POLLOUT, deadline))
    return ETIMEDOUT;
  int error = 0;
  socklen_t error_size = sizeof error;
  ::getsockopt(descriptor, SOL_SOCKET, SO_ERROR, &error, &error_size);
  return error;
}

std::unique_ptr<Transport> finished(SocketHandle socket, int error, const Address &address,
                                    Deadline deadline) {
  check(error == 0 || may_mend(error), "bridge.address {}: cannot connect: {}", address.text(),
        system_text(error));
  if (error != 0)
    return nullptr;
  return transport_over(std::move(socket), address.family, false, deadline);
}

} // namespace

std::unique_ptr<Transport> try_connect(const Address &address, Deadline deadline) {
  if (address.family != Address::Family::tcp) {
    SocketHandle socket = open_socket(AF_UNIX);
    const auto name = unix_name(address.path);
    const int error = connect_error(socket.get(), generic(name), sizeof name, deadline);
    check(error != 0 || is_own_user(socket.get()),
          "bridge.address {}: another user's program listens there", address.path);
    return finished(std::move(socket), error, address, deadline);
  }
  const auto list = resolve(address);
  int error = 0;
  for (const addrinfo *entry = list.get(); entry; entry = entry->ai_next) {
    SocketHandle socket(::socket(entry->ai_family, socket_type, 0));
    error = socket.is_open()
                ? connect_error(socket.get(), entry->ai_addr, entry->ai_addrlen, deadline)
                : errno;
    send_at_once(socket.get());
    if (error == 0)
      return std::make_unique<SocketTransport>(std::move(socket));
  }
  return finished(SocketHandle(), error, address, deadline);
}

} // namespace sluice::bridge
