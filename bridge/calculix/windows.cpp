// SPDX-License-Identifier: MIT
#include "bridge/calculix/windows.hpp"

#include "bridge/base/check.hpp"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>

namespace sluice::calculix {

namespace fs = std::filesystem;

namespace {

constexpr const char *job = "window";

void write_text(const fs::path &file, const std::string &text) {
  std::ofstream out(file, std::ios::binary);
  out << text << std::flush;
  check(out.good(), "{}: cannot be written; is the disk full?", file.string());
}

std::string text_of(const std::vector<Line> &lines) {
  std::string text;
  for (const Line &line : lines)
    text += line.text + '\n';
  return text;
}

std::string forces_card(std::span<const NodalForce> forces) {
  std::string text = "*CLOAD, OP=NEW\n";
  for (const auto &[node, force] : forces)
    for (int d = 0; d < 3; ++d)
      text += fmt::format("{}, {}, {}\n", node, d + 1, as_ccx_reads(force[d]));
  return text;
}

fs::path made(const fs::path &folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  check(!error, "{}: cannot be made ({}); give another --out folder", folder.string(),
        error.message());
  return fs::absolute(folder);
}

} // namespace

std::string as_ccx_reads(double value) {
  // an exponent of three digits would be cut to two: -1e-100 is read as -1e-10
  const double readable = std::abs(value) < 1e-99 ? 0 : value;
  return fmt::format("{:.13e}", readable);
}
double rounded_as_ccx_reads(double value) {
  return std::strtod(as_ccx_reads(value).c_str(), nullptr);
}

Windows::Windows(const Deck &deck, const std::string &program, int threads, const fs::path &folder)
    : step_(deck.step), ccx_(program, threads, made(folder)) {
  write_text(ccx_.folder() / "model.inp", text_of(deck.model));
}

Motion Windows::solve(std::span<const NodalForce> forces, double dt) {
  write_input(forces, dt);
  ccx_.run(job, task(dt));
  Motion motion = read_restart_file(ccx_.folder() / "window.rout");
  check(std::abs(motion.time - time_ - dt) <= 1e-6 * dt,
        "calculix: ccx stopped in {} at t = {:.9g} s, after {:.3g} s of {:.3g} s", task(dt),
        motion.time, motion.time - time_, dt);
  end_time_ = motion.time;
  return motion;
}

void Windows::accept() {
  fs::rename(ccx_.folder() / "window.rout", ccx_.folder() / "window.rin");
  time_ = end_time_;
  ++accepted_;
}

std::vector<std::byte> Windows::saved() const {
  const fs::path file = ccx_.folder() / "window.rin";
  std::ifstream in(file, std::ios::binary);
  check(in.good(), "{}: cannot be read", file.string());
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

Motion Windows::restore(std::span<const std::byte> state, double time, long windows) {
  const fs::path file = ccx_.folder() / "window.rin";
  write_text(file, {reinterpret_cast<const char *>(state.data()), state.size()});
  Motion motion = read_restart_file(file);
  check(std::abs(motion.time - time) <= 1e-9 * time,
        "calculix: the restart file is of t = {:.9g} s, ccx's state in it of {:.9g} s", time,
        motion.time);
  time_ = end_time_ = motion.time;
  accepted_ = windows;
  return motion;
}

void Windows::write_input(std::span<const NodalForce> forces, double dt) const {
  std::string text = accepted_ == 0 ? "*INCLUDE, INPUT=model.inp\n" : "*RESTART, READ\n";
  for (auto line = step_.begin(); line != step_.end(); ++line) {
    text += line->text + '\n';
    if (!is_card(line->text, "*DYNAMIC"))
      continue;
    if (line + 1 != step_.end() && !(line + 1)->text.starts_with('*'))
      ++line; // the deck's own increment and period
    text += fmt::format("{0}, {0}\n*RESTART, WRITE\n{1}", as_ccx_reads(dt), forces_card(forces));
  }
  write_text(ccx_.folder() / "window.inp", text + "*END STEP\n");
}

std::string Windows::task(double dt) const {
  return fmt::format("window {} (t = {:.6g} to {:.6g} s)", accepted_ + 1, time_, time_ + dt);
}

} // namespace sluice::calculix
