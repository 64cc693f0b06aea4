// Threads that libraries start without saying how.
#pragma once

namespace farpoint::drivers {

// From now on such threads of this process get a stack of 1 MB, since locked memory means all of each (8 MB
// by default), and stand one below the calling thread where that has a real-time priority. Inheriting the
// same one would let a library's thread that spins on a device that has gone keep the very thread off its
// core that would notice.
void limit_foreign_threads();

}  // namespace farpoint::drivers
