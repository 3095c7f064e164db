// SPDX-License-Identifier: BSD-3-Clause
//
// What obstacles hide of a robot in a picture, from each side.
#include <gtest/gtest.h>

#include <dyntape/interface/run/solve/hidden_parts.h>

namespace dyntape::hidden_parts_test {
namespace {

using Eigen::Vector3d;

constexpr View kViews[] = {View::kXz, View::kXy, View::kYz, View::kOblique};

// A step towards the viewer is none in the picture.
TEST(HiddenParts, TheViewerIsInLineOfSight) {
  for (const View view : kViews) {
    const auto [x, y] = project(view, towards_viewer(view));
    EXPECT_NEAR(std::hypot(x, y), 0, 1e-15);
    EXPECT_NEAR(towards_viewer(view).norm(), 1, 1e-15);
  }
}

TEST(HiddenParts, OnlyWhatIsBehindIsHidden) {
  const Vector3d center(0.3, -0.2, 0.5);
  const std::vector<Capsule> ball = {sphere("ball", kWorld, center, 0.1)},
                             post = {capsule("post", kWorld, center - Vector3d(0.1, 0.2, 0.3),
                                             center + Vector3d(0.1, 0.2, 0.3), 0.1)};
  for (const View view : kViews) {
    const Vector3d n = towards_viewer(view);
    const Vector3d aside = n.unitOrthogonal();
    for (const auto* obstacles : {&ball, &post}) {
      EXPECT_TRUE(is_hidden(view, *obstacles, center - n));
      EXPECT_FALSE(is_hidden(view, *obstacles, center + n));
      EXPECT_TRUE(is_hidden(view, *obstacles, center - n + 0.09 * aside));
    }
    EXPECT_FALSE(is_hidden(view, ball, center - n + 0.11 * aside));
  }
}

// A bone behind the ball, one before it, one that goes by beside it.
TEST(HiddenParts, BonesAreCutWhereTheyGetHidden) {
  const std::vector<Capsule> ball = {sphere("ball", kWorld, Vector3d::Zero(), 0.1)};
  const Bone behind = {Vector3d(-0.5, 1, 0), Vector3d(0.5, 1, 0)},
             before = {Vector3d(-0.5, -1, 0), Vector3d(0.5, -1, 0)},
             beside = {Vector3d(-0.5, 1, 0.2), Vector3d(0.5, 1, 0.2)};
  const io::MotionFrame frame = frame_of(View::kXz, ball, 2, {behind, before, beside});
  EXPECT_EQ(frame.time, 2);
  EXPECT_EQ(frame.parts.size(), 2u);
  ASSERT_EQ(frame.behind.size(), 1u);
  ASSERT_EQ(frame.in_front.size(), 2u);  // left and right of the ball
  EXPECT_NEAR(frame.in_front[0].back()[0], -0.1, 0.02);
  EXPECT_NEAR(frame.in_front[1].front()[0], 0.1, 0.02);
}

}  // namespace
}  // namespace dyntape::hidden_parts_test
