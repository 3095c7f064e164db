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

#if defined(__has_feature)  // clang
#define DYNTAPE_SANITIZED (__has_feature(address_sanitizer) || __has_feature(thread_sanitizer))
#elif defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define DYNTAPE_SANITIZED 1
#else
#define DYNTAPE_SANITIZED 0
#endif

namespace dyntape::testing {

// Why there is none, or "".  Drivers leak and race in ways of their own, so they stay closed under sanitizers.
inline std::string no_device() {
#if DYNTAPE_SANITIZED
  return "drivers of devices are not opened under sanitizers";
#endif
  try {
    return codegen::opencl_device(0).has_doubles ? "" : "the first device has no double precision";
  } catch (const Error& e) {
    return e.what();
  }
}

}  // namespace dyntape::testing

#define DYNTAPE_NEED_DEVICE \
  if (const std::string reason = dyntape::testing::no_device(); !reason.empty()) GTEST_SKIP() << reason
