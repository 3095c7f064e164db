// SPDX-License-Identifier: BSD-3-Clause
//
// What reads files, under libFuzzer: the first byte is the kind, the rest the text.  fuzz_corpus.sh builds and runs it.
#include <array>
#include <cstdio>
#include <cstdlib>

#include <dyntape/autodiff/error.h>

#include "file_reading.h"

namespace {

constexpr std::size_t kKinds = 4;
std::array<unsigned long, kKinds> all, was_read;

const dyntape::ReadingPlace& place() {
  static const dyntape::ReadingPlace here(std::getenv("DYNTAPE_CONFIG"));
  return here;
}

void print_counts() {
  static const std::array<const char*, kKinds> names = {"robots", "tables", "scenes", "tasks"};
  for (std::size_t k = 0; k < kKinds; ++k)
    std::fprintf(stderr, "%s: %lu, of which %lu were read\n", names[k], all[k], was_read[k]);
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  place();
  std::atexit(print_counts);
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::size_t kind = data[0] % kKinds;
  ++all[kind];
  try {
    place().read(dyntape::FileKind(kind), std::string(reinterpret_cast<const char*>(data) + 1, size - 1));
    ++was_read[kind];
  } catch (const dyntape::Error& refused) {
    if (std::string(refused.what()).size() < 10) std::abort();
  }
  return 0;
}
