// SPDX-License-Identifier: MIT
// Every way in which ccx can fail, played by small scripts; no ccx is needed.
#include "bridge/calculix/ccx.hpp"
#include "tests/unit/bridge/support.hpp"

#include <fstream>

namespace sluice::calculix {
namespace {

namespace fs = std::filesystem;
using bridge::contains;
using bridge::error_of;

constexpr const char *good = "echo ' Job finished'; echo state > $1.rout\n";

class CcxTest : public testing::Test {
protected:
  Ccx stand_in(const std::string &script) const {
    const fs::path program = folder_.path() / "my-ccx";
    std::ofstream(program) << "#!/bin/sh\n" << script;
    fs::permissions(program, fs::perms::owner_all);
    return Ccx(program.string(), 3, folder_.path());
  }
  std::string failure(const std::string &script) const {
    Ccx ccx = stand_in(script);
    return error_of([&] { ccx.run("window", "window 7"); });
  }
  void expect(const std::string &script, std::initializer_list<std::string> parts) const {
    const std::string message = failure(script);
    for (const std::string &part : parts)
      EXPECT_TRUE(contains(message, part)) << script << message;
    for (const char *part : {"ccx failed in window 7", "/window.inp", "/window.log"})
      EXPECT_TRUE(contains(message, part)) << script << message;
  }

  TemporaryFolder folder_;
};

TEST_F(CcxTest, a_good_run_gets_its_job_and_its_threads_and_is_counted) {
  Ccx ccx = stand_in("pwd; env; echo job=$1\n" + std::string(good));
  ccx.run("window", "window 1");
  ccx.run("window", "window 2");
  std::ifstream log(folder_.path() / "window.log");
  const std::string said{std::istreambuf_iterator<char>(log), {}};
  EXPECT_TRUE(contains(said, "job=window\n"));
  EXPECT_TRUE(contains(said, "OMP_NUM_THREADS=3\n"));
  EXPECT_TRUE(contains(said, fs::canonical(folder_.path()).string() + "\n"));
  EXPECT_EQ(ccx.cost().runs, 2);
  EXPECT_GT(ccx.cost().seconds, 0);
}

TEST_F(CcxTest, what_it_calls_an_error_is_passed_on) {
  expect("echo ' *ERROR reading *CLOAD: node set WETTED'; echo '        does not exist'; echo;"
         "echo more; exit 201\n",
         {"status 201: *ERROR reading *CLOAD: node set WETTED does not exist."});
  expect("echo ' *ERROR: solution seems to diverge'; exit 201\n", {"seems to diverge"});
}

TEST_F(CcxTest, an_error_counts_though_the_status_is_zero) {
  expect("echo ' *ERROR in readinput: cannot open file window.inp'\n",
         {"reports: *ERROR in readinput"});
  expect("echo ' *ERROR in e_c3d: nonpositive jacobian'\n" + std::string(good), {"jacobian"});
}

TEST_F(CcxTest, a_run_that_is_killed_is_told_by_its_signal) {
  expect("kill -9 $$\n", {"ended by signal 9"});
  expect("kill -SEGV $$\n", {"ended by signal 11"});
}

TEST_F(CcxTest, an_error_of_its_language_is_passed_on) {
  expect("echo 'Fortran runtime error: End of file' >&2; exit 2\n",
         {"status 2: Fortran runtime error: End of file"});
}

TEST_F(CcxTest, a_run_that_ends_early_or_without_a_result_is_no_good_one) {
  std::ofstream(folder_.path() / "window.rout") << "of an earlier run";
  expect("echo 'nothing to do'\n", {"ended before its job was finished"});
  expect("echo ' Job finished'\n", {"left no restart file"});
}

TEST_F(CcxTest, a_program_that_is_not_there_is_named_with_what_to_do) {
  const auto missing = [](const std::string &program) {
    return error_of([&] { Ccx(program, 1, "."); });
  };
  EXPECT_TRUE(contains(missing("no-such-ccx"), "no program 'no-such-ccx' on PATH"));
  EXPECT_TRUE(contains(missing("/no/ccx"), "'/no/ccx' is not an executable file"));
  EXPECT_TRUE(contains(missing("/etc/passwd"), "not an executable file"));
  for (const char *program : {"no-such-ccx", "/no/ccx"})
    EXPECT_TRUE(contains(missing(program), "calculix-ccx")) << "the package";
}

} // namespace
} // namespace sluice::calculix
