// SPDX-License-Identifier: BSD-3-Clause
//
// From functions to libraries of models, by CppADCodeGen's classes (cg.h).
//
// A library is known to the cache by what it computes, so that createDynamicLibrary is at once there where the same was compiled before,
// in any program: there is no file to name, to look for or to grow stale.  Options that tune CppADCodeGen's C (numbers of assignments, digits of
// parameters, passes that are reused) are taken and change nothing: constants are exact, and long functions are cut anyway.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include <dyntape/interface/cppad/cg/model.h>

namespace CppAD::inline dyntape_names::cg {

enum class JacobianADMode { Forward, Reverse, Automatic };
enum class MultiThreadingType { NONE, OPENMP, PTHREADS };

template <class Base>
class ModelCSourceGen {
 public:
  using Sizes = std::vector<std::size_t>;

  ModelCSourceGen(ADFun<CG<Base>>& f, std::string model) : f_(f.core().shared()), name_(std::move(model)) {}

  const std::string& getName() const { return name_; }
  void setCreateForwardZero(bool yes) { choice_.forward_zero = yes; }
  void setCreateJacobian(bool yes) { choice_.jacobian = yes; }
  void setCreateHessian(bool yes) { choice_.hessian = yes; }
  void setCreateSparseJacobian(bool yes) { choice_.sparse_jacobian = yes; }
  void setCreateSparseHessian(bool yes) { choice_.sparse_hessian = yes; }
  void setCreateHessianSparsityByEquation(bool) {}
  void setCreateForwardOne(bool yes) { choice_.forward_one = yes; }
  void setCreateReverseOne(bool yes) { choice_.reverse_one = yes; }
  void setCreateReverseTwo(bool yes) { choice_.reverse_two = yes; }
  bool isCreateForwardZero() const { return choice_.forward_zero; }
  bool isCreateJacobian() const { return choice_.jacobian; }
  bool isCreateHessian() const { return choice_.hessian; }
  bool isCreateSparseJacobian() const { return choice_.sparse_jacobian; }
  bool isCreateSparseHessian() const { return choice_.sparse_hessian; }
  bool isCreateForwardOne() const { return choice_.forward_one; }
  bool isCreateReverseOne() const { return choice_.reverse_one; }
  bool isCreateReverseTwo() const { return choice_.reverse_two; }

  template <class SizeVector>
  void setCustomSparseJacobianElements(const SizeVector& row, const SizeVector& col) {
    choice_.jacobian_rows = detail::sizes_of(row), choice_.jacobian_cols = detail::sizes_of(col);
  }
  template <class VectorSet>
  void setCustomSparseJacobianElements(const VectorSet& elements) {
    take(elements, choice_.jacobian_rows, choice_.jacobian_cols);
  }
  template <class SizeVector>
  void setCustomSparseHessianElements(const SizeVector& row, const SizeVector& col) {
    choice_.hessian_rows = detail::sizes_of(row), choice_.hessian_cols = detail::sizes_of(col);
  }
  template <class VectorSet>
  void setCustomSparseHessianElements(const VectorSet& elements) {
    take(elements, choice_.hessian_rows, choice_.hessian_cols);
  }

  // --- taken, and without effect ---
  void setJacobianADMode(JacobianADMode) {}
  void setSparseJacobianReuse1stOrderPasses(bool) {}
  void setSparseHessianReusesRev2(bool) {}
  template <class Vector>
  void setTypicalIndependentValues(const Vector&) {}
  void setRelatedDependents(const std::vector<std::set<std::size_t>>&) {}
  void setMultiThreading(bool) {}
  void setParameterPrecision(std::size_t) {}
  void setMaxAssignmentsPerFunc(std::size_t) {}
  void setMaxOperationsPerAssignment(std::size_t) {}

  // --- for the library ---
  const detail::Recording<CG<Base>>& recording() const { return *f_; }
  const ModelChoice& choice() const { return choice_; }

 private:
  template <class VectorSet>
  static void take(const VectorSet& elements, Sizes& row, Sizes& col) {
    row.clear(), col.clear();
    for (std::size_t i = 0; i < std::size_t(elements.size()); ++i) {
      for (std::size_t j : elements[i]) row.push_back(i), col.push_back(j);
    }
  }

  std::shared_ptr<const detail::Recording<CG<Base>>> f_;
  std::string name_;
  ModelChoice choice_;
};

template <class Base>
class ModelLibraryCSourceGen {
 public:
  template <class... More>
  explicit ModelLibraryCSourceGen(ModelCSourceGen<Base>& model, More&... more) : models_{&model, &more...} {}

