// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/motion/centroidal_problem.h>

#include <algorithm>
#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/centroidal.h>
#include <dyntape/interface/motion/robot_terms.h>

namespace dyntape {

namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kLevelPull = 100, kLevelDrag = 20,
                 kTurnDrag = 10;  // 1/s^2, 1/s, 1/s: as fast as held points

[[noreturn]] void refuse_body(const CentroidalBody& body, const std::string& what) {
  throw ArgumentError("robot \"" + body.name + "\" as one mass: " + what);
}

void check_feet(const CentroidalBody& body) {
  for (std::size_t i = 0; i < body.feet.size(); ++i) {
    const CentroidalBody::Foot& foot = body.feet[i];
    if (!foot.place.allFinite())
      refuse_body(body, "the place of foot \"" + foot.name + "\" has an entry that is no finite number");
    for (std::size_t k = 0; k < i; ++k) {
      if (body.feet[k].name == foot.name)
        refuse_body(body, "foot \"" + foot.name + "\" stands twice, expected once");
    }
  }
}

void check_body(const CentroidalBody& body, const CentroidalOptions& options) {
  if (!(body.mass > 0 && std::isfinite(body.mass)))
    refuse_body(body, "the mass is " + std::to_string(body.mass) + " kg, expected one above zero");
  if (!body.com.allFinite() || !body.gravity.allFinite())
    refuse_body(body, "the centre of mass or gravity has an entry that is no finite number");
  if (!(body.gravity.z() < 0))
    refuse_body(body, "gravity is " + std::to_string(body.gravity.z()) +
                          " m/s^2 upwards, expected one that pulls down");
  if (body.feet.empty()) refuse_body(body, "it has no foot; expected one contact or more");
  check_feet(body);
  if (!(options.most_force > 0))
    refuse_body(body, "the most force of a foot is " + std::to_string(options.most_force) +
                          " N, expected one above zero");
}

// Handles of what a stage reads.
struct FootHandles {
  Parameter place, load;
};

struct Mass {
  CentroidalBody body;
  std::vector<FootHandles> feet;
  std::optional<Parameter> target;

  // (6) v', k'.
  template <class T>
  Eigen::Matrix<T, Eigen::Dynamic, 1> accelerations(const Stage<T>& s) const {
    using Of3 = Eigen::Matrix<T, 3, 1>;
    const Of3 c = s.x.template head<3>();
    Of3 pushed = Of3::Constant(T(0)), turned = Of3::Constant(T(0));
    for (std::size_t i = 0; i < feet.size(); ++i) {
      const Of3 place = feet[i].place(s),
                force = s.u.template segment<3>(3 * Eigen::Index(i)) * feet[i].load(s)[0];
      pushed += force;
      turned += Of3(place - c).cross(force);
    }
    Eigen::Matrix<T, Eigen::Dynamic, 1> rate(6);
    rate << pushed * T(1 / body.mass) + body.gravity.cast<T>(), turned;
    return rate;
  }
  // What each foot that stands bears of the weight (N).
  template <class T>
  Eigen::Matrix<T, 3, 1> share(const Stage<T>& s) const {
    using dynamics::select;
    T standing = T(0);
    for (const FootHandles& foot : feet) standing += foot.load(s)[0];
    const T count = select(standing > T(1), standing, T(1));
    return Vector3d(-body.mass * body.gravity).cast<T>() / count;
  }
};

using SharedMass = std::shared_ptr<const Mass>;

void add_demands(Problem& problem, const SharedMass& mass, const CentroidalOptions& options) {
  if (options.is_level) {
    problem.add(path_equality("level", [mass](const auto& s) {
      using T = typename std::decay_t<decltype(s.x)>::Scalar;
      const T up = mass->accelerations(s)[2];
      return vector(T(up + s.x[5] * T(kLevelDrag) + (s.x[2] - (*mass->target)(s)[2]) * T(kLevelPull)));
    }));
  }
  if (options.zero_angular_momentum) {
    problem.add(path_equality("zero_angular_momentum", [mass](const auto& s) {
      using T = typename std::decay_t<decltype(s.x)>::Scalar;
      return (mass->accelerations(s).tail(3) + s.x.tail(3) * T(kTurnDrag)).eval();
    }));
  }
  if (!options.ends_at_rest) return;
  const int lines = options.is_level ? 2 : 3, turns = options.zero_angular_momentum ? 0 : 3;
  problem.add(terminal_equality("rest", [mass, lines, turns](const auto& s) {
    const auto rate = mass->accelerations(s);
    auto rows = rate;
    rows.resize(2 * (lines + turns));
    rows << s.x.segment(3, lines), rate.head(lines), s.x.tail(turns), rate.tail(turns);
    return rows;
  }));
}

void add_costs(Problem& problem, const SharedMass& mass, const CentroidalOptions::Weights& weights) {
  const auto add = [&](const char* name, double weight, const StageFunction& residuals) {
    const StageFunction row = weighted(residuals, weight);
    if (weight > 0) problem.add(running_squares(name, row));
  };
  add("com tracking", weights.com,
      [mass](const auto& s) { return (s.x.head(3) - (*mass->target)(s)).eval(); });
  add("velocity", weights.velocity, [](const auto& s) { return s.x.segment(3, 3).eval(); });
  add("angular momentum", weights.angular, [](const auto& s) { return s.x.tail(3).eval(); });
  add("force", weights.force, [mass](const auto& s) {
    return (s.u - mass->share(s).replicate(Eigen::Index(mass->feet.size()), 1)).eval();
  });
}

}  // namespace

