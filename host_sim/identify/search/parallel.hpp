// search - independent pieces of work on all cores; knows nothing of the work.
#pragma once

#include <functional>

namespace armcal::search {

// work(0) .. work(count - 1), each once, on `threads` threads (0: one a core), in that order of begin. An exception
// ends what has not begun and comes out here when the rest is done.
void InParallel(int count, int threads, const std::function<void(int)>& work);

}  // namespace armcal::search
