// SPDX-License-Identifier: Apache-2.0
#include "daemon/system/control_socket.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <thread>

#include "tests/ipc/scratch.h"

namespace farpoint::daemon {
namespace {

std::string ask_and_serve(ControlSocket* socket, const std::string& path, const std::string& request) {
  std::atomic<bool> answered{false};
  std::string answer;
  std::thread client([&] {
    answer = ask_daemon(path, request);
    answered = true;
  });
  while (!answered) {
    socket->serve([](const std::string& text) { return "ok " + text; });
    usleep(1000);
  }
  client.join();
  return answer;
}

TEST(ControlSocket, AnswersAndIsForOwnerAndGroup) {
  const test::Scratch scratch;
  const std::string path = scratch.path("control");
  {
    ControlSocket socket(path);
    struct stat status {};
    ASSERT_EQ(stat(path.c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, 0660U);
    EXPECT_EQ(ask_and_serve(&socket, path, "status"), "ok status");
    EXPECT_EQ(ask_and_serve(&socket, path, "again"), "ok again");
    socket.serve([](const std::string&) -> std::string { throw std::logic_error("nobody asked"); });
  }
  EXPECT_NE(access(path.c_str(), F_OK), 0);  // gone with the daemon
}

TEST(ControlSocket, WhatAKilledDaemonLeftIsReplacedAndALiveOneIsNot) {
  const test::Scratch scratch;
  const std::string path = scratch.path("control");
  test::write_bytes(path, {1});
  ControlSocket socket(path);
  try {
    ControlSocket second(path);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()), path + ": another farpointd answers there");
  }
}

TEST(ControlSocket, NobodyThereIsSaid) {
  const test::Scratch scratch;
  try {
    (void)ask_daemon(scratch.path("none"), "status");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("expected a running farpointd"), std::string::npos);
  }
  EXPECT_THROW(ControlSocket(scratch.path("no/such/folder")), std::runtime_error);
  EXPECT_THROW(ControlSocket(std::string(200, 'x')), std::runtime_error);
}

}  // namespace
}  // namespace farpoint::daemon
