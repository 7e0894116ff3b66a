// SPDX-License-Identifier: MIT
#include "bridge/precice/meeting.hpp"

#include "bridge/base/check.hpp"
#include "bridge/transport_socket.hpp"

#include <algorithm>
#include <cstdlib>
#include <sstream>
#include <thread>

namespace sluice::precice_layer {

using bridge::FrameType;
using bridge::PayloadReader;
using bridge::PayloadWriter;

namespace {

constexpr double connect_deadline = 60;        // [s]
constexpr double silence_deadline = 20;        // [s]
constexpr double stranger_patience = 5;        // [s]
constexpr std::size_t largest_hello = 4096;    // [bytes]
constexpr std::size_t largest_text = 16 << 20; // [bytes]

struct Names {
  const std::string &self, &partner;
  bool accepts; // the connection; the other one calls
};

std::string token() {
  const char *given = std::getenv("SLUICE_TOKEN");
  return given ? given : "";
}

bridge::Address address_of(const Configuration &config) {
  bridge::Address address{bridge::Address::Family::unix_domain, "", "", ""};
  address.path = (std::filesystem::absolute(config.exchange_directory).lexically_normal() /
                  fmt::format("precice-{}-{}.sock", config.acceptor, config.connector))
                     .string();
  check(address.path.size() <= 107,
        "precice: the socket's path {} is longer than 107 characters; choose a shorter "
        "exchange-directory",
        address.path);
  return address;
}

// Refuses aloud: the other end's user sees the reason too.
void greet(bridge::Link &link, const Names &names, bridge::Deadline deadline,
           bridge::LastWords last_words) {
  const auto say_hello = [&] {
    PayloadWriter payload;
    payload.text(token()).text(names.self);
    link.send(FrameType::hello, std::move(payload));
  };
  link.distrust(deadline, last_words);
  try {
    if (!names.accepts)
      say_hello();
    link.receive(FrameType::hello, largest_hello, fmt::format("the greeting of {}", names.partner),
                 [&](PayloadReader &read) {
                   check(read.text() == token(),
                         "precice: {} showed a wrong token to {}; both need "
                         "the same SLUICE_TOKEN",
                         names.partner, names.self);
                   const std::string there = read.text();
                   check(there == names.partner, "precice: {} met {} instead of {}", names.self,
                         there, names.partner);
                   return 0;
                 });
    if (names.accepts)
      say_hello();
  } catch (const UserError &error) {
    link.send_abort(error.what());
    throw;
  }
  link.trust();
}

} // namespace

std::unique_ptr<bridge::Link> meet(const Configuration &config, const std::string &name,
                                   const std::string &partner) {
  const Names names{name, partner, name == config.acceptor};
  const bridge::Address address = address_of(config);
  const bridge::Deadline deadline = bridge::deadline_in(connect_deadline);
  const auto link_over = [&](std::unique_ptr<bridge::Transport> transport) {
    return std::make_unique<bridge::Link>(std::move(transport), name, partner, silence_deadline);
  };
  std::unique_ptr<bridge::Link> met;
  if (names.accepts) {
    bridge::Listener listener(address, token());
    while (auto transport = listener.accept(deadline)) {
      auto link = link_over(std::move(transport));
      try {
        greet(*link, names, std::min(deadline, bridge::deadline_in(stranger_patience)),
              bridge::LastWords::unheard);
        met = std::move(link);
        break;
      } catch (const UserError &) { // a stranger: the partner may still come
      }
    }
  } else {
    while (!met && bridge::Clock::now() < deadline) {
      if (auto transport = bridge::try_connect(address, deadline)) {
        auto link = link_over(std::move(transport));
        greet(*link, names, deadline, bridge::LastWords::heard);
        met = std::move(link);
      } else {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
      }
    }
  }
  check(met != nullptr, "precice: {} waited {} s for {} at {}", name, connect_deadline, partner,
        address.text());
  met->start_heartbeat();
  return met;
}

void compare_texts(bridge::Link &link, const Configuration &config, const std::string &name,
                   const std::string &partner) {
  const bool is_first = name == config.first;
  const auto send = [&] {
    PayloadWriter payload;
    payload.text(config.text);
    link.send(FrameType::case_text, std::move(payload));
  };
  if (is_first)
    send();
  const std::string there =
      link.receive(FrameType::case_text, largest_text, "the partner's configuration",
                   [](PayloadReader &read) { return read.text(); });
  if (!is_first)
    send();
  std::istringstream own_text(config.text), other_text(there);
  std::string own, other;
  for (int line = 1; there != config.text; ++line) {
    const bool has_own = static_cast<bool>(std::getline(own_text, own));
    const bool has_other = static_cast<bool>(std::getline(other_text, other));
    check(has_own && has_other && own == other,
          "precice: the participants read different configurations: line {} is '{}' "
          "for {} and '{}' for {}",
          line, own, name, other, partner);
  }
}

} // namespace sluice::precice_layer
