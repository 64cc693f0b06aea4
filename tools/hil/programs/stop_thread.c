// SPDX-License-Identifier: Apache-2.0
// usage: stop_thread PID NAME SECONDS
//
// Holds the threads of that name of a process for so long while its others run on: what a hung thread looks
// like.
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/wait.h>
#include <unistd.h>

enum { kLook_ms = 20 };

static int has_name(const char* tasks, const char* task, const char* wanted) {
  char path[300], name[32] = "";
  snprintf(path, sizeof path, "%s/%.20s/comm", tasks, task);
  FILE* file = fopen(path, "r");
  if (!file) return 0;
  const int found = fscanf(file, "%31s", name) == 1 && strcmp(name, wanted) == 0;
  fclose(file);
  return found;
}

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  char tasks[64];
  snprintf(tasks, sizeof tasks, "/proc/%.20s/task", argv[1]);
  DIR* folder = opendir(tasks);
  int held = 0;
  for (struct dirent* entry; folder && (entry = readdir(folder));) {
    if (!has_name(tasks, entry->d_name, argv[2])) continue;
    const pid_t thread = atoi(entry->d_name);
    if (ptrace(PTRACE_SEIZE, thread, 0, 0) != 0 || ptrace(PTRACE_INTERRUPT, thread, 0, 0) != 0) {
      perror("ptrace");
      return 1;
    }
    ++held;
  }
  if (held == 0) {
    fprintf(stderr, "no thread %s in %s\n", argv[2], argv[1]);
    return 1;
  }
  // A thread that is killed meanwhile must be taken note of: until then its process cannot go.
  for (int left_ms = 1000 * atoi(argv[3]); left_ms > 0; left_ms -= kLook_ms) {
    if (waitpid(-1, NULL, __WALL | WNOHANG) < 0) break;
    usleep(1000 * kLook_ms);
  }
  return 0;
}
