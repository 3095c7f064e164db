// SPDX-License-Identifier: BSD-3-Clause
//
// Whole files in, whole files out (autodiff/text_file.h), by the name of this folder.
//
//   io::write_file_atomically("out/result.csv", text);
#pragma once

#include <dyntape/autodiff/text_file.h>

namespace dyntape::io {

using dyntape::check_can_write;
using dyntape::read_file;
using dyntape::temporary_name_beside;
using dyntape::write_file_atomically;

}  // namespace dyntape::io
