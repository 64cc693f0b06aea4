// SPDX-License-Identifier: Apache-2.0
// To be preloaded to any program: prints "NAME FILE OFFSET" of the heap's functions, for the kernel's
// uprobes.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>

__attribute__((constructor)) static void print_places(void) {
  static const char* const names[] = {"malloc",   "calloc",        "realloc",
                                      "memalign", "aligned_alloc", "posix_memalign"};
  for (unsigned i = 0; i < sizeof names / sizeof *names; ++i) {
    Dl_info where;
    char* const at = dlsym(RTLD_NEXT, names[i]);
    if (at && dladdr(at, &where))
      printf("%s %s 0x%lx\n", names[i], where.dli_fname, (unsigned long)(at - (char*)where.dli_fbase));
  }
}
