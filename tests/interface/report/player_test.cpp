// SPDX-License-Identifier: BSD-3-Clause
//
// Pages that play motions: what they hold is held against forward kinematics.  A browser looks at them in tests/full.
#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algebra/lie.h>
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/report/player/player.h>
#include <dyntape/interface/report/player/shapes.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>

#include "source_folder.h"

namespace dyntape::player_test {
namespace {

using namespace dynamics;
using nlohmann::json;

std::string robot_path(const std::string& name) {
  return test::source_folder() + "/config/robots/" + name + ".urdf";
}

json scene_of(const std::string& page) {
  const std::string begin = "id=\"scene\">";
  const std::size_t at = page.find(begin) + begin.size();
  return json::parse(page.substr(at, page.find("</script>", at) - at));
}

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != text.npos; at = text.find(part, at + 1)) ++count;
  return count;
}

// Random configurations, half a second apart.
PlayerInput random_motion(const std::string& robot, Base base, int samples, unsigned seed) {
  PlayerInput input{.title = "random " + robot, .model = load_urdf(robot_path(robot), {.base = base})};
  input.visuals = read_visuals(robot_path(robot), input.model);
  input.t = Eigen::VectorXd::LinSpaced(samples, 1, 1 + 0.5 * (samples - 1));
  input.q.resize(input.model.nq, samples);
  std::mt19937_64 random(seed);
  for (int k = 0; k < samples; ++k) input.q.col(k) = random_configuration(input.model, random);
  return input;
}

Placement<double> pose(const json& scene, std::size_t frame, int body) {
  const json& all = scene["poses"][frame];
  const auto number = [&](int i) { return all[std::size_t(7 * body + i)].get<double>(); };
  const Vector4<double> q(number(3), number(4), number(5), number(6));
  return {rotation(q), {number(0), number(1), number(2)}};
}

double distance(const Placement<double>& a, const Placement<double>& b) {
  return (a.p - b.p).norm() + (a.R - b.R).norm();
}

void expect_finite(const json& value) {
  if (value.is_structured()) {
    for (const json& part : value) expect_finite(part);
  } else {
    EXPECT_FALSE(value.is_null());  // JSON's word for what is no number
  }
}

constexpr std::pair<const char*, Base> kRobots[] = {
    {"pendulum", Base::kFixed},          {"arm_2r", Base::kFixed},
    {"cart_pole", Base::kFixed},         {"panda", Base::kFixed},
    {"solo12", Base::kFloating},         {"talos", Base::kFloating},
    {"simple_humanoid", Base::kFloating}};

TEST(Player, PosesAreThoseOfForwardKinematicsAtTheSamples) {
  for (const auto& [robot, base] : kRobots) {
    const PlayerInput input = random_motion(robot, base, 4, 3);
    const json scene = scene_of(player_page(input));
    ASSERT_EQ(scene["t"].size(), 91u);
    expect_finite(scene);
    Data<double> data(input.model);
    for (int k = 0; k < 4; ++k) {
      forward_kinematics<double>(input.model, data, input.q.col(k));
      EXPECT_EQ(scene["t"][std::size_t(30 * k)], input.t[k]);
      for (int i = 0; i < input.model.njoints(); ++i)
        EXPECT_LT(distance(pose(scene, std::size_t(30 * k), i), data.X_WB[std::size_t(i)]), 5e-5) << robot;
    }
  }
}

// Between samples as well: where a joint turns, its origin stays where its parent holds it.
TEST(Player, JointsHoldTogetherBetweenTheSamplesAndQuaternionsDoNotJump) {
  const PlayerInput input = random_motion("solo12", Base::kFloating, 5, 4);
  const json scene = scene_of(player_page(input));
  for (std::size_t frame = 0; frame < scene["t"].size(); ++frame) {
    for (int i = 1; i < input.model.njoints(); ++i) {
      const auto X =
          pose(scene, frame, input.model.parent[std::size_t(i)]) * input.model.X_PJ[std::size_t(i)];
      EXPECT_LT((X.p - pose(scene, frame, i).p).norm(), 5e-5);
      if (frame == 0) continue;
      double dot = 0;
      for (std::size_t c = 0; c < 4; ++c) {
        const std::size_t at = std::size_t(7 * i + 3) + c;
        dot += scene["poses"][frame][at].get<double>() * scene["poses"][frame - 1][at].get<double>();
      }
      EXPECT_GT(dot, 0.9);
    }
  }
}

