// SPDX-License-Identifier: BSD-3-Clause
//
// A function of variables x and parameters p, recorded once, derived, compiled and served: with the
// vocabulary of OCS2's CppAdInterface, so that code written for it compiles, and with what it lacks.
//
//   auto distance = [](const ad_vector_t& x, const ad_vector_t& p, ad_vector_t& y) {
//     y.resize(1);
//     y[0] = (x - p).norm();                                  // x, p: (3)
//   };
//   AdFunction f(distance, 3, 3, "distance");                 // nothing is recorded yet
//   f.createModels(AdFunction::ApproximationOrder::Second);
//   vector_t y = f.getFunctionValue(x, p);                    // (1)
//   matrix_t J = f.getJacobian(x, p);                         // (1 x 3) dy/dx; never dy/dp
//   matrix_t H = f.getHessian(0, x, p);                       // (3 x 3) both triangles
//
// What the user's function captures is baked in as a constant; what changes between evaluations is a
// parameter.
//
// The name is a label of any spelling and the folder the root of the cache: a library is known by what it
// computes, its order, flags, compiler and processor, so that a stale one cannot be loaded, whatever the
// names. Copies are cheap and share the loaded library.  All `const` members may be called from any number of
// threads on one object; createModels and its kin change the object and are for one thread, as for every C++
// object.
//
// Errors are exceptions of the family in autodiff/error.h that name the model and the entry: ArgumentError
// (sizes, an order that was not created, no model yet), NumericalError (a result that is not finite, with the
// operation that made it), GuardViolation (a recorded branch is left), ToolError (compiler).  What the user's
// function throws passes through.
//
// Formulas: Gauss-Newton of f = 1/2 |y|^2: dfdx = J^T y, dfdxx = J^T J; Hessian of the weighted sum w . y.
#pragma once

#include <Eigen/SparseCore>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/options/options.h>
#include <dyntape/codegen/timings.h>
#include <dyntape/interface/ocs2/approximation.h>

namespace dyntape {

using ad_scalar_t = AD;
using ad_vector_t = VectorXad;
using ad_matrix_t = MatrixXad;

// What the five arguments of OCS2 do not say.
struct AdFunctionSettings {
  std::string name = "function";
  std::string folder;              // root of the cache; empty: the user's default (codegen/options/options.h)
  std::vector<std::string> flags;  // for the compiler
  vector_t variables, parameters;  // the recording point, which decides branches; empty: values in (0.3, 1.1)
  bool forceRebuild = false;  // createModels compiles even what is in the cache (recompileLibrariesCppAd)
  bool checkFinite = true;    // a result that is not finite is a NumericalError
  unsigned threads = 1;       // that share the points of evaluateBatch; 0: as many as there are
  CodegenOptions codegen;  // profile, compiler, route, lanes; its order, folder, flags and label are not read
};

// What happened in createModels or loadModels, and what was made: of what serves now.
struct AdFunctionStatistics {
  std::string route;  // "compiled", "machine code" or "interpreter"
  Timings timings;
  std::vector<std::size_t> operations;  // of the kernels: value; with Jacobian; with Hessian
  std::size_t jacobianNonZeros = 0, hessianNonZeros = 0;  // of the Hessian: lower triangle
  std::string sourcePath;                                 // the generated C, empty if there is none
};

namespace detail {
struct AdFunctionModel;
}

class AdFunction {
 public:
  using ad_function_t = std::function<void(const ad_vector_t& x, ad_vector_t& y)>;
  using ad_parameterized_function_t =
      std::function<void(const ad_vector_t& x, const ad_vector_t& p, ad_vector_t& y)>;
  using VectorRef = Eigen::Ref<const vector_t>;

  enum class ApproximationOrder { Zero, First, Second };

  // OCS2's defaults but -ffast-math, which would not be passed on: that is said once to those who give it.
  static std::vector<std::string> defaultCompileFlags();

  // Errors of the recording name the line that makes the object.
  AdFunction(ad_parameterized_function_t function, std::size_t variableDim, std::size_t parameterDim,
             std::string modelName, std::string folderName = "",
             std::vector<std::string> compileFlags = defaultCompileFlags(),
             const char* file = __builtin_FILE(), int line = __builtin_LINE());
  AdFunction(ad_function_t function, std::size_t variableDim, std::string modelName,
             std::string folderName = "", std::vector<std::string> compileFlags = defaultCompileFlags(),
             const char* file = __builtin_FILE(), int line = __builtin_LINE());
  AdFunction(ad_parameterized_function_t function, std::size_t variableDim, std::size_t parameterDim,
             AdFunctionSettings settings, const char* file = __builtin_FILE(), int line = __builtin_LINE());

