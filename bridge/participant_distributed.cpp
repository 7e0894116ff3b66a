// SPDX-License-Identifier: MIT
#include "bridge/participant_distributed.hpp"

#include "bridge/base/check.hpp"
#include "bridge/transport.hpp"
#include "bridge/transport_mpi.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

namespace sluice::bridge {

namespace {

template <class T> MPI_Datatype type_of() {
  if constexpr (std::is_same_v<T, int>)
    return MPI_INT;
  else
    return MPI_DOUBLE;
}

// Waits without taking a core: rank 0 may be waiting for the partner meanwhile.
void finish(MPI_Request &request) {
  wait_for_mpi(Deadline::max(), [&] {
    int done = 0;
    MPI_Test(&request, &done, MPI_STATUS_IGNORE);
    return done != 0;
  });
}

std::vector<int> starts_of(const std::vector<int> &counts) {
  std::vector<int> starts(counts.size());
  std::exclusive_scan(counts.begin(), counts.end(), starts.begin(), 0);
  return starts;
}

} // namespace

DistributedParticipant::DistributedParticipant(const std::string &name, const Config &config,
                                               const std::filesystem::path &out_dir, MPI_Comm ranks,
                                               std::unique_ptr<Transport> transport)
    : name_(name), ranks_(ranks) {
  MPI_Comm_rank(ranks_, &rank_);
  MPI_Comm_size(ranks_, &n_ranks_);
  std::string problem;
  try {
    if (rank_ == 0)
      bridge_ = std::make_unique<Participant>(name, config, out_dir, std::move(transport));
  } catch (const std::exception &error) {
    problem = error.what();
  }
  agree(problem);
}

// The text of the lowest rank that has one, on all ranks; "" when none has.
std::string DistributedParticipant::first_of(const std::string &text) const {
  const int own = text.empty() ? n_ranks_ : rank_;
  int first = n_ranks_;
  MPI_Request request;
  MPI_Iallreduce(&own, &first, 1, MPI_INT, MPI_MIN, ranks_, &request);
  finish(request);
  std::string found = text;
  if (first == n_ranks_)
    return "";
  broadcast(found, first);
  return found;
}

void DistributedParticipant::broadcast(std::string &text, int from) const {
  auto length = static_cast<int>(text.size());
  MPI_Request request;
  MPI_Ibcast(&length, 1, MPI_INT, from, ranks_, &request);
  finish(request);
  text.resize(static_cast<std::size_t>(length));
  MPI_Bcast(text.data(), length, MPI_CHAR, from, ranks_);
}

// Every verb starts with this: a rank that gave up, or cannot do what it was asked to, ends all.
void DistributedParticipant::agree(const std::string &problem) {
  const std::string found = first_of(problem);
  if (found.empty())
    return;
  is_over_ = true;
  if (bridge_)
    bridge_->abort(found);
  throw UserError(found);
}

// Rank 0 acts; its failure is everybody's, and so is what it knows then.
void DistributedParticipant::act(const std::function<void(Participant &)> &action) {
  std::string problem;
  try {
    if (bridge_)
      action(*bridge_);
  } catch (const std::exception &error) {
    problem = error.what();
  }
  broadcast(problem, 0);
  is_over_ = !problem.empty();
  check(problem.empty(), "{}", problem);
  if (bridge_)
    state_ = {bridge_->is_coupling_ongoing(),
              bridge_->is_time_window_complete(),
              bridge_->requires_writing_checkpoint(),
              bridge_->requires_reading_checkpoint(),
              bridge_->requires_writing_restart(),
              bridge_->is_stopped(),
              bridge_->iteration(),
              bridge_->time_window(),
              bridge_->max_time_step_size(),
              bridge_->time()};
  MPI_Bcast(&state_, sizeof state_, MPI_BYTE, 0, ranks_);
}

// Rank 0: what all ranks have, one after the other.
template <class T> std::vector<T> DistributedParticipant::gathered(std::span<const T> own) const {
  const auto n = static_cast<int>(own.size());
  std::vector<int> counts(static_cast<std::size_t>(n_ranks_));
  MPI_Gather(&n, 1, MPI_INT, counts.data(), 1, MPI_INT, 0, ranks_);
  const std::vector<int> starts = starts_of(counts);
  std::vector<T> all(rank_ == 0 ? static_cast<std::size_t>(starts.back() + counts.back()) : 0);
  MPI_Gatherv(own.data(), n, type_of<T>(), all.data(), counts.data(), starts.data(), type_of<T>(),
              0, ranks_);
  return all;
}

void DistributedParticipant::set_mesh(const InterfaceMesh &part, std::span<const int> numbers) {
  std::string problem;
  if (numbers.size() != part.n_nodes())
    problem = fmt::format("bridge: rank {} of the {} numbers {} of its {} interface nodes", rank_,
                          name_, numbers.size(), part.n_nodes());
  agree(problem);
  dim_ = part.dim;
  n_own_ = part.positions.size();
  std::vector<int> faces(part.faces.size());
  std::transform(part.faces.begin(), part.faces.end(), faces.begin(),
                 [&](int node) { return numbers[static_cast<std::size_t>(node)]; });
  InterfaceMesh whole{part.dim, part.nodes_per_face, {}, gathered<int>(faces)};
  numbers_ = gathered<int>(numbers);
  const std::vector<double> positions = gathered<double>(part.positions);
  const auto n_values = static_cast<int>(n_own_);
  counts_.resize(static_cast<std::size_t>(n_ranks_));
  MPI_Gather(&n_values, 1, MPI_INT, counts_.data(), 1, MPI_INT, 0, ranks_);
  starts_ = starts_of(counts_);
  act([&](Participant &bridge) {
    const auto d = static_cast<std::size_t>(dim_);
    const int n = numbers_.empty() ? 0 : 1 + *std::max_element(numbers_.begin(), numbers_.end());
    whole_.assign(static_cast<std::size_t>(n) * d, std::numeric_limits<double>::quiet_NaN());
    for (std::size_t k = 0; k < numbers_.size(); ++k)
      check(numbers_[k] >= 0, "bridge: interface node {} of the {} has the number {}", k, name_,
            numbers_[k]);
    assemble("positions", positions);
    for (std::size_t k = 0; k < whole_.size(); ++k)
      check(!std::isnan(whole_[k]), "bridge: no rank of the {} has interface node {} of {}", name_,
            k / d, n);
    whole.positions = whole_;
    bridge.set_mesh(std::move(whole));
  });
}

void DistributedParticipant::restore(std::span<const std::byte> saved) {
  agree();
  act([&](Participant &bridge) { bridge.restore(saved); });
}

std::vector<std::byte> DistributedParticipant::saved_state() {
  agree();
  std::vector<std::byte> bytes;
  act([&](Participant &bridge) { bytes = bridge.saved_state(); });
  return bytes;
}

void DistributedParticipant::initialize() {
  agree();
  act([](Participant &bridge) { bridge.initialize(); });
}

// Into whole_: sums for forces, else the value of the lowest rank.
void DistributedParticipant::assemble(std::string_view field, const std::vector<double> &all) {
  const auto d = static_cast<std::size_t>(dim_);
  const bool is_summed = field == "force";
  if (is_summed)
    std::fill(whole_.begin(), whole_.end(), 0.0);
  for (std::size_t k = numbers_.size(); k-- > 0;)
    for (std::size_t c = 0; c < d; ++c) {
      double &value = whole_[d * static_cast<std::size_t>(numbers_[k]) + c];
      value = all[d * k + c] + (is_summed ? value : 0);
    }
}

void DistributedParticipant::write_data(std::string_view field, std::span<const double> values) {
  std::string problem;
  if (values.size() != n_own_)
    problem = fmt::format("bridge: {} on rank {} of the {} needs {} values, {} were given", field,
                          rank_, name_, n_own_, values.size());
  agree(problem);
  const std::vector<double> all = gathered<double>(values);
  act([&](Participant &bridge) {
    assemble(field, all);
    bridge.write_data(field, whole_);
  });
}

void DistributedParticipant::read_data(std::string_view field, double relative_time,
                                       std::span<double> values) {
  std::string problem;
  if (values.size() != n_own_)
    problem = fmt::format("bridge: {} on rank {} of the {} has {} values, room is for {}", field,
                          rank_, name_, n_own_, values.size());
  agree(problem);
  std::vector<double> all;
  act([&](Participant &bridge) {
    bridge.read_data(field, relative_time, whole_);
    const auto d = static_cast<std::size_t>(dim_);
    all.reserve(d * numbers_.size());
    for (const int node : numbers_)
      for (std::size_t c = 0; c < d; ++c)
        all.push_back(whole_[d * static_cast<std::size_t>(node) + c]);
  });
  MPI_Scatterv(all.data(), counts_.data(), starts_.data(), MPI_DOUBLE, values.data(),
               static_cast<int>(n_own_), MPI_DOUBLE, 0, ranks_);
}

void DistributedParticipant::report_failure(std::string_view reason) {
  agree();
  const std::string first = first_of(std::string(reason));
  if (!first.empty())
    act([&](Participant &bridge) { bridge.report_failure(first); });
}

void DistributedParticipant::advance(double dt) {
  agree();
  const int own = wants_to_stop_;
  int any = 0;
  MPI_Reduce(&own, &any, 1, MPI_INT, MPI_MAX, 0, ranks_);
  act([&](Participant &bridge) {
    if (any != 0)
      bridge.request_stop();
    bridge.advance(dt);
  });
}

void DistributedParticipant::finalize() {
  agree();
  act([](Participant &bridge) { bridge.finalize(); });
  is_over_ = true;
}

void DistributedParticipant::abort(std::string_view message) noexcept {
  if (is_over_)
    return;
  try {
    agree(fmt::format("rank {}: {}", rank_, message));
  } catch (const std::exception &) { // said to all; the caller ends anyway
  }
}

void DistributedParticipant::report_totals(const InterfaceTotals &totals) {
  agree();
  static_assert(sizeof totals == 10 * sizeof(double));
  InterfaceTotals sum;
  MPI_Reduce(&totals, &sum, 10, MPI_DOUBLE, MPI_SUM, 0, ranks_);
  act([&](Participant &bridge) { bridge.report_totals(sum); });
}

} // namespace sluice::bridge