TEST(Player, TracesContactsAndValuesAreWhereTheyBelong) {
  PlayerInput input = random_motion("panda", Base::kFixed, 3, 5);
  input.traces = {"panda_link8"};
  input.contacts = {{}, {{{1, 2, 3}, {0, 0, 4}}}, {}};
  input.values = {{"ramp", "J", Eigen::Vector3d(0, 1, 3)}};
  const json scene = scene_of(player_page(input));
  const auto& frame = input.model.frames[std::size_t(input.model.frame_index("panda_link8"))];
  for (std::size_t k = 0; k < scene["t"].size(); ++k) {
    const auto X = pose(scene, k, frame.body) * frame.X_BF;
    for (std::size_t c = 0; c < 3; ++c)
      EXPECT_NEAR(scene["traces"][0]["points"][3 * k + c].get<double>(), X.p[long(c)], 5e-5);
    EXPECT_EQ(scene["contacts"][k].size(), k >= 30 && k < 60 ? 6u : 0u) << k;
    const double ramp = k <= 30 ? double(k) / 30 : 1 + double(k - 30) / 15;
    EXPECT_NEAR(scene["values"][0]["y"][k].get<double>(), ramp, 1e-5);
  }
  EXPECT_EQ(scene["contacts"][30], json({1, 2, 3, 0, 0, 4}));
}

TEST(Player, IsOneFileWithoutOthersAndTheSameEachTime) {
  for (const auto& [robot, base] : kRobots) {
    const PlayerInput input = random_motion(robot, base, 3, 6);
    const std::string page = player_page(input);
    for (const char* outside : {"http:", "https:", "src=", "url(", "@import", "fetch(", "XMLHttp", "import("})
      EXPECT_EQ(count_of(page, outside), 0u) << outside;
    EXPECT_EQ(count_of(page, "href="), count_of(page, "href=\"data:,\""));
    EXPECT_EQ(count_of(page, "@SCENE@") + count_of(page, "@PLAYER@") + count_of(page, "@GEOMETRY@"), 0u);
    EXPECT_EQ(page, player_page(input));
  }
}

TEST(Player, NamesAreTextWhateverTheyHold) {
  const std::string odd = "</script><script>alert(1)</script> & <!-- \" \\ é";
  PlayerInput input = random_motion("pendulum", Base::kFixed, 2, 7);
  const std::size_t scripts = count_of(player_page(input), "</script>");
  input.title = input.model.name = input.model.frames[0].name = odd;
  input.traces = {odd};
  input.values = {{odd, odd, Eigen::Vector2d(1, 2)}};
  input.visuals.notes = {odd};
  const std::string page = player_page(input);
  EXPECT_EQ(count_of(page, "</script>"), scripts);
  EXPECT_EQ(count_of(page, "alert(1)<"), 0u);
  const json scene = scene_of(page);
  for (const json& name : {scene["title"], scene["robot"], scene["traces"][0]["name"],
                           scene["values"][0]["name"], scene["values"][0]["unit"], scene["notes"][0]})
    EXPECT_EQ(name, odd);
  input.title = "\xff\xfe no text";
  EXPECT_NO_THROW(scene_of(player_page(input)));
}