CentroidalBody centroidal_body(const RobotScene& scene, const VectorXd& q,
                               const std::vector<HeldContact>& contacts) {
  const auto& model = scene.model;
  dynamics::Data<double> data(model);
  dynamics::Centroidal<double> whole(model);
  CentroidalBody body;
  body.name = model.name;
  body.com = dynamics::center_of_mass<double>(model, data, whole, q);
  body.mass = whole.mass;
  if (scene.effects.acting().gravity) body.gravity = model.gravity;
  dynamics::forward_kinematics<double>(model, data, q);
  for (const HeldContact& contact : contacts) {
    const Vector3d there = dynamics::frame_placement(model, data, moving_frame(model, contact.frame)).p;
    body.feet.push_back({contact.frame, contact.place.value_or(there), contact.friction});
  }
  return body;
}

VectorXd centroidal_state(const RobotScene& scene, const VectorXd& q, const VectorXd& v) {
  dynamics::Data<double> data(scene.model);
  dynamics::Centroidal<double> whole(scene.model);
  const dynamics::Force<double> h = dynamics::centroidal_momentum<double>(scene.model, data, whole, q, v);
  VectorXd state(9);
  state << whole.com, h.linear / whole.mass, h.angular;
  return state;
}

Problem centroidal_problem(const CentroidalBody& body, const CentroidalOptions& options) {
  check_body(body, options);
  std::vector<std::string> states, controls;
  const auto name = [](std::vector<std::string>& names, const std::string& what) {
    for (const char* axis : {".x", ".y", ".z"}) names.push_back(what + axis);
  };
  for (const char* what : {"c", "v", "k"}) name(states, what);
  for (const CentroidalBody::Foot& foot : body.feet) name(controls, "f." + foot.name);
  const auto mass = std::make_shared<Mass>();
  mass->body = body;
  Problem problem(body.name + " as one mass", states, controls, options.duration, [mass](const auto& s) {
    auto rate = s.x;
    rate << s.x.segment(3, 3), mass->accelerations(s);
    return rate;
  });
  mass->target = problem.parameters.add("com", body.com);
  for (const CentroidalBody::Foot& foot : body.feet)
    mass->feet.push_back({problem.parameters.add(foot.name + " place", foot.place),
                          problem.parameters.add(foot.name + " load", 1.0)});
  for (std::size_t i = 0; i < body.feet.size(); ++i) {
    const Eigen::Index k = 3 * Eigen::Index(i);
    problem.u.lower[k + 2] = 0;
    problem.u.upper[k + 2] = options.most_force;
    problem.add(friction_cone(body.name, {body.feet[i].name, body.feet[i].friction}, k, body.weight()));
  }
  add_demands(problem, mass, options);
  add_costs(problem, mass, options.weights);
  problem.start << body.com, VectorXd::Zero(6);
  const VectorXd share = -body.mass * body.gravity / double(body.feet.size());
  problem.guess = [x = problem.start,
                   u = share.replicate(Eigen::Index(body.feet.size()), 1).eval()](double t) {
    return Stage<double>{t, x, {}, u};
  };
  return problem;
}

void walk(Problem& problem, const CentroidalBody& body, const Gait& gait) {
  if (const std::string fault = gait.fault(body.feet.size()); !fault.empty()) refuse_body(body, fault);
  const Vector3d velocity(gait.velocity.x(), gait.velocity.y(), 0);
  problem.parameters.set("com",
                         [com = body.com, velocity](double t) -> VectorXd { return com + velocity * t; });
  for (std::size_t i = 0; i < body.feet.size(); ++i) {
    problem.parameters.set(body.feet[i].name + " load",
                           [gait, i](double t) { return VectorXd::Constant(1, gait.stands(i, t) ? 1 : 0); });
    problem.parameters.set(
        body.feet[i].name + " place", [=, place = body.feet[i].place](double t) -> VectorXd {
          const double middle = std::floor(gait.steps(i, t)) + gait.phases[i] + gait.duty / 2;
          return place + velocity * (middle * gait.period);
        });
  }
}

}  // namespace dyntape
