// SPDX-License-Identifier: BSD-3-Clause
//
// Functions that are not finite where a solve begins: every method names function, point and variable.
#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/mpc/receding_horizon.h>
#include <dyntape/interface/control/solve/ddp.h>
#include <dyntape/interface/control/solve/optimise.h>
#include "interface/control/ocp_problems.h"
#include "interface/message_of.h"

namespace dyntape::not_finite_test {
namespace {

// A root of what becomes negative on the straight guess from 1 to -1, in the rate of v.
Problem root(bool demands_goal) {
  Problem p("root", {"p", "v"}, {"u"}, 1, [](const auto& s) {
    using std::sqrt;
    using T = std::decay_t<decltype(s.t)>;
    return vector(T(s.x[1]), T(s.u[0] + sqrt(s.x[0] + 0.25)));
  });
  p.add(running_squares("effort", [](const auto& s) { return s.u; }));
  p.start << 1, 0;
  p.goal << -1, 0;
  p.guess = straight_line(p);
  if (!demands_goal) p.goal.setConstant(Problem::kFree);
  return p;
}

void expect_named(const std::string& message) {
  for (const char* part : {"\"root\"", "v", "p", "t = "})
    EXPECT_NE(message.find(part), std::string::npos) << part << " not in: " << message;
  EXPECT_NE(message.find("root"), std::string::npos);
  EXPECT_EQ(message.find("solve_with_riccati"), std::string::npos) << message;
}

TEST(NotFinite, IsNamedByEveryMethod) {
  for (const NlpMethod method : {NlpMethod::kIpopt, NlpMethod::kRiccati}) {
    const MeshOptions mesh{.scheme = trapezoid(), .intervals = 8, .evaluation = test::kInterpreted};
    const std::string optimised = message_of<NumericalError>(
        [&] { optimise(root(true), {.mesh = mesh, .solver = {.method = method}}); });
    expect_named(optimised);
    StagedNlp nlp = discretize(root(true), mesh);
    EXPECT_EQ(message_of<NumericalError>([&] { solve_nlp(nlp, nlp.start(), {.method = method}); }),
              optimised);
    Phases phases("root");
    phases.add("root", root(true));
    expect_named(message_of<NumericalError>(
        [&] { optimise(phases, {.meshes = {mesh}, .solver = {.method = method}}); }));
  }
  MpcOptions options;
  options.mesh.evaluation = test::kInterpreted;
  Problem p = root(true);
  expect_named(message_of<NumericalError>([&] {
    RecedingHorizon mpc(p, options);
    mpc.step(0, p.start);
  }));
  DdpOptions ddp{.intervals = 10, .evaluation = test::kInterpreted};
  ddp.start = DdpStart::kNodes;
  const std::string stepped = message_of<NumericalError>([&] { solve_with_ddp(root(false), ddp); });
  EXPECT_NE(stepped.find("is not finite at the start: it gives the state \"p\" as "), std::string::npos)
      << stepped;
}

}  // namespace
}  // namespace dyntape::not_finite_test
