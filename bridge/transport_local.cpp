// SPDX-License-Identifier: MIT
#include "bridge/transport_local.hpp"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <mutex>

namespace sluice::bridge {

namespace {

// One direction of the stream. Unbounded, as a test never sends more than a few frames ahead.
class ByteQueue {
public:
  std::size_t push(std::span<const std::byte> bytes) {
    const std::lock_guard lock(mutex_);
    if (is_closed_)
      throw ConnectionLost("end of stream");
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    changed_.notify_one();
    return bytes.size();
  }
  std::size_t pop(std::span<std::byte> into, Deadline deadline) {
    std::unique_lock lock(mutex_);
    if (!changed_.wait_until(lock, deadline, [&] { return !bytes_.empty() || is_closed_; }))
      return 0;
    if (bytes_.empty())
      throw ConnectionLost("end of stream");
    const auto n = std::min(into.size(), bytes_.size());
    const auto end = bytes_.begin() + static_cast<std::ptrdiff_t>(n);
    std::copy(bytes_.begin(), end, into.begin());
    bytes_.erase(bytes_.begin(), end);
    return n;
  }
  void close() {
    const std::lock_guard lock(mutex_);
    is_closed_ = true;
    changed_.notify_all();
  }

private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::byte> bytes_;
  bool is_closed_ = false;
};

class LocalTransport final : public Transport {
public:
  LocalTransport(std::shared_ptr<ByteQueue> in, std::shared_ptr<ByteQueue> out)
      : in_(std::move(in)), out_(std::move(out)) {}
  ~LocalTransport() override {
    in_->close();
    out_->close();
  }
  LocalTransport(const LocalTransport &) = delete;
  LocalTransport &operator=(const LocalTransport &) = delete;

  std::size_t write_some(Pieces pieces, Deadline) override { return out_->push(pieces.front()); }
  std::size_t read_some(std::span<std::byte> bytes, Deadline deadline) override {
    return in_->pop(bytes, deadline);
  }
  bool can_write() override { return true; }

private:
  std::shared_ptr<ByteQueue> in_, out_;
};

} // namespace

std::pair<std::unique_ptr<Transport>, std::unique_ptr<Transport>> local_transports() {
  auto there = std::make_shared<ByteQueue>();
  auto back = std::make_shared<ByteQueue>();
  return {std::make_unique<LocalTransport>(back, there),
          std::make_unique<LocalTransport>(there, back)};
}

} // namespace sluice::bridge
