// SPDX-License-Identifier: MIT
#include "solid-dealii/shared_entries.hpp"

#include <algorithm>
#include <cmath>

namespace sluice::solid {

SharedEntries::SharedEntries(const Ranks &ranks, const std::vector<double> &numbers)
    : ranks_(ranks) {
  if (ranks.is_one())
    return;
  owned_.setOnes(static_cast<Eigen::Index>(numbers.size()));
  const auto everywhere = ranks.gather_everywhere(numbers);
  for (int r = 0; r < ranks.size(); ++r) {
    const auto &theirs = everywhere[static_cast<std::size_t>(r)];
    std::vector<int> both;
    auto at = theirs.begin();
    for (std::size_t k = 0; r != ranks.rank() && k < numbers.size(); ++k) {
      at = std::lower_bound(at, theirs.end(), numbers[k]);
      if (at == theirs.end() || *at != numbers[k])
        continue;
      both.push_back(static_cast<int>(k));
      if (r < ranks.rank())
        owned_[static_cast<Eigen::Index>(k)] = 0;
    }
    if (both.empty())
      continue;
    neighbours_.push_back(r);
    border_.insert(border_.end(), both.begin(), both.end());
    shared_.push_back(std::move(both));
  }
  std::sort(border_.begin(), border_.end());
  border_.erase(std::unique(border_.begin(), border_.end()), border_.end());
}

Eigen::Index SharedEntries::count(Eigen::Index n) const {
  return ranks_.is_one() ? n : static_cast<Eigen::Index>(std::lround(ranks_.sum(owned_.sum())));
}

void SharedEntries::add_up(Eigen::VectorXd &partial) const {
  if (neighbours_.empty())
    return;
  Ranks::Lists sent;
  for (const auto &entries : shared_) {
    sent.emplace_back();
    for (const int entry : entries)
      sent.back().push_back(partial[entry]);
  }
  const auto received = ranks_.exchange(neighbours_, sent);
  std::vector<double> own;
  for (const int entry : border_) {
    own.push_back(partial[entry]);
    partial[entry] = 0;
  }
  const auto add = [&](const std::vector<int> &entries, const std::vector<double> &values) {
    for (std::size_t k = 0; k < entries.size(); ++k)
      partial[entries[k]] += values[k];
  };
  const auto higher = static_cast<std::size_t>(
      std::lower_bound(neighbours_.begin(), neighbours_.end(), ranks_.rank()) -
      neighbours_.begin());
  for (std::size_t k = 0; k <= neighbours_.size();
       ++k) { // by ascending rank, this one in its place
    if (k == higher)
      add(border_, own);
    if (k < neighbours_.size())
      add(shared_[k], received[k]);
  }
}

void SharedEntries::copy_from_owners(Eigen::VectorXd &values) const {
  if (ranks_.is_one())
    return;
  values.array() *= owned_.array();
  add_up(values);
}

} // namespace sluice::solid
