// Threads that wait between jobs, one pool for the process; a child made by fork starts its own.
#pragma once
#include <functional>

namespace pneumorph {

// Runs job(0) ... job(count - 1) at once, job(0) in the calling thread, and returns when all are done. One caller at
// a time; others wait. The first exception is thrown again here.
void run_in_threads(int count, const std::function<void(int)>& job);

}  // namespace pneumorph
