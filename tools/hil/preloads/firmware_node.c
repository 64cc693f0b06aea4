// SPDX-License-Identifier: Apache-2.0
// To be preloaded: gives the virtual USB host controller (vhci-hcd) a node of the machine's firmware.
// libcamera makes a USB camera's id of the controller's node, and lists no camera of a controller that has
// none. The text of the node is that of the file $FIRMWARE_NODE.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static const char* lead(const char* path) {
  static const char node[] = "/vhci_hcd.0/firmware_node/path";
  const size_t length = path ? strlen(path) : 0, node_length = sizeof node - 1;
  const char* file = getenv("FIRMWARE_NODE");
  if (!file || length < node_length || strcmp(path + length - node_length, node) != 0) return path;
  return file;
}

// ISO C has no cast from an object's address to a function's.
#define NEXT(pointer, name) (*(void**)&(pointer) = dlsym(RTLD_NEXT, name))

int stat(const char* restrict path, struct stat* restrict status) {
  int (*next)(const char*, struct stat*);
  NEXT(next, "stat");
  return next(lead(path), status);
}

int stat64(const char* restrict path, struct stat64* restrict status) {
  int (*next)(const char*, struct stat64*);
  NEXT(next, "stat64");
  return next(lead(path), status);
}

FILE* fopen(const char* restrict path, const char* restrict mode) {
  FILE* (*next)(const char*, const char*);
  NEXT(next, "fopen");
  return next(lead(path), mode);
}

FILE* fopen64(const char* restrict path, const char* restrict mode) {
  FILE* (*next)(const char*, const char*);
  NEXT(next, "fopen64");
  return next(lead(path), mode);
}
