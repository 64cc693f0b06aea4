// SPDX-License-Identifier: Apache-2.0
#include "daemon/system/control_socket.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
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
    socket.serve([](const std::string&) -> std::string { throw std::logic_error("no request"); });
  }
  EXPECT_NE(access(path.c_str(), F_OK), 0);  // gone with the daemon
}

// A socket at this path without a daemon.
void leave_socket(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof(address.sun_path) - 1);
  const int fd = ::socket(AF_UNIX, SOCK_SEQPACKET, 0);
  ASSERT_EQ(bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  close(fd);
}

std::string refusal(const std::string& path) {
  try {
    ControlSocket socket(path);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST(ControlSocket, TheSocketOfAKilledDaemonIsReplacedAndThatOfALiveOneIsNot) {
  const test::Scratch scratch;
  const std::string path = scratch.path("control");
  leave_socket(path);
  ControlSocket socket(path);
  EXPECT_EQ(refusal(path), path + ": another farpointd answers there");
}

TEST(ControlSocket, NothingButASocketIsRemoved) {
  const test::Scratch scratch;
  const std::string file = scratch.path("file"), link = scratch.path("link"), folder = scratch.path("folder");
  test::write_bytes(file, {1, 2, 3});
  leave_socket(scratch.path("other"));
  std::filesystem::create_symlink(scratch.path("other"), link);
  std::filesystem::create_directory(folder);
  for (const std::string& path : {file, link, folder})
    EXPECT_EQ(refusal(path), path + ": not a socket, expected none or the socket of a killed farpointd");
  EXPECT_EQ(test::read_bytes(file), (std::vector<std::uint8_t>{1, 2, 3}));
  EXPECT_TRUE(std::filesystem::is_symlink(link));
  EXPECT_TRUE(std::filesystem::is_directory(folder));
}

TEST(ControlSocket, WithoutADaemonTheClientSaysWhatItExpected) {
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