  // --- making the model ---
  // Records, then takes the library from the cache or builds it.  If anything throws, the object keeps the
  // model it had.  verbose: one line on stderr.
  void createModels(ApproximationOrder order = ApproximationOrder::Second, bool verbose = true);
  // Records and loads the highest order that the cache has of exactly this function; NotCached if none.
  void loadModels(bool verbose = true);
  // Loads this order from the cache, or creates it; never rebuilds what is there.
  void loadModelsIfAvailable(ApproximationOrder order = ApproximationOrder::Second, bool verbose = true);
  // The same, and a library of a higher order serves too.
  void loadModelsOfAtLeast(ApproximationOrder order, bool verbose = true);
  // With settings.codegen.route = Route::kTiered these come back before a compiler has started, and the first
  // results are interpreted (codegen/compiled_function.h); results have the same bits all along.  This waits until
  // the compiler is done, and throws ToolError if it failed.
  void waitForCompiler() const;

  // --- OCS2's results: dense, by value ---
  vector_t getFunctionValue(const VectorRef& x, const VectorRef& p = vector_t()) const;  // (m)
  matrix_t getJacobian(const VectorRef& x, const VectorRef& p = vector_t()) const;       // (m x n)
  ScalarFunctionQuadraticApproximation getGaussNewtonApproximation(const VectorRef& x,
                                                                   const VectorRef& p = vector_t()) const;
  matrix_t getHessian(std::size_t outputIndex, const VectorRef& x, const VectorRef& p = vector_t()) const;
  matrix_t getHessian(const VectorRef& weights, const VectorRef& x, const VectorRef& p = vector_t()) const;

  // --- sparse results ---
  const Pattern& jacobianPattern() const;  // (m x n), sorted by row
  const Pattern& hessianPattern() const;   // (n x n), lower triangle
  Eigen::SparseMatrix<double> getSparseJacobian(const VectorRef& x, const VectorRef& p = vector_t()) const;
  // Both triangles.
  Eigen::SparseMatrix<double> getSparseHessian(const VectorRef& weights, const VectorRef& x,
                                               const VectorRef& p = vector_t()) const;

  // --- one call, into the caller's memory, nothing computed twice, nothing allocated ---
  // y (m), jacobian and hessian: non-zeros in the order of the patterns; null: not wanted.  Sizes are the
  // caller's word; results are as finite as they are.  Throws GuardViolation.
  void evaluate(const double* x, const double* p, double* y, double* jacobian = nullptr,
                const double* weights = nullptr, double* hessian = nullptr) const;

  // The same at `count` points that follow each other in every array, in settings.threads; the same bits.
  void evaluateBatch(std::size_t count, const double* x, const double* p, double* y,
                     double* jacobian = nullptr, const double* weights = nullptr,
                     double* hessian = nullptr) const;

  // --- on request: recorded derivatives made at the first call ---
  matrix_t getParameterJacobian(const VectorRef& x, const VectorRef& p) const;             // (m x n_p)
  vector_t jvp(const VectorRef& x, const VectorRef& p, const VectorRef& direction) const;  // J d (m)
  vector_t vjp(const VectorRef& x, const VectorRef& p, const VectorRef& weights) const;    // J^T w (n)

  // --- what is known about it ---
  const std::string& name() const { return settings_.name; }
  std::size_t variableDim() const { return variable_dim_; }
  std::size_t parameterDim() const { return parameter_dim_; }
  std::size_t rangeDim() const;
  bool hasModel() const { return model_ != nullptr; }
  ApproximationOrder order() const;
  const Function& recorded() const;
  AdFunctionStatistics statistics() const;

 private:
  using Model = detail::AdFunctionModel;

  Function record_function() const;
  CodegenOptions options(Order order) const;
  void build(Order order, bool rebuild, bool verbose);
  std::shared_ptr<const Model> cached(const Function& function, Order lowest, Order highest,
                                      double seconds) const;
  void check_inputs(const char* asked, const VectorRef& x, const VectorRef& p) const;
  const Model& model(const char* asked_for, Order order = Order::kValue) const;

  ad_parameterized_function_t function_;
  std::size_t variable_dim_, parameter_dim_;
  AdFunctionSettings settings_;
  const char* file_;  // where it is made
  int line_;
  std::shared_ptr<const Model> model_;
};

// For code that names OCS2's class.
using CppAdInterface = AdFunction;

}  // namespace dyntape
