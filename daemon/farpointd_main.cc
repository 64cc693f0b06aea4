#include "daemon/run.h"

int main(int argc, char** argv) {
  return farpoint::daemon::run(argc, argv);
}
