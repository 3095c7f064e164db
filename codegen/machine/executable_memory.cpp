// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/machine/executable_memory.h>

#include <sys/mman.h>
#include <unistd.h>

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

ExecutableMemory::ExecutableMemory(std::span<const std::uint8_t> code) {
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  const std::size_t inner = (code.size() + page - 1) / page * page;
  bytes_ = inner + 2 * page;
  pages_ = mmap(nullptr, bytes_, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (pages_ == MAP_FAILED) pages_ = nullptr, refuse("mmap");
  auto* const writable = static_cast<std::uint8_t*>(pages_) + page;
  const bool made = mprotect(writable, inner, PROT_READ | PROT_WRITE) == 0 &&
                    (std::memcpy(writable, code.data(), code.size()),
                     mprotect(writable, inner, PROT_READ | PROT_EXEC) == 0);
  if (!made) {
    const int reason = errno;
    munmap(pages_, bytes_);
    errno = reason;
    refuse("mprotect");
  }
  code_ = {writable, code.size()};
}

ExecutableMemory::~ExecutableMemory() {
  if (pages_) munmap(pages_, bytes_);
}

}  // namespace dyntape::codegen
