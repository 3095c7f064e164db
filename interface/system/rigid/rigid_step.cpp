// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/system/rigid/rigid_step.h>

#include <boost/math/tools/toms748_solve.hpp>
#include <limits>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/factorisations.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/system/rigid/rigid_dips.h>

namespace dyntape {

namespace {

using dynamics::ContactProblem;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kTouch = 1e-11;   // m or rad: what is nearer touches
constexpr double kRest = 1e-8;     // what bounces no higher rests
constexpr double kGrazes = 1e-6;   // what is beyond by no more may start there, or pass without an impact
constexpr double kLeft = 1e-9;     // what presses no more is open beyond it
constexpr double kRounded = 1e-8;  // of what they answer to: forces no farther off are solved to rounding
constexpr double kDecay = 0.2;     // beta
constexpr double kAtOnce = 1e-9;   // of a step: a shorter piece would need forces without bound

// Why a step could not be made; ends it from wherever it is found.
struct RigidFailure {
  std::string why;
};

}  // namespace

// Where a piece of a step begins.
struct RigidStepper::Piece {
  double t;
  const VectorXd &x, &u;
  VectorXd gap, rate;  // (n)
  std::vector<int> closed, rows;
};

RigidStepper::RigidStepper(const RobotScene& scene, Stepper& stepper, Integrator integrator,
                           RigidFunctions functions)
    : scene_(scene),
      stepper_(stepper),
      is_implicit_(needs_jacobians(integrator)),
      functions_(std::move(functions)),
      blocks_(dynamics::blocks_of(scene.constraints.rigid)),
      is_closed_(blocks_.size(), false),
      impacts_in_step_(blocks_.size(), 0),
      parameters_(VectorXd::Zero(stepper.n_p())),
      unsure_(VectorXd::Zero(Eigen::Index(blocks_.size()))) {
  int row = 0;
  for (const auto& block : blocks_) first_row_.push_back(row), row += block.rows;
  forces_ = VectorXd::Zero(row);
}

bool RigidStepper::needs_jacobians(Integrator integrator) {
  return integrator != Integrator::kSemiImplicitEuler && integrator != Integrator::kRungeKutta4;
}

void RigidStepper::start(const VectorXd& x, const VectorXd& p) {
  functions_.set_parameters(p);
  parameters_.head(p.size()) = p;
  forces_.setZero(), unsure_.setZero(), undecided_.clear();
  const Nearness& near = functions_.near(x);
  const double still = 1e-12 * (1 + x.segment(scene_.model.nq, scene_.model.nv).cwiseAbs().maxCoeff());
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    const double gap = near.gap[Eigen::Index(i)];
    if (!(gap >= -kGrazes))
      throw ArgumentError(depth_text(scene_.constraints.rigid, i, -gap, 3) +
                          "; expected at most 1e-6, or to be clear of it");
    is_closed_[i] = gap <= kLeft && std::abs(near.u[first_row_[i]]) <= still;
  }
}

std::vector<int> RigidStepper::closed() const {
  std::vector<int> contacts;
  for (std::size_t i = 0; i < is_closed_.size(); ++i)
    if (is_closed_[i]) contacts.push_back(int(i));
  return contacts;
}

std::vector<int> RigidStepper::rows_of(const std::vector<int>& contacts) const {
  std::vector<int> rows;
  for (const int i : contacts) {
    for (int k = 0; k < blocks_[std::size_t(i)].rows; ++k) rows.push_back(first_row_[std::size_t(i)] + k);
  }
  return rows;
}

ContactProblem RigidStepper::problem_of(const std::vector<int>& contacts, const MatrixXd& D) const {
  ContactProblem problem{D, VectorXd::Zero(D.rows()), {}, 0};
  for (const int i : contacts) problem.blocks.push_back(blocks_[std::size_t(i)]);
  return problem;
}

const double* RigidStepper::parameters() {
  parameters_.tail(forces_.size()) = forces_;
  return parameters_.data();
}

// --- a piece: the step of the Stepper, with the forces that closed contacts need ---

void RigidStepper::take_free(const Piece& piece, double h, VectorXd& end) {
  std::string why;
  end.resize(piece.x.size());
  if (!stepper_.step(piece.t, h, piece.x.data(), piece.u.data(), parameters(), end.data(), &why))
    throw RigidFailure{why};
}

