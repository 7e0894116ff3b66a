// SPDX-License-Identifier: MIT
#include "bridge/transport_shared.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <new>

#include <linux/futex.h>
#include <poll.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace sluice::bridge {

namespace {

using Counter = std::atomic<std::uint32_t>;
static_assert(Counter::is_always_lock_free && sizeof(Counter) == 4, "the kernel waits on 4 bytes");

constexpr std::uint32_t capacity = 1 << 20; // [bytes] each way, a power of two; fits into a cache
constexpr std::uint32_t lot = 1 << 15;      // [bytes] shown to the reader while more is copied
constexpr auto looking = std::chrono::microseconds(50); // what a sleep and its end would cost
constexpr long nap = 20'000'000; // [ns] between two looks whether the partner lives

// Counters run freely and wrap; their difference is what lies in the ring.
struct Ring {
  alignas(64) Counter written;
  Counter reader_sleeps;
  alignas(64) Counter read;
  Counter writer_sleeps;
  alignas(64) std::byte bytes[capacity];
};

struct Block {
  Ring to_listener, to_connector;
  alignas(64) std::atomic<int> listener_core{-1}, connector_core{-1}; // where they last waited
};

void wake(Counter &word) {
  ::syscall(SYS_futex, reinterpret_cast<std::uint32_t *>(&word), FUTEX_WAKE, 1, nullptr, nullptr,
            0);
}

void sleep_while(Counter &word, std::uint32_t value) {
  const timespec longest{0, nap};
  ::syscall(SYS_futex, reinterpret_cast<std::uint32_t *>(&word), FUTEX_WAIT, value, &longest,
            nullptr, 0);
}

/// The block in this process's memory.
class Mapping {
public:
  explicit Mapping(int file) {
    void *place = ::mmap(nullptr, sizeof(Block), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (place == MAP_FAILED)
      throw ConnectionLost(std::string("shared memory: ") + std::strerror(errno));
    block_ = static_cast<Block *>(place);
  }
  ~Mapping() { ::munmap(block_, sizeof(Block)); }
  Mapping(const Mapping &) = delete;
  Mapping &operator=(const Mapping &) = delete;
  Block &block() { return *block_; }

private:
  Block *block_;
};

class SharedTransport final : public Transport {
public:
  SharedTransport(SocketHandle socket, std::unique_ptr<Mapping> memory, bool is_listener)
      : socket_(std::move(socket)), memory_(std::move(memory)),
        in_(is_listener ? memory_->block().to_listener : memory_->block().to_connector),
        out_(is_listener ? memory_->block().to_connector : memory_->block().to_listener),
        own_core_(is_listener ? memory_->block().listener_core : memory_->block().connector_core),
        other_core_(is_listener ? memory_->block().connector_core
                                : memory_->block().listener_core) {}

  std::size_t write_some(Pieces pieces, Deadline deadline) override {
    const std::uint32_t start = out_.written.load(std::memory_order_relaxed);
    std::uint32_t end = start;
    const auto room = [&] { return capacity - checked(end - out_.read.load()); };
    if (!wait(out_.read, out_.writer_sleeps, deadline, [&] { return room() > 0; }))
      return 0;
    std::uint32_t shown = start;
    for (std::span<const std::byte> piece : pieces) {
      while (!piece.empty() && room() > 0) {
        const std::uint32_t n = std::min<std::size_t>({piece.size(), room(), lot});
        put(end, piece.first(n));
        end += n;
        piece = piece.subspan(n);
        if (end - shown >= lot)
          show(shown = end);
      }
      if (!piece.empty())
        break;
    }
    if (end != shown)
      show(end);
    return end - start;
  }

  std::size_t read_some(std::span<std::byte> bytes, Deadline deadline) override {
    const std::uint32_t read = in_.read.load(std::memory_order_relaxed);
    const auto there = [&] { return checked(in_.written.load() - read); };
    if (!wait(in_.written, in_.reader_sleeps, deadline, [&] { return there() > 0; }))
      return 0;
    const std::uint32_t n = std::min<std::size_t>(there(), bytes.size());
    const std::uint32_t at = read % capacity, first = std::min(n, capacity - at);
    std::memcpy(bytes.data(), in_.bytes + at, first);
    std::memcpy(bytes.data() + first, in_.bytes, n - first);
    in_.read.store(read + n);
    if (in_.writer_sleeps.load() != 0)
      wake(in_.read);
    return n;
  }

  bool can_write() override {
    return capacity - checked(out_.written.load() - out_.read.load()) >= 256;
  }

private:
  void put(std::uint32_t position, std::span<const std::byte> bytes) {
    const std::uint32_t at = position % capacity;
    const std::size_t first = std::min<std::size_t>(bytes.size(), capacity - at);
    std::memcpy(out_.bytes + at, bytes.data(), first);
    std::memcpy(out_.bytes, bytes.data() + first, bytes.size() - first);
  }
  void show(std::uint32_t written) {
    out_.written.store(written);
    if (out_.reader_sleeps.load() != 0)
      wake(out_.written);
  }

