// SPDX-License-Identifier: BSD-3-Clause
//
// The file that createDynamicLibrary writes and DynamicLib(path) reads.  For the sources here.
//
// The file holds the recorded functions of the models as JSON, and no code: the code comes from the cache, or is
// compiled for the processor at hand.  A file thus fits every machine, and nothing of it is executed.
#pragma once

#include <map>
#include <memory>
#include <string>

#include <dyntape/interface/cppad/cg/detail/model.hxx>

namespace CppAD::inline dyntape_names::cg {

using Models = std::map<std::string, std::shared_ptr<const ModelState>>;

// Writes the models to `path`, compiled as `how` says.  If a model calls functions without text (atomic functions of
// the user, pivoted matrices), writes nothing and removes an older file of this kind.  FileError.
void write_models(const std::string& path, const Models& models, const CodegenOptions& how);

}  // namespace CppAD::inline dyntape_names::cg
