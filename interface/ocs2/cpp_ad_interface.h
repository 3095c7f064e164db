// SPDX-License-Identifier: BSD-3-Clause
//
// OCS2's class CppAdInterface with its own names and calls, implemented by AdFunction (ad_function.h).
//
//   #include <dyntape/interface/ocs2/ocs2.h>
//   namespace ocs2 = dyntape::ocs2;
//
//   using ad_vector_t = ocs2::CppAdInterface::ad_vector_t;
//   auto distance = [](const ad_vector_t& x, const ad_vector_t& p, ad_vector_t& y) { y = (x - p).cwiseAbs2(); };
//   ocs2::CppAdInterface f(distance, 3, 3, "distance", "out/models");
//   f.createModels(ocs2::CppAdInterface::ApproximationOrder::Second, false);
//   ocs2::matrix_t J = f.getJacobian(x, p);
//
// Differences from OCS2, and the setting that restores OCS2's behaviour (table in docs/from_ocs2.md):
//   settings().forceRebuild = true           createModels compiles even if the cache has this function
//   settings().checkFinite = false           results that are not finite are returned, without NumericalError
//   recordAtOnes()                           branches are decided at OCS2's recording point
// Settings take effect at the next createModels, loadModels or loadModelsIfAvailable.
//
// Errors name the model; errors of the recording name the line that constructs the object: ArgumentError,
// NumericalError, GuardViolation, RecordingError, ToolError (autodiff/error.h).  After an error the object keeps its
// previous model.
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/ocs2/cpp_ad_sparsity.h>

namespace dyntape::ocs2 {

// Value, Jacobian and Hessian of w . y from one call.
struct CppAdEvaluation {
  vector_t value;     // (m)
  matrix_t jacobian;  // (m x n); empty for a model of order Zero
  matrix_t hessian;   // (n x n), both triangles; empty for a model below Second
};

class CppAdInterface {
 public:
  using ad_base_t = ocs2::ad_base_t;
  using ad_scalar_t = ocs2::ad_scalar_t;
  using ad_vector_t = ocs2::ad_vector_t;
  using ad_matrix_t = ocs2::ad_matrix_t;
  using ad_fun_t = ocs2::ad_fun_t;
  using rowMajor_matrix_t = Eigen::Matrix<scalar_t, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  using ad_function_t = AdFunction::ad_function_t;
  using ad_parameterized_function_t = AdFunction::ad_parameterized_function_t;
  using VectorRef = AdFunction::VectorRef;
  using ApproximationOrder = AdFunction::ApproximationOrder;

  // folderName: root of the cache, relative to the working directory; empty: the user's default cache.
  CppAdInterface(ad_parameterized_function_t adFunction, std::size_t variableDim, std::size_t parameterDim,
                 std::string modelName, std::string folderName = "",
                 std::vector<std::string> compileFlags = AdFunction::defaultCompileFlags(),
                 const char* file = __builtin_FILE(), int line = __builtin_LINE());
  CppAdInterface(ad_function_t adFunction, std::size_t variableDim, std::string modelName,
                 std::string folderName = "",
                 std::vector<std::string> compileFlags = AdFunction::defaultCompileFlags(),
                 const char* file = __builtin_FILE(), int line = __builtin_LINE());
  CppAdInterface(ad_parameterized_function_t adFunction, std::size_t variableDim, std::size_t parameterDim,
                 AdFunctionSettings settings, const char* file = __builtin_FILE(),
                 int line = __builtin_LINE());

  // Uses a library of this function from the cache, also one of a higher order, unless settings().forceRebuild.
  void createModels(ApproximationOrder approximationOrder = ApproximationOrder::Second, bool verbose = true);
  // Loads the highest order in the cache; NotCached if there is none.
  void loadModels(bool verbose = true);
  // Like createModels, but never compiles an existing library.
  void loadModelsIfAvailable(ApproximationOrder approximationOrder = ApproximationOrder::Second,
                             bool verbose = true);

  vector_t getFunctionValue(const VectorRef& x, const VectorRef& p = vector_t()) const;  // (m)
  matrix_t getJacobian(const VectorRef& x, const VectorRef& p = vector_t()) const;       // (m x n)
  // f = 1/2 |y|^2, dfdx = J^T y, dfdxx = J^T J.
  ScalarFunctionQuadraticApproximation getGaussNewtonApproximation(const VectorRef& x,
                                                                   const VectorRef& p = vector_t()) const;
  matrix_t getHessian(std::size_t outputIndex, const VectorRef& x, const VectorRef& p = vector_t()) const;
  matrix_t getHessian(const VectorRef& w, const VectorRef& x, const VectorRef& p = vector_t()) const;

  // All results of the model's order, from one call of the library.  w: (m) weights of the Hessian; empty: ones.
  CppAdEvaluation getAll(const VectorRef& x, const VectorRef& p = vector_t(),
                         const VectorRef& w = vector_t()) const;

  const std::string& getModelName() const { return settings_.name; }
  std::size_t getVariableDim() const { return variableDim_; }
  std::size_t getParameterDim() const { return parameterDim_; }
  std::size_t getRangeDim() const { return function_.rangeDim(); }
  bool hasModels() const { return function_.hasModel(); }

  // The columns of the non-zeros of each row.
  cppad_sparsity::SparsityPattern getJacobianSparsityPattern() const;
  cppad_sparsity::SparsityPattern getHessianSparsityPattern() const;  // both triangles

  AdFunctionSettings& settings() { return settings_; }
  void recordAtOnes();
  // With sparse results, evaluation into memory, derivatives by p, statistics.
  const AdFunction& function() const { return function_; }

 private:
  AdFunction made() const;

  ad_parameterized_function_t recorded_;
  std::size_t variableDim_, parameterDim_;
  AdFunctionSettings settings_;
  const char* file_;  // of the construction
  int line_;
  AdFunction function_;
};

}  // namespace dyntape::ocs2
