// SPDX-License-Identifier: BSD-3-Clause
//
// Skips a test where no device of OpenCL is, and says why.
//
//   TEST(Device, ...) {
//     DYNTAPE_NEED_DEVICE;
#pragma once

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/device/opencl.h>
#include <gtest/gtest.h>

namespace dyntape::testing {

// Why there is none, or "".
inline std::string no_device() {
  try {
    return codegen::opencl_device(0).has_doubles ? "" : "the first device has no double precision";
  } catch (const Error& e) {
    return e.what();
  }
}

}  // namespace dyntape::testing

#define DYNTAPE_NEED_DEVICE \
  if (const std::string reason = dyntape::testing::no_device(); !reason.empty()) GTEST_SKIP() << reason