void RigidStepper::take(const Piece& piece, double h, VectorXd& end) {
  constexpr int kMostRounds = 60;
  take_free(piece, h, end);
  if (piece.closed.empty()) return;
  slopes_.resize(0, 0);
  closest_ = {};
  double last = HUGE_VAL;
  try {
    for (int round = 0; round < kMostRounds; ++round) {
      if (balance(piece, h, end, last)) return;
      take_free(piece, h, end);
    }
  } catch (const RigidFailure&) {
    if (closest_.off > kRounded) throw;
  }
  if (closest_.off > kRounded) {
    throw RigidFailure{"the forces of " + std::to_string(piece.closed.size()) +
                       " closed contacts or stops are not found in " + std::to_string(kMostRounds) +
                       " rounds, the residual is " + io::with_digits(last, 3) +
                       " m/s; take shorter steps, or an implicit integrator"};
  }
  // Rounds that end among rounding errors may pass the best of them on the way.
  forces_(piece.rows) = closest_.forces;
  take_free(piece, h, end);
}

// Velocities beta gap / h of the rows that make the gaps of a piece decay.
VectorXd RigidStepper::demanded_by_gaps(const Piece& piece) const {
  VectorXd demanded = VectorXd::Zero(Eigen::Index(piece.rows.size()));
  Eigen::Index row = 0;
  for (const int i : piece.closed) {
    demanded[row] = kDecay * piece.gap[i] / whole_step_;
    row += blocks_[std::size_t(i)].rows;
  }
  return demanded;
}

// Whether the end of a piece obeys the laws of closed contacts; otherwise the next forces.
bool RigidStepper::balance(const Piece& piece, double h, const VectorXd& end, double& last) {
  const int nq = scene_.model.nq, nv = scene_.model.nv;
  const RigidResponse& at = functions_.response(end);
  const MatrixXd J = at.J(piece.rows, Eigen::all);
  // J^+.  Gaps of several contacts of one body need not be those of any motion of it; what J cannot do would make them slide
  // against each other.  So does what derivatives found elsewhere than J have outside of its range.
  const MatrixXd J_inverse = pseudo_inverse(J, 1e-9);
  const VectorXd v = end.segment(nq, nv);
  MatrixXd D = h * J * at.W * J.transpose();
  if (is_implicit_) {
    if (slopes_.size() == 0) {
      MatrixXd A, B, P;
      VectorXd again(end.size());
      std::string why;
      if (!stepper_.jacobians(piece.t, h, piece.x.data(), piece.u.data(), parameters(), again.data(), A, B, P,
                              &why))
        throw RigidFailure{why};
      slopes_ = P.block(nv, P.cols() - forces_.size(), nv, forces_.size());
    }
    const MatrixXd projection = J * J_inverse;
    D = projection * J * slopes_(Eigen::all, piece.rows) * projection;
    D = (D + D.transpose()).eval() / 2;
  }
  ContactProblem problem = problem_of(piece.closed, D);
  VectorXd forces = forces_(piece.rows);
  problem.size = (J.cwiseAbs() * v.cwiseAbs()).maxCoeff();
  const double scale = problem.size + (D.cwiseAbs() * forces.cwiseAbs()).maxCoeff();
  const VectorXd kept = v + J_inverse * demanded_by_gaps(piece), u = J * kept;
  const double off = contact_residual(problem, u, forces);
  // m/s, 3e-8 m in a year: what loops hold is at rest but for rounding, which nothing here is relative to.
  constexpr double kStill = 1e-15;
  if (off <= std::max(kStill, 1e-12 * scale) || (off > 0.5 * last && off <= kRounded * scale)) return true;
  last = off;
  if (off < closest_.off * scale) closest_ = {off / scale, forces};
  problem.b = u - D * forces;
  bool solved = solver_.solve(problem, forces);
  if (!solved && is_implicit_) {
    // Slopes of a step whose contacts depend on each other may be of none that obey laws; those of its masses always are.
    forces = forces_(piece.rows);
    problem.D = h * J * at.W * J.transpose();
    problem.b = u - problem.D * forces;
    solved = solver_.solve(problem, forces);
  }
  if (!solved) {
    throw RigidFailure{
        "the closed contacts and stops contradict each other: no forces obey their laws, the residual is " +
        io::with_digits(solver_.residual(), 3) + " m/s"};
  }
  forces_(piece.rows) = forces;
  return false;
}

// --- events ---

double RigidStepper::gap_after(const Piece& piece, double h, int contact) {
  VectorXd end;
  take(piece, h, end);
  return functions_.near(end).gap[contact];
}

// Where within (0, h) the gap is least, if that is below ground; 0: nowhere.
double RigidStepper::dip(const Piece& piece, double h, int contact, double gap, double rate) const {
  const double g = piece.gap[contact];
  const auto low = GapCurve(g, piece.rate[contact], gap, rate, h).lowest();
  return low && low->gap < std::min(0.0, g) - kTouch ? low->at : 0;
}