TEST(Player, StaysSmall) {
  PlayerInput input = random_motion("simple_humanoid", Base::kFloating, 2, 8);
  const std::size_t one_pose = player_page(random_motion("simple_humanoid", Base::kFloating, 1, 8)).size();
  EXPECT_LT(one_pose, 60'000u);
  input.t = Eigen::Vector2d(0, 10);
  const std::string page = player_page(input);
  EXPECT_EQ(scene_of(page)["t"].size(), 601u);
  EXPECT_LT(page.size(), 1'600'000u);
  input.t = Eigen::Vector2d(0, 1e9);
  EXPECT_EQ(scene_of(player_page(input))["t"].size(), 6000u);
}

TEST(Player, TakesManySamplesAndSuchOfOneTime) {
  PlayerInput input = random_motion("pendulum", Base::kFixed, 4, 9);
  input.t = Eigen::Vector4d(0, 0.5, 0.5, 1);  // a jump
  input.q = Eigen::RowVector4d(0, 1, 2, 3);
  const json scene = scene_of(player_page(input));
  ASSERT_EQ(scene["t"].size(), 61u);
  Data<double> data(input.model);
  for (std::size_t k = 0; k <= 60; ++k) {
    const double angle = double(k) / 30 + (k >= 30 ? 1 : 0);
    forward_kinematics<double>(input.model, data, Eigen::VectorXd::Constant(1, angle));
    EXPECT_LT(distance(pose(scene, k, 0), data.X_WB[0]), 5e-5) << k;
  }
  input.t = Eigen::VectorXd::LinSpaced(10001, 0, 1);
  input.q = input.t.transpose();
  EXPECT_EQ(scene_of(player_page(input))["t"].size(), 61u);
}

TEST(Player, RefusesWhatDoesNotFit) {
  const PlayerInput sound = random_motion("solo12", Base::kFloating, 2, 10);
  const auto refused = [&](const auto& change, const std::string& part) {
    PlayerInput input = sound;
    change(input);
    try {
      player_page(input);
      ADD_FAILURE() << "accepted; expected: " << part;
    } catch (const ArgumentError& e) {
      EXPECT_NE(std::string(e.what()).find(part), std::string::npos) << e.what();
    }
  };
  const double nan = std::nan("");
  refused([](PlayerInput& i) { i.t.resize(0); }, "no samples");
  refused([](PlayerInput& i) { i.q.conservativeResize(18, 2); },
          "q is 18 x 2; expected nq x samples, 19 x 2");
  refused([](PlayerInput& i) { i.t[1] = 0; }, "decreases after sample 0");
  refused([&](PlayerInput& i) { i.t[1] = nan; }, "t holds");
  refused([&](PlayerInput& i) { i.q(3, 1) = nan; }, "q holds");
  refused([](PlayerInput& i) { i.contacts.resize(1); }, "contacts has 1 lists");
  refused([&](PlayerInput& i) { i.contacts = {{}, {{{0, nan, 0}, {0, 0, 0}}}}; }, "not finite");
  refused([](PlayerInput& i) { i.traces = {"FL_FOOOT"}; }, "FL_FOOT");
  refused([](PlayerInput& i) { i.values = {{"x", "m", Eigen::Vector3d::Zero()}}; }, "'x' has 3 samples");
  refused([](PlayerInput& i) { i.plane = PlayerPlane{Eigen::Vector3d::Zero(), 0}; }, "plane");
  refused(
      [](PlayerInput& i) {
        i.heights = PlayerHeights{{0, 0}, {1, 1}, Eigen::MatrixXd::Zero(1, 3)};
      },
      "2 x 2");
  refused(
      [](PlayerInput& i) {
        i.heights = PlayerHeights{{0, 0}, {0, 1}, Eigen::MatrixXd::Zero(2, 3)};
      },
      "steps");
}

Placements placements(const Model<double>& model, const Eigen::VectorXd& q) {
  Data<double> data(model);
  forward_kinematics<double>(model, data, q);
  return data.X_WB;
}

// From every body that the file does not show a stick leads to each joint that it carries.
TEST(PlayerShapes, SticksReachTheJoints) {
  for (const char* robot : {"solo12", "talos", "iiwa14"}) {
    const Model<double> model = load_urdf(robot_path(robot), {.base = Base::kFloating});
    const auto shapes = player_shapes(model, {}, placements(model, neutral(model)));
    for (int i = 1; i < model.njoints(); ++i) {
      const Eigen::Vector3d end = model.X_PJ[std::size_t(i)].p;
      double nearest = 1, radius = 0;
      for (const Visual& shape : shapes) {
        if (shape.body != model.parent[std::size_t(i)]) continue;
        if (shape.shape == Shape::kSphere) radius = shape.scale.x();
        if (shape.shape == Shape::kSphere)
          nearest = std::min(nearest, (Eigen::Vector3d(shape.X_BV.p) - end).norm());
      }
      EXPECT_LT(nearest, radius) << robot << " " << model.joints[std::size_t(i)].name;
    }
  }
}

TEST(PlayerShapes, SticksStandInForMeshesThatAreNotThere) {
  const std::string text =
      "<robot name='r'><link name='base'/><joint name='j' type='continuous'><parent link='base'/><child "
      "link='arm'/>"
      "<axis xyz='0 0 1'/></joint><link name='arm'><visual><geometry><mesh "
      "filename='none.stl'/></geometry></visual>"
      "<visual><geometry><box size='1 1 1'/></geometry></visual></link><joint name='f' type='fixed'>"
      "<parent link='arm'/><child link='tip'/><origin xyz='0 0 2'/></joint><link name='tip'/></robot>";
  const Model<double> model = load_urdf_text(text, "t.urdf");
  UrdfVisuals visuals = read_visuals_text(text, "t.urdf", model);
  const Placements X_WB = placements(model, neutral(model));
  const std::size_t with_sticks = player_shapes(model, visuals, X_WB).size();
  EXPECT_EQ(visuals.shapes.size(), 1u);
  visuals.incomplete.clear();
  const std::size_t without = player_shapes(model, visuals, X_WB).size();
  EXPECT_EQ(with_sticks, without + 3);  // a cylinder and its two ends
}

// The box of a shape holds points of its surface, and touches some on each side.
TEST(PlayerShapes, BoxesHoldTheirShapesTightly) {
  std::mt19937_64 random(11);
  const auto uniform = [&](double a, double b) { return a + (b - a) * double(random() >> 11) * 0x1p-53; };
  auto mesh = std::make_shared<Mesh>();
  mesh->vertices = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}, {1, 2, 3}, {1, 2, 0}, {1, 0, 3}, {0, 2, 3}};
  for (int trial = 0; trial < 40; ++trial) {
    Visual shape{.link = "", .shape = Shape(trial % 4), .mesh = mesh};
    const double r = uniform(0.1, 2);
    shape.scale = {r, r, shape.shape == Shape::kSphere ? r : uniform(0.1, 2)};
    shape.body = trial % 3 ? 0 : -1;
    const auto anywhere = [&] {
      const Vector4<double> q(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
      return Placement<double>{rotation(q), {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)}};
    };
    shape.X_BV = anywhere();
    const Placements X_WB = {anywhere()};
    const auto X = shape.body < 0 ? shape.X_BV : X_WB[0] * shape.X_BV;
    Eigen::AlignedBox3d found;
    for (int k = 0; k < 40000; ++k) {
      const double u = uniform(0, 2 * M_PI), z = uniform(-1, 1), s = std::sqrt(1 - z * z);
      Eigen::Vector3d p(s * std::cos(u), s * std::sin(u), z);
      if (shape.shape == Shape::kCylinder) p = {std::cos(u), std::sin(u), k % 2 - 0.5};
      if (shape.shape == Shape::kBox) p = Eigen::Vector3d(k % 2, k / 2 % 2, k / 4 % 2).array() - 0.5;
      if (shape.shape == Shape::kMesh) p = mesh->vertices[std::size_t(k) % 8].cast<double>();
      found.extend(Eigen::Vector3d(X.R * Vector3<double>(shape.scale.cwiseProduct(p)) + X.p));
    }
    const Eigen::AlignedBox3d box = world_box(shape, own_box(shape), X_WB);
    const double slack = 0.02 * shape.scale.maxCoeff();
    EXPECT_TRUE((found.min() - box.min()).minCoeff() > -1e-12 &&
                (box.max() - found.max()).minCoeff() > -1e-12);
    EXPECT_LT((found.min() - box.min()).maxCoeff(), slack) << trial;
    EXPECT_LT((box.max() - found.max()).maxCoeff(), slack) << trial;
  }
}

}  // namespace
}  // namespace dyntape::player_test
