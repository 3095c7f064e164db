// SPDX-License-Identifier: BSD-3-Clause
//
// Interpolation, look-up and references over time.
#include "program.h"

namespace {

using ocs2::scalar_array_t;
using ocs2::vector_array_t;
using ocs2::vector_t;
namespace LinearInterpolation = ocs2::LinearInterpolation;

TEST(Interpolation, BetweenBeforeAndAfter) {
  const scalar_array_t times = {0, 1, 3};
  const scalar_array_t values = {0, 10, 30};
  EXPECT_EQ(LinearInterpolation::interpolate(0.25, times, values), 2.5);
  EXPECT_EQ(LinearInterpolation::interpolate(2.0, times, values), 20);
  EXPECT_EQ(LinearInterpolation::interpolate(-1.0, times, values), 0);
  EXPECT_EQ(LinearInterpolation::interpolate(9.0, times, values), 30);
  EXPECT_EQ(LinearInterpolation::timeSegment(0.25, times), (std::pair{0, 0.75}));
  EXPECT_EQ(LinearInterpolation::interpolate(LinearInterpolation::timeSegment(2, times), values), 20);
}

TEST(Interpolation, OfVectorsAndOfWhatIsInThem) {
  const scalar_array_t times = {0, 2};
  const vector_array_t states = {vector_t::Zero(3), vector_t::Constant(3, 4)};
  const vector_t x = LinearInterpolation::interpolate(0.5, times, states);
  expect_near(x, vector_t::Ones(3), 0);
  const auto first = [](const vector_array_t& all, std::size_t k) { return all[k][0]; };
  EXPECT_EQ(LinearInterpolation::interpolate(0.5, times, states, first), 1);
}

TEST(Interpolation, ByReferenceAsOlderVersionsHaveIt) {
  const std::vector<Eigen::Vector2d, Eigen::aligned_allocator<Eigen::Vector2d>> data = {
      Eigen::Vector2d::Zero(), Eigen::Vector2d::Ones()};
  Eigen::Vector2d found;
  EXPECT_EQ(LinearInterpolation::interpolate(0.5, found, {0, 1}, data).first, 0);
  EXPECT_EQ(found, Eigen::Vector2d::Constant(0.5));
}

TEST(Interpolation, SpecialCases) {
  const scalar_array_t one = {1};
  EXPECT_EQ(LinearInterpolation::interpolate(5.0, one, scalar_array_t{7}), 7);
  EXPECT_EQ(LinearInterpolation::interpolate(5.0, scalar_array_t{}, scalar_array_t{7}), 7);
  EXPECT_THROW(LinearInterpolation::interpolate(5.0, one, scalar_array_t{}), dyntape::ArgumentError);
  // Sizes that differ: the nearer one.  An event stands twice: the value before it holds at its time.
  const vector_array_t mixed = {vector_t::Zero(2), vector_t::Ones(3)};
  EXPECT_EQ(vector_t(LinearInterpolation::interpolate(0.2, {0, 1}, mixed)).size(), 2);
  EXPECT_EQ(vector_t(LinearInterpolation::interpolate(0.8, {0, 1}, mixed)).size(), 3);
  EXPECT_EQ(LinearInterpolation::interpolate(1.0, {0, 1, 1, 2}, scalar_array_t{0, 1, 5, 6}), 1);
  EXPECT_EQ(LinearInterpolation::interpolate(1.5, {0, 1, 1, 2}, scalar_array_t{0, 1, 5, 6}), 5.5);
}

TEST(Interpolation, Lookup) {
  const scalar_array_t events = {1, 2};
  EXPECT_EQ(ocs2::lookup::findIndexInTimeArray(events, 0.5), 0);
  EXPECT_EQ(ocs2::lookup::findIndexInTimeArray(events, 1), 0);  // the earlier mode at equality
  EXPECT_EQ(ocs2::lookup::findIndexInTimeArray(events, 1.5), 1);
  EXPECT_EQ(ocs2::lookup::findIndexInTimeArray(events, 2.5), 2);
  EXPECT_EQ(ocs2::lookup::findIntervalInTimeArray(events, 1.5), 0);
  EXPECT_EQ(ocs2::lookup::findActiveIntervalInTimeArray(events, 1), 0);
  EXPECT_EQ(ocs2::lookup::findActiveIntervalInTimeArray(events, 3), 1);
  EXPECT_EQ(ocs2::lookup::findBoundedActiveIntervalInTimeArray(events, 1), 0);
  EXPECT_THROW(ocs2::lookup::findBoundedActiveIntervalInTimeArray(events, 3), dyntape::ArgumentError);
}

TEST(Interpolation, References) {
  const ocs2::TargetTrajectories target({0, 1}, {vector_t::Zero(2), vector_t::Ones(2)},
                                        {vector_t::Ones(1), vector_t::Ones(1)});
  EXPECT_EQ(target.size(), 2u);
  expect_near(target.getDesiredState(0.5), vector_t::Constant(2, 0.5), 0);
  expect_near(target.getDesiredInput(0.5), vector_t::Ones(1), 0);
  EXPECT_TRUE(ocs2::TargetTrajectories().empty());
  EXPECT_THROW(ocs2::TargetTrajectories().getDesiredInput(0), dyntape::ArgumentError);
}

}  // namespace
