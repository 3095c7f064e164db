// SPDX-License-Identifier: BSD-3-Clause
//
// The optimal control problems of tests/bench/ilqr.cpp by Crocoddyl, mim-solvers and aligator: control_peers.py compiles and runs it.
//
//   control crocoddyl|mim-solvers|aligator arm|quadruped|cart-pole URDF euler|rk4 INTERVALS TIMES
//
// Prints one JSON object: how the solve ended, iterations, cost, seconds (the quickest of TIMES) and the controls.  Each solver begins
// with a roll-out of the torques that hold the robot.  aligator has no classical Runge-Kutta scheme: it takes Crocoddyl's steps then.
#include <cstdio>
#include <ctime>
#include <memory>
#include <string>

#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/model.hpp>
#include <pinocchio/parsers/urdf.hpp>

#include <aligator/compat/crocoddyl/problem-wrap.hpp>
#include <aligator/core/traj-opt-problem.hpp>
#include <aligator/modelling/constraints.hpp>
#include <aligator/modelling/costs/quad-state-cost.hpp>
#include <aligator/modelling/costs/sum-of-costs.hpp>
#include <aligator/modelling/dynamics/integrator-semi-euler.hpp>
#include <aligator/modelling/dynamics/multibody-constraint-fwd.hpp>
#include <aligator/modelling/dynamics/multibody-free-fwd.hpp>
#include <aligator/solvers/proxddp/solver-proxddp.hpp>
#include <crocoddyl/core/activations/weighted-quadratic.hpp>
#include <crocoddyl/core/constraints/constraint-manager.hpp>
#include <crocoddyl/core/constraints/residual.hpp>
#include <crocoddyl/core/costs/residual.hpp>
#include <crocoddyl/core/integrator/euler.hpp>
#include <crocoddyl/core/integrator/rk.hpp>
#include <crocoddyl/core/optctrl/shooting.hpp>
#include <crocoddyl/core/residuals/control.hpp>
#include <crocoddyl/core/solvers/box-fddp.hpp>
#include <crocoddyl/core/solvers/fddp.hpp>
#include <crocoddyl/multibody/actions/contact-fwddyn.hpp>
#include <crocoddyl/multibody/actions/free-fwddyn.hpp>
#include <crocoddyl/multibody/actuations/floating-base.hpp>
#include <crocoddyl/multibody/actuations/full.hpp>
#include <crocoddyl/multibody/contacts/contact-3d.hpp>
#include <crocoddyl/multibody/contacts/multiple-contacts.hpp>
#include <crocoddyl/multibody/residuals/state.hpp>
#include <mim_solvers/csqp.hpp>
#include <mim_solvers/sqp.hpp>

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::make_shared, std::shared_ptr;
using Vectors = std::vector<VectorXd>;

constexpr const char* kFeet[] = {"FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT"};

// What a problem is made of; squares of what is missed are weighted by `missed`, at the end by `missed_at_end`.
struct Robot {
  pinocchio::Model model;
  VectorXd start, goal, missed, missed_at_end, limit;  // limit: of controls, empty: none
  double torque = 1e-3, duration = 1;                  // torque: weight of squared controls
  MatrixXd actuation;                                  // (nv x nu)
  std::vector<pinocchio::FrameIndex> feet;
};

VectorXd weights(int n, double angle, double rate) {
  VectorXd w(2 * n);
  w << VectorXd::Constant(n, angle), VectorXd::Constant(n, rate);
  return w;
}

Robot arm(const std::string& urdf) {
  pinocchio::Model whole;
  pinocchio::urdf::buildModel(urdf, whole);
  Robot r;
  r.model = pinocchio::buildReducedModel(
      whole, {whole.getJointId("panda_finger_joint1"), whole.getJointId("panda_finger_joint2")},
      pinocchio::neutral(whole));
  r.start.setZero(14), r.goal.setZero(14);
  r.start.head(7) << 0, -.5, 0, -2, 0, 1.5, .5;
  r.goal.head(7) << 1, .5, -.5, -1.2, .5, 2, -.5;
  r.missed = weights(7, 10, .1), r.missed_at_end = 100 * r.missed;
  r.actuation.setIdentity(7, 7);
  return r;
}

