// SPDX-License-Identifier: BSD-3-Clause
#include <memory>

#include <dyntape/interface/robot/packs/packed_robot.h>
#include <dyntape/interface/robot/robot_rows.h>

#include "route.h"

namespace dyntape::bench {

std::vector<Route> plain_routes(const dynamics::Model<double>& model, const RobotFunction& function,
                                const States& states) {
  struct Plain {
    Plain(const dynamics::Model<double>& robot, const RobotFunction& f) : model(robot), work(model, f) {}
    dynamics::Model<double> model;
    detail::RobotWorkspace<double> work;
    std::vector<detail::RobotState<double>> states;
  };
  const auto plain = std::make_shared<Plain>(model, function);
  for (const auto& state : states) {
    plain->work.read(state.data());
    plain->states.push_back(plain->work.state);
  }
  Route one;
  one.name = "plain double";
  one.run = [plain](int first, int calls) {
    for (int k = 0; k < calls; ++k)
      plain->work.run(plain->states[static_cast<std::size_t>(first + k) % plain->states.size()]);
  };
  one.value = [plain, &states](int i) {
    std::vector<double> y(plain->work.n_out());
    plain->work.evaluate(states[static_cast<std::size_t>(i)].data(), y.data());
    return y;
  };

  struct Packs {
    Packs(const dynamics::Model<double>& robot, const RobotFunction& f) : run(robot, f) {}
    PackedRobot run;
    std::vector<double> states, results;
  };
  const auto packs = std::make_shared<Packs>(model, function);
  for (const auto& state : states) packs->states.insert(packs->states.end(), state.begin(), state.end());
  packs->results.resize(8 * packs->run.n_out());
  const std::size_t count = states.size();
  Route packed;
  packed.name = "packs";
  packed.run = [packs, count](int first, int calls) {
    for (int k = 0; k < calls; k += 8) {
      const std::size_t i = static_cast<std::size_t>(first + k) % count;
      packs->run.evaluate(packs->states.data() + i * packs->run.n_in(), 8, packs->results.data());
    }
  };
  packed.value = [packs](int i) {
    std::vector<double> y(packs->run.n_out());
    packs->run.evaluate(packs->states.data() + static_cast<std::size_t>(i) * packs->run.n_in(), 1, y.data());
    return y;
  };
  return {one, packed};
}

}  // namespace dyntape::bench
