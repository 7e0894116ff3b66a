// SPDX-License-Identifier: MIT
#include "bridge/transport_mpi.hpp"

#include "bridge/base/check.hpp"
#include "bridge/message.hpp"

#include <array>
#include <cstring>

namespace sluice::bridge {

namespace {

constexpr int stream = 0;                        // tag of the bytes
constexpr std::size_t longest_message = 1 << 30; // [bytes], counts are int

// A message under way, in memory of its own: after a deadline that has passed MPI still reads or
// writes there, whatever the caller does with its own.
class Parcel {
public:
  Parcel() = default;
  // MPI cannot be made to let go of a message that is matched: its memory outlives the run then.
  ~Parcel() {
    if (!is_done(Clock::now()))
      static_cast<void>(bytes_.release());
  }
  Parcel(const Parcel &) = delete;
  Parcel &operator=(const Parcel &) = delete;

  /// For `size` bytes, when the last message is done.
  std::span<std::byte> emptied(std::size_t size) {
    bytes_->resize(size);
    return *bytes_;
  }
  std::span<const std::byte> bytes() const { return *bytes_; }
  MPI_Request &request() { return request_; }
  /// False when `deadline` passed first. True where none was begun.
  bool is_done(Deadline deadline) {
    return wait_for_mpi(deadline, [&] {
      int done = 0;
      MPI_Test(&request_, &done, MPI_STATUS_IGNORE);
      return done != 0;
    });
  }

private:
  std::unique_ptr<Bytes> bytes_ = std::make_unique<Bytes>();
  MPI_Request request_ = MPI_REQUEST_NULL;
};

// A piece that is sent becomes a message; one without bytes is the end of the stream.
class MpiTransport final : public Transport {
public:
  MpiTransport(MPI_Comm pair, int partner) : pair_(pair), partner_(partner) {}
  ~MpiTransport() override {
    MPI_Request request;
    MPI_Isend(nullptr, 0, MPI_BYTE, partner_, stream, pair_, &request);
    MPI_Request_free(&request);
  }
  MpiTransport(const MpiTransport &) = delete;
  MpiTransport &operator=(const MpiTransport &) = delete;

  // Taken over, and as a rule delivered when this returns.
  std::size_t write_some(Pieces pieces, Deadline deadline) override {
    if (!outbox_.is_done(deadline))
      return 0;
    const auto piece = pieces.front().first(std::min(pieces.front().size(), longest_message));
    std::memcpy(outbox_.emptied(piece.size()).data(), piece.data(), piece.size());
    MPI_Isend(outbox_.bytes().data(), static_cast<int>(piece.size()), MPI_BYTE, partner_, stream,
              pair_, &outbox_.request());
    outbox_.is_done(deadline);
    return piece.size();
  }

  std::size_t read_some(std::span<std::byte> bytes, Deadline deadline) override {
    if (read_ == inbox_.bytes().size() && !begin_message(deadline))
      return 0;
    if (!inbox_.is_done(deadline))
      return 0;
    const auto unread = inbox_.bytes().subspan(read_);
    const std::size_t n = std::min(unread.size(), bytes.size());
    std::memcpy(bytes.data(), unread.data(), n);
    read_ += n;
    return n;
  }

  bool can_write() override { return outbox_.is_done(Clock::now()); }

private:
  // Receives the next message from now on; false when the deadline passed before there was one.
  bool begin_message(Deadline deadline) {
    if (is_over_)
      throw ConnectionLost("end of stream");
    int is_there = 0;
    MPI_Status status;
    MPI_Message message = MPI_MESSAGE_NULL;
    if (!wait_for_mpi(deadline, [&] {
          MPI_Improbe(partner_, stream, pair_, &is_there, &message, &status);
          return is_there != 0;
        }))
      return false;
    int n = 0;
    MPI_Get_count(&status, MPI_BYTE, &n);
    is_over_ = n == 0;
    read_ = 0;
    const auto room = inbox_.emptied(static_cast<std::size_t>(n));
    MPI_Imrecv(room.data(), n, MPI_BYTE, &message, &inbox_.request());
    if (is_over_)
      throw ConnectionLost("end of stream");
    return true;
  }

  MPI_Comm pair_;
  int partner_;
  Parcel outbox_, inbox_;
  std::size_t read_ = 0; // of the inbox
  bool is_over_ = false;
};

// What every rank says of itself.
struct Member {
  int program = 0; // 0: fluid, 1: solid
  int thread_level = MPI_THREAD_SINGLE;
};

std::vector<Member> members(Role self, MPI_Comm world) {
  int n = 0;
  MPI_Comm_size(world, &n);
  Member own{self == Role::fluid ? 0 : 1};
  MPI_Query_thread(&own.thread_level);
  std::vector<Member> all(static_cast<std::size_t>(n));
  MPI_Allgather(&own, 2, MPI_INT, all.data(), 2, MPI_INT, world);
  return all;
}

// World ranks of the two programs, the fluid's first.
std::array<std::vector<int>, 2> ranks_of_programs(const std::vector<Member> &all) {
  std::array<std::vector<int>, 2> ranks;
  for (std::size_t r = 0; r < all.size(); ++r)
    ranks[static_cast<std::size_t>(all[r].program)].push_back(static_cast<int>(r));
  return ranks;
}

// All ranks find the same one lacking: none of them waits for it in what follows.
void check_thread_support(const std::vector<Member> &all) {
  for (std::size_t r = 0; r < all.size(); ++r)
    check(
        all[r].thread_level == MPI_THREAD_MULTIPLE,
        "bridge: heartbeats over MPI need MPI_THREAD_MULTIPLE (level {}) in both programs; rank {} "
        "of this mpirun, of the {}, has level {}: call MPI_Init_thread with it there",
        static_cast<int>(MPI_THREAD_MULTIPLE), r,
        name_of(all[r].program == 0 ? Role::fluid : Role::solid), all[r].thread_level);
}

} // namespace

MpiProgram join_programs(Role self, MPI_Comm world) {
  const std::vector<Member> all = members(self, world);
  const auto ranks = ranks_of_programs(all);
  for (const Role role : {Role::fluid, Role::solid})
    check(
        !ranks[role == Role::fluid ? 0 : 1].empty(),
        "bridge: this mpirun has {} ranks and none of them is the {}; start both programs at once: "
        "mpirun -n N FLUID CASE : -n M SOLID CASE",
        ranks[0].size() + ranks[1].size(), name_of(role));
  check_thread_support(all);
  MpiProgram program;
  int own = 0;
  MPI_Comm_rank(world, &own);
  MPI_Comm_split(world, self == Role::fluid ? 0 : 1, own, &program.ranks);
  const std::array<int, 2> roots{ranks[0].front(), ranks[1].front()};
  if (own != roots[0] && own != roots[1])
    return program;
  MPI_Group everybody, both;
  MPI_Comm_group(world, &everybody);
  MPI_Group_incl(everybody, 2, roots.data(), &both);
  MPI_Comm pair = MPI_COMM_NULL;
  MPI_Comm_create_group(world, both, stream, &pair);
  MPI_Group_free(&both);
  MPI_Group_free(&everybody);
  program.transport = std::make_unique<MpiTransport>(pair, self == Role::fluid ? 1 : 0);
  return program;
}

} // namespace sluice::bridge
