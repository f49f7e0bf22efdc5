// Simulated recordings of 12 s, unless the scenario says otherwise.
#ifndef CAMGYRO_TESTS_ESTIMATOR_DIAGNOSIS_SIMULATED_RECORDING_H_
#define CAMGYRO_TESTS_ESTIMATOR_DIAGNOSIS_SIMULATED_RECORDING_H_

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "simulation/simulate.h"

namespace camgyro {

inline simulation::Simulated SimulateFor12S(const std::vector<std::string>& overrides) {
  const auto scenario = simulation::ParseScenario("duration_s: 12", overrides);
  EXPECT_TRUE(scenario) << scenario.error().message;
  auto simulated = simulation::SimulateTracks(*scenario);
  EXPECT_TRUE(simulated) << simulated.error().message;
  return std::move(*simulated);
}

}  // namespace camgyro

#endif  // CAMGYRO_TESTS_ESTIMATOR_DIAGNOSIS_SIMULATED_RECORDING_H_