  void addModel(ModelCSourceGen<Base>& model) { models_.push_back(&model); }
  void addCustomFunctionSource(const std::string& name, const std::string&) {
    detail::refuse("addCustomFunctionSource: \"" + name +
                   "\": libraries hold what is recorded, and no C of the user's");
  }
  void setMultiThreading(MultiThreadingType) {}
  void setVerbose(bool yes) { verbose_ = yes; }
  bool isVerbose() const { return verbose_; }
  const std::vector<ModelCSourceGen<Base>*>& getModels() const { return models_; }
  // A C file a model, with its derivatives.
  void saveSources(const std::string& folder) const;

 private:
  std::vector<ModelCSourceGen<Base>*> models_;
  bool verbose_ = false;
};

template <class Base>
class SaveFilesModelLibraryProcessor {
 public:
  explicit SaveFilesModelLibraryProcessor(ModelLibraryCSourceGen<Base>& sources) : sources_(sources) {}
  void saveSources() const { sources_.saveSources("cppadcg_sources"); }
  void saveSourcesTo(const std::string& folder) const { sources_.saveSources(folder); }

 private:
  ModelLibraryCSourceGen<Base>& sources_;
};

// Which compiler, and its flags.  Flags of levels, processors, warnings and macros are passed on.
template <class Base>
class CCompiler {
 public:
  explicit CCompiler(std::string path) : path_(std::move(path)) {}
  const std::string& getCompilerPath() const { return path_; }
  void setCompileFlags(const std::vector<std::string>& flags) { flags_ = flags; }
  void addCompileFlag(const std::string& flag) { flags_.push_back(flag); }
  const std::vector<std::string>& getCompileFlags() const { return flags_; }
  void setCompileLibFlags(const std::vector<std::string>&) {}
  void addCompileLibFlag(const std::string&) {}
  void setLinkFlags(const std::vector<std::string>&) {}
  void setTemporaryFolder(const std::string&) {}
  void setSourcesFolder(const std::string&) {}
  void setSaveToDiskFirst(bool) {}
  void setVerbose(bool) {}

 private:
  std::string path_;
  std::vector<std::string> flags_ = {"-O2"};
};
template <class Base>
struct GccCompiler : CCompiler<Base> {
  explicit GccCompiler(std::string path = "gcc") : CCompiler<Base>(std::move(path)) {}
};
template <class Base>
struct ClangCompiler : CCompiler<Base> {
  explicit ClangCompiler(std::string path = "clang") : CCompiler<Base>(std::move(path)) {}
};

template <class Base>
class DynamicLib {
 public:
  explicit DynamicLib(std::map<std::string, std::shared_ptr<const ModelState>> models)
      : models_(std::move(models)) {}
  std::set<std::string> getModelNames() const {
    std::set<std::string> names;
    for (const auto& entry : models_) names.insert(entry.first);
    return names;
  }
  std::unique_ptr<GenericModel<Base>> model(const std::string& name) const {
    const auto found = models_.find(name);
    if (found == models_.end()) detail::refuse("DynamicLib: there is no model \"" + name + "\"" + listed());
    return std::make_unique<GenericModel<Base>>(found->second);
  }
  unsigned long getAPIVersion() const { return 7; }

 private:
  std::string listed() const {
    std::string names;
    for (const auto& entry : models_) names += (names.empty() ? "; there are " : ", ") + entry.first;
    return names;
  }
  std::map<std::string, std::shared_ptr<const ModelState>> models_;
};

template <class Base>
class DynamicModelLibraryProcessor {
 public:
  explicit DynamicModelLibraryProcessor(ModelLibraryCSourceGen<Base>& sources,
                                        std::string name = "cppad_cg_model")
      : sources_(sources), name_(std::move(name)) {}

  const std::string& getLibraryName() const { return name_; }
  void setLibraryName(const std::string& name) { name_ = name; }
  void setCustomLibraryExtension(const std::string&) {}
  std::map<std::string, std::string>& getOptions() { return options_; }
  // Compiled, or from the cache, and loaded.
  std::unique_ptr<DynamicLib<Base>> createDynamicLibrary(CCompiler<Base>& compiler, bool loadLib = true);

 private:
  ModelLibraryCSourceGen<Base>& sources_;
  std::string name_;
  std::map<std::string, std::string> options_;
};

// CppADCodeGen's way to a file of an earlier run.
template <class Base>
class LinuxDynamicLib : public DynamicLib<Base> {
 public:
  explicit LinuxDynamicLib(const std::string& path) : DynamicLib<Base>({}) {
    detail::refuse(
        "LinuxDynamicLib: \"" + path +
        "\": libraries are found by what they compute; record the functions and call createDynamicLibrary, "
        "which compiles nothing that the cache has");
  }
};

}  // namespace CppAD::inline dyntape_names::cg
