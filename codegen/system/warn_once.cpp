// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/system/warn_once.h>

#include <cstdio>
#include <mutex>
#include <set>

namespace dyntape::codegen {

void warn_once(const std::string& sentence) {
  static std::mutex mutex;
  static std::set<std::string> said;
  const std::scoped_lock lock(mutex);
  if (said.insert(sentence).second) std::fprintf(stderr, "dyntape: %s\n", sentence.c_str());
}

}  // namespace dyntape::codegen
