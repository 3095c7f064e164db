// SPDX-License-Identifier: BSD-3-Clause
//
// A function of variables x and parameters p: recorded, differentiated, compiled, evaluated.  AdFunction has the
// interface of OCS2's CppAdInterface, with additions, so that code for OCS2 compiles.
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
// Values that the user's function captures are constants of the recording; pass values that change as parameters.
//
// The name is a label of any spelling, the folder is the root of the cache.  A library is identified by its
// computation, order, flags, compiler and processor, so a stale library is never loaded.
//
// Copies are cheap and share the loaded library.  All `const` members may be called from several threads on one
// object.  createModels and the load functions change the object and need exclusive access.
//
// Errors name the model and the entry (autodiff/error.h):
//
// - ArgumentError: sizes, an order that was not created, no model yet
// - NumericalError: a result that is not finite, with the operation that produced it
// - GuardViolation: another branch than the recording
// - ToolError: the compiler failed
//
// Exceptions of the user's function are passed on.
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

// Settings beyond the five arguments of OCS2.
struct AdFunctionSettings {
  std::string name = "function";
  std::string folder;              // root of the cache; empty: the user's default (codegen/options/options.h)
  std::vector<std::string> flags;  // for the compiler
  vector_t variables, parameters;  // the recording point, which decides branches; empty: values in (0.3, 1.1)
  bool forceRebuild =
      false;  // true: createModels compiles even if the cache has a library (recompileLibrariesCppAd)
  bool checkFinite = true;  // true: a result that is not finite throws NumericalError
  unsigned threads = 1;     // threads that share the points of evaluateBatch; 0: all
  CodegenOptions codegen;   // compiler, route, lanes; its order, folder, flags and label are ignored
};

// How the current model was made, and its size.
struct AdFunctionStatistics {
  std::string route;  // "compiled", "machine code" or "interpreter"
  Timings timings;
  std::vector<std::size_t> operations;  // of the kernels: value; with Jacobian; with Hessian
  std::size_t jacobianNonZeros = 0, hessianNonZeros = 0;  // of the Hessian: lower triangle
  std::string sourcePath;                                 // the generated C file, or ""
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

  // OCS2's defaults without -ffast-math.  If a caller passes -ffast-math, it is ignored with one warning.
  static std::vector<std::string> defaultCompileFlags();

  // Errors of the recording name the line that constructs the object.
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
  // Records, then loads the library from the cache or builds it.  If this throws, the object keeps its previous model.
  // verbose: one line on stderr.
  void createModels(ApproximationOrder order = ApproximationOrder::Second, bool verbose = true);
  // Records, and loads the highest order that the cache has for this function; throws NotCached if it has none.
  void loadModels(bool verbose = true);
  // Loads this order from the cache, or creates it; never rebuilds an existing library.
  void loadModelsIfAvailable(ApproximationOrder order = ApproximationOrder::Second, bool verbose = true);
  // Loads this order or a higher one from the cache, or creates it.
  void loadModelsOfAtLeast(ApproximationOrder order, bool verbose = true);
  // With settings.codegen.route = Route::kTiered, the functions above return before a compiler starts, and the first
  // tier (codegen/compiled_function.h) gives the first results, with the same bits.  waitForCompiler()
  // returns when the compiler has finished, and throws ToolError if it failed.
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
  // With both triangles.
  Eigen::SparseMatrix<double> getSparseHessian(const VectorRef& weights, const VectorRef& x,
                                               const VectorRef& p = vector_t()) const;

  // --- all results in one call, into the caller's memory, without allocation ---
  // y (m); jacobian and hessian: non-zeros in the order of the patterns; null: not computed.  Sizes and finiteness
  // are not checked.  Throws GuardViolation.
  void evaluate(const double* x, const double* p, double* y, double* jacobian = nullptr,
                const double* weights = nullptr, double* hessian = nullptr) const;

  // Evaluates `count` contiguous points with settings.threads threads, with the same bits as evaluate().
  void evaluateBatch(std::size_t count, const double* x, const double* p, double* y,
                     double* jacobian = nullptr, const double* weights = nullptr,
                     double* hessian = nullptr) const;

  // --- derivatives that are generated at their first call ---
  matrix_t getParameterJacobian(const VectorRef& x, const VectorRef& p) const;             // (m x n_p)
  vector_t jvp(const VectorRef& x, const VectorRef& p, const VectorRef& direction) const;  // J d (m)
  vector_t vjp(const VectorRef& x, const VectorRef& p, const VectorRef& weights) const;    // J^T w (n)

  // --- properties ---
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
  const char* file_;  // where the object was constructed
  int line_;
  std::shared_ptr<const Model> model_;
};

// OCS2's name of the class.
using CppAdInterface = AdFunction;

}  // namespace dyntape
