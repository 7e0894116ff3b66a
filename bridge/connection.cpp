// SPDX-License-Identifier: MIT
#include "bridge/connection.hpp"

#include "bridge/base/check.hpp"
#include "bridge/transport_socket.hpp"

#include <cstdlib>
#include <sstream>
#include <thread>

namespace sluice::bridge {

namespace {

constexpr std::size_t largest_hello = 4096;         // [bytes] from a stranger, no more
constexpr std::size_t largest_case_text = 16 << 20; // [bytes]
constexpr double stranger_patience = 5;             // [s] for a connection that does not speak

void send_hello(Link &link, Role self, const std::string &token) {
  PayloadWriter payload;
  payload.text(token).text(name_of(self));
  link.send(FrameType::hello, std::move(payload));
}

// Looks at every character whatever the first ones are, so that the time taken tells nothing.
bool is_same_secret(const std::string &a, const std::string &b) {
  unsigned difference = a.size() == b.size() ? 0 : 1;
  for (std::size_t k = 0; k < a.size() && !b.empty(); ++k)
    difference |= static_cast<unsigned char>(a[k] ^ b[k % b.size()]);
  return difference == 0;
}

// The token first: of a stranger nothing but the header, of fixed size, is read before it, and
// nothing after it.
void receive_hello(Link &link, Role self, const std::string &token) {
  const std::string partner = name_of(partner_of(self));
  link.receive(FrameType::hello, largest_hello, fmt::format("the {}'s greeting", link.partner()),
               [&](PayloadReader &read) {
                 check(is_same_secret(read.text(), token),
                       "bridge: the {} showed a wrong token to the {}; both programs need the same "
                       "bridge.token (or SLUICE_TOKEN)",
                       partner, name_of(self));
                 const std::string role = read.text();
                 check(role == partner,
                       "bridge: the {} met another {} instead of the {}; start one program of each",
                       name_of(self), role, partner);
                 return role;
               });
}

std::unique_ptr<Link> make_link(Role role, const BridgeSettings &settings,
                                std::unique_ptr<Transport> transport) {
  return std::make_unique<Link>(std::move(transport), name_of(role), name_of(partner_of(role)),
                                settings.silence_deadline);
}

// Refuses aloud: the other end's user sees the reason too.
void greet(Role role, Link &link, const std::string &token, Deadline deadline) {
  link.distrust(deadline, role == Role::fluid ? LastWords::unheard : LastWords::heard);
  try {
    if (role == Role::solid)
      send_hello(link, role, token);
    receive_hello(link, role, token);
    if (role == Role::fluid)
      send_hello(link, role, token);
  } catch (const UserError &error) {
    link.send_abort(error.what());
    throw;
  }
  link.trust();
}

// A stranger gets a short deadline of its own, so that it cannot keep the partner out.
std::unique_ptr<Link> accept_partner(Listener &listener, const BridgeSettings &settings,
                                     Deadline deadline, std::string &last_refusal) {
  while (auto transport = listener.accept(deadline)) {
    try {
      auto link = make_link(Role::fluid, settings, std::move(transport));
      greet(Role::fluid, *link, token_of(settings),
            std::min(deadline, deadline_in(stranger_patience)));
      return link;
    } catch (const UserError &error) {
      last_refusal = fmt::format("; the last one that came was turned away: {}", error.what());
    }
  }
  return nullptr;
}

std::unique_ptr<Link> listen_for_partner(const BridgeSettings &settings, const Address &address) {
  std::string last_refusal;
  Listener listener(address, token_of(settings));
  auto link =
      accept_partner(listener, settings, deadline_in(settings.connect_deadline), last_refusal);
  check(link != nullptr,
        "bridge: the fluid waited {} s for the solid at {}, which never came "
        "(bridge.connect_deadline_s){}",
        settings.connect_deadline, address.text(), last_refusal);
  return link;
}

std::unique_ptr<Transport> retry_connecting(const BridgeSettings &settings,
                                            const Address &address) {
  using std::chrono::milliseconds;
  const Deadline deadline = deadline_in(settings.connect_deadline);
  for (milliseconds pause(1); Clock::now() < deadline;
       pause = std::min(2 * pause, milliseconds(4))) {
    if (auto transport = try_connect(address, deadline))
      return transport;
    std::this_thread::sleep_for(pause);
  }
  fail("bridge: the solid waited {} s for the fluid at {}, where nobody listened "
       "(bridge.connect_deadline_s)",
       settings.connect_deadline, address.text());
}

std::vector<std::string> lines_of(const std::string &text) {
  std::istringstream in(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);)
    lines.push_back(line);
  return lines;
}

[[noreturn]] void report_difference(Role self, const std::string &own, const std::string &other) {
  const auto a = lines_of(own), b = lines_of(other);
  std::size_t k = 0;
  while (k < a.size() && k < b.size() && a[k] == b[k])
    ++k;
  const auto line = [&](const std::vector<std::string> &lines) {
    return k < lines.size() ? fmt::format("'{}'", lines[k]) : std::string("nothing more");
  };
  fail("bridge: the two programs read different case files (or got different --set options, or "
       "restart files of different windows or runs): the {} has {}, the {} has {}",
       name_of(self), line(a), name_of(partner_of(self)), line(b));
}

void send_case(Link &link, const std::string &text) {
  PayloadWriter payload;
  payload.text(text);
  link.send(FrameType::case_text, std::move(payload));
}

std::string receive_case(Link &link) {
  return link.receive(FrameType::case_text, largest_case_text,
                      fmt::format("the {}'s case file", link.partner()),
                      [](PayloadReader &read) { return read.text(); });
}

} // namespace

Role role_of(const std::string &name) {
  check(name == "fluid" || name == "solid",
        "bridge: a participant is called fluid or solid, not '{}'", name);
  return name == "fluid" ? Role::fluid : Role::solid;
}
std::string name_of(Role role) { return role == Role::fluid ? "fluid" : "solid"; }
Role partner_of(Role role) { return role == Role::fluid ? Role::solid : Role::fluid; }

std::string token_of(const BridgeSettings &settings) {
  const char *token = std::getenv("SLUICE_TOKEN");
  return token && *token ? token : settings.token;
}

std::unique_ptr<Link> connect_to_partner(Role role, const BridgeSettings &settings,
                                         const std::filesystem::path &out_dir) {
  check(settings.transport != "mpi",
        "bridge.transport = mpi is for two programs in one mpirun that split its ranks "
        "(bridge/transport_mpi.hpp); the {} did not: use unix, shared or tcp",
        name_of(role));
  const Address address = address_of(settings, out_dir);
  if (role == Role::fluid)
    return listen_for_partner(settings, address);
  return greet_partner(role, settings, retry_connecting(settings, address));
}

std::unique_ptr<Link> greet_partner(Role role, const BridgeSettings &settings,
                                    std::unique_ptr<Transport> transport) {
  auto link = make_link(role, settings, std::move(transport));
  greet(role, *link, token_of(settings), deadline_in(settings.connect_deadline));
  return link;
}

// The fluid speaks first, so that two long texts never fill both buffers at once.
void compare_cases(Role role, Link &link, const std::string &own_text) {
  if (role == Role::fluid)
    send_case(link, own_text);
  const std::string other = receive_case(link);
  if (role == Role::solid)
    send_case(link, own_text);
  if (other != own_text)
    report_difference(role, own_text, other);
}

} // namespace sluice::bridge
