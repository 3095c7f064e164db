// SPDX-License-Identifier: BSD-3-Clause
//
// The tape beside CppAD's, in one run: inverse dynamics of dyntape recorded on AD, Pinocchio's on
// CppAD::AD<double> (tape_cppad.cpp), each by its own templates, with its users' flags, of the same robot.
//
//   cmake -B build -DDYNTAPE_PEERS="folder;folder" ...      folders with include/pinocchio and include/cppad
//   ninja -C build bench_tape_peer && build/bin/bench_tape_peer config/robots/panda.urdf --floating config/robots/solo12.urdf
//
// record    from templates, working memory at hand, to a function
// prepare   from there to the first sparse Jacobian: derivation and program; sparsity and colours
// value     one evaluation of the recorded function
// jacobian  one evaluation of its non-zero derivatives by (q, v, a), by CppAD's fastest driver of those below
//
// Each figure is the least of many repetitions.  Both sides must agree on the torques and their derivatives.
#include <cstdio>
#include <random>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/urdf/urdf.h>

#include "peer.h"
#include "tape_times.h"

namespace dyntape {
namespace {

using dynamics::JointType;

using bench::least_us;
using bench::Times;

// The answers at the point, for the comparison: y, and J as a dense matrix.
struct Answers {
  Eigen::VectorXd y;
  Eigen::MatrixXd J;
};

Eigen::VectorXd random_state(const dynamics::Model<double>& model) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Eigen::VectorXd x(model.nq + 2 * model.nv);
  for (double& t : x) t = uniform(random);
  for (const auto& joint : model.joints) {
    if (joint.type == JointType::kFreeFlyer) x.segment(joint.idx_q + 3, 4).normalize();
  }
  return x;
}

constexpr std::size_t kPoints = 32;

// Ours; `many` takes the times a point of eight side by side.
Times measure_ours(const dynamics::Model<double>& model, const Eigen::VectorXd& point, Answers& answers,
                   Times& many) {
  const dynamics::Model<AD> taped = model.cast<AD>();
  dynamics::Data<AD> data(taped);
  const auto n = static_cast<std::size_t>(point.size());
  const auto record_it = [&] {
    return record("rnea", n, [&](const VectorXad& x) -> VectorXad {
      return dynamics::rnea<AD>(taped, data, x.head(model.nq), x.segment(model.nq, model.nv),
                                x.tail(model.nv));
    });
  };
  Times times;
  const Function f = record_it();
  times.record = least_us(record_it);
  const SparseFunction jacobian = sparse_jacobian(f);
  times.prepare = least_us([&] { Interpreter{sparse_jacobian(f).function}; });

  std::vector<double> x(kPoints * n);
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = point[static_cast<Eigen::Index>(i % n)];
  const auto evaluate = [&](const Function& g, double& alone, double& side_by_side) {
    const Interpreter run(g);
    Interpreter::Workspace workspace(run, kPoints);
    std::vector<double> y(kPoints * g.n_y());
    alone = least_us([&] {
              for (std::size_t i = 0; i < kPoints; ++i)
                run(&x[i * n], nullptr, nullptr, &y[i * g.n_y()], workspace);
            }) /
            kPoints;
    const PointRange range{.points = kPoints, .x = x.data(), .y = y.data()};
    side_by_side = least_us([&] { run(range, workspace); }) / kPoints;
    return y;
  };
  const std::vector<double> y = evaluate(f, times.value, many.value),
                            J = evaluate(jacobian.function, times.jacobian, many.jacobian);
  answers.y = Eigen::VectorXd::Map(y.data(), static_cast<Eigen::Index>(f.n_y()));
  answers.J = Eigen::MatrixXd::Zero(model.nv, point.size());
  for (std::size_t k = 0; k < jacobian.pattern.nnz(); ++k)
    answers.J(jacobian.pattern.row[k], jacobian.pattern.col[k]) = J[k];
  return times;
}

// CppAD's; `optimised` is the same after ADFun::optimize().
Times measure_peer(const dynamics::Model<double>& model, const Eigen::VectorXd& point, Answers& answers,
                   Times& optimised) {
  const auto joints = tools::peer_joints(model);
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> J(model.nv, point.size());
  answers.y.resize(model.nv);
  Times times;
  if (!measure_cppad(joints.data(), model.njoints(), model.gravity.data(), point.data(),
                     static_cast<int>(point.size()), answers.y.data(), J.data(), &times, &optimised))
    throw ArgumentError("bench_tape_peer: \"" + model.name + "\" has a joint that Pinocchio does not have");
  answers.J = J;
  return times;
}

// Columns of q are compared where q is free: off the unit sphere each side continues quaternions as it likes.
void demand_agreement(const dynamics::Model<double>& model, const Answers& ours, const Answers& peer) {
  const bool quaternion = model.nq != model.nv;
  const Eigen::Index from = quaternion ? model.nq : 0, columns = ours.J.cols() - from;
  const double y = (ours.y - peer.y).norm() / peer.y.norm();
  const double J = (ours.J.rightCols(columns) - peer.J.rightCols(columns)).norm() / peer.J.norm();
  if (y < 1e-10 && J < 1e-10) return;
  throw std::runtime_error(model.name + ": the two sides disagree by " + std::to_string(y) + " (torques), " +
                           std::to_string(J) + " (derivatives)");
}

struct Robot {
  const char* file;
  dynamics::Base base;
};

void run(const std::vector<Robot>& robots, bool csv) {
  if (csv) std::printf("robot,function,route,quantity,us\n");
  for (const Robot& robot : robots) {
    const auto model = dynamics::load_urdf(robot.file, {.base = robot.base});
    const Eigen::VectorXd x = random_state(model);
    Answers our_answers, peer_answers;
    Times many, optimised;
    const Times ours = measure_ours(model, x, our_answers, many);
    const Times peer = measure_peer(model, x, peer_answers, optimised);
    demand_agreement(model, our_answers, peer_answers);
    if (csv) {
      const auto row = [&](const char* route, const char* quantity, double us) {
        if (us > 0) std::printf("%s,rnea,\"%s\",%s,%.4g\n", model.name.c_str(), route, quantity, us);
      };
      const auto rows = [&](const char* route, const Times& t) {
        row(route, "record", t.record), row(route, "prepare", t.prepare);
        row(route, "value", t.value), row(route, "jacobian", t.jacobian);
      };
      rows("dyntape tape", ours), rows("dyntape tape, 8 lanes", many);
      rows("CppAD tape", peer), rows("CppAD tape, optimised", optimised);
      continue;
    }
    const double value = std::min(peer.value, optimised.value),
                 jacobian = std::min(peer.jacobian, optimised.jacobian);
    std::printf("%-16s %10s %10s %10s %10s %8s %8s\n", model.name.c_str(), "us", "dyntape", "8 lanes",
                "CppAD", "ratio", "8 lanes");
    std::printf("%-16s %10s %10.4g %10s %10.4g %8.3g\n", "", "record", ours.record, "", peer.record,
                ours.record / peer.record);
    const auto line = [&](const char* quantity, double one, double lanes, double theirs) {
      std::printf("%-16s %10s %10.4g %10.4g %10.4g %8.3g %8.3g\n", "", quantity, one, lanes, theirs,
                  one / theirs, lanes / theirs);
    };
    line("value", ours.value, many.value, value);
    line("jacobian", ours.jacobian, many.jacobian, jacobian);
    std::printf("%-16s %10s %10.4g\n", "", "prepare", ours.prepare);
  }
}

}  // namespace
}  // namespace dyntape

int main(int count, char** arguments) {
  using dyntape::dynamics::Base;
  bool csv = false, understood = true;
  Base base = Base::kFixed;
  std::vector<dyntape::Robot> robots;
  for (int i = 1; i < count; ++i) {
    const std::string argument = arguments[i];
    if (argument == "--csv") {
      csv = true;
    } else if (argument == "--floating") {
      base = Base::kFloating;
    } else if (argument[0] == '-') {
      understood = false;
    } else {
      robots.push_back({arguments[i], base});
    }
  }
  if (!understood || robots.empty()) {
    std::fprintf(stderr,
                 "usage: bench_tape_peer [--csv] ROBOT.urdf ... [--floating ROBOT.urdf ...]\n"
                 "--csv: rows robot,function,route,quantity,us in the place of a table with ratios\n");
    return 2;
  }
  try {
    dyntape::run(robots, csv);
  } catch (const std::exception& e) {
    return std::fprintf(stderr, "bench_tape_peer: %s\n", e.what()), 1;
  }
}
