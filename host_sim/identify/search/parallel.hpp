// search - runs independent pieces of work on all cores.
#pragma once

#include <functional>

namespace armcal::search {

// Calls work(0) .. work(count - 1), each once, on `threads` threads (0: one a core). They begin in this order. After an
// exception no further piece begins; it is thrown here when the running ones are done. A watch over this thread (io) is
// over the others, too.
void InParallel(int count, int threads, const std::function<void(int)>& work);

}  // namespace armcal::search
