// SPDX-License-Identifier: MIT
// record_corpus DIR: writes the whole conversations that the corpus starts from, for a protocol
// that has changed.
#include "tests/fuzz/wire_input.hpp"
#include "tests/support/temporary_folder.hpp"

#include <fstream>

namespace {
void write(const std::filesystem::path &file, const sluice::bridge::Bytes &bytes) {
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char *>(bytes.data()), std::ssize(bytes));
}
} // namespace

int main(int argc, char **argv) {
  if (argc != 2)
    return 1;
  const sluice::TemporaryFolder folder;
  const auto conversations = sluice::bridge::record_conversations(folder.path());
  write(std::filesystem::path(argv[1]) / "conversation_fluid_hears", conversations.fluid);
  write(std::filesystem::path(argv[1]) / "conversation_solid_hears", conversations.solid);
}
