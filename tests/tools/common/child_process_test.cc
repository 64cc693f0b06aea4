// SPDX-License-Identifier: Apache-2.0
// Programs as children: what they print and complain, and how they ended.
#include "tools/common/child_process.h"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <csignal>

#include "tests/tools/tool_support.h"

namespace farpoint::tools {
namespace {

std::vector<std::string> shell(const std::string& script) {
  return {"sh", "-c", script};
}

// Reads to the end of the output.
std::string output_of(ChildProcess* child) {
  std::string text;
  std::array<char, 1000> buffer{};
  for (std::size_t got = child->read(buffer); got > 0; got = child->read(buffer))
    text.append(buffer.data(), got);
  return text;
}

TEST(ChildProcess, OutputAndExitStatusAreItsOwn) {
  ChildProcess child(shell("cat; echo one; echo two; exit 3"), "none");
  EXPECT_EQ(output_of(&child), "one\ntwo\n") << "standard input is empty";
  EXPECT_EQ(child.wait(), 3);
  EXPECT_EQ(child.complaint(), "");
}

TEST(ChildProcess, TheComplaintIsTheLastLine) {
  ChildProcess child(shell("echo first >&2; echo 'the last' >&2; echo >&2"), "none");
  EXPECT_EQ(child.wait(), 0);
  EXPECT_EQ(child.complaint(), "the last");
}

// A file of its complaints that grew with them would take all memory.
TEST(ChildProcess, ComplaintsBeyondTheirLimitAreRefused) {
  ChildProcess child(shell("yes complaint | head -c 1000000 >&2; echo status $?"), "none");
  EXPECT_EQ(output_of(&child), "status 1\n") << "head could write all of it";
  EXPECT_EQ(child.wait(), 0);
  EXPECT_EQ(child.complaint(), "compla") << "65536 bytes of lines of 10";
}

TEST(ChildProcess, AChildThatWritesNoMoreOutputIsEnded) {
  ChildProcess child(shell("kill -9 $$"), "none");
  EXPECT_EQ(child.wait(), -1) << "ended by a signal";
  ChildProcess endless({"yes"}, "none");
  std::array<char, 100> buffer{};
  EXPECT_EQ(endless.read(buffer), buffer.size());
}

// As after `trap '' CHLD` in a shell, or below a service that ignores it.
TEST(ChildProcess, AnIgnoredSigchldHidesNoStatus) {
  const auto before = std::signal(SIGCHLD, SIG_IGN);
  ChildProcess child(shell("exit 3"), "none");
  EXPECT_EQ(child.wait(), 3);
  std::signal(SIGCHLD, before);
}

TEST(ChildProcess, AStatusThatOthersTookIsNoSuccess) {
  ChildProcess child(shell("exit 0"), "none");
  EXPECT_EQ(output_of(&child), "");
  ASSERT_GT(waitpid(-1, nullptr, 0), 0);
  EXPECT_EQ(child.wait(), -1);
}

TEST(ChildProcess, AnAbsentProgramNamesItsPackage) {
  expect_all_in(complaint_of([] { const ChildProcess child({"no-such-program"}, "somewhere"); }),
                {"no-such-program", "package somewhere"});
}

}  // namespace
}  // namespace farpoint::tools
