// SPDX-License-Identifier: MIT
#include "fluid/rheology.hpp"
#include "tests/support/fluid_cases.hpp"

#include <gtest/gtest.h>

namespace sluice::fluid {
namespace {

double viscosity_of(const RheologyParams &params, double gamma) {
  double result = 0;
  Rheology(params, 1e-3).with_law([&](const auto &law) { result = law(gamma); });
  return result;
}

RheologyParams law(const std::string &name) {
  RheologyParams params;
  params.law = name;
  params.lowest_shear_rate = 1e-12;
  return params;
}

TEST(Rheology, APowerLawOfExponentOneIsItsConsistencyToTheBit) {
  RheologyParams params = law("power-law");
  params.consistency = 1e-3;
  for (const double gamma : {0.0, 1e-9, 0.3, 1e7})
    EXPECT_EQ(viscosity_of(params, gamma), 1e-3);
}

TEST(Rheology, APowerLawsStressIsAPowerOfTheShearRate) {
  RheologyParams params = law("power-law");
  params.consistency = 3;
  for (const double n : {0.2, 0.5, 1.5, 2.5}) {
    params.exponent = n;
    for (const double gamma : {0.01, 1.0, 40.0})
      EXPECT_NEAR(gamma * viscosity_of(params, gamma), 3 * std::pow(gamma, n),
                  1e-12 * 3 * std::pow(gamma, n));
  }
}

TEST(Rheology, CarreauYasudaAndCrossRunFromTheViscosityAtRestToThatAtInfinity) {
  for (const char *name : {"carreau-yasuda", "cross"}) {
    RheologyParams params = law(name);
    params.at_rest = 5;
    params.at_infinity = 0.1;
    params.time = 2;
    params.exponent = params.law == "cross" ? 0.8 : 0.3;
    EXPECT_NEAR(viscosity_of(params, 0), 5, 1e-6);
    EXPECT_NEAR(viscosity_of(params, 1e14), 0.1, 1e-8);
    double before = 5;
    for (double gamma = 0.01; gamma < 1e4; gamma *= 3) {
      EXPECT_LT(viscosity_of(params, gamma), before);
      before = viscosity_of(params, gamma);
    }
  }
}

TEST(Rheology, CarreauYasudaHasThePowerLawsSlopeInItsMiddle) {
  RheologyParams params = law("carreau-yasuda");
  params.exponent = 0.4;
  const double slope =
      std::log(viscosity_of(params, 2e5) / viscosity_of(params, 1e5)) / std::log(2.0);
  EXPECT_NEAR(slope, 0.4 - 1, 1e-9);
}

TEST(Rheology, BinghamsStressTendsToTheYieldStressAndItsViscosityIsBounded) {
  RheologyParams params = law("bingham");
  params.consistency = 0.5;
  params.yield_stress = 20;
  params.growth = 1000;
  const double gamma = 0.1; // exp(-100) is nothing
  EXPECT_NEAR(gamma * viscosity_of(params, gamma), 20 + 0.5 * gamma, 1e-12);
  EXPECT_NEAR(viscosity_of(params, 0), 0.5 + 20 * 1000, 1e-3); // the limit: mu + m tau_y
}

TEST(Rheology, BoundsHoldAndContradictoryOnesAreRefused) {
  RheologyParams params = law("power-law");
  params.exponent = 0.2;
  params.lowest = 1e-2;
  params.highest = 10;
  params.consistency = 1;
  EXPECT_EQ(viscosity_of(params, 1e-9), 10);
  EXPECT_EQ(viscosity_of(params, 1e9), 1e-2);
  params.lowest = 20;
  const std::string message = testing::message_of([&] { Rheology(params, 1); });
  EXPECT_TRUE(testing::contains(message, "lowest_viscosity_pa_s = 20 exceeds")) << message;
}

} // namespace
} // namespace sluice::fluid
