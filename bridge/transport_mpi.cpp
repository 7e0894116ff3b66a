// SPDX-License-Identifier: MIT
#include "bridge/transport_mpi.hpp"

#include "bridge/base/check.hpp"

#include <array>
#include <cstring>

namespace sluice::bridge {

namespace {

constexpr int stream = 0;                        // tag of the bytes
constexpr std::size_t longest_message = 1 << 30; // [bytes], counts are int

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

  // Not earlier than MPI needs the bytes no more. After a deadline that passed MPI still holds
  // them: the run is over then.
  std::size_t write_some(Pieces pieces, Deadline deadline) override {
    const std::size_t n = std::min(pieces.front().size(), longest_message);
    MPI_Request request;
    MPI_Isend(pieces.front().data(), static_cast<int>(n), MPI_BYTE, partner_, stream, pair_,
              &request);
    return is_done(request, deadline) ? n : 0;
  }

  std::size_t read_some(std::span<std::byte> bytes, Deadline deadline) override {
    if (read_ == inbox_.size()) {
      const std::size_t n = await_message(deadline);
      if (n == 0 || n <= bytes.size())
        return n == 0 ? 0 : receive(bytes.first(n), deadline);
      inbox_.resize(n);
      read_ = 0;
      receive(inbox_, deadline);
    }
    const std::size_t n = std::min(inbox_.size() - read_, bytes.size());
    std::memcpy(bytes.data(), inbox_.data() + read_, n);
    read_ += n;
    return n;
  }

  bool can_write() override { return true; } // MPI keeps a small message until it is asked for

private:
  // Bytes of the next message, 0 when the deadline passed first.
  std::size_t await_message(Deadline deadline) {
    if (is_over_)
      throw ConnectionLost("end of stream");
    int is_there = 0;
    MPI_Status status;
    if (!wait_for_mpi(deadline, [&] {
          MPI_Improbe(partner_, stream, pair_, &is_there, &message_, &status);
          return is_there != 0;
        }))
      return 0;
    int n = 0;
    MPI_Get_count(&status, MPI_BYTE, &n);
    if (n == 0) {
      is_over_ = true;
      MPI_Mrecv(nullptr, 0, MPI_BYTE, &message_, MPI_STATUS_IGNORE);
      throw ConnectionLost("end of stream");
    }
    return static_cast<std::size_t>(n);
  }

  std::size_t receive(std::span<std::byte> bytes, Deadline deadline) {
    MPI_Request request;
    MPI_Imrecv(bytes.data(), static_cast<int>(bytes.size()), MPI_BYTE, &message_, &request);
    if (!is_done(request, deadline))
      throw ConnectionLost("a message began and did not come to its end");
    return bytes.size();
  }

  static bool is_done(MPI_Request &request, Deadline deadline) {
    return wait_for_mpi(deadline, [&] {
      int done = 0;
      MPI_Test(&request, &done, MPI_STATUS_IGNORE);
      return done != 0;
    });
  }

  MPI_Comm pair_;
  int partner_;
  MPI_Message message_ = MPI_MESSAGE_NULL;
  Bytes inbox_; // of a message longer than what was asked for
  std::size_t read_ = 0;
  bool is_over_ = false;
};

// World ranks of the two programs, the fluid's first.
std::array<std::vector<int>, 2> members(Role self, MPI_Comm world) {
  int n = 0;
  MPI_Comm_size(world, &n);
  const int own = self == Role::fluid ? 0 : 1;
  std::vector<int> program(static_cast<std::size_t>(n));
  MPI_Allgather(&own, 1, MPI_INT, program.data(), 1, MPI_INT, world);
  std::array<std::vector<int>, 2> ranks;
  for (int r = 0; r < n; ++r)
    ranks[static_cast<std::size_t>(program[static_cast<std::size_t>(r)])].push_back(r);
  return ranks;
}

void check_thread_support() {
  int level = MPI_THREAD_SINGLE;
  MPI_Query_thread(&level);
  check(
      level == MPI_THREAD_MULTIPLE,
      "bridge: heartbeats over MPI need MPI_THREAD_MULTIPLE (level {}), here it has level {}; call "
      "MPI_Init_thread with it",
      static_cast<int>(MPI_THREAD_MULTIPLE), level);
}

} // namespace

MpiProgram join_programs(Role self, MPI_Comm world) {
  const auto ranks = members(self, world);
  for (const Role role : {Role::fluid, Role::solid})
    check(
        !ranks[role == Role::fluid ? 0 : 1].empty(),
        "bridge: this mpirun has {} ranks and none of them is the {}; start both programs at once: "
        "mpirun -n N FLUID CASE : -n M SOLID CASE",
        ranks[0].size() + ranks[1].size(), name_of(role));
  check_thread_support();
  MpiProgram program;
  int own = 0;
  MPI_Comm_rank(world, &own);
  MPI_Comm_split(world, self == Role::fluid ? 0 : 1, own, &program.ranks);
  const std::array<int, 2> roots{ranks[0].front(), ranks[1].front()};
  if (own != roots[0] && own != roots[1])
    return program;
  MPI_Group all, both;
  MPI_Comm_group(world, &all);
  MPI_Group_incl(all, 2, roots.data(), &both);
  MPI_Comm pair = MPI_COMM_NULL;
  MPI_Comm_create_group(world, both, stream, &pair);
  MPI_Group_free(&both);
  MPI_Group_free(&all);
  program.transport = std::make_unique<MpiTransport>(pair, self == Role::fluid ? 1 : 0);
  return program;
}

} // namespace sluice::bridge