void RigidStepper::look_at_turns(const Piece& piece, double h, const VectorXd& middle, const VectorXd& end) {
  const VectorXd at_middle = functions_.near(middle).gap;
  const Nearness& then = functions_.near(end);
  for (int i = 0; i < at_middle.size(); ++i) {
    if (is_closed_[std::size_t(i)]) continue;
    const GapCurve curve(piece.gap[i], piece.rate[i], then.gap[i], then.u[first_row_[std::size_t(i)]], h);
    unsure_[i] += std::abs(at_middle[i] - curve.middle());
    const auto low = curve.lowest();
    const bool comes_from_afar = std::min(piece.gap[i], then.gap[i]) > unsure_[i];
    if (!low || !comes_from_afar || !(low->gap < unsure_[i] - kGrazes) || !undecided_.empty()) continue;
    undecided_ = "at t = " + io::with_digits(piece.t + low->at, 6) + " s " +
                 contact_text(scene_.constraints.rigid, std::size_t(i)) + " turns " +
                 io::with_digits(std::abs(low->gap), 2) +
                 " m or rad from its limit, which these steps know to " + io::with_digits(unsure_[i], 2) +
                 ": whether it touches is not decided to 1e-6; take shorter steps";
  }
}

// The moment within (0, h] at which an open contact that is below ground at `end` touched it; 0: at once.
double RigidStepper::impact_of(const Piece& piece, double h, const VectorXd& end, int contact) {
  double low = 0, at_low = piece.gap[contact];
  const double at_high = functions_.near(end).gap[contact];
  if (at_low <= kRest) {
    const double rate = piece.rate[contact], curve = (at_high - at_low - rate * h) / (h * h);
    if (rate >= 0 && curve < 0 && at_low - rate * rate / (4 * curve) <= kRest) return 0;
  }
  if (at_low <= kTouch) {  // it has just left; the next root is meant
    const double rate = piece.rate[contact], curve = (at_high - at_low - rate * h) / (h * h);
    if (!(rate > 0 && curve < 0)) return 0;
    low = std::min(h, -rate / curve) / 2;
    for (int i = 0; i < 40 && !((at_low = gap_after(piece, low, contact)) > 0); ++i) low /= 2;
    if (!(at_low > 0)) return 0;
  }
  const auto done = [h](double a, double b) {
    return b - a <= 4 * std::numeric_limits<double>::epsilon() * std::min(b, h);
  };
  std::uintmax_t most = 80;
  const double moment =
      boost::math::tools::toms748_solve([&](double s) { return gap_after(piece, s, contact); }, low, h,
                                        at_low, at_high, done, most)
          .first;
  return moment > kAtOnce * whole_step_ ? moment : 0;
}

// How long the piece lasts until something touches, which hit_ names, in the state `end` then; h where nothing does.
double RigidStepper::first_impact(const Piece& piece, double h, VectorXd& end) {
  hit_ = -1;
  for (;;) {
    int lowest = lowest_open(piece, end);
    if (lowest < 0) {
      h = lowest_dip(piece, h, end, lowest);
      if (lowest < 0) return h;
      take(piece, h, end);
      if (!(functions_.near(end).gap[lowest] < 0)) return h;  // with forces that obey the laws as well
    }
    h = impact_of(piece, h, end, lowest);
    hit_ = lowest;
    if (h == 0) {
      end = piece.x;
      return 0;
    }
    take(piece, h, end);
  }
}

// The open contact that is farthest below ground at the end, -1: none.  What an impact threw up from below, where closed
// contacts are by little, counts once it is lower than there.
int RigidStepper::lowest_open(const Piece& piece, const VectorXd& end) {
  const VectorXd depth = functions_.near(end).gap - piece.gap.cwiseMin(0);
  int lowest = -1;
  for (int i = 0; i < depth.size(); ++i) {
    if (is_closed_[std::size_t(i)] || !(depth[i] < -kTouch)) continue;
    if (lowest < 0 || depth[i] < depth[lowest]) lowest = i;
  }
  return lowest;
}

