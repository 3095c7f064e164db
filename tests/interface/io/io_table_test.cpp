// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/facts.h>
#include <dyntape/interface/io/table.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>

namespace dyntape::io::io_table_test {
namespace {

TEST(TextTable, aligns_by_characters) {
  TextTable table({{"route"}, {"time", "us", Align::kRight}, {"error", "", Align::kRight}});
  table.append({"généré", significant(1.2345, 3), scientific(3e-16)});
  table.append({"fd", "10", "-"});
  EXPECT_EQ(table.text(),
            "route   time [us]    error\n"
            "------  ---------  -------\n"
            "généré       1.23  3.0e-16\n"
            "fd             10        -\n");
  EXPECT_THROW(table.append({"x"}), ArgumentError);
}

TEST(TextTable, numbers) {
  EXPECT_EQ(significant(1234.5, 3), "1230");
  EXPECT_EQ(significant(0.00012345, 3), "0.000123");
  EXPECT_EQ(significant(9.996, 3), "10.0");
  EXPECT_EQ(significant(0, 3), "0");
  EXPECT_EQ(duration(3.2e-9), "3.20 ns");
  EXPECT_EQ(duration(999.9e-9), "1.00 us");
  EXPECT_EQ(duration(0.0456), "45.6 ms");
  EXPECT_EQ(duration(60), "60.0 s");
  EXPECT_EQ(duration(123.4), "2 min 03 s");
  EXPECT_EQ(with_groups(1234567), "1 234 567");
  EXPECT_EQ(with_groups(-123456), "-123 456");
  EXPECT_EQ(with_groups(999), "999");
  EXPECT_EQ(significant(std::numeric_limits<double>::infinity(), 3), "inf");
}

TEST(TextTable, rounded_numbers_are_near_what_they_show) {
  for (unsigned seed = 0; seed < 2000; ++seed) {
    std::mt19937_64 random(seed);
    const double value = std::exp(std::uniform_real_distribution<>(-50, 50)(random));
    const double shown = std::strtod(significant(value, 4).c_str(), nullptr);
    ASSERT_LE(std::abs(shown - value), 0.50001e-3 * value) << "seed " << seed;
  }
}

TEST(Facts, are_told_to_people_and_programs_in_order) {
  Facts facts("pendulum: simulated 2 s");
  facts.say("one step", "12 operations");
  facts["operations"] = 12;
  facts["error"] = std::numeric_limits<double>::quiet_NaN();
  facts.time("check derivatives", 0.25, "twice");
  facts.below("\n" + facts.times());
  EXPECT_EQ(facts.text(),
            "pendulum: simulated 2 s\n\n"
            "quantity  value\n"
            "--------  -------------\n"
            "one step  12 operations\n"
            "\n"
            "step                 time  remark\n"
            "-----------------  ------  ------\n"
            "check derivatives  250 ms  twice\n");
  EXPECT_EQ(facts.json(),
            "{\n  \"operations\": 12,\n  \"error\": null,\n  \"seconds\": {\n    "
            "\"check_derivatives\": 0.25\n  }\n}\n");
}

}  // namespace
}  // namespace dyntape::io::io_table_test
