// SPDX-License-Identifier: BSD-3-Clause
//
// Programs that are too large are refused before memory is spent on them.
#include <gtest/gtest.h>

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <limits>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/discretize/staged_program.h>
#include "interface/control/ocp_problems.h"

namespace dyntape::mesh_size_test {
namespace {

// A limit on what the process may have, for a test.
class AddressSpace {
 public:
  explicit AddressSpace(rlim_t bytes) {
    getrlimit(RLIMIT_AS, &given_);
    const rlimit limit{std::min(bytes, given_.rlim_max), given_.rlim_max};
    setrlimit(RLIMIT_AS, &limit);
  }
  ~AddressSpace() { setrlimit(RLIMIT_AS, &given_); }

 private:
  struct rlimit given_ {};
};

// Refused with one sentence, before the memory is asked for.
TEST(Size, OfAProgramIsBounded) {
  const auto message = [](int intervals) -> std::string {
    try {
      return discretize(test::swing_up(), {.intervals = intervals, .evaluation = test::kInterpreted}), "";
    } catch (const ArgumentError& e) {
      return e.what();
    }
  };
  const auto begin = std::chrono::steady_clock::now();
  for (int intervals : {30'000'000, std::numeric_limits<int>::max()}) {
    EXPECT_NE(
        message(intervals).find("problem \"cart-pole\": " + std::to_string(intervals) + " intervals make "),
        std::string::npos)
        << message(intervals);
  }
  const AddressSpace small(rlim_t{16} << 30);
  const std::string million = message(1'000'000);
  EXPECT_NE(million.find("expected at most "), std::string::npos) << million;
  const int most = std::stoi(million.substr(million.find("expected at most ") + 17));
  EXPECT_GT(most, 100'000);
  EXPECT_LT(most, 500'000);
  EXPECT_NE(message(most + 1), "");
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(10));
  EXPECT_EQ(message(most / 100), "");
}

}  // namespace
}  // namespace dyntape::mesh_size_test