// When an open contact is below ground in between, and which; contact stays where none is.
double RigidStepper::lowest_dip(const Piece& piece, double h, const VectorXd& end, int& contact) {
  const Nearness near = functions_.near(end);
  for (int i = 0; i < near.gap.size(); ++i) {
    if (is_closed_[std::size_t(i)]) continue;
    const double at = dip(piece, h, i, near.gap[i], near.u[first_row_[std::size_t(i)]]);
    if (at == 0) continue;
    const VectorXd forces = forces_;
    if (gap_after(piece, at, i) < std::min(0.0, piece.gap[i]) - kTouch) {
      contact = i;
      return at;
    }
    forces_ = forces;  // those of the whole piece
  }
  return h;
}

// What touches, is pressed on by an acceleration a, and nears with less than a fall through kRest gives, rests: its velocity
// ends at once, without restitution.  Where nothing presses it bounces, however slow it is.
void RigidStepper::close_what_rests(double t, double h, VectorXd& x, const VectorXd& u) {
  const Nearness near = functions_.near(x);
  const auto nears = [&](std::size_t k) {
    return !is_closed_[k] && near.gap[Eigen::Index(k)] <= kTouch && near.u[first_row_[k]] < 0;
  };
  bool any = false;
  for (std::size_t k = 0; k < is_closed_.size(); ++k) any = any || nears(k);
  if (!any) return;
  const Piece piece{t, x, u, near.gap, near.u(first_row_), closed(), {}};
  VectorXd end;
  take_free(piece, h, end);
  const Nearness& then = functions_.near(end);
  bool rests = false;
  for (std::size_t k = 0; k < is_closed_.size(); ++k) {
    if (!nears(k)) continue;
    const double rate = near.u[first_row_[k]], pressing = (rate - then.u[first_row_[k]]) / h;
    if (rate * rate <= 2 * kRest * pressing) is_closed_[k] = rests = true;
  }
  if (rests) settle(t, x);
}

// Ends the velocity at which a contact that rests would leave, in place of the flight that it would make.
void RigidStepper::stop(double t, VectorXd& x, int contact) {
  const RigidResponse& at = functions_.response(x);
  const int row = first_row_[std::size_t(contact)];
  const VectorXd J = at.J.row(row).transpose(), K = at.W * J;
  auto v = x.segment(scene_.model.nq, scene_.model.nv);
  const double rate = J.dot(v), D = J.dot(K);
  if (!(D > 1e-14 * J.cwiseAbs().dot(at.W.cwiseAbs() * J.cwiseAbs()))) return;  // nothing moves it
  v -= rate / D * K;
  note_impact(t).p[row] = -rate / D;
  impacts_.back().u_sum[row] = rate;
}

// Ends velocities of closed contacts against their ground.  What a step finds of velocity in a closed contact becomes a gap of
// u h / 2, which may be far above the height of a fall at that velocity: energy from nowhere that keeps boxes rattling.
void RigidStepper::settle(double t, VectorXd& x) {
  const std::vector<int> contacts = closed();
  push(t, x, contacts, std::vector<double>(contacts.size(), 0), {});
}

bool RigidStepper::hits(const VectorXd& x) {
  const Nearness& near = functions_.near(x);
  for (int i = 0; i < near.gap.size(); ++i) {
    const std::size_t k = std::size_t(i);
    if (!is_closed_[k] && near.gap[i] <= kTouch && near.u[first_row_[k]] < 0) return true;
  }
  return false;
}

RigidImpact& RigidStepper::note_impact(double t) {
  impacts_.push_back({t, VectorXd::Zero(forces_.size()), VectorXd::Zero(forces_.size()), {}, 1});
  return impacts_.back();
}

// Pushes contacts with the impulses of an impact; those that hit are counted.
dynamics::ImpactImpulses RigidStepper::push(double t, VectorXd& x, const std::vector<int>& contacts,
                                            const std::vector<double>& restitution, std::vector<int> hit) {
  const std::vector<int> rows = rows_of(contacts);
  const RigidResponse& at = functions_.response(x);
  const MatrixXd J = at.J(rows, Eigen::all), K = at.W * J.transpose();
  auto v = x.segment(scene_.model.nq, scene_.model.nv);
  const VectorXd u = J * v;
  const ContactProblem problem = problem_of(contacts, J * K);
  dynamics::ImpactImpulses impact = solve_impact(solver_, problem.D, problem.blocks, restitution, u,
                                                 (J.cwiseAbs() * v.cwiseAbs()).maxCoeff());
  if (!impact.solved) {
    throw RigidFailure{"the impact of " + std::to_string(contacts.size()) +
                       " contacts or stops has no impulses that obey their laws; the residual is " +
                       io::with_digits(solver_.residual(), 3) + " m/s"};
  }
  v += K * impact.p;
  RigidImpact& record = note_impact(t);
  record.p(rows) = impact.p, record.u_sum(rows) = u + impact.u;
  record.hit = std::move(hit), record.restitution = impact.restitution;
  return impact;
}