Robot quadruped(const std::string& urdf) {
  Robot r;
  pinocchio::urdf::buildModel(urdf, pinocchio::JointModelFreeFlyer(), r.model);
  r.start.setZero(37);
  r.start.head(19) << 0, 0, .24, 0, 0, 0, 1, 0, .8, -1.6, 0, .8, -1.6, 0, -.8, 1.6, 0, -.8, 1.6;
  r.goal = r.start;
  r.goal[0] += .02, r.goal[2] -= .04;
  r.missed = weights(18, 10, .1), r.missed_at_end = 100 * r.missed;
  r.actuation.setZero(18, 12);
  r.actuation.bottomRows(12).setIdentity();
  for (const char* foot : kFeet) r.feet.push_back(r.model.getFrameId(foot));
  return r;
}

Robot cart_pole(const std::string& urdf) {
  Robot r;
  pinocchio::urdf::buildModel(urdf, r.model);
  r.start.setZero(4), r.goal.setZero(4);
  r.goal.head(2) << 1, M_PI;
  r.missed.setZero(4), r.missed_at_end = weights(2, 1e4, 1e3);
  r.torque = 1, r.duration = 2;
  r.limit.setConstant(1, 12);
  r.actuation.setZero(2, 1);
  r.actuation(0, 0) = 1;
  return r;
}

// Torques by a constant matrix, as of a cart-pole.
template <class S>
class Linear : public crocoddyl::ActuationModelAbstractTpl<S> {
 public:
  using Scalar = S;
  using Base = crocoddyl::ActuationModelAbstractTpl<S>;
  using Data = crocoddyl::ActuationDataAbstractTpl<S>;
  using Vector = typename Base::VectorXs;
  CROCODDYL_BASE_DERIVED_CAST(crocoddyl::ActuationModelBase, Linear)
  Linear(shared_ptr<crocoddyl::StateAbstractTpl<S>> state, const MatrixXd& of_controls)
      : Base(state, std::size_t(of_controls.cols())), of_controls_(of_controls) {}

  void calc(const shared_ptr<Data>& data, const Eigen::Ref<const Vector>&,
            const Eigen::Ref<const Vector>& u) override {
    data->tau.noalias() = of_controls_ * u;
  }
  void calcDiff(const shared_ptr<Data>&, const Eigen::Ref<const Vector>&,
                const Eigen::Ref<const Vector>&) override {}
  void commands(const shared_ptr<Data>& data, const Eigen::Ref<const Vector>&,
                const Eigen::Ref<const Vector>& tau) override {
    data->u.noalias() = of_controls_.transpose() * tau;
  }
  void torqueTransform(const shared_ptr<Data>& data, const Eigen::Ref<const Vector>&,
                       const Eigen::Ref<const Vector>&) override {
    data->Mtau = of_controls_.transpose();
  }
  shared_ptr<Data> createData() override {
    auto data = Base::createData();
    data->dtau_du = of_controls_, data->Mtau = of_controls_.transpose();
    return data;
  }

 private:
  MatrixXd of_controls_;
};

namespace croc {
using namespace crocoddyl;

shared_ptr<ActuationModelAbstract> actuation(const Robot& r, const shared_ptr<StateMultibody>& state) {
  if (!r.feet.empty()) return make_shared<ActuationModelFloatingBase>(state);
  if (r.actuation.rows() == r.actuation.cols()) return make_shared<ActuationModelFull>(state);
  return make_shared<Linear<double>>(state, r.actuation);
}

shared_ptr<ContactModelMultiple> contacts(const Robot& r, const shared_ptr<StateMultibody>& state,
                                          std::size_t n_u) {
  auto all = make_shared<ContactModelMultiple>(state, n_u);
  pinocchio::Data data(r.model);
  pinocchio::framesForwardKinematics(r.model, data, r.start.head(r.model.nq));
  for (const auto foot : r.feet)
    all->addContact(std::to_string(foot),
                    make_shared<ContactModel3D>(state, foot, data.oMf[foot].translation(), pinocchio::LOCAL,
                                                n_u, Eigen::Vector2d(100, 20)));
  return all;
}

shared_ptr<DifferentialActionModelAbstract> model(const Robot& r, const shared_ptr<StateMultibody>& state,
                                                  bool at_end, bool has_limits) {
  const auto driven = actuation(r, state);
  const std::size_t n_u = driven->get_nu();
  auto costs = make_shared<CostModelSum>(state, n_u);
  const VectorXd w = 2 * (at_end ? r.missed_at_end : r.missed);  // activations are halves of squares
  if (w.norm() > 0)
    costs->addCost("missed",
                   make_shared<CostModelResidual>(state, make_shared<ActivationModelWeightedQuad>(w),
                                                  make_shared<ResidualModelState>(state, r.goal, n_u)),
                   1);
  const auto controls = make_shared<ResidualModelControl>(state, n_u);
  if (!at_end) costs->addCost("torques", make_shared<CostModelResidual>(state, controls), 2 * r.torque);
  if (!r.feet.empty())
    return make_shared<DifferentialActionModelContactFwdDynamics>(state, driven, contacts(r, state, n_u),
                                                                  costs, 0., true);
  if (!has_limits || at_end) return make_shared<DifferentialActionModelFreeFwdDynamics>(state, driven, costs);
  auto limits = make_shared<ConstraintModelManager>(state, n_u);
  limits->addConstraint("limits", make_shared<ConstraintModelResidual>(state, controls, -r.limit, r.limit));
  return make_shared<DifferentialActionModelFreeFwdDynamics>(state, driven, costs, limits);
}

// `has_limits`: as constraints; otherwise as bounds of the models, which solvers with boxes know.
shared_ptr<ShootingProblem> problem(const Robot& r, const std::string& scheme, int n, bool has_limits) {
  const auto state = make_shared<StateMultibody>(make_shared<pinocchio::Model>(r.model));
  std::vector<shared_ptr<ActionModelAbstract>> steps;
  for (int i = 0; i < n; ++i) {
    const auto dynamics = model(r, state, false, has_limits);
    if (scheme == "euler")
      steps.push_back(make_shared<IntegratedActionModelEuler>(dynamics, r.duration / n));
    else
      steps.push_back(make_shared<IntegratedActionModelRK>(dynamics, RKType::four, r.duration / n));
    if (r.limit.size() > 0 && !has_limits) steps.back()->set_u_lb(-r.limit), steps.back()->set_u_ub(r.limit);
  }
  const auto end = make_shared<IntegratedActionModelEuler>(model(r, state, true, false), 0);
  return make_shared<ShootingProblem>(r.start, steps, end);
}

}  // namespace croc

