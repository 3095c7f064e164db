// SPDX-License-Identifier: BSD-3-Clause
//
// OCS2's names of types.
//
//   namespace ocs2 = dyntape::ocs2;
//   ocs2::vector_t x;  ocs2::ad_scalar_t y;  ocs2::scalar_array_t times;
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include <dyntape/autodiff/record/linear_algebra.h>
#include <dyntape/interface/ocs2/ad_function.h>

namespace dyntape::ocs2 {

using dyntape::matrix_t;
using dyntape::scalar_t;
using dyntape::vector_t;

using size_array_t = std::vector<std::size_t>;
using size_array2_t = std::vector<size_array_t>;
using scalar_array_t = std::vector<scalar_t>;
using scalar_array2_t = std::vector<scalar_array_t>;
using scalar_array3_t = std::vector<scalar_array2_t>;
using vector_array_t = std::vector<vector_t>;
using vector_array2_t = std::vector<vector_array_t>;
using vector_array3_t = std::vector<vector_array2_t>;
using matrix_array_t = std::vector<matrix_t>;
using matrix_array2_t = std::vector<matrix_array_t>;
using matrix_array3_t = std::vector<matrix_array2_t>;
using matrix3_t = Eigen::Matrix3d;
using vector3_t = Eigen::Vector3d;
using quaternion_t = Eigen::Quaterniond;

// The base type of ad_scalar_t.  There is one level of recorded numbers, so the base is double.
using ad_base_t = scalar_t;
using dyntape::ad_matrix_t;
using dyntape::ad_scalar_t;
using dyntape::ad_vector_t;
using ad_quaternion_t = Eigen::Quaternion<ad_scalar_t>;

using dyntape::checkBeingPSD;
using dyntape::checkSize;
using dyntape::ScalarFunctionLinearApproximation;
using dyntape::ScalarFunctionQuadraticApproximation;
using dyntape::VectorFunctionLinearApproximation;
using dyntape::VectorFunctionQuadraticApproximation;

}  // namespace dyntape::ocs2
