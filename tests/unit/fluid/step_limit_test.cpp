// SPDX-License-Identifier: MIT
#include "fluid/step_limit.hpp"

#include <gtest/gtest.h>

namespace sluice::fluid {
namespace {

class StepLimitTest : public ::testing::Test {
protected:
  StepLimitTest() {
    state_.points.position = {Vec<2>(0, 0), Vec<2>(1, 0)};
    state_.points.velocity = {Vec<2>(0, 0.1), Vec<2>(0, 0)};
    walls_.velocity = {Vec<2>(0.2, 0)};
    params_.spacing = 0.1;
    params_.courant = 0.25;
    params_.gravity = Vec<2>(0, -10);
  }
  LimitedStep at_most(double largest) const {
    return limited_step(state_, walls_, params_, largest);
  }

  FluidState<2> state_;
  Walls<2> walls_;
  FluidParams<2> params_;
};

TEST_F(StepLimitTest, GravityHoldsSlowWater) {
  const LimitedStep step = at_most(1);
  EXPECT_EQ(step.limit, StepLimit::gravity);
  EXPECT_DOUBLE_EQ(step.size, 0.25 * 0.1); // sqrt(0.1 m / 10 m/s2) = 0.1 s
}

TEST_F(StepLimitTest, TheFastestPointOrWallHoldsFastFlow) {
  params_.gravity = Vec<2>::Zero();
  EXPECT_DOUBLE_EQ(at_most(1).size, 0.25 * 0.1 / 0.2); // the wall
  state_.points.velocity[1] = Vec<2>(-3, 4);
  EXPECT_DOUBLE_EQ(at_most(1).size, 0.25 * 0.1 / 5);
  EXPECT_EQ(at_most(1).limit, StepLimit::courant);
}

TEST_F(StepLimitTest, TheStepGrowsByATenthAtMost) {
  state_.step_size = 1e-3;
  const LimitedStep step = at_most(1);
  EXPECT_EQ(step.limit, StepLimit::growth);
  EXPECT_DOUBLE_EQ(step.size, 1.1e-3);
}

TEST_F(StepLimitTest, WithoutACourantNumberTheStepIsAsGiven) {
  params_.courant = 0;
  EXPECT_EQ(at_most(1).size, 1);
  EXPECT_EQ(at_most(1).limit, StepLimit::given);
}

} // namespace
} // namespace sluice::fluid
