// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/system/owners.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include <dyntape/codegen/system/descriptor.h>

namespace dyntape::codegen {
namespace {

bool others_may_write(const struct stat& status) { return status.st_mode & (S_IWGRP | S_IWOTH); }

std::string belongs_to(const std::string& path, const struct stat& status) {
  return path + " belongs to user " + std::to_string(status.st_uid) + ", not to this one";
}

// Of one folder on the way.  Who owns / may do anything: root, who has another number in some containers.
std::string fault_of(const struct stat& status, const std::string& path, uid_t root) {
  if (status.st_uid != 0 && status.st_uid != root && status.st_uid != geteuid())
    return belongs_to(path, status) + " or to root";
  if (others_may_write(status) && !(status.st_mode & S_ISVTX))
    return path +
           " may be written by others, who could exchange what is in it (chmod go-w helps, or a sticky bit)";
  return {};
}

}  // namespace

std::string exchangeable(const std::string& folder) {
  constexpr int kHow = O_PATH | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC;
  Descriptor here(open("/", kHow));
  uid_t root = 0;
  for (std::size_t end = 0;;) {
    const std::string path = end ? folder.substr(0, end) : "/";
    struct stat status {};
    if (here.number() < 0 || fstat(here.number(), &status) != 0) return path + ": " + std::strerror(errno);
    if (end == 0) root = status.st_uid;
    if (std::string fault = fault_of(status, path, root); !fault.empty()) return fault;
    const std::size_t begin = folder.find_first_not_of('/', end);
    if (begin == std::string::npos) return {};
    end = std::min(folder.find('/', begin), folder.size());
    here = Descriptor(openat(here.number(), folder.substr(begin, end - begin).c_str(), kHow));
  }
}

std::string shared_with_others(int file, const std::string& path) {
  struct stat status {};
  if (fstat(file, &status) != 0) return path + ": " + std::strerror(errno);
  if (status.st_uid != geteuid()) return belongs_to(path, status);
  if (others_may_write(status)) return path + " may be written by others";
  return {};
}

}  // namespace dyntape::codegen
