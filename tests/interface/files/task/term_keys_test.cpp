// SPDX-License-Identifier: BSD-3-Clause
//
// The blocks terms, waypoints and reference of task files.
#include <gtest/gtest.h>

#include <map>

#include <dyntape/interface/control/problem/penalties.h>
#include <dyntape/interface/files/task/task_keys.h>
#include <dyntape/interface/io/csv.h>
#include <dyntape/interface/run/mpc/mpc_task.h>
#include <dyntape/interface/run/solve/solve.h>
#include "interface/message_of.h"
#include "task_text.h"

namespace dyntape::term_keys_test {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

class TermKeys : public test::TaskText {
 protected:
  TermKeys() : TaskText("term-keys") {
    load("arm_reaching");
    text_.erase(text_.find("expected\n"),
                text_.find("}", text_.find("expected\n")) + 1 - text_.find("expected\n"));
  }
  void add(const std::string& text) { text_ += "\n" + text + "\n"; }
  void term(const std::string& name, const std::string& keys) {
    add("terms {\n term " + name + " {\n" + keys + "\n }\n}");
  }
};

const Term& named(const Task& task, const std::string& name) {
  for (const Term& term : task.problem.terms) {
    if (term.name == name) return term;
  }
  ADD_FAILURE() << "no term " << name;
  return task.problem.terms.front();
}

Stage<double> some_stage(const Task& task) {
  Stage<double> s = task.problem.first_guess(0.3);
  for (Eigen::Index i = 0; i < s.x.size(); ++i) s.x[i] += 0.1 * std::sin(double(i));
  for (Eigen::Index i = 0; i < s.u.size(); ++i) s.u[i] = std::cos(double(i));
  return s;
}

// A row of the table each: the file's term is that of C++.
TEST_F(TermKeys, EveryKindIsThatOfCpp) {
  using R = dynamics::ReferenceFrame;
  const auto at = "frame panda_hand\n";
  const auto minus = [](VectorXd values, double target) { return VectorXd(values.array() - target); };
  struct Row {
    std::string keys;
    std::function<VectorXd(const Task&, const Stage<double>&)> expected;
  };
  const std::map<std::string, Row> rows = {
      {"frame_position",
       {std::string(at) + "target \"0.1 0.2 0.3\"",
        [](const Task& t, const auto& s) {
          return frame_position(t.scene, "panda_hand", {0.1, 0.2, 0.3})(s);
        }}},
      {"frame_orientation",
       {std::string(at) + "target \"3 0.1 0.2\"",
        [](const Task& t, const auto& s) {
          return frame_orientation(t.scene, "panda_hand", rotation_of(3, 0.1, 0.2))(s);
        }}},
      {"frame_velocity",
       {std::string(at) + "in local\ntarget 0.5",
        [&](const Task& t, const auto& s) {
          return minus(frame_velocity(t.scene, "panda_hand", R::kLocal)(s), 0.5);
        }}},
      {"looks_at",
       {std::string(at) + "axis \"0 0 2\"\nplace \"1 0 0.2\"",
        [](const Task& t, const auto& s) {
          return frame_looks_at(t.scene, "panda_hand", {0, 0, 1}, {1, 0, 0.2})(s);
        }}},
      {"com",
       {"target \"0 0 0.4\"",
        [](const Task& t, const auto& s) {
          return com_position(t.scene, {0, 0, 0.4})(s);
        }}},
      {"momentum", {"", [](const Task& t, const auto& s) { return centroidal_momentum(t.scene)(s); }}},
      {"joint_position", {"target 0.2", [&](const Task&, const auto& s) { return minus(s.x.head(7), 0.2); }}},
      {"joint_velocity", {"", [](const Task&, const auto& s) { return VectorXd(s.x.tail(7)); }}},
      {"torque", {"target 1", [&](const Task&, const auto& s) { return minus(s.u, 1); }}},
      {"power", {"", [](const Task&, const auto& s) { return VectorXd(s.u.cwiseProduct(s.x.tail(7))); }}},
  };
  for (const auto& [what, row] : rows) {
    const std::string before = text_;
    term("mine", "what " + what + "\n" + row.keys + "\nrole equality");
    const Task task = read();
    text_ = before;
    const Term& found = named(task, "mine");
    EXPECT_EQ(found.role, Role::kEquality);
    EXPECT_EQ(found.where, Where::kRunning);
    const Stage<double> s = some_stage(task);
    EXPECT_LT((found.function(s) - row.expected(task, s)).norm(), 1e-14) << what;
  }
}

TEST_F(TermKeys, RolesPlacesAndPenalties) {
  term("end",
       "type joint_velocity\nentries \"panda_joint2 panda_joint7\"\nrole inequality\nlower -1\nupper \"2 "
       "3\"\nwhere end");
  Task task = read();
  const Term& end = named(task, "end");
  EXPECT_EQ(end.where, Where::kTerminal);
  EXPECT_EQ(end.role, Role::kInequality);
  EXPECT_EQ(end.lower, Eigen::Vector2d(-1, -1));
  EXPECT_EQ(end.upper, Eigen::Vector2d(2, 3));
  const Stage<double> s = some_stage(task);
  EXPECT_EQ(end.function(s), Eigen::Vector2d(s.x[8], s.x[13]));

  const std::string before = text_;
  const auto with = [&](const std::string& from, const std::string& to) {
    text_ = before;
    replace(from, to);
    return named(read(), "end");
  };
  const Term via = with("where end", "where at\nat 0.25");
  EXPECT_EQ(via.where, Where::kInstant);
  EXPECT_EQ(via.share, 0.25);
  EXPECT_EQ(with("where end", "where start").share, 0);
  // A cost with bounds is a soft limit.
  const Term barrier = with("role inequality", "penalty barrier\nweight 0.3\nwidth 0.05");
  EXPECT_EQ(barrier.role, Role::kCost);
  Term hard = end;
  EXPECT_EQ(barrier.function(s), soft(hard, RelaxedBarrier{0.3, 0.05}).function(s));
  const Term squares = with("role inequality", "penalty huber\nweight 2\nwidth 0.1");
  EXPECT_EQ(squares.role, Role::kSquares);
  EXPECT_EQ(squares.function(s), soft(hard, Huber{2, 0.1}).function(s));
}

TEST_F(TermKeys, WrongOnesAreNamed) {
  const auto says = [&](const std::string& keys, const std::string& part) {
    const std::string before = text_;
    term("mine", keys);
    const std::string found = message();
    text_ = before;
    EXPECT_NE(found.find(part), std::string::npos) << part << " not in: " << found;
    EXPECT_EQ(std::count(found.begin(), found.end(), '\n'), 0) << found;
  };
  says("type frame_positon\nframe panda_hand", "did you mean 'frame_position'?");
  says("frame panda_hand", "'terms.term.type'");
  says("type frame_position\nframe panda_hnd",
       "'panda_hnd', which is no link of the robot; did you mean 'panda_hand'?");
  says("type frame_position\nframe panda_link0", "fixed to the world");
  says("type com\nframe panda_hand", "unknown key 'frame' in 'terms.term'");
  says("type com\nentries \"x w\"", "'w'");
  says("type com\ntarget \"1 2\"", "'target' has 2 numbers, expected 3, or one for all");
  says("type com\nrole inequality", "an inequality needs 'lower', 'upper' or both");
  says("type com\nrole equality\nweight 2", "unknown key 'weight'");
  says("type com\nlower 2\nupper 1", "'lower' is above 'upper'");
  says("type com\npenalty barrier", "a barrier keeps away from bounds; expected 'lower', 'upper' or both");
  says("type com\nwhere at", "'terms.term.at'");
  says("type com\nwhere at\nat 1.5", "between 0 and 1");
  says("type com\nwidth 0.1", "unknown key 'width'");
}

TEST_F(TermKeys, AreSolvedFor) {
  // Work, in and out alike, beside the acceleration: less of it, for more acceleration.
  replace("acceleration 1", "acceleration 1e-2");
  replace("integration_error 1e-5", "integration_error 1e-3");  // no finer mesh
  const auto work = [&](const Task& task) {
    const SolveReport report = solve_task(task);
    EXPECT_TRUE(report.success()) << report.verdict();
    const Term term =
        soft(running_squares("", joint_power(task.scene, ControlUnit::kPhysical)), SmoothAbsolute{1, 1});
    const Trajectory& m = report.solution.motion;
    double sum = 0;
    for (int p = 0; p < m.points(); ++p)
      sum += term.function(task.problem.stage(m.t[p], m.x.col(p), m.a.col(p), m.u.col(p))).squaredNorm();
    return sum / m.points();
  };
  const double without = work(read());
  term("work", "type power\npenalty absolute\nwidth 1\nweight 0.1");
  EXPECT_LT(work(read()), 0.97 * without);
}

TEST_F(TermKeys, WaypointsAreMet) {
  add("waypoints {\n waypoint high {\n at 0.4\n frame panda_hand {\n position \"0.4 0.3 0.9\"\n }\n }\n"
      " waypoint folded {\n at 0.7\n q \"0.7 0 -0.2 -1.6 0.3 1.9 0\"\n }\n}");
  const Task task = read();
  // So does the guess.
  EXPECT_LT(named(task, "waypoint high").function(task.problem.first_guess(0.4)).norm(), 1e-8);
  EXPECT_LT(named(task, "waypoint folded").function(task.problem.first_guess(0.7)).norm(), 1e-12);
  const SolveReport report = solve_task(task);
  ASSERT_TRUE(report.success()) << report.verdict();
  const Trajectory& m = report.solution.motion;
  const auto stage = [&](int p) { return task.problem.stage(m.t[p], m.x.col(p), m.a.col(p), m.u.col(p)); };
  int met = 0;
  for (int k = 0; k <= m.intervals(); ++k) {
    const int p = m.node(k);
    if (std::abs(m.t[p] - 0.4) < 1e-9) met += named(task, "waypoint high").function(stage(p)).norm() < 1e-7;
    if (std::abs(m.t[p] - 0.7) < 1e-9) met += named(task, "waypoint folded").function(stage(p)).norm() < 1e-7;
  }
  EXPECT_EQ(met, 2);  // whatever the mesh has been refined to
}

TEST_F(TermKeys, WaypointsKeepTheirShareOfAFreeDuration) {
  load("block_move_free_time");
  add("waypoints {\n waypoint third {\n at 0.3333333333\n q 0.5\n }\n}");
  replace("expected", "; expected");
  text_ = text_.substr(0, text_.find("; expected")) + text_.substr(text_.find("waypoints"));
  const Task task = read();
  const SolveReport report = solve_task(task);
  ASSERT_TRUE(report.success()) << report.verdict();
  const Trajectory& m = report.solution.motion;
  const double T = m.t[m.points() - 1];
  int met = 0;
  for (int k = 0; k <= m.intervals(); ++k)
    met += std::abs(m.t[m.node(k)] - T / 3) < 1e-6 * T && std::abs(m.x(0, m.node(k)) - 0.5) < 1e-6;
  EXPECT_EQ(met, 1);
}

TEST_F(TermKeys, WrongWaypointsAreNamed) {
  const auto says = [&](const std::string& keys, const std::string& part) {
    const std::string before = text_;
    add("waypoints {\n waypoint via {\n" + keys + "\n }\n}");
    const std::string found = message();
    text_ = before;
    EXPECT_NE(found.find(part), std::string::npos) << part << " not in: " << found;
  };
  says("q 0", "'waypoints.waypoint.at'");
  says("at 0.5", "'waypoints.waypoint.q'");
  says("at 0\nq 0", "above 0 and below 1");
  says("at 0.5\nq \"1 2\"", "'q' has 2 numbers, the robot has 7 joints");
  says("at 0.5\nframe panda_hnd {\nposition \"0 0 1\"\n}", "did you mean 'panda_hand'?");
  says("at 0.5\nq 0\nframe panda_hand {\nposition \"0 0 1\"\n}", "expected one of them");
}

// The motion of one task is what another follows; where nothing else counts, to the bit of its rows.
TEST_F(TermKeys, AReferenceIsFollowed) {
  const auto table_at = [&](const std::string& name) { return (folder_ / name).string(); };
  io::CsvTable table({"t", "q.slider", "v.slider"});
  for (int k = 0; k <= 100; ++k) {
    const double t = 0.01 * k;
    table.append({t, t * t * (3 - 2 * t) + 0.1 * std::sin(9 * t) * t * (1 - t), 0});
  }
  write_csv(table_at("motion.csv"), table);
  load("block_move");
  text_ = text_.substr(0, text_.find("expected"));
  replace("control 1", "control 1e-9");
  add("reference {\n file motion.csv\n q 1e3\n}");
  const Task task = read();
  const SolveReport report = solve_task(task);
  ASSERT_TRUE(report.success()) << report.verdict();
  const Trajectory& m = report.solution.motion;
  const Term& tracking = named(task, "reference tracking");
  EXPECT_EQ(tracking.role, Role::kSquares);
  for (int k = 0; k <= m.intervals(); ++k) {
    const double t = m.t[m.node(k)];
    EXPECT_NEAR(m.x(0, m.node(k)), t * t * (3 - 2 * t) + 0.1 * std::sin(9 * t) * t * (1 - t), 2e-3) << t;
  }
}

// A controller follows it in the plant's time: one plan after another begins where the table has come to.
TEST_F(TermKeys, AControllerFollowsAReference) {
  io::CsvTable table({"t", "q.slider", "v.slider"});
  for (int k = 0; k <= 300; ++k) table.append({0.01 * k, 0.3 * std::sin(0.02 * k), 0.6 * std::cos(0.02 * k)});
  write_csv((folder_ / "motion.csv").string(), table);
  load("block_move");
  text_ = text_.substr(0, text_.find("expected"));
  replace("control 1", "control 1e-6");
  add("reference {\n file motion.csv\n q 100\n v 1\n}\nmpc {\n duration 2.5\n period 0.02\n}");
  const ControlReport report = control_task(read());
  double worst = 0;
  const Trajectory& m = report.loop.motion;
  for (int p = 0; p < m.points(); ++p) {
    if (m.t[p] > 0.5) worst = std::max(worst, std::abs(m.x(0, p) - 0.3 * std::sin(2 * m.t[p])));
  }
  EXPECT_LT(worst, 5e-3);
  EXPECT_GT(m.t[m.points() - 1], 2.4);
}

TEST_F(TermKeys, AControllerRefusesWaypointsOfItsHorizonAndTakesTermsAsWhatDrawsIt) {
  load("block_move");
  text_ = text_.substr(0, text_.find("expected"));
  const auto refusal = [&] {
    const Task task = read();
    return message_of<ArgumentError>([&] { control_task(task); });
  };
  EXPECT_NE(refusal().find("expected weights in costs.tracking or reference, or a cost in terms"),
            std::string::npos);
  term("there", "type joint_position\ntarget 1\nweight 100");
  add("mpc {\n duration 2\n}");
  const ControlReport report = control_task(read());
  EXPECT_LT(report.off_end, 0.05);
  add("waypoints {\n waypoint half {\n at 0.5\n q 0.5\n }\n}");
  EXPECT_NE(
      refusal().find("the term \"waypoint half\" is at 0.5 of the duration, which recedes with the horizon"),
      std::string::npos)
      << refusal();
}

TEST_F(TermKeys, WrongReferencesAreNamed) {
  load("block_move");
  const auto says = [&](const std::string& table, const std::string& keys, const std::string& part) {
    const std::string before = text_;
    write_file_atomically((folder_ / "motion.csv").string(), table);
    add("reference {\n" + keys + "\n}");
    const std::string found = message();
    text_ = before;
    EXPECT_NE(found.find(part), std::string::npos) << part << " not in: " << found;
  };
  const std::string good = "t,q.slider\n0,0\n1,1\n";
  says(good, "file motion.csv", "'reference' weighs nothing; expected 'q', 'v' or both above zero");
  says(good, "q 1", "'reference.file'");
  says(good, "file nowhere.csv\nq 1", "nowhere.csv");
  says(good, "file motion.csv\nv 1", "there is no column 'v.slider'");
  says("t,q.slder\n0,0\n", "file motion.csv\nq 1", "there is no column 'q.slider'");
  says("t,q.slider\n0,0\n1,1\n1,2\n", "file motion.csv\nq 1",
       "the time of row 3 is 1 s, expected more than 1 s, that of the row before");
  says("t,q.slider\n", "file motion.csv\nq 1", "there are no rows, expected a motion");
  says("t,q.slider\n0,a\n", "file motion.csv\nq 1", "motion.csv:2");
  load("block_move_free_time");
  says(good, "file motion.csv\nq 1", "leaves the duration free; expected a given one");
}

// Bodies are kept away from obstacles by a barrier, farther by a stronger one.
TEST_F(TermKeys, BodiesMayBeKeptAwayByABarrier) {
  load("arm_around_obstacles");
  text_.erase(text_.find("expected {"),
              text_.find("}", text_.find("expected {")) + 1 - text_.find("expected {"));
  const std::string before = text_;
  std::vector<double> least;
  for (const char* mu : {"1", "0.1"}) {
    text_ = before;
    replace("bodies {", std::string("bodies {\n  barrier ") + mu);
    const Task task = read();
    EXPECT_EQ(named(task, "hand clear of post").role, Role::kCost);
    const SolveReport report = solve_task(task);
    ASSERT_TRUE(report.solution.success()) << report.verdict();
    const Trajectory& m = report.solution.motion;
    least.push_back(HUGE_VAL);
    for (int p = 0; p < m.points(); ++p) {
      for (const auto& pair : task.around.apart)
        least.back() =
            std::min(least.back(), clearance(task.scene.model, m.x.col(p).head(7), pair.a, pair.b));
    }
  }
  EXPECT_GT(least[0], 1e-3);
  EXPECT_LT(least[1], least[0] / 2);
}

TEST_F(TermKeys, StandInTheListOfAllKeys) {
  std::map<std::string, int> asked;
  for (const io::Question& q : task_questions()) ++asked[q.path];
  for (const char* key : {"terms.term.type", "terms.term.frame", "terms.term.width", "terms.term.at",
                          "waypoints.waypoint.at", "waypoints.waypoint.q", "reference.file", "reference.q"})
    EXPECT_EQ(asked[key], 1) << key;
}

}  // namespace
}  // namespace dyntape::term_keys_test
