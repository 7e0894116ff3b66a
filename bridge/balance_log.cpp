// SPDX-License-Identifier: MIT
#include "bridge/balance_log.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sluice::bridge {

namespace {

using Vector = std::array<double, 3>;

// Largest difference of the components relative to the sum of magnitudes; infinite when one of them
// is not a number.
double imbalance(const Vector &a, const Vector &b, double magnitude) {
  double largest = 0;
  for (std::size_t d = 0; d < 3; ++d) {
    const double difference = std::abs(a[d] - b[d]);
    if (!std::isfinite(difference))
      return std::numeric_limits<double>::infinity();
    largest = std::max(largest, difference);
  }
  return largest == 0 ? 0 : largest / magnitude;
}

// Both sides' reports of a window, taken out of the maps; nothing while one is missing.
std::optional<std::pair<InterfaceTotals, InterfaceTotals>>
take_both(long window, std::map<long, InterfaceTotals> &fluid,
          std::map<long, InterfaceTotals> &solid) {
  const auto f = fluid.find(window), s = solid.find(window);
  if (f == fluid.end() || s == solid.end())
    return std::nullopt;
  const std::pair both(f->second, s->second);
  fluid.erase(f);
  solid.erase(s);
  return both;
}

} // namespace

void write_totals(PayloadWriter &write, const std::optional<WindowTotals> &totals) {
  write.number(totals ? static_cast<std::uint64_t>(totals->window) : 0);
  if (!totals)
    return;
  const InterfaceTotals &t = totals->totals;
  for (const double value :
       {t.force[0], t.force[1], t.force[2], t.moment[0], t.moment[1], t.moment[2], t.work,
        t.force_magnitude, t.moment_magnitude, t.work_magnitude})
    write.real(value);
}

std::optional<WindowTotals> read_totals(PayloadReader &read) {
  const auto window = static_cast<long>(read.number());
  if (window == 0)
    return std::nullopt;
  InterfaceTotals t;
  for (double *value :
       {&t.force[0], &t.force[1], &t.force[2], &t.moment[0], &t.moment[1], &t.moment[2], &t.work,
        &t.force_magnitude, &t.moment_magnitude, &t.work_magnitude})
    *value = read.real();
  return WindowTotals{window, t};
}

void BalanceLog::add_fluid(const WindowTotals &totals, Statistics &statistics) {
  fluid_[totals.window] = totals.totals;
  if (const auto both = take_both(totals.window, fluid_, solid_))
    compare(totals.window, both->first, both->second, statistics);
}

void BalanceLog::add_solid(const WindowTotals &totals, Statistics &statistics) {
  solid_[totals.window] = totals.totals;
  if (const auto both = take_both(totals.window, fluid_, solid_))
    compare(totals.window, both->first, both->second, statistics);
}

void BalanceLog::compare(long window, const InterfaceTotals &f, const InterfaceTotals &s,
                         Statistics &statistics) {
  const double force = imbalance(f.force, s.force, f.force_magnitude);
  const double moment = imbalance(f.moment, s.moment, f.moment_magnitude);
  const double work = imbalance({f.work, 0, 0}, {s.work, 0, 0}, f.work_magnitude);
  statistics.force_balance_max = std::max(statistics.force_balance_max, force);
  statistics.moment_balance_max = std::max(statistics.moment_balance_max, moment);
  statistics.work_balance_max = std::max(statistics.work_balance_max, work);
  if (!csv_)
    csv_.emplace(file_,
                 "window,fluid_fx_n,fluid_fy_n,fluid_fz_n,solid_fx_n,solid_fy_n,solid_fz_n,"
                 "fluid_mx_nm,fluid_my_nm,fluid_mz_nm,solid_mx_nm,solid_my_nm,solid_mz_nm,"
                 "fluid_work_j,solid_work_j,force_imbalance,moment_imbalance,work_imbalance");
  csv_->row({static_cast<double>(window), f.force[0], f.force[1], f.force[2], s.force[0],
             s.force[1], s.force[2], f.moment[0], f.moment[1], f.moment[2], s.moment[0],
             s.moment[1], s.moment[2], f.work, s.work, force, moment, work});
}

} // namespace sluice::bridge