  // The other side's counter is not to be believed blindly.
  static std::uint32_t checked(std::uint32_t n) {
    if (n > capacity)
      throw ConnectionLost("the shared memory is damaged");
    return n;
  }

  // Nothing is ever sent over the socket any more: readable means closed.
  bool is_partner_gone() const {
    pollfd entry{socket_.get(), POLLIN, 0};
    return ::poll(&entry, 1, 0) > 0;
  }

  // Until `is_ready`; false when the deadline passed first. What the partner wrote before it ended
  // is still delivered.
  template <class Ready>
  bool wait(Counter &word, Counter &sleeps, Deadline deadline, Ready &&is_ready) const {
    bool is_there = comes_soon(is_ready);
    while (!is_there) {
      const bool is_gone = is_partner_gone();
      if (is_ready())
        return true;
      if (is_gone)
        throw ConnectionLost("end of stream");
      if (Clock::now() >= deadline)
        return false;
      sleeps.store(1);
      const std::uint32_t value = word.load();
      if (!is_ready())
        sleep_while(word, value);
      sleeps.store(0);
      is_there = is_ready();
    }
    return true;
  }

  // What is about to come is not worth a sleep, from which the kernel takes longer to wake a thread
  // than a small frame takes there and back; but the partner must have a core to send it from.
  template <class Ready> bool comes_soon(Ready &&is_ready) const {
    if (is_ready())
      return true;
    const int core = ::sched_getcpu();
    own_core_.store(core, std::memory_order_relaxed);
    if (core == other_core_.load(std::memory_order_relaxed))
      return false;
    for (const Deadline patience = Clock::now() + looking; Clock::now() < patience;)
      for (int look = 0; look < 16; ++look) {
        if (is_ready())
          return true;
        __builtin_ia32_pause();
      }
    return false;
  }

  SocketHandle socket_;
  std::unique_ptr<Mapping> memory_;
  Ring &in_, &out_;
  std::atomic<int> &own_core_, &other_core_;
};

// One byte with the descriptor beside it, as POSIX passes descriptors.
struct Parcel {
  char byte = 'm';
  iovec content{&byte, 1};
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))] = {};
  msghdr message{};
  Parcel() {
    message.msg_iov = &content;
    message.msg_iovlen = 1;
    message.msg_control = control;
    message.msg_controllen = sizeof control;
  }
};

[[noreturn]] void lost(const char *what) {
  throw ConnectionLost(std::string(what) + ": " + std::strerror(errno));
}

} // namespace

std::unique_ptr<Transport> offer_shared_memory(SocketHandle socket) {
  const SocketHandle file(static_cast<int>(::memfd_create("sluice", MFD_CLOEXEC)));
  if (!file.is_open() || ::ftruncate(file.get(), sizeof(Block)) != 0)
    lost("shared memory cannot be made");
  auto memory = std::make_unique<Mapping>(file.get()); // zero, as the kernel gives it
  Parcel parcel;
  cmsghdr *header = CMSG_FIRSTHDR(&parcel.message);
  header->cmsg_level = SOL_SOCKET;
  header->cmsg_type = SCM_RIGHTS;
  header->cmsg_len = CMSG_LEN(sizeof(int));
  const int descriptor = file.get();
  std::memcpy(CMSG_DATA(header), &descriptor, sizeof descriptor);
  if (::sendmsg(socket.get(), &parcel.message, MSG_NOSIGNAL) != 1)
    lost("shared memory cannot be passed on");
  return std::make_unique<SharedTransport>(std::move(socket), std::move(memory), true);
}

std::unique_ptr<Transport> accept_shared_memory(SocketHandle socket, Deadline deadline) {
  const auto left =
      std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
  pollfd entry{socket.get(), POLLIN, 0};
  if (::poll(&entry, 1, static_cast<int>(std::clamp<long>(left, 0, 1'000'000))) <= 0)
    throw ConnectionLost("no shared memory came in time");
  Parcel parcel;
  const auto n = ::recvmsg(socket.get(), &parcel.message, MSG_CMSG_CLOEXEC);
  const cmsghdr *header = CMSG_FIRSTHDR(&parcel.message);
  if (n != 1 || !header || header->cmsg_type != SCM_RIGHTS)
    throw ConnectionLost("no shared memory came; does the partner use bridge.transport = shared?");
  int descriptor = -1;
  std::memcpy(&descriptor, CMSG_DATA(header), sizeof descriptor);
  const SocketHandle file(descriptor);
  return std::make_unique<SharedTransport>(std::move(socket), std::make_unique<Mapping>(file.get()),
                                           false);
}

} // namespace sluice::bridge
