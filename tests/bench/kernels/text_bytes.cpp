// SPDX-License-Identifier: BSD-3-Clause
#include "text_bytes.h"

#include <elf.h>

#include <cstring>
#include <optional>

#include <dyntape/codegen/system/files.h>

namespace dyntape::bench {

std::size_t text_bytes(const std::string& path) {
  int error = 0;
  const std::optional<std::string> found = codegen::read_file(path, error);
  if (!found) return 0;
  const std::string& file = *found;
  const auto read = [&](auto& to, std::size_t at) {
    if (at + sizeof(to) > file.size()) return false;
    std::memcpy(&to, file.data() + at, sizeof(to));
    return true;
  };
  Elf64_Ehdr header;
  if (!read(header, 0) || std::memcmp(header.e_ident, ELFMAG, SELFMAG) != 0) return 0;
  const auto section = [&](std::size_t i, Elf64_Shdr& to) {
    return read(to, header.e_shoff + i * header.e_shentsize);
  };
  Elf64_Shdr names, s;
  if (!section(header.e_shstrndx, names)) return 0;
  for (std::size_t i = 0; i < header.e_shnum && section(i, s); ++i) {
    const std::size_t name = names.sh_offset + s.sh_name;
    if (name < file.size() && std::strcmp(file.c_str() + name, ".text") == 0) return s.sh_size;
  }
  return 0;
}

}  // namespace dyntape::bench
