// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/machine/executable_memory.h>

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string>

#include <dyntape/codegen/system/files.h>

namespace dyntape::codegen {
namespace {

[[noreturn]] void refuse(const char* what) {
  throw Unavailable(std::string("the system gives no memory for machine code: ") + what + ": " +
                    std::strerror(errno));
}

}  // namespace

ExecutableMemory::ExecutableMemory(const std::vector<std::span<const std::uint8_t>>& codes) {
  constexpr std::size_t kLine = 64;  // of the cache
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  const auto rounded = [](std::size_t bytes, std::size_t unit) { return (bytes + unit - 1) / unit * unit; };
  std::size_t inner = 0;
  for (const auto& code : codes) inner += rounded(code.size(), kLine);
  inner = rounded(inner, page);
  bytes_ = inner + 2 * page;
  pages_ = mmap(nullptr, bytes_, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (pages_ == MAP_FAILED) pages_ = nullptr, refuse("mmap");
  auto* const writable = static_cast<std::uint8_t*>(pages_) + page;
  const auto place = [&] {
    std::uint8_t* to = writable;
    for (const auto& code : codes) {
      std::copy(code.begin(), code.end(), to);
      // A processor may hold what the memory contained before in its instruction cache.
      __builtin___clear_cache(reinterpret_cast<char*>(to), reinterpret_cast<char*>(to + code.size()));
      codes_.emplace_back(to, code.size());
      to += rounded(code.size(), kLine);
    }
  };
  const bool made = mprotect(writable, inner, PROT_READ | PROT_WRITE) == 0 &&
                    (place(), mprotect(writable, inner, PROT_READ | PROT_EXEC) == 0);
  if (made) return;
  const int reason = errno;
  munmap(pages_, bytes_);
  errno = reason;
  refuse("mprotect");
}

ExecutableMemory::~ExecutableMemory() {
  if (pages_) munmap(pages_, bytes_);
}

}  // namespace dyntape::codegen
