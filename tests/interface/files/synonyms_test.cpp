// SPDX-License-Identifier: BSD-3-Clause
//
// Names that other tools use are answered by ours.
#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/files/info/section.h>
#include <dyntape/interface/files/info/synonyms.h>

namespace dyntape::io::synonyms_test {
namespace {

TEST(Synonyms, OnlyOfNamesThatAreValid) {
  EXPECT_EQ(synonym_of("dt", {"duration", "step"}), "step");
  EXPECT_EQ(synonym_of("dt", {"duration"}), "");
  EXPECT_EQ(synonym_of("N", {"intervals"}), "intervals");
  EXPECT_EQ(synonym_of("RK4", {"euler", "runge-kutta-4"}), "runge-kutta-4");
  EXPECT_EQ(synonym_of("L-BFGS", {"exact", "limited_memory"}), "limited_memory");
  EXPECT_EQ(synonym_of("torque", {"control", "effort"}), "control");
  EXPECT_EQ(synonym_of("torque", {"efforts", "positions"}), "efforts");
  EXPECT_EQ(synonym_of("", {"step"}), "");
}

std::string problems_of(const std::string& text) {
  Section file = Section::parse(text, "a.info");
  try {
    Section horizon = file.child("horizon");
    horizon.get<double>("duration");
    horizon.get_or("intervals", 10);
    file.choice_or<int>("scheme", "euler", {{"euler", 0}, {"runge-kutta-4", 1}});
    file.finish();
  } catch (const FileError& e) {
    return e.what();
  }
  return "";
}

TEST(Synonyms, OfKeysAndValuesInMessages) {
  EXPECT_NE(problems_of("horizon { duration 1\n N 5\n }")
                .find("unknown key 'N' in 'horizon'; did you mean 'intervals'?"),
            std::string::npos);
  EXPECT_NE(problems_of("horizon {\n duration 1\n}\nscheme rk4")
                .find("'scheme' cannot be 'rk4'; did you mean 'runge-kutta-4'?"),
            std::string::npos);
  // A misspelling stays one.
  EXPECT_NE(problems_of("horizon {\n duration 1\n intervls 5\n}").find("did you mean 'intervals'?"),
            std::string::npos);
}

}  // namespace
}  // namespace dyntape::io::synonyms_test
