// SPDX-License-Identifier: Apache-2.0
// Stack and priority of threads that libraries start without attributes.
#pragma once

namespace farpoint::drivers {

// Sets the default of this process: a stack of 1 MB (locked memory holds all of each stack, 8 MB otherwise),
// and a real-time priority one below the calling thread's. With equal priority, a library's thread that spins
// on a removed device would keep the capture thread off its core.
void limit_foreign_threads();

}  // namespace farpoint::drivers
