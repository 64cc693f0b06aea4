// SPDX-License-Identifier: Apache-2.0
#include "daemon/run.h"

int main(int argc, char** argv) {
  return farpoint::daemon::run(argc, argv);
}
