// SPDX-License-Identifier: BSD-3-Clause
//
// Goals that leave joints open need no value for them.
#include <gtest/gtest.h>

#include <cmath>

#include "task_text.h"

namespace dyntape::open_goal_test {
namespace {

class OpenGoal : public test::TaskText {
 protected:
  OpenGoal() : TaskText("open-goal") {}
  void goal_of_cart_pole(const std::string& goal) {
    load("cart_pole_swing_up");
    const std::size_t at = text_.find("\ngoal\n{"), end = text_.find("\n}\n", at);
    ASSERT_NE(end, std::string::npos);
    text_.replace(at, end + 3 - at, "\ngoal\n{\n" + goal + "\n}\n");
    const std::size_t expected = text_.find("\nexpected");
    if (expected != std::string::npos) text_.erase(expected);
  }
};

TEST_F(OpenGoal, WhereAllIsOpenNothingIsAskedFor) {
  goal_of_cart_pole("free \"slider pivot\"");
  EXPECT_TRUE(read().goal.array().isNaN().all());
}

TEST_F(OpenGoal, OneJointIsOpenTheOtherHasAValue) {
  goal_of_cart_pole("free slider\nq { pivot 3 }");
  const Eigen::VectorXd goal = read().goal;
  EXPECT_TRUE(std::isnan(goal[0]) && std::isnan(goal[2]));
  EXPECT_EQ(goal[1], 3);
  EXPECT_EQ(goal[3], 0);
}

TEST_F(OpenGoal, AJointWithoutAValueIsNamed) {
  goal_of_cart_pole("free slider");
  EXPECT_NE(message().find(
                "'goal' leaves joint 'pivot' without a value; expected 'q', or the joint in 'free' as well"),
            std::string::npos)
      << message();
}

}  // namespace
}  // namespace dyntape::open_goal_test