struct Outcome {
  bool is_solved = false;
  std::size_t iterations = 0;
  double cost = 0, seconds = 0;
  Vectors u;
};

// Processor time of this thread: others on the machine do not count.
double thread_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

template <class Run>
double seconds_of(Run run) {
  const double begin = thread_seconds();
  run();
  return thread_seconds() - begin;
}

template <class Solver>
Outcome solve(Solver& solver, const Vectors& x, const Vectors& u, std::size_t most) {
  Outcome o;
  o.seconds = seconds_of([&] { o.is_solved = solver.solve(x, u, most, false); });
  o.iterations = solver.get_iter() + 1, o.cost = solver.get_cost(), o.u = solver.get_us();
  return o;
}

Outcome by_crocoddyl(const Robot& r, const shared_ptr<crocoddyl::ShootingProblem>& p, const Vectors& x,
                     const Vectors& u) {
  if (r.limit.size() == 0) {
    crocoddyl::SolverFDDP solver(p);
    solver.set_th_stop(1e-12);
    return solve(solver, x, u, 100);
  }
  crocoddyl::SolverBoxFDDP solver(p);
  solver.set_th_stop(1e-9);
  return solve(solver, x, u, 1000);
}

Outcome by_mim_solvers(const Robot& r, const shared_ptr<crocoddyl::ShootingProblem>& p, const Vectors& x,
                       const Vectors& u) {
  if (r.limit.size() == 0) {
    mim_solvers::SolverSQP solver(p);
    solver.set_termination_tolerance(1e-5);
    return solve(solver, x, u, 100);
  }
  mim_solvers::SolverCSQP solver(p);
  solver.set_termination_tolerance(1e-4);
  solver.set_eps_abs(1e-7), solver.set_eps_rel(0);
  return solve(solver, x, u, 1000);
}

