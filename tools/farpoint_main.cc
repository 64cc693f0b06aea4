// SPDX-License-Identifier: Apache-2.0
#include "tools/commands/commands.h"

int main(int argc, char** argv) {
  return farpoint::tools::run_farpoint(argc, argv);
}
