// SPDX-License-Identifier: Apache-2.0
// To be preloaded: every ioctl takes memory from the heap and gives it back.
#define _GNU_SOURCE
#include <stdarg.h>
#include <stdlib.h>
#include <sys/syscall.h>
#include <unistd.h>

int ioctl(int fd, unsigned long request, ...) {
  va_list more;
  va_start(more, request);
  void* const argument = va_arg(more, void*);
  va_end(more);
  char* volatile block = malloc(1);
  free(block);
  return (int)syscall(SYS_ioctl, fd, request, argument);
}