void RigidStepper::collide(double t, VectorXd& x) {
  const Nearness& near = functions_.near(x);
  std::vector<int> touching, hit;
  std::vector<double> restitution;
  for (int i = 0; i < near.gap.size(); ++i) {
    const std::size_t k = std::size_t(i);
    if (!is_closed_[k] && near.gap[i] > 2 * kTouch && i != hit_) continue;
    touching.push_back(i);
    restitution.push_back(0);
    if (is_closed_[k]) continue;
    if (near.u[first_row_[k]] < 0 || i == hit_) hit.push_back(i), ++impacts_in_step_[k];
    if (impacts_in_step_[k] < kMostImpacts) restitution.back() = scene_.constraints.rigid.restitution(k);
  }
  const VectorXd before = near.u;
  const dynamics::ImpactImpulses impact = push(t, x, touching, restitution, std::move(hit));
  const double still =
      1e-10 * std::max(before(rows_of(touching)).cwiseAbs().maxCoeff(), impact.u.cwiseAbs().maxCoeff());
  Eigen::Index row = 0;
  for (const int i : touching) {
    const std::size_t k = std::size_t(i);
    is_closed_[k] = impact.u[row] <= still || impacts_in_step_[k] >= kMostImpacts;
    row += blocks_[k].rows;
  }
}

void RigidStepper::open_what_left(const VectorXd& x) {
  const Nearness& near = functions_.near(x);
  for (std::size_t k = 0; k < is_closed_.size(); ++k) {
    const int row = first_row_[k];
    const bool leaves = forces_[row] == 0 && near.gap[Eigen::Index(k)] > kLeft && near.u[row] > 0;
    if (is_closed_[k] && leaves) is_closed_[k] = false;
  }
}

// --- a step ---

// How long the piece lasts, `rest` or until an impact, and its end; where there are no forces for so long, a part of it.
double RigidStepper::go_on(const Piece& piece, double rest, VectorXd& end) {
  constexpr int kMostHalvings = 6;
  const VectorXd warm = forces_;
  for (int i = 0;; ++i, rest /= 2) {
    forces_.setZero();
    forces_(piece.rows) = warm(piece.rows);
    try {
      take(piece, rest, end);
      return first_impact(piece, rest, end);
    } catch (const RigidFailure&) {
      if (i == kMostHalvings || piece.closed.empty()) throw;
    }
  }
}

void RigidStepper::run(double t, double h, VectorXd x, const VectorXd& u, VectorXd& next) {
  const int most = 50 + 20 * int(blocks_.size());
  double done = 0;
  for (int events = 0; events < most; ++events) {
    hit_ = -1;
    close_what_rests(t + done, h - done, x, u);
    if (hits(x)) {
      collide(t + done, x);
      continue;
    }
    const Nearness& near = functions_.near(x);
    Piece piece{t + done, x, u, near.gap, near.u(first_row_), closed(), {}};
    piece.rows = rows_of(piece.closed);
    const VectorXd warm = forces_;
    VectorXd end;
    const double length = go_on(piece, h - done, end);
    if (length == 0 && piece.rate[hit_] >= 0) {
      is_closed_[std::size_t(hit_)] = true;  // what comes back before it is away rests
      stop(t + done, x, hit_);
      settle(t + done, x);
      continue;
    }
    if (length > 0) {
      VectorXd middle;
      take_free(piece, length / 2, middle);
      look_at_turns(piece, length, middle, end);
      pieces_.push_back({piece.t, length, x, std::move(middle), end, forces_});
    }
    done = length == h - done ? h : done + length;
    x = end;
    open_what_left(x);
    if (length < 0.1 * h) forces_ = warm;  // what a short piece needed says little about the next
    if (hit_ >= 0) collide(t + done, x);
    if (done >= h) {
      next = x;
      return;
    }
  }
  throw RigidFailure{"more than " + std::to_string(most) + " impacts within one step; take shorter steps"};
}

bool RigidStepper::step(double t, double h, const VectorXd& x, const VectorXd& u, VectorXd& next,
                        std::string* why) {
  pieces_.clear(), impacts_.clear();
  impacts_in_step_.assign(blocks_.size(), 0);
  whole_step_ = h;
  try {
    run(t, h, x, u, next);
    return true;
  } catch (const RigidFailure& failure) {
    if (why) *why = failure.why;
    next = VectorXd::Constant(x.size(), std::nan(""));
    return false;
  }
}

}  // namespace dyntape