namespace ali {
using namespace aligator;
using Space = MultibodyPhaseSpace<double>;
using Ode = xyz::polymorphic<dynamics::ODEAbstractTpl<double>>;

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
Ode dynamics_of(const Robot& r, const Space& space) {
  if (r.feet.empty()) return dynamics::MultibodyFreeFwdDynamicsTpl<double>(space, r.actuation);
  typename dynamics::MultibodyConstraintFwdDynamicsTpl<double>::RigidConstraintModelVector feet;
  pinocchio::Data data(r.model);
  pinocchio::framesForwardKinematics(r.model, data, r.start.head(r.model.nq));
  for (const auto foot : r.feet) {
    const auto& frame = r.model.frames[foot];
    pinocchio::SE3 place = data.oMf[foot];
    place.rotation().setIdentity();
    pinocchio::RigidConstraintModel held(pinocchio::CONTACT_3D, r.model, frame.parentJoint, frame.placement,
                                         0, place, pinocchio::LOCAL);
    auto& gains = held.baumgarte_corrector_parameters();
    gains.Kp = 100, gains.Kd = 20;
    feet.push_back(held);
  }
  return dynamics::MultibodyConstraintFwdDynamicsTpl<double>(space, r.actuation, feet,
                                                             pinocchio::ProximalSettings(1e-12, 1e-12, 1));
}
#pragma GCC diagnostic pop

TrajOptProblemTpl<double> problem(const Robot& r, int n) {
  const Space space(r.model);
  const int n_u = int(r.actuation.cols());
  const double h = r.duration / n;
  CostStackTpl<double> running(space, n_u), end(space, n_u);
  const auto missed = [&](const VectorXd& w) {
    return QuadraticStateCostTpl<double>(space, n_u, r.goal, MatrixXd(2 * w.asDiagonal()));
  };
  if (r.missed.norm() > 0) running.addCost(missed(r.missed), h);
  running.addCost(QuadraticControlCostTpl<double>(space, n_u, 2 * r.torque * MatrixXd::Identity(n_u, n_u)),
                  h);
  end.addCost(missed(r.missed_at_end), 1);
  StageModelTpl<double> stage(running,
                              dynamics::IntegratorSemiImplEulerTpl<double>(dynamics_of(r, space), h));
  if (r.limit.size() > 0)
    stage.addConstraint(ControlErrorResidualTpl<double>(2 * r.model.nv, VectorXd::Zero(n_u)),
                        BoxConstraintTpl<double>(-r.limit, r.limit));
  return {r.start, std::vector<xyz::polymorphic<StageModelTpl<double>>>(std::size_t(n), stage), end};
}

Outcome solve(const TrajOptProblemTpl<double>& p, const Robot& r, const Vectors& x, const Vectors& u) {
  SolverProxDDPTpl<double> solver(1e-6, r.limit.size() > 0 ? 1e-2 : 1e-8, 1000);
  solver.rollout_type_ = RolloutType::LINEAR;
  solver.setup(p);
  Outcome o;
  o.seconds = seconds_of([&] { o.is_solved = solver.run(p, x, u); });
  o.iterations = solver.results_.num_iters, o.cost = solver.results_.traj_cost_;
  o.u.assign(solver.results_.us.begin(), solver.results_.us.end());
  return o;
}

}  // namespace ali

void print(const Outcome& o) {
  std::printf("{\"status\": \"%s\", \"iterations\": %zu, \"cost\": %.15g, \"seconds\": %.6g, \"u\": [",
              o.is_solved ? "solved" : "not solved", o.iterations, o.cost, o.seconds);
  for (std::size_t k = 0; k < o.u.size(); ++k) {
    std::printf(k == 0 ? "[" : ", [");
    for (Eigen::Index i = 0; i < o.u[k].size(); ++i) std::printf(i == 0 ? "%.17g" : ", %.17g", o.u[k][i]);
    std::printf("]");
  }
  std::printf("]}\n");
}

int run(const std::string& solver, const std::string& which, const std::string& urdf,
        const std::string& scheme, int n, int times) {
  const Robot r = which == "arm" ? arm(urdf) : which == "quadruped" ? quadruped(urdf) : cart_pole(urdf);
  const bool has_limits = r.limit.size() > 0 && solver == "mim-solvers";
  const auto shooting = croc::problem(r, scheme, n, has_limits);
  const Vectors u = shooting->quasiStatic_xs(Vectors(std::size_t(n), r.start)), x = shooting->rollout_us(u);
  const bool is_own = solver == "aligator" && scheme == "euler";
  const auto problem =
      is_own ? ali::problem(r, n) : aligator::compat::croc::convertCrocoddylProblem<double>(shooting);
  Outcome best;
  for (int i = 0; i < times; ++i) {
    Outcome o = solver == "crocoddyl"     ? by_crocoddyl(r, shooting, x, u)
                : solver == "mim-solvers" ? by_mim_solvers(r, shooting, x, u)
                                          : ali::solve(problem, r, x, u);
    if (i == 0 || o.seconds < best.seconds) best = std::move(o);
  }
  print(best);
  return 0;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 7) {
    std::fprintf(stderr,
                 "usage: control crocoddyl|mim-solvers|aligator arm|quadruped|cart-pole URDF euler|rk4 "
                 "INTERVALS TIMES\n");
    return 2;
  }
  return run(argv[1], argv[2], argv[3], argv[4], std::max(1, std::atoi(argv[5])),
             std::max(1, std::atoi(argv[6])));
} catch (const std::exception& e) {
  std::fprintf(stderr, "control: %s\n", e.what());
  return 1;
}
