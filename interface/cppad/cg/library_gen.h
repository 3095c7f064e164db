// SPDX-License-Identifier: BSD-3-Clause
//
// Makes libraries of models from functions, by CppADCodeGen's classes (cg.h).
//
//   DynamicModelLibraryProcessor<double> processor(sources, "folder/models");
//   auto library = processor.createDynamicLibrary(compiler);                 // writes folder/models.so
//   LinuxDynamicLib<double> again("folder/models.so");                       // in a later run
//
// The cache identifies compiled code by its content.  If any program compiled the same function before,
// createDynamicLibrary loads the code from the cache.  The file holds the recorded functions, not the code, although
// its name ends in .so as in CppADCodeGen: loading compiles only what the cache does not have.  No file is written for
// models that call atomic functions of the user.  Options that tune
// CppADCodeGen's C (numbers of assignments, digits of parameters, reuse of passes) are accepted and have no effect:
// constants are exact, and long functions are always cut.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include <dyntape/interface/cppad/cg/compiler.h>
#include <dyntape/interface/cppad/cg/model.h>

namespace CppAD::inline dyntape_names::cg {

enum class JacobianADMode { Forward, Reverse, Automatic };
enum class MultiThreadingType { NONE, OPENMP, PTHREADS };
enum class ThreadPoolScheduleStrategy { STATIC = 1, DYNAMIC = 2, GUIDED = 3 };

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
  MultiThreadingType getMultiThreading() const {
    return threading_;
  }  // threads may share models with any setting
  void setMultiThreading(MultiThreadingType threading) { threading_ = threading; }
  void setVerbose(bool yes) { verbose_ = yes; }
  bool isVerbose() const { return verbose_; }
  const std::vector<ModelCSourceGen<Base>*>& getModels() const { return models_; }
  // Writes one C file for each model, with its derivatives.
  void saveSources(const std::string& folder) const;

 private:
  std::vector<ModelCSourceGen<Base>*> models_;
  MultiThreadingType threading_ = MultiThreadingType::NONE;
  bool verbose_ = false;
};

template <class Base>
class SaveFilesModelLibraryProcessor {
 public:
  explicit SaveFilesModelLibraryProcessor(ModelLibraryCSourceGen<Base>& sources) : sources_(sources) {}
  void saveSources() const { saveLibrarySources(sources_); }
  void saveSourcesTo(const std::string& folder) const { saveLibrarySourcesTo(sources_, folder); }
  static void saveLibrarySources(ModelLibraryCSourceGen<Base>& sources) {
    saveLibrarySourcesTo(sources, "cppadcg_sources");
  }
  static void saveLibrarySourcesTo(ModelLibraryCSourceGen<Base>& sources, const std::string& folder) {
    sources.saveSources(folder);
  }

 private:
  ModelLibraryCSourceGen<Base>& sources_;
};

// The models of a file of createDynamicLibrary, compiled or from the cache (model_file.cpp).  FileError: there is no such
// file, or it is damaged or of another kind.
std::map<std::string, std::shared_ptr<const ModelState>> models_of_file(const std::string& path);

// Loaded models.  A call of a model runs in the calling thread; settings of threads are stored and have no effect.
template <class Base>
class DynamicLib {
 public:
  explicit DynamicLib(std::map<std::string, std::shared_ptr<const ModelState>> models)
      : models_(std::move(models)) {}
  // The file of an earlier run.
  explicit DynamicLib(const std::string& path) : DynamicLib(models_of_file(path)) {}
  DynamicLib(DynamicLib&&) noexcept = default;
  virtual ~DynamicLib() = default;

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

  unsigned int getThreadNumber() const { return threads_.number; }
  void setThreadNumber(unsigned int n) { threads_.number = n; }
  bool isThreadPoolDisabled() const { return threads_.disabled; }
  void setThreadPoolDisabled(bool yes) { threads_.disabled = yes; }
  bool isThreadPoolVerbose() const { return threads_.verbose; }
  void setThreadPoolVerbose(bool yes) { threads_.verbose = yes; }
  ThreadPoolScheduleStrategy getThreadPoolSchedulerStrategy() const { return threads_.strategy; }
  void setThreadPoolSchedulerStrategy(ThreadPoolScheduleStrategy strategy) { threads_.strategy = strategy; }
  float getThreadPoolGuidedMaxWork() const { return threads_.guided_work; }
  void setThreadPoolGuidedMaxWork(float share) { threads_.guided_work = share; }
  unsigned int getThreadPoolNumberOfTimeMeas() const { return threads_.measurements; }
  void setThreadPoolNumberOfTimeMeas(unsigned int n) { threads_.measurements = n; }

 private:
  std::string listed() const {
    std::string names;
    for (const auto& entry : models_) names += (names.empty() ? "; there are " : ", ") + entry.first;
    return names;
  }
  struct Threads {
    unsigned int number = 1, measurements = 10;
    bool disabled = false, verbose = false;
    ThreadPoolScheduleStrategy strategy = ThreadPoolScheduleStrategy::DYNAMIC;
    float guided_work = 1;
  };
  std::map<std::string, std::shared_ptr<const ModelState>> models_;
  Threads threads_;
};
template <class Base>
using LinuxDynamicLib = DynamicLib<Base>;
template <class Base>
using LinuxDynamicLibModel = GenericModel<Base>;
template <class Base>
class DynamicModelLibraryProcessor {
 public:
  explicit DynamicModelLibraryProcessor(ModelLibraryCSourceGen<Base>& sources,
                                        std::string name = "cppad_cg_model")
      : sources_(sources), name_(std::move(name)) {}

  const std::string& getLibraryName() const { return name_; }
  void setLibraryName(const std::string& name) { name_ = name; }
  // Of the file: ".so" by default.
  const std::string* getCustomLibraryExtension() const { return extension_.get(); }
  void setCustomLibraryExtension(const std::string& extension) {
    extension_ = std::make_unique<std::string>(extension);
  }
  void removeCustomLibraryExtension() { extension_.reset(); }
  std::map<std::string, std::string>& getOptions() { return options_; }
  const std::map<std::string, std::string>& getOptions() const { return options_; }
  // Compiles the models, or takes them from the cache, writes the file, and loads them.
  std::unique_ptr<DynamicLib<Base>> createDynamicLibrary(AbstractCCompiler<Base>& compiler,
                                                         bool loadLib = true);

 private:
  ModelLibraryCSourceGen<Base>& sources_;
  std::string name_;
  std::unique_ptr<std::string> extension_;
  std::map<std::string, std::string> options_;
};

}  // namespace CppAD::inline dyntape_names::cg
